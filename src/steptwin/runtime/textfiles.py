"""Files the user names: their bytes, and texts as people's editors leave them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from errno import EACCES, EISDIR, ENOTDIR
from pathlib import Path

from steptwin.diagnostics import Source
from steptwin.errors import Misuse
from steptwin.textcodec import Decoded, decode


@dataclass(frozen=True, slots=True)
class TextFile:
    """A text and how its bytes say it."""

    source: Source
    decoded: Decoded

    def to_bytes(self, text: str) -> bytes:
        """A text in the manner of this file: encoding, byte order mark, DOS end mark. Its own text gives its own bytes."""
        return self.decoded.to_bytes(text)


def read_bytes(path: Path) -> bytes:
    """The content of a file the user named. Raises `Misuse` when it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise Misuse(f"cannot read {path}: {error.strerror or error}") from error


def check_writable(path: Path) -> None:
    """Whether a file can be written here, before much is done for it; folders on the way can be made. Raises `Misuse`."""
    place, number = path, EISDIR if path.is_dir() else 0
    while not number and not place.exists():
        place = place.parent
        number = 0 if place.is_dir() or not place.exists() else ENOTDIR
    if not number and not os.access(place, os.W_OK):
        number = EACCES
    if number:
        raise Misuse(f"cannot write {path}: {os.strerror(number)}")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file, and the folders it is to be in. Raises `Misuse` when it cannot be written."""
    check_writable(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    except OSError as error:
        raise Misuse(f"cannot write {path}: {error.strerror or error}") from error


def read_text(path: Path) -> TextFile:
    """A text file in UTF-8, UTF-16 with its byte order mark, or the code page of Polish Windows.

    Raises `Misuse` when it cannot be read or is no text.
    """
    decoded = decode(read_bytes(path), str(path))
    return TextFile(Source(str(path), decoded.text), decoded)
