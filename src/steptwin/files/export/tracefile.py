"""Recording of a running world: none, a ring of the last records, or a file that grows on disk."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import IO, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.files.export.axes import AxisViews
from steptwin.files.export.records import begin_records, end_records, record_line
from steptwin.files.writing import directly, new_text
from steptwin.numerals import read_whole
from steptwin.simulation.scheduler.trace import Trace, TraceRecord
from steptwin.system import reason

MOST_IN_RING = 10_000_000


class Ring:
    """The last records of a trace, at most ``size``."""

    def __init__(self, trace: Trace, size: int) -> None:
        self._controllers = trace.controllers
        self._records: deque[TraceRecord] = deque(trace, maxlen=size)
        trace.subscribers.append(self._records.append)

    def __len__(self) -> int:
        return len(self._records)

    @property
    def size(self) -> int:
        """The most records."""
        return self._records.maxlen or 0

    @property
    def begin(self) -> Nanos | None:
        """The moment of the oldest record; None if there is none."""
        return self._records[0].time if self._records else None

    def clear(self) -> None:
        """Drop all earlier records."""
        self._records.clear()

    def trace(self) -> Trace:
        """The present contents as a trace."""
        held = Trace(self._controllers)
        for record in self._records:
            held.add(record)
        return held


class TraceFile:
    """A file of JSON lines to which records are appended; `read_trace` reads it, also if it was cut.

    ``show`` is called once if the disk is full. Raises `Misuse` if the file cannot be made.
    """

    def __init__(self, trace: Trace, path: Path, views: AxisViews, title: str, show: Callable[[str], None]) -> None:
        self.path = path
        self._trace = trace
        self._show = show
        self._failure: str | None = None
        try:
            stream = directly(path)  # who reads from it would see its end if it were opened again
            if stream is None:
                with new_text(path) as text:
                    _begin(text, trace, views, title)
            file = path.open("ab") if stream is None else stream
            self._file = TextIOWrapper(file, "utf-8", newline="", line_buffering=True)  # each line is there at once
            if stream is not None:
                _begin(self._file, trace, views, title)
        except OSError as error:
            raise Misuse(f"cannot write {path}: {reason(error)}") from error
        trace.subscribers.append(self._add)

    def _add(self, record: TraceRecord) -> None:
        self._write(record_line(record))

    def _write(self, line: str) -> None:
        if self._failure is None:
            try:
                self._file.write(line)
            except OSError as error:
                self._fail(error)

    def _fail(self, error: OSError) -> None:
        self._failure = f"cannot write {self.path}: {reason(error)}"
        self._show(self._failure)

    def close(self, until: Nanos) -> None:
        """Write the end of the run and close. Raises `Misuse` if not everything could be written."""
        if self._add in self._trace.subscribers:
            self._trace.subscribers.remove(self._add)
        self._write(end_records(self._trace, until))
        try:
            self._file.close()
        except OSError as error:
            self._fail(error)
        if self._failure is not None:
            raise Misuse(self._failure)


def _begin(file: IO[str], trace: Trace, views: AxisViews, title: str) -> None:
    file.write(begin_records(trace, views, title))
    file.writelines(map(record_line, trace))


Kept: TypeAlias = int | Path | None
"""The kept part of a trace: a number of records, a file or directory, or None."""


def read_kept(text: str) -> Kept:
    """Parse ``off``, ``ring 10000``, or a path. Raises `Misuse`."""
    if text == "off":
        return None
    word, _, number = text.partition(" ")
    if word != "ring":
        return Path(text)
    records = read_whole(number.strip())
    if records is None or not 1 <= records <= MOST_IN_RING:
        raise Misuse(f"trace = {text!r}: a ring takes a number of records from 1 to {MOST_IN_RING}, such as 'ring 10000'")
    return records
