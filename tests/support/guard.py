"""What tests start ends with them, however they end: a process of its own waits for the end of a pipe and kills what is left.

A pipe ends on every system when its writer is gone, killed or not. The command `steptwin` begins warm (`warm.py`).
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import Any

from warm import Warm


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

    warm = Warm()

    class Guarded(plain):  # type: ignore[misc, valid-type]
        def __init__(self, *arguments: Any, **options: Any) -> None:
            self._noted = False
            self._is_plain = bool(options.keys() - {"stdin", "stdout", "stderr", "cwd", "env", "text", "encoding", "bufsize"})
            super().__init__(*arguments, **options)
            self._noted = True
            note("+", self.pid)

        def _execute_child(
            self, args: Any, executable: Any, preexec_fn: Any, close_fds: Any, pass_fds: Any, cwd: Any, env: Any, *rest: Any
        ) -> None:
            environment = os.environ if env is None else env
            if self._is_plain or not warm.can(args, environment):
                super()._execute_child(args, executable, preexec_fn, close_fds, pass_fds, cwd, env, *rest)  # type: ignore[misc]
                return
            pipes = rest[3:9]  # behind startupinfo, creationflags and shell: of each pipe the reading end, then the writing one
            ends = (pipes[0], pipes[3], pipes[5])
            descriptors = [number if end == -1 else end for number, end in enumerate(ends)]
            self.pid = warm.fork([str(one) for one in args[1:]], str(cwd or Path.cwd()), environment, descriptors)
            self._child_created = True
            self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]

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
        warm.close()
        guard.communicate()


if __name__ == "__main__":
    kill_what_is_left(sys.stdin)
