"""Commands as bytes: sizes against the manual, every command there and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.m1486.commands import TABLE, ArgType, When, takes_variable
from steptwin.m1486.encoding import LONGEST, SIZES, decode, encode
from steptwin.m1486.syntax import ChipCommand, JumpCondition, parse_line
from steptwin.m1486.variants import variant

B = variant("B")


def command(text: str) -> ChipCommand:
    read = parse_line(text).line.command
    assert read is not None
    return read


# Chapter II, Memory: the manual's own examples, and the length of I.
@pytest.mark.parametrize(
    ("text", "bits"), [("R", 8), ("L5", 16), ("A1000", 24), ("W500", 32), ("I2H2", 32), ("f", 32), ("g+", 32)]
)
def test_a_command_takes_the_bits_the_manual_says(text: str, bits: int) -> None:
    assert 8 * len(encode(command(text))) == bits


def stored_commands() -> list[ChipCommand]:
    cases = []
    for spec in TABLE:
        if spec.when is not When.QUEUED:
            continue
        if spec.kind is ArgType.NONE:
            cases.append(ChipCommand(spec.key))
            continue
        values = spec.permitted(B)
        cases += [
            ChipCommand(spec.key, JumpCondition(number, number % 2 == 0, 80) if spec.kind is ArgType.CONDITION else number)
            for number in {values[0], values[-1], values[len(values) // 2]}
        ]
        if takes_variable(spec.key):
            cases.append(ChipCommand(spec.key))
    return cases


@pytest.mark.parametrize("case", stored_commands(), ids=str)
def test_a_stored_command_is_read_back(case: ChipCommand) -> None:
    raw = encode(case)
    assert len(raw) == SIZES[case.key[0]]
    # What lies behind it in the memory does not matter.
    for filling in (0x00, 0xFF):
        stored = decode((raw + bytes([filling]) * LONGEST)[:LONGEST])
        assert stored == (case, len(raw))


def test_m_29_a_byte_that_begins_no_command_is_none() -> None:
    """A number that is left out sets the highest bit."""
    for first in range(256):
        letter = chr(first & 0x7F)
        if letter not in SIZES:
            assert decode(bytes((first, 1, ord("H"), 1, 0, 0))[:LONGEST]) is None, first
    assert decode(bytes((ord("I"), 1, ord("H"), 2, 0, 0))[:LONGEST]) == (ChipCommand("I", JumpCondition(1, True, 2)), 4)
    assert decode(bytes((ord("I"), 1, ord("X"), 2, 0, 0))[:LONGEST]) is None


def test_m_24_g_plus_and_minus_take_as_much_as_g() -> None:
    assert len(encode(ChipCommand("G+"))) == len(encode(ChipCommand("G-"))) == len(encode(ChipCommand("G", 1)))


@given(st.binary(min_size=LONGEST, max_size=LONGEST))
def test_m_29_any_bytes_are_a_command_or_none(raw: bytes) -> None:
    stored = decode(raw)
    if stored is not None and not isinstance(stored.command.argument, JumpCondition):
        assert encode(stored.command)[: stored.size] == raw[: stored.size] or stored.command.from_variable


def test_m_29_the_number_left_out_is_no_number() -> None:
    assert decode(encode(ChipCommand(":"))) == (ChipCommand(":"), 4)
    assert decode(encode(ChipCommand(":", 0))) == (ChipCommand(":", 0), 4)
    assert decode(encode(ChipCommand(":", 2**24 - 1))) == (ChipCommand(":", 2**24 - 1), 4)
