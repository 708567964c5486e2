"""One grammar of numbers."""

from __future__ import annotations

import sys

import pytest

from steptwin.errors import Misuse
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import value_of
from steptwin.numerals import read_integer, read_number, read_whole

ACCEPTED = {"12": 12.0, "-0.5": -0.5, "+3": 3.0, "12,5": 12.5, ".5": 0.5, "5.": 5.0, "1e3": 1000.0, "0,125": 0.125, " 7 ": 7.0}
REFUSED = {
    "1,000": "has a comma that may separate thousands: write 1000 or 1.0",
    "-12,345": "write -12345 or -12.345",
    "1,000,000": "write 1000000",
    "1_000": "is not a number: write 1000",
    "1 000": "is not a number: write 1000",
    "1'000": "is not a number: write 1000",
    "1.000,5": "is not a number: write 1000.5",
    "1,000.5": "is not a number: write 1000.5",
    "１２": "is not a number: write 12",
    "−5": "is not a number: write -5",
    "0x10": "is not a number: write 16",
    "1e999": "is too large for a number",
    "9" * 400: "is too large for a number",
    "9" * 5000: "is too large for a number",
    "inf": "is not a number",
    "nan": "is not a number",
    "12mm": "is not a number",
    "": "is not a number",
}


@pytest.mark.parametrize(("text", "value"), ACCEPTED.items())
def test_numbers(text: str, value: float) -> None:
    assert read_number(text) == value


@pytest.mark.parametrize(("text", "message"), REFUSED.items(), ids=lambda text: text[:20])
def test_others_are_refused_with_what_to_write(text: str, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        read_number(text)
    assert str(refused.value).endswith(message)
    assert len(str(refused.value)) < 150


def test_a_word_may_be_hexadecimal() -> None:
    assert read_number("0x1F", or_hexadecimal=True) == 31.0
    registers = register_map()
    assert value_of(registers.named("USER_REGISTER"), "0x1F") == 31.0
    with pytest.raises(Misuse, match="'0x10' is not a number: write 16"):
        value_of(registers.named("M1_POS_ABS"), "0x10")


@pytest.mark.parametrize(("text", "value"), {"0": 0, "007": 7, "１２": None, "1_0": None, "-1": None, "9" * 19: None}.items())
def test_whole_numbers(text: str, value: int | None) -> None:
    assert read_whole(text) == value


def test_integers_are_exact() -> None:
    assert [read_integer(text) for text in ("-9223372036854775807", "0xFF", "1e3", "+4,0")] == [-(2**63) + 1, 255, 1000, 4]
    for text in ("1.5", "1_0", "9" * 5000):
        with pytest.raises(Misuse):
            read_integer(text)


def test_python_reads_no_longer_whole_numbers() -> None:
    """The reason for the limits: int() refuses them with an error that is not ours."""
    assert sys.get_int_max_str_digits() == 4300
