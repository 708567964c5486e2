"""Reading and writing of text files that the user names."""

from __future__ import annotations

import os
from dataclasses import dataclass
from errno import EACCES, EINVAL, EISDIR, ENOTDIR
from pathlib import Path

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.inputfiles import MOST_BYTES, read_bytes, shown
from steptwin.system import reason
from steptwin.textcodec import Decoded, decode


@dataclass(frozen=True, slots=True)
class TextFile:
    """A text and its encoding."""

    source: SourceText
    decoded: Decoded

    def to_bytes(self, text: str) -> bytes:
        """Encode a text as this file was: encoding, byte order mark, DOS end mark. The unchanged text gives the same bytes."""
        return self.decoded.to_bytes(text)


def check_writable(path: Path) -> None:
    """Check in advance that a file can be written; missing folders are permitted. Raises `Misuse`."""
    try:
        place, number = path, EISDIR if path.is_dir() else 0
        while not number and not place.exists():
            place = place.parent
            number = 0 if place.is_dir() or not place.exists() else ENOTDIR
        if not number and not os.access(place, os.W_OK):
            number = EACCES
    except OSError as error:  # a name that is too long
        number = error.errno or EINVAL
    except ValueError as error:
        raise Misuse(f"cannot write {shown(path)}: {error}") from None
    if number:
        raise Misuse(f"cannot write {shown(path)}: {reason(OSError(number, ''))}")
    if path.exists() and not path.is_file():
        raise Misuse(f"cannot write {path}: it is not a regular file")


def check_folder(path: Path) -> None:
    """Check that the folder of a file exists. Raises `Misuse`."""
    if not path.parent.is_dir():
        raise Misuse(f"cannot write {shown(path)}: there is no folder {shown(path.parent)}")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file, and make its folders. Raises `Misuse` if that is not possible."""
    check_writable(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    except OSError as error:
        raise Misuse(f"cannot write {path}: {reason(error)}") from error


def read_text(path: Path, most: int = MOST_BYTES) -> TextFile:
    """A text file of at most ``most`` bytes in UTF-8, UTF-16 with its byte order mark, or the code page of Polish Windows.

    Raises `Misuse` when it cannot be read or is not text.
    """
    decoded = decode(read_bytes(path, most), str(path))
    return TextFile(SourceText(str(path), decoded.text), decoded)
