"""Text output of a served twin.

The reader of the output may stop (a pager, a terminal held by Ctrl-S), and a write then blocks. So a thread writes, and the
twin continues.
"""

from __future__ import annotations

import contextlib
import os
import queue
import select
import sys
import threading
from collections.abc import Mapping, Sequence
from typing import TextIO

from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.records import describe
from steptwin.wire.frameline import FrameLine

MOST_WAITING = 10_000
"""Pieces of text kept for a reader that has stopped; later ones are dropped."""
PATIENCE_S = 1.0
"""Time that the end waits for the reader, s."""


class Output:
    """Writes to ``stream``'s descriptor, in order, from a thread of its own. Also a file that rich can draw on.

    After the reader has closed its end, output is dropped without an error.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self.encoding = "utf-8" if stream is None else stream.encoding
        self._stream = stream
        self._waiting: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._left_out = 0
        self._thread: threading.Thread | None = None
        if stream is not None:
            stream.flush()
            self._thread = threading.Thread(target=self._run, args=(stream,), name="output", daemon=True)
            self._thread.start()

    def line(self, text: str) -> None:
        self.write(text + "\n")

    def notice(self, text: str) -> None:
        """Print a notice, which a user has to know."""
        self.line(text)

    def record(self, record: TraceRecord) -> None:
        """Print a record of a world."""
        self.line(describe(record))

    def frame(self, frame: FrameLine) -> None:
        self.line(str(frame))

    def begin(self, head: Sequence[str], announcement: Mapping[str, object]) -> None:
        """Print what is served: as text, and as the ready file has it (`steptwin.live.server.Server.announcement`)."""
        for text in head:
            self.line(text)

    def write(self, text: str) -> int:
        if self._thread is not None:
            try:
                self._waiting.put_nowait(text.encode(self.encoding, "replace"))
            except queue.Full:
                self._left_out += 1
        return len(text)

    def flush(self) -> None:
        """No effect: nothing is buffered here."""

    def isatty(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def _run(self, stream: TextIO) -> None:
        with contextlib.suppress(OSError):
            while (data := self._waiting.get()) is not None:
                _write_all(stream, data)
                if self._left_out and self._waiting.empty():
                    count, self._left_out = self._left_out, 0
                    _write_all(stream, f"({count} lines left out: they were not read)\n".encode())
        self._thread = None

    def close(self) -> None:
        """Write the queued text, as long as it is read."""
        thread = self._thread
        if thread is not None:
            with contextlib.suppress(queue.Full):
                self._waiting.put(None, timeout=PATIENCE_S)
            thread.join(PATIENCE_S)
            self._thread = None


def _write_all(stream: TextIO, data: bytes) -> None:
    if sys.platform == "win32" and stream.isatty():  # bytes for the descriptor of a console would be in its code page
        stream.buffer.write(data)
        stream.buffer.flush()
        return
    descriptor = stream.fileno()
    while data:
        try:
            data = data[os.write(descriptor, data) :]
        except BlockingIOError:  # another process that shares it made it so
            select.select([], [descriptor], [])
