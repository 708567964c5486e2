"""Rows that the database has not taken yet, in files, which survive the end of the process.

A folder has ``RUN.head``, one for each recording, and segments ``NUMBER-RUN.rows`` with a batch in each line. One thread appends,
another one takes from the front.
"""

from __future__ import annotations

import contextlib
import shutil
import threading
from dataclasses import dataclass
from io import BufferedWriter, FileIO
from pathlib import Path
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.files.locks import lock, unlock
from steptwin.files.writing import new_content
from steptwin.history.rows import RowBatch, RunHead, read_batch, read_head
from steptwin.system import reason

SEGMENT_BYTES = 8 << 20
MOST_BYTES = 1 << 30
"""More is not kept: what comes then is lost, and counted."""
LEAST_FREE_BYTES = 200 << 20
"""Left on the disk for others."""
TAKE_BYTES = 2 << 20
"""Most bytes of batches that are taken at once."""
HEAD, ROWS, REFUSED, LOCK = ".head", ".rows", "refused", "lock"


class Taken(NamedTuple):
    """Batches of one run from the front; `Spool.done` confirms them."""

    head: RunHead | None
    """None where it has been lost: these rows cannot be kept."""
    batches: list[RowBatch]
    lines: list[bytes]
    end: int
    """Where they end in their segment."""


@dataclass(slots=True)
class _Segment:
    path: Path
    size: int
    """Whole lines of it, bytes."""

    @property
    def run(self) -> str:
        return self.path.name.partition("-")[2].removesuffix(ROWS)


class Spool:
    """The one in ``folder``, which is made. Raises `Misuse` where it cannot be used."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._guard = threading.Lock()
        try:
            self._lock = _locked(folder)
            self._segments = [_Segment(path, _whole_lines(path)) for path in sorted(folder.glob(f"*{ROWS}"))]
        except OSError as error:
            raise Misuse(f"cannot keep what the database has not taken yet in {folder}: {reason(error)}") from None
        self._taken = 0
        """Bytes of the first segment that are in the database."""
        self._next = 1 + max((int(one.path.name.partition("-")[0]) for one in self._segments), default=0)
        self._run = ""
        """The one that is written."""
        self._file: FileIO | None = None
        """The last segment; None before anything was written."""
        self.more = threading.Event()
        """Set when there is something to take."""
        self.more.set()

    @property
    def waiting(self) -> int:
        """Bytes that are not in the database."""
        with self._guard:
            return sum(one.size for one in self._segments) - self._taken

    # ------------------------------------------------------------------ at the end

    def begin(self, head: RunHead) -> None:
        """Batches of this run follow. Raises `OSError`."""
        with new_content(self._folder / f"{head.key}{HEAD}") as file:
            file.write(head.line())
        with self._guard:
            self._run = head.key
            self._end_segment()

    def has_room(self) -> bool:
        """Whether it takes more."""
        try:
            return self.waiting <= MOST_BYTES and shutil.disk_usage(self._folder).free >= LEAST_FREE_BYTES
        except OSError:
            return False

    def append(self, batch: RowBatch) -> bool:
        """Whether there was room. Raises `OSError`."""
        if not self.has_room():
            return False
        line = batch.line()
        with self._guard:
            if self._file is None or self._segments[-1].size > SEGMENT_BYTES:
                self._end_segment()
                path = self._folder / f"{self._next:08d}-{self._run}{ROWS}"
                self._next += 1
                self._file = path.open("xb", buffering=0)
                self._segments.append(_Segment(path, 0))
            self._write(self._file, line)
            self._segments[-1].size += len(line)
        self.more.set()
        return True

    def _write(self, file: FileIO, line: bytes) -> None:
        """Write a line whole, or nothing of it. Raises `OSError`."""
        left = memoryview(line)
        try:
            while left:
                left = left[file.write(left) :]
        except OSError:
            with contextlib.suppress(OSError):
                file.truncate(self._segments[-1].size)
            self._end_segment()
            raise

    def _end_segment(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    # ------------------------------------------------------------------ at the front

    def take(self) -> Taken | None:
        """The batches at the front; None where there are none. Raises `OSError`."""
        with self._guard:
            while self._segments and self._taken == self._segments[0].size:
                if len(self._segments) == 1 and self._file is not None:
                    break
                self._drop(self._segments.pop(0))
                self._taken = 0
            if not self._segments or self._taken == self._segments[0].size:
                self.more.clear()
                return None
            first, begin = self._segments[0], self._taken
            left = first.size - begin
        with first.path.open("rb") as file:
            file.seek(begin)
            lines = file.read(left).splitlines(keepends=True) if left <= TAKE_BYTES else file.readlines(TAKE_BYTES)
        head = self._head(first.run)
        return Taken(head, [] if head is None else self._batches(lines), lines, begin + sum(map(len, lines)))

    def done(self, taken: Taken) -> None:
        """They are in the database, or refused."""
        with self._guard:
            self._taken = taken.end

    def refuse(self, lines: list[bytes]) -> Path:
        """Keep lines apart that can never come into the database; where."""
        path = self._folder / REFUSED
        with path.open("ab") as file:
            file.writelines(lines)
        return path

    def _head(self, run: str) -> RunHead | None:
        try:
            return read_head((self._folder / f"{run}{HEAD}").read_bytes())
        except (OSError, ValueError, TypeError):
            return None

    def _batches(self, lines: list[bytes]) -> list[RowBatch]:
        found: list[RowBatch] = []
        for line in lines:
            try:
                found.append(read_batch(line))
            except (ValueError, TypeError):  # of a disk that lost what was written last
                self.refuse([line])
        return found

    def _drop(self, segment: _Segment) -> None:
        """Remove a segment, and with the last one of a run that is over its head."""
        segment.path.unlink(missing_ok=True)
        if segment.run != self._run and all(other.run != segment.run for other in self._segments):
            (self._folder / f"{segment.run}{HEAD}").unlink(missing_ok=True)

    def close(self) -> None:
        """Leave what has not been taken. An empty folder is removed."""
        with self._guard:
            self._end_segment()
            self._run = ""
        self.take()
        is_empty = not self._segments
        if is_empty:
            for head in self._folder.glob(f"*{HEAD}"):
                head.unlink(missing_ok=True)
        unlock(self._lock.fileno())
        self._lock.close()
        if is_empty:
            with contextlib.suppress(OSError):
                (self._folder / LOCK).unlink()
                self._folder.rmdir()


def _locked(folder: Path) -> BufferedWriter:
    """The lock of a folder, which is made. Raises `Misuse` where another process has it, `OSError`."""
    folder.mkdir(parents=True, exist_ok=True)
    file = (folder / LOCK).open("ab")
    try:
        lock(file.fileno())
    except BlockingIOError:
        file.close()
        raise Misuse(f"{folder} is in use by another process: give this one a 'spool' of its own") from None
    return file


def _whole_lines(path: Path) -> int:
    """Bytes up to the end of the last line: a process may have ended in the middle of one."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - TAKE_BYTES))
        return size - len(file.read().rpartition(b"\n")[2])
