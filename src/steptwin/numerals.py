"""Numbers as people type them: one grammar for every way in.

Digits with a point or one comma before the fraction, a sign, an exponent: ``12``, ``-0.5``, ``12,5``, ``1e3``; nothing else:
no separators of thousands, no ``_``, no digits of other scripts, no ``inf``. What looks like one is refused with what to write.
"""

from __future__ import annotations

import re
import unicodedata
from math import isfinite

from steptwin.datatypes import format_short
from steptwin.errors import Misuse
from steptwin.messages import Message

_NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+", re.ASCII)
"""The comma may be one of thousands, or one before a fraction."""
_HEXADECIMAL = re.compile(r"0[xX][0-9A-Fa-f]{1,8}", re.ASCII)
_SEPARATORS = str.maketrans("−", "-", "_' \u00a0\u2009\u202f")
_LONGEST_WHOLE = 18
"""Digits; what is read as one has far fewer."""


NO_NUMBER = Message("numerals.no-number", "{text} is not a number")
OTHER_FORM = Message("numerals.other-form", "{text} is not a number: write {meant}")
COMMA_OF_THOUSANDS = Message(
    "numerals.comma-of-thousands", "{text} has a comma that may separate thousands: write {whole} or {fraction}"
)
COMMAS_OF_THOUSANDS = Message("numerals.commas-of-thousands", "{text} has a comma that may separate thousands: write {whole}")
TOO_LARGE = Message("numerals.too-large", "{text} is too large for a number")


def read_number(text: str, *, or_hexadecimal: bool = False) -> float:
    """A finite number. ``or_hexadecimal``: also a word as ``0x1F``. Raises `Misuse` with what to write instead."""
    text = text.strip()
    if or_hexadecimal and _HEXADECIMAL.fullmatch(text):
        return float(int(text, 16))
    if _GROUPED.fullmatch(text):
        whole = text.replace(",", "")
        if text.count(",") > 1:
            raise Misuse(COMMAS_OF_THOUSANDS(text=format_short(text), whole=whole))
        raise Misuse(COMMA_OF_THOUSANDS(text=format_short(text), whole=whole, fraction=str(float(text.replace(",", ".")))))
    if not _NUMBER.fullmatch(text):
        meant = _meant(text)
        raise Misuse(NO_NUMBER(text=format_short(text)) if meant is None else OTHER_FORM(text=format_short(text), meant=meant))
    value = float(text.replace(",", "."))
    if not isfinite(value):
        raise Misuse(TOO_LARGE(text=format_short(text)))
    return value


NO_WHOLE_NUMBER = Message("numerals.no-whole-number", "{text} is not a whole number")


def read_integer(text: str) -> int:
    """A whole number with its sign, or a word as ``0x1F``, exactly. Raises `Misuse`."""
    value = read_number(text, or_hexadecimal=True)
    if not value.is_integer():
        raise Misuse(NO_WHOLE_NUMBER(text=format_short(text.strip())))
    return int(text) if len(text) <= 4000 and text.strip().lstrip("+-").isdecimal() else int(value)


def _meant(text: str) -> str | None:
    """The number that is probably meant; None where that is not clear."""
    if _HEXADECIMAL.fullmatch(text):
        return str(int(text, 16))
    plain = unicodedata.normalize("NFKC", text).translate(_SEPARATORS)
    if plain.count(".") and plain.count(","):
        last = max(plain.rindex("."), plain.rindex(","))
        plain = plain[:last].replace(".", "").replace(",", "") + "." + plain[last + 1 :]
    return plain if len(plain) <= _LONGEST_WHOLE and _NUMBER.fullmatch(plain) else None


def read_whole(text: str) -> int | None:
    """A whole number from 0; None for anything else than decimal digits, and for more than any that is meant."""
    is_one = text.isascii() and text.isdecimal() and len(text) <= _LONGEST_WHOLE
    return int(text) if is_one else None
