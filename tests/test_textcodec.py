"""Bytes of text files: whatever is read is written back byte for byte."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.textcodec import decode


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", ""),
        (b"caf\xc3\xa9\n", "café\n"),
        (b"\xef\xbb\xbfM1\r\n", "M1\r\n"),
        (b"\xff\xfeM\x001\x00\x05\x01", "M1ą"),
        (b"\xfe\xff\x00M\x001\x01\x05", "M1ą"),
        (b"\xb9\xea\n", "ąę\n"),
        (b"\xb9\x81\n", "¹\x81\n"),
        (b"\xef\xbb\xbf\xb9\n", "ą\n"),
        (b"END\r\n\x1a", "END\r\n"),
        (b"END\x1a\x1a\r\n\x1a", "END"),
        (b"A\x1aB\n", "A\x1aB\n"),
        (b"one \x1b is an accident\n", "one \x1b is an accident\n"),
    ],
    ids=str,
)
def test_texts(data: bytes, text: str) -> None:
    decoded = decode(data, "x")
    assert decoded.text == text
    assert decoded.to_bytes(text) == data


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"ab\0", "x is not a text file: character 3 is NUL"),
        (b"\x7fELF\x02\x01\x01\0\0\0", "x is not a text file: character 8 is NUL"),
        ("ON\n".encode("utf-16-le"), "x looks like UTF-16 without a byte order mark: save it as UTF-8"),
        ("ON\n".encode("utf-16-be"), "x looks like UTF-16 without a byte order mark: save it as UTF-8"),
        (b"\xff\xfe\x00\xd8", "x is not a text file: it begins like UTF-16-LE, but goes on otherwise"),
        (b"\x1f\x8b\x08\x01abc", "x is not a text file: 2 of its 7 characters are control characters"),
    ],
    ids=str,
)
def test_what_is_no_text(data: bytes, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        decode(data, "x")
    assert str(refused.value) == message


@given(st.binary(max_size=60))
def test_any_bytes_are_refused_or_written_back(data: bytes) -> None:
    try:
        decoded = decode(data, "x")
    except Misuse:
        return
    assert decoded.to_bytes(decoded.text) == data
