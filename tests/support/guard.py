"""What tests start ends with them, however they end: a process of its own waits for the end of a pipe and kills what is left.

A pipe ends on every system when its writer is gone, killed or not.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Generator, Iterable
from typing import Any


def kill_what_is_left(lines: Iterable[str]) -> None:
    """Lines are ``+PID`` of a process that was started, ``-PID`` of one that was waited for; afterwards the rest is killed."""
    running: set[int] = set()
    for line in lines:
        (running.add if line[0] == "+" else running.discard)(int(line[1:]))
    for process in running:
        with contextlib.suppress(OSError):
            os.kill(process, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)


@contextlib.contextmanager
def guarded() -> Generator[None]:
    """What `subprocess` starts meanwhile ends with this process."""
    plain = subprocess.Popen
    guard = plain(
        [sys.executable, "-S", __file__],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        text=True,
    )

    def note(sign: str, process: int) -> None:
        assert guard.stdin is not None
        guard.stdin.write(f"{sign}{process}\n")
        guard.stdin.flush()

    class Guarded(plain):  # type: ignore[misc, valid-type]
        def __init__(self, *arguments: Any, **options: Any) -> None:
            self._noted = False
            super().__init__(*arguments, **options)
            self._noted = True
            note("+", self.pid)

        def poll(self) -> int | None:
            return self._ended(super().poll())

        def wait(self, timeout: float | None = None) -> int:
            super().wait(timeout)
            return self._ended(self.returncode)

        def _ended(self, code: Any) -> Any:
            if code is not None and self._noted:
                self._noted = False
                note("-", self.pid)
            return code

    subprocess.Popen = Guarded  # type: ignore[misc]
    try:
        yield
    finally:
        subprocess.Popen = plain  # type: ignore[misc]
        guard.communicate()


if __name__ == "__main__":
    kill_what_is_left(sys.stdin)
