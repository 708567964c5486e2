"""Text files of this field as bytes: UTF-8 and UTF-16 with their marks, the code page of Polish Windows, the end mark of DOS."""

from __future__ import annotations

import re
from dataclasses import dataclass

from steptwin.errors import Misuse

# Code page 1250 is Polish Windows before Unicode; Latin-1 takes the bytes that page leaves undefined, so that every text can be
# written back.
_WITHOUT_MARK = ("utf-8", "cp1250", "latin-1")
_MARKS = ((b"\xef\xbb\xbf", _WITHOUT_MARK), (b"\xff\xfe", ("utf-16-le",)), (b"\xfe\xff", ("utf-16-be",)))
# DOS editors end a text with Ctrl-Z and may fill the last block with more of them.
_DOS_END = re.compile("\x1a+[\\s\x1a]*\\Z")
# ESC, BS and the like occur in texts by accident. A file with many of them is not text.
_CONTROL = re.compile("[\x01-\x06\x0e-\x1f\x7f]")
_CONTROLS_PER_TEXT = 0.01


@dataclass(frozen=True, slots=True)
class Decoded:
    """A text, and the facts for writing it back: encoding, byte order mark, and the bytes after the end mark of DOS."""

    text: str
    encoding: str
    mark: bytes = b""
    tail: str = ""

    def to_bytes(self, text: str) -> bytes:
        """``text`` as bytes of this kind of file; the unchanged text gives the bytes it was read from."""
        return self.mark + (text + self.tail).encode(self.encoding)


def decode(data: bytes, name: str) -> Decoded:
    """The text of a file. Raises `Misuse`, which gives ``name``, for bytes that are no text."""
    mark, encodings = next(((mark, encodings) for mark, encodings in _MARKS if data.startswith(mark)), (b"", _WITHOUT_MARK))
    content = data[len(mark) :]
    for encoding in encodings:
        try:
            return _text(content.decode(encoding), name, encoding, mark)
        except UnicodeDecodeError:
            continue
    raise Misuse(f"{name} is not a text file: it begins like {encodings[0].upper()}, but goes on otherwise")


def _text(whole: str, name: str, encoding: str, mark: bytes = b"") -> Decoded:
    if (place := whole.find("\0")) >= 0:
        half, other = whole[place % 2 :: 2], whole[1 - place % 2 :: 2]
        if 2 * half.count("\0") > len(half) and "\0" not in other and len(whole) > 3:
            raise Misuse(f"{name} looks like UTF-16 without a byte order mark: save it as UTF-8")
        raise Misuse(f"{name} is not a text file: character {place + 1} is NUL")
    end = _DOS_END.search(whole)
    text, tail = (whole[: end.start()], whole[end.start() :]) if end else (whole, "")
    found = _CONTROL.findall(text)
    if len(found) > max(1, _CONTROLS_PER_TEXT * len(text)):
        raise Misuse(f"{name} is not a text file: {len(found)} of its {len(text)} characters are control characters")
    return Decoded(text, encoding, mark, tail)
