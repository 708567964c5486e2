"""32-bit values in two registers, low word first, each register big-endian on the wire (manual 3.2).

``value = register[X + 1] << 16 | register[X]``. DINT is two's complement, REAL is IEEE 754 single precision.
"""

from __future__ import annotations

import math
import struct
from array import array
from itertools import count

from steptwin.errors import Misuse
from steptwin.messages import Message

DINT_MIN = -(2**31)
DINT_MAX = 2**31 - 1
REAL_MAX = (2.0 - 2.0**-23) * 2.0**127
"""Largest finite REAL, about 3.4028e38."""
WORD_MAX = 0xFFFF

_REAL = struct.Struct("<f")
_DINT = struct.Struct("<i")
_WORDS = struct.Struct("<HH")


def swap_bytes(block: bytes | bytearray) -> bytes:
    """Exchange the two bytes of every 16-bit word; its own inverse. The length must be even.

    A block of values packed little-endian (``<f``, ``<i``, ``<H``) becomes the bytes on the wire, in one step for a whole
    block: swapping the bytes of each word, but not the words, leaves the low word of a 32-bit value first.
    """
    words = array("H", block)
    words.byteswap()
    return words.tobytes()


NO_DINT = Message("mic488.no-dint", "{value} does not fit a DINT: permitted {least}…{most}")


def dint_to_words(value: int) -> tuple[int, int]:
    """Low and high word of a DINT. Raises `Misuse` outside −2³¹…2³¹−1."""
    if not DINT_MIN <= value <= DINT_MAX:
        raise Misuse(NO_DINT(value=value, least=DINT_MIN, most=DINT_MAX))
    return _WORDS.unpack(_DINT.pack(value))


def words_to_dint(low: int, high: int) -> int:
    """The DINT in two registers (each 0…65535)."""
    return _DINT.unpack(_WORDS.pack(low, high))[0]


NO_REAL = Message("mic488.no-real", "{value:g} does not fit a REAL: permitted −{most:.5g}…{most:.5g}")


def real_to_words(value: float) -> tuple[int, int]:
    """Low and high word of the nearest REAL. Raises `Misuse` for a finite number beyond ±3.4028e38; NaN, infinity pass."""
    try:
        return _WORDS.unpack(_REAL.pack(value))
    except OverflowError:
        raise Misuse(NO_REAL(value=value, most=REAL_MAX)) from None


def words_to_real(low: int, high: int) -> float:
    """The REAL in two registers (each 0…65535); may be NaN or infinite, which no register accepts (MIC-7)."""
    return _REAL.unpack(_WORDS.pack(low, high))[0]


def word_to_int(word: int) -> int:
    """A register read as signed 16-bit number (INT)."""
    return word - 0x10000 if word & 0x8000 else word


def wrapped_dint(value: int) -> int:
    """The value that a 32-bit counter shows at ``value``."""
    return (value - DINT_MIN) % 2**32 + DINT_MIN


NAN_IS_NO_DINT = Message("mic488.nan-is-no-dint", "NaN is not a DINT")


def saturated_dint(value: float) -> int:
    """The nearest DINT within its range, which a register shows when its quantity is beyond it. Ties go to even.

    Raises `Misuse` for NaN.
    """
    if math.isnan(value):
        raise Misuse(NAN_IS_NO_DINT())
    return round(min(max(value, DINT_MIN), DINT_MAX))


NAN_IS_NO_REAL = Message("mic488.nan-is-no-real", "NaN is not a REAL of this device")


def saturated_real(value: float) -> float:
    """``value`` limited to what a REAL can hold, so that it can always be packed. Raises `Misuse` for NaN."""
    if math.isnan(value):
        raise Misuse(NAN_IS_NO_REAL())
    return min(max(value, -REAL_MAX), REAL_MAX)


def shortest_real(value: float) -> str:
    """A REAL as text, with the fewest digits (6 to 9) that distinguish it from its neighbours: 10.11 for 10.109999656677246."""
    if not math.isfinite(value):
        return f"{value:.9g}"  # a NaN is equal to nothing, not to all that are written so
    try:
        words = real_to_words(value)
    except Misuse:
        return f"{value:.9g}"
    return next(text for n in count(6) if real_to_words(float(text := f"{value:.{n}g}")) == words)
