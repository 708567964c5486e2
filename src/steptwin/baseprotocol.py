"""Messages of JSON-RPC and of the Debug Adapter Protocol on a stream: a header with the length, then the body.

Nothing in the stream marks where a message begins, so behind a wrong header no byte can be trusted: the session ends.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import BinaryIO

from steptwin.errors import Misuse
from steptwin.numerals import read_whole

LONGEST_MESSAGE = 16 << 20
LONGEST_LINE = 1000
"""Bytes of a line of the header."""
_LENGTH = b"content-length:"


def own_stdin() -> BinaryIO:
    """Standard input with a buffer of its own: the interpreter cannot end while a thread waits in that of ``sys.stdin``."""
    return open(0, "rb", closefd=False)


def read_body(stream: BinaryIO) -> bytes | None:
    """The body of the next message; None at the end of the stream, also inside a message. Raises `Misuse` for a wrong header."""
    length: int | None = None
    while True:
        line = stream.readline(LONGEST_LINE)
        if not line.endswith(b"\n"):
            if len(line) == LONGEST_LINE:
                raise Misuse(f"header {line[:40].decode('latin-1')!r}…: a line of more than {LONGEST_LINE} bytes")
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
    body = stream.read(length)
    return body if len(body) == length else None


def message_bytes(message: Mapping[str, object]) -> bytes:
    body = json.dumps(message, ensure_ascii=False, separators=(",", ":")).encode(errors="replace")
    return b"Content-Length: %d\r\n\r\n" % len(body) + body
