"""Reading the files a user names. Only regular files of a bounded size: a pipe would block, a device need never end."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import IO

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.system import READ_FLAGS, reason

MOST_BYTES = 256 << 10
"""Limit for programs, configurations and tables, which people write for a controller; it holds far less."""
MOST_DESCRIPTION_BYTES = 1 << 20
"""Limit for descriptions of worlds."""
MOST_RECORDED_BYTES = 48 << 20
"""Limit for recordings and transcripts, which programs write."""
MOST_RECORDED_VALUES = 1_500_000
"""Limit for the lists, objects and their items in such a file: an empty list takes 3 bytes on disk and 64 in memory."""

_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


CANNOT_READ = Message("inputfiles.cannot-read", "cannot read {path}: {why}")


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """The content of a regular file of at most ``most`` bytes. Raises `Misuse`."""
    with open_regular(path, most) as file:
        try:
            data = file.read(most + 1)
        except OSError as error:
            raise Misuse(CANNOT_READ(path=path, why=reason(error))) from error
    if len(data) > most:  # it grew, or its file system reports no sizes
        raise _too_large(path, len(data), most)
    return data


TOO_MANY_VALUES = Message(
    "inputfiles.too-many-values", "cannot read {path}: it has about {values} values; permitted are at most {most}"
)
NO_TEXT = Message("inputfiles.no-text", "cannot read {path}: it is not UTF-8 text")


def read_recorded(path: Path, most: int = MOST_RECORDED_BYTES) -> str:
    """The text of a recording or transcript (JSON in UTF-8), which may be parsed: its size and its number of values are bounded.
    Raises `Misuse`."""
    data = read_bytes(path, most)
    values = sum(map(data.count, (b",", b"[", b"{")))
    if values > MOST_RECORDED_VALUES:
        raise Misuse(TOO_MANY_VALUES(path=path, values=values, most=MOST_RECORDED_VALUES))
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise Misuse(NO_TEXT(path=path)) from error


NO_FILE = Message("inputfiles.no-file", "cannot read {path}: it is {kind}, not a file")


def open_regular(path: Path, most: int | None = None) -> IO[bytes]:
    """A regular file opened for reading. Raises `Misuse` for what cannot be read, is not a regular file or has more bytes."""
    try:
        # Opening a pipe would wait for a program that writes into it.
        handle = os.open(path, READ_FLAGS)
    except OSError as error:
        raise Misuse(CANNOT_READ(path=format_path(path), why=reason(error))) from error
    except ValueError as error:
        raise Misuse(CANNOT_READ(path=format_path(path), why=error)) from None
    found = os.fstat(handle)
    if stat.S_ISREG(found.st_mode) and (most is None or found.st_size <= most):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISREG(found.st_mode):
        raise _too_large(path, found.st_size, most or 0)
    kind = next((kind for is_one, kind in _KINDS if is_one(found.st_mode)), "something else")
    raise Misuse(NO_FILE(path=path, kind=kind))


def _too_large(path: Path, size: int, most: int) -> Misuse:
    return Misuse(f"cannot read {path}: it has {size} bytes; permitted are at most {most}")


def format_path(path: Path) -> str:
    """A path for a message: printable, and no longer than a line."""
    text = str(path).encode("utf-8", "backslashreplace").decode().replace("\0", "\\0")
    return text if len(text) <= 200 else f"{text[:100]}…{text[-60:]}"
