"""The audit log in a file: lines of JSON. A file that is full is kept until the next one is."""

from __future__ import annotations

import json
import os
from collections.abc import Generator
from contextlib import contextmanager
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Self, TextIO

from steptwin.access.audit import Audit, Entry
from steptwin.errors import Misuse
from steptwin.files.writing import is_written_directly
from steptwin.jsonvalues import to_json
from steptwin.system import reason

MOST_BYTES = 8 << 20


def wall_clock() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@contextmanager
def audit_into(path: Path | None) -> Generator[Audit | None]:
    """An audit log that is kept in a file; None without one. Raises `Misuse` where it cannot be written."""
    if path is None:
        yield None
        return
    with AuditFile(path) as file:
        yield Audit(wall_clock, file.add)


class AuditFile:
    """Appends to ``path``, which only its owner can read. The file before it is ``path`` with ``.1`` behind its name; a pipe or
    device has none."""

    def __init__(self, path: Path, most_bytes: int = MOST_BYTES) -> None:
        self._path = path
        self._most = inf if is_written_directly(path) else most_bytes
        self._file: TextIO | None = None

    def __enter__(self) -> Self:
        """Raises `Misuse` where it cannot be written."""
        self._file = self._open()
        return self

    def _open(self) -> TextIO:
        try:
            descriptor = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        except OSError as error:
            raise Misuse(f"--audit {self._path}: {reason(error)}") from error
        return os.fdopen(descriptor, "a", encoding="utf-8")

    def add(self, entry: Entry) -> None:
        if self._file is None:
            return
        self._file.write(json.dumps(to_json(entry), ensure_ascii=False) + "\n")
        self._file.flush()
        if self._most < inf and self._file.tell() > self._most:
            self._file.close()
            self._path.replace(self._path.with_name(f"{self._path.name}.1"))
            self._file = self._open()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
