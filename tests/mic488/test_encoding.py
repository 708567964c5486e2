"""32-bit values in registers, against the manual's rules and examples worked out by hand."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.mic488.encoding import (
    DINT_MAX,
    DINT_MIN,
    REAL_MAX,
    dint_to_words,
    real_to_words,
    saturated_dint,
    saturated_real,
    shortest_real,
    swap_bytes,
    word_to_int,
    words_to_dint,
    words_to_real,
    wrapped_dint,
)

WORDS = st.integers(0, 0xFFFF)


def _manual(low: int, high: int) -> int:
    """Manual 3.2: Byte3<<24 + Byte2<<16 + Byte1<<8 + Byte0, register X holding bytes 1 and 0, X+1 bytes 3 and 2."""
    byte1, byte0, byte3, byte2 = low >> 8, low & 0xFF, high >> 8, high & 0xFF
    return (byte3 << 24) + (byte2 << 16) + (byte1 << 8) + byte0


DINT_EXAMPLES = [
    (32000, (0x7D00, 0x0000)),  # 2.5 rev/s at 12800 imp/rev
    (57600, (0xE100, 0x0000)),  # 4.5 rev
    (65536, (0x0000, 0x0001)),
    (0, (0x0000, 0x0000)),
    (-1, (0xFFFF, 0xFFFF)),
    (DINT_MAX, (0xFFFF, 0x7FFF)),
    (DINT_MIN, (0x0000, 0x8000)),
]
REAL_EXAMPLES = [
    (2.5, (0x0000, 0x4020)),
    (4.5, (0x0000, 0x4090)),
    (10.0, (0x0000, 0x4120)),
    (-0.1, (0xCCCD, 0xBDCC)),
    (3.4028234663852886e38, (0xFFFF, 0x7F7F)),
    (1.1754943508222875e-38, (0x0000, 0x0080)),
    (0.0, (0x0000, 0x0000)),
]


@pytest.mark.parametrize(("value", "words"), DINT_EXAMPLES)
def test_dint_low_word_first(value: int, words: tuple[int, int]) -> None:
    assert dint_to_words(value) == words
    assert words_to_dint(*words) == value
    assert _manual(*words) == value % 2**32


@pytest.mark.parametrize(("value", "words"), REAL_EXAMPLES)
def test_real_low_word_first(value: float, words: tuple[int, int]) -> None:
    assert real_to_words(value) == words
    assert words_to_real(*words) == pytest.approx(value, rel=1e-7)
    assert struct.unpack(">f", _manual(*words).to_bytes(4, "big"))[0] == words_to_real(*words)


@given(WORDS, WORDS)
def test_every_pair_of_words_is_a_dint(low: int, high: int) -> None:
    assert words_to_dint(low, high) % 2**32 == _manual(low, high)
    assert dint_to_words(words_to_dint(low, high)) == (low, high)


@given(st.floats(width=32, allow_nan=False))
def test_every_single_survives(value: float) -> None:
    assert words_to_real(*real_to_words(value)) == value


@pytest.mark.parametrize("value", [DINT_MAX + 1, DINT_MIN - 1, 10**20])
def test_a_number_beyond_dint_is_refused_with_the_range(value: int) -> None:
    with pytest.raises(Misuse, match=rf"{value} does not fit a DINT: permitted -2147483648…2147483647"):
        dint_to_words(value)


def test_a_number_beyond_real_is_refused_with_the_range() -> None:
    with pytest.raises(Misuse, match=r"1e\+39 does not fit a REAL: permitted −3\.4028e\+38…3\.4028e\+38"):
        real_to_words(1e39)


@given(st.floats(allow_nan=False))
def test_saturated_values_always_fit(value: float) -> None:
    dint = saturated_dint(value)
    assert words_to_dint(*dint_to_words(dint)) == dint
    real_to_words(saturated_real(value))
    if DINT_MIN <= value <= DINT_MAX:
        assert abs(dint - value) <= 0.5
    if abs(value) <= REAL_MAX:
        assert saturated_real(value) == value


def test_saturation_goes_to_the_limits() -> None:
    assert (saturated_dint(1e300), saturated_dint(-math.inf), saturated_dint(2147483646.6)) == (DINT_MAX, DINT_MIN, DINT_MAX)
    assert (saturated_real(1e300), saturated_real(-math.inf)) == (REAL_MAX, -REAL_MAX)
    assert (saturated_dint(2.5), saturated_dint(3.5), saturated_dint(-0.4)) == (2, 4, 0)


def test_counters_wrap_as_32_bits_do() -> None:
    values = {DINT_MAX: DINT_MAX, DINT_MAX + 1: DINT_MIN, DINT_MIN - 1: DINT_MAX, 2**32: 0, -1: -1, 5 * 2**32 + 7: 7}
    assert {value: wrapped_dint(value) for value in values} == values


def test_nan_has_no_saturated_value() -> None:
    with pytest.raises(Misuse, match="NaN"):
        saturated_dint(math.nan)
    with pytest.raises(Misuse, match="NaN"):
        saturated_real(math.nan)


def test_int_is_signed() -> None:
    assert [word_to_int(word) for word in (0, 1, 0x7FFF, 0x8000, 0xFFFF)] == [0, 1, 32767, -32768, -1]


def test_a_block_packed_little_endian_is_swapped_onto_the_wire() -> None:
    block = struct.pack("<Hif", 0x1234, 57600, 2.5)
    assert swap_bytes(block) == bytes.fromhex("1234 E100 0000 0000 4020")


@given(st.lists(st.tuples(st.integers(DINT_MIN, DINT_MAX), st.floats(width=32, allow_nan=False))))
def test_the_block_way_equals_the_word_way(values: list[tuple[int, float]]) -> None:
    block = b"".join(struct.pack("<if", dint, real) for dint, real in values)
    words = [word for dint, real in values for word in (*dint_to_words(dint), *real_to_words(real))]
    assert swap_bytes(block) == struct.pack(f">{len(words)}H", *words)
    assert swap_bytes(swap_bytes(block)) == block


@pytest.mark.parametrize(
    ("value", "text"),
    [(10.11, "10.11"), (10.13, "10.13"), (0.1, "0.1"), (16777216.0, "16777216"), (16777217.0, "16777217"), (-25.0, "-25"),
     (1.0000001, "1.0000001"), (0.0, "0"), (1e10, "1e+10"), (math.inf, "inf"), (1e300, "1e+300")],
)  # fmt: skip
def test_a_real_for_people(value: float, text: str) -> None:
    assert shortest_real(value) == text


@pytest.mark.parametrize("bits", ["7FC00000", "FFC00000", "7FD63116", "7F800001", "FFFFFFFF"])
def test_a_real_that_is_no_number_for_people(bits: str) -> None:
    """A device may send any of them."""
    (value,) = struct.unpack(">f", bytes.fromhex(bits))
    assert shortest_real(value) == "nan"


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_what_people_read_is_the_same_real(value: float) -> None:
    assert words_to_real(*real_to_words(float(shortest_real(value)))) == value
