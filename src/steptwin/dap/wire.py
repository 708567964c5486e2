"""Messages of the Debug Adapter Protocol as bytes: a header with the length, then JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, BinaryIO

from steptwin.errors import Misuse
from steptwin.numerals import read_whole

LONGEST_MESSAGE = 16 << 20
LONGEST_LINE = 1000
"""Bytes of a line of the header."""
_LENGTH = b"content-length:"


def read_message(stream: BinaryIO) -> dict[str, Any] | None:
    """The next message; None at the end of the stream. Raises `Misuse` for what is no message."""
    length: int | None = None
    while True:
        line = stream.readline(LONGEST_LINE)
        if not line:
            return None
        text = line.strip()
        if text.lower().startswith(_LENGTH):
            number = text[len(_LENGTH) :].strip()
            length = read_whole(number.decode("latin-1"))
            if length is None or length > LONGEST_MESSAGE:
                raise Misuse(f"Content-Length {number[:40].decode('latin-1')!r}: permitted are 0 to {LONGEST_MESSAGE}")
        elif not text and length is not None:
            break
        elif text and b":" not in text:
            raise Misuse(f"header {text[:40].decode('latin-1')!r}: expected Content-Length")
    data = stream.read(length)
    if len(data) < length:
        return None
    try:
        message = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise Misuse(f"this is no JSON: {error}") from None
    if not isinstance(message, dict):
        raise Misuse("a message is an object of JSON")
    return message


def message_bytes(message: Mapping[str, object]) -> bytes:
    data = json.dumps(message, ensure_ascii=False, separators=(",", ":")).encode(errors="replace")
    return b"Content-Length: %d\r\n\r\n" % len(data) + data
