"""One branch of the world of a studio, which starts it: a world without ports, and a page for it.

It reads a `steptwin.live.studio.branches.BranchStart` from its standard input, and ends when that is closed: with the studio,
however that ends.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading

from steptwin.errors import SteptwinError
from steptwin.live.studio.branches import BranchStart
from steptwin.live.studio.start import studio_of_branch


def main() -> int:
    """The exit code."""
    start = pickle.load(sys.stdin.buffer)  # written by the studio that has started this process
    if not isinstance(start, BranchStart):
        raise TypeError(f"a branch begins with a BranchStart, not with {type(start).__name__}")
    threading.Thread(target=_end_with_studio, daemon=True).start()
    try:
        studio_of_branch(start)
    except SteptwinError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


def _end_with_studio() -> None:
    sys.stdin.buffer.read()
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
