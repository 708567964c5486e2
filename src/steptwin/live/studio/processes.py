"""Processes that a studio starts beside itself, so that its world goes on undisturbed. All functions block."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

from steptwin.errors import LineFailure, Refusal
from steptwin.messages import Message, text_of

START_S = 300.0
"""Longest duration of the start of a studio."""
POLL_S = 0.05
Process: TypeAlias = subprocess.Popen[bytes]
STUDIO_ENDS = Message("live.studio-ends", "the studio ends")
ENDED_WITHOUT_A_WORD = Message("live.ended-without-a-word", "it ended without a word")
HAS_NOT_STARTED = Message("live.has-not-started", "{what} has not started: {problem}")


class ChildProcesses:
    """Processes that end with it, and a folder of their files."""

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="steptwin-")
        self.folder = Path(self._folder.name)
        self.turn = threading.Lock()
        """For what is done one at a time."""
        self._running: set[Process] = set()
        self._is_closed = False

    def start(self, module: str, *arguments: str, given: bytes | None = None) -> Process:
        """``given``: what it reads; its input stays open then. Raises `Refusal` when the studio ends."""
        if self._is_closed:
            raise Refusal(STUDIO_ENDS())
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.DEVNULL if given is None else subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        self._running.add(process)
        if given is not None and process.stdin is not None:
            try:
                process.stdin.write(given)
                process.stdin.flush()
            except OSError:  # it has ended already; it says why
                pass
        return process

    def url(self, process: Process, ready: Path, what: str) -> str:
        """The address of the page of a studio, when it is there. Raises `LineFailure` where it does not start."""
        until = time.monotonic() + START_S
        while not ready.exists() and process.poll() is None and time.monotonic() < until:
            time.sleep(POLL_S)
        if not ready.exists():
            raise LineFailure(HAS_NOT_STARTED(what=what, problem=text_of(last_words(self.end(process)))))
        points = json.loads(ready.read_text("utf-8"))["end_points"]
        return str(next(point["url"] for point in points if point["kind"] == "http"))

    def end(self, process: Process) -> bytes:
        """End it; return what it has written about errors."""
        self._running.discard(process)
        process.terminate()
        return process.communicate()[1]

    def close(self) -> None:
        self._is_closed = True
        for process in list(self._running):
            self.end(process)
        with self.turn:  # an export notices
            self._folder.cleanup()


def last_words(errors: bytes) -> str:
    """The last error of a process; of a finding in a file its place, what is wrong and what is permitted."""
    lines = errors.decode("utf-8", "replace").strip().splitlines()
    if not lines:
        return ENDED_WITHOUT_A_WORD()
    begin = max(number for number, line in enumerate(lines) if number == 0 or not line[:1].isspace())
    hints = [line.strip().removeprefix("= ") for line in lines[begin + 1 :] if line.lstrip().startswith("= ")]
    return f"{lines[begin]} ({hints[0]})" if hints else lines[begin]
