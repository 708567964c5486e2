"""A directory that keeps what survives power-off: non-volatile images, each in two generations, with one owner at a time.

An image is saved into the slot that does not hold its newest good generation: temporary file, fsync, rename onto the slot,
fsync of the directory. The newest generation stays untouched meanwhile, so at any moment — ``kill -9``, power loss, full disk —
the old or the new content is there. A header with generation, length and CRC-32 tells a torn slot from a good one.

Layout: ``<name>.0``, ``<name>.1`` (slots), ``<name>.tmp`` (a save in progress), ``owner.lock``. POSIX only (flock, fsync of
directories).
"""

from __future__ import annotations

import errno
import os
import re
import struct
import zlib
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from steptwin.errors import Misuse, SteptwinError
from steptwin.files import read_bytes
from steptwin.runtime.ownership import InUse, Ownership

_MAGIC = b"STW1"
_HEADER = struct.Struct("<4sQII")
"""Magic, generation, length of the data, CRC-32 of generation, length and data."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")
_LOCK = "owner.lock"


class StateInUse(Misuse):
    """Another process owns the state directory; the text names it."""


class StateFailure(SteptwinError, OSError):
    """The state directory cannot be read or written, or both generations of an image are damaged."""


class _Generation(NamedTuple):
    slot: int
    number: int
    data: bytes


class StateDirectory:
    """A locked state directory; a context manager. It is made when it does not exist.

    Entering raises `StateInUse` when somebody owns it and `StateFailure` when it cannot be used.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._lock: Ownership | None = None

    def __enter__(self) -> Self:
        try:
            self._make()
            self._lock = Ownership(self.path / _LOCK)
        except InUse as taken:
            raise StateInUse(f"the state directory {self.path} is in use by {taken.owner}") from None
        except OSError as error:
            raise StateFailure(f"the state directory {self.path} cannot be used: {error.strerror}") from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Give the directory free. Closing twice does nothing."""
        if self._lock is not None:
            self._lock.release(remove=False)
            self._lock = None

    def _make(self) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "it is no directory")
        missing = [p for p in (self.path, *self.path.parents) if not p.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        for path in missing:
            _sync(path.parent)

    def load(self, name: str) -> bytes | None:
        """The newest good content of an image, None when it was never saved.

        Raises `StateFailure` when it was saved and both generations are damaged, `Misuse` for a name outside
        letters, digits, ``-`` and ``_``.
        """
        newest = self._newest(name)
        return None if newest is None else newest.data

    def save(self, name: str, data: bytes) -> None:
        """Make ``data`` the content of an image; when this returns it survives power loss.

        Raises `StateFailure` when that is not possible; a later `load` then gives the old content or this one.
        """
        newest = self._newest(name, strict=False)
        slot, number = (0, 1) if newest is None else (1 - newest.slot, newest.number + 1)
        body = struct.pack("<QI", number, len(data)) + data
        temporary = self.path / f"{name}.tmp"
        try:
            _write(temporary, _HEADER.pack(_MAGIC, number, len(data), zlib.crc32(body)) + data)
            temporary.replace(self._slot(name, slot))
            _sync(self.path)
        except OSError as error:
            raise StateFailure(f"{name} cannot be saved in {self.path}: {error.strerror}") from error

    def _newest(self, name: str, *, strict: bool = True) -> _Generation | None:
        if self._lock is None:
            raise Misuse(f"the state directory {self.path} is not open")
        if not _NAME.match(name):
            raise Misuse(f"{name!r} is no image name: permitted are up to 64 letters, digits, '-' and '_'")
        slots = [self._read(name, slot) for slot in (0, 1)]
        good = [slot for slot in slots if isinstance(slot, _Generation)]
        if good:
            return max(good, key=lambda generation: generation.number)
        # A single damaged slot is a first save that was torn: what was there before is nothing.
        if strict and None not in slots:
            raise StateFailure(
                f"both generations of {name} in {self.path} are unusable ({name}.0 is {slots[0]}, {name}.1 is {slots[1]});"
                " remove both to start anew"
            )
        return None

    def _slot(self, name: str, slot: int) -> Path:
        return self.path / f"{name}.{slot}"

    def _read(self, name: str, slot: int) -> _Generation | str | None:
        """A good generation; what a bad one is; None for a slot never used."""
        try:
            content = read_bytes(self._slot(name, slot))
        except Misuse as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return None
            raise StateFailure(str(error)) from error
        if len(content) < _HEADER.size:
            return "too short"
        magic, number, length, check = _HEADER.unpack_from(content)
        data = content[_HEADER.size :]
        if magic != _MAGIC or length != len(data) or zlib.crc32(content[4:16] + data) != check:
            return "damaged"
        return _Generation(slot, number, data)


def _write(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync(directory: Path) -> None:
    """Make renames and new names in a directory survive power loss."""
    handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
