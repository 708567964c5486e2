"""Reading and writing of text files that the user names."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, SteptwinError
from steptwin.files.writing import check_content, new_content
from steptwin.inputfiles import MOST_BYTES, format_path, read_bytes
from steptwin.messages import Message
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


CANNOT_WRITE = Message("files.cannot-write", "cannot write {path}: {why}")


def check_writable(path: Path) -> None:
    """Check in advance that a file can be written; missing folders are permitted. Raises `Misuse`."""
    try:
        check_content(path)
    except (OSError, ValueError) as error:
        raise Misuse(CANNOT_WRITE(path=format_path(path), why=reason(error))) from None


NO_FOLDER = Message("files.no-folder", "cannot write {path}: there is no folder {folder}")


def check_folder(path: Path) -> None:
    """Check that the folder of a file exists. Raises `Misuse`."""
    if not path.parent.is_dir():
        raise Misuse(NO_FOLDER(path=format_path(path), folder=format_path(path.parent)))


@contextmanager
def new_file(path: Path) -> Generator[IO[bytes]]:
    """`new_content` of a file that the user names. Raises `Misuse` if it cannot be written."""
    try:
        with new_content(path) as file:
            yield file
    except SteptwinError:  # a failed line or database is an `OSError`, too
        raise
    except OSError as error:
        raise Misuse(CANNOT_WRITE(path=format_path(path), why=reason(error))) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file as a whole, and make its folders. Raises `Misuse` if that is not possible."""
    check_writable(path)
    with new_file(path) as file:
        file.write(data)


def read_text(path: Path, most: int = MOST_BYTES) -> TextFile:
    """A text file of at most ``most`` bytes in UTF-8, UTF-16 with its byte order mark, or the code page of Polish Windows.

    Raises `Misuse` when it cannot be read or is not text.
    """
    decoded = decode(read_bytes(path, most), str(path))
    return TextFile(SourceText(str(path), decoded.text), decoded)
