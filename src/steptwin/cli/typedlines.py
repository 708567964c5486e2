"""Lines typed by a person, or piped in by a script."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Generator

from steptwin.cli.device import complain


def typed_lines(
    prompt: Callable[[], str], is_stop: Callable[[str], bool], clock: Callable[[], float] = time.monotonic
) -> Generator[str]:
    """The lines of the standard input, until it ends or one is ``quit``.

    What a terminal has kept while the program was suspended is reported and left out, except where ``is_stop`` is true of it.
    """
    from steptwin.drivers.stale import BEAT_S, StaleInput

    interactive = sys.stdin.isatty()
    stale = StaleInput(clock)
    has_ended = threading.Event()

    def beat() -> None:
        while not has_ended.wait(BEAT_S):
            stale.beat()

    if interactive:
        threading.Thread(target=beat, daemon=True).start()
    try:
        while True:
            try:
                line = input(prompt() if interactive else "").strip()
            except (EOFError, KeyboardInterrupt):
                return
            if line in ("quit", "exit"):
                return
            if interactive and line and stale.is_stale() and not is_stop(line):
                complain(f"{line!r} is ignored: it was typed while this program was suspended")
            else:
                yield line
    finally:
        has_ended.set()
