"""The state directory: non-volatile images, with one owner at a time.

An image is one file, which a save replaces as a whole (`steptwin.files.writing`). Damage is found by a header with format,
length and CRC-32; it is an error, never older content passed off as the newest.

Layout: ``<name>.image``, ``owner.lock``; what a killed process has left unfinished is removed by the next owner.
"""

from __future__ import annotations

import errno
import os
import re
import struct
import zlib
from pathlib import Path
from types import TracebackType
from typing import Self

from steptwin.errors import Misuse, SteptwinError
from steptwin.files.ownership import InUse, Ownership
from steptwin.files.writing import new_content, remove_unfinished
from steptwin.inputfiles import read_bytes
from steptwin.system import reason, sync_directory

_FAMILY = b"STW"
_MAGIC = _FAMILY + b"2"
"""Family and number of the format."""
_HEADER = struct.Struct("<4sII")
"""Magic, length of the data, CRC-32 of length and data."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")
_LOCK = "owner.lock"


class StateInUse(Misuse):
    """Another process owns the state directory; the text names it."""


class StateFailure(SteptwinError, OSError):
    """The state directory cannot be read or written, or an image in it is damaged or of another format."""


class StateDirectory:
    """A locked state directory; a context manager. It is made when it does not exist.

    Entering raises `StateInUse` when another process owns it and `StateFailure` when it cannot be used.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._lock: Ownership | None = None

    def __enter__(self) -> Self:
        try:
            self._make()
            self._lock = Ownership(self.path / _LOCK)
            remove_unfinished(self.path)
        except InUse as taken:
            raise StateInUse(f"the state directory {self.path} is in use by {taken.owner}") from None
        except OSError as error:
            raise StateFailure(f"the state directory {self.path} cannot be used: {reason(error)}") from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Release the directory. Closing twice has no effect."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def _make(self) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "not a directory")
        missing = [p for p in (self.path, *self.path.parents) if not p.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        for path in missing:
            sync_directory(path.parent)

    def load(self, name: str) -> bytes | None:
        """The last saved contents of an image; None if it was never saved.

        Raises `StateFailure` when it is damaged or of another format, `Misuse` for a name outside letters, digits, ``-``, ``_``.
        """
        path = self._path(name)
        content = self._content(path)
        if content is None:
            earlier = [f"{name}.{slot}" for slot in (0, 1) if (self.path / f"{name}.{slot}").exists()]
            if earlier:
                raise StateFailure(
                    f"{name} in {self.path} was saved in an earlier format ({', '.join(earlier)}), which is not read; remove that"
                    " to start anew"
                )
            return None
        self._check_format(path, content)
        data = content[_HEADER.size :]
        if content[: _HEADER.size] != _header(data):
            raise StateFailure(f"{path} is damaged; remove it to start anew")
        return data

    def save(self, name: str, data: bytes) -> None:
        """Save ``data`` as an image; after the return it survives a power loss.

        Raises `StateFailure` when that is not possible, or what is there is of another format; a later `load` then gives the old
        content or this one.
        """
        path = self._path(name)
        self._check_format(path, self._content(path) or b"")
        try:
            with new_content(path) as file:
                file.write(_header(data) + data)
        except OSError as error:
            raise StateFailure(f"{name} cannot be saved in {self.path}: {reason(error)}") from error

    def _path(self, name: str) -> Path:
        if self._lock is None:
            raise Misuse(f"the state directory {self.path} is not open")
        if not _NAME.match(name):
            raise Misuse(f"{name!r} is not an image name: permitted are up to 64 letters, digits, '-' and '_'")
        return self.path / f"{name}.image"

    def _content(self, path: Path) -> bytes | None:
        """The content of the file; None if there is none."""
        try:
            return read_bytes(path)
        except Misuse as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return None
            raise StateFailure(str(error)) from error

    def _check_format(self, path: Path, content: bytes) -> None:
        magic = content[: len(_MAGIC)]
        if magic.startswith(_FAMILY) and len(magic) == len(_MAGIC) and magic != _MAGIC:
            raise StateFailure(
                f"{path} has format {_text(magic)}, this version of steptwin reads and writes {_text(_MAGIC)}; it is left alone"
            )


def _header(data: bytes) -> bytes:
    return _HEADER.pack(_MAGIC, len(data), zlib.crc32(len(data).to_bytes(4, "little") + data))


def _text(magic: bytes) -> str:
    return magic.decode("ascii", "backslashreplace")
