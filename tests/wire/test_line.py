from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.wire.line import CharacterClock, SerialLine

bauds = st.sampled_from([300, 600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200])


@pytest.mark.parametrize(
    ("baud", "characters", "time_ns"),
    [
        (300, 1, 33_333_334),
        (9600, 1, 1_041_667),
        (9600, 96, 100_000_000),
        (38400, 8, 2_083_334),
        (38400, 0, 0),
        (115200, 256, 22_222_223),
    ],
)
def test_duration_of_8n1_characters(baud: int, characters: int, time_ns: int) -> None:
    assert SerialLine(baud).duration(characters) == time_ns


def test_parity_makes_a_character_longer() -> None:
    assert SerialLine(9600, bits=11).duration(96) == 110_000_000


@given(bauds, st.integers(0, 10**6))
def test_a_run_is_rounded_once(baud: int, characters: int) -> None:
    exact = Fraction(10 * characters * 10**9, baud)
    assert 0 <= SerialLine(baud).duration(characters) - exact < 1


@given(bauds, st.integers(0, 10**5))
def test_characters_is_the_inverse_of_duration(baud: int, characters: int) -> None:
    line = SerialLine(baud)
    time = line.duration(characters)
    assert line.characters(time) == characters
    assert line.characters(time + 1) == characters + 1


@pytest.mark.parametrize(("bits", "time_ns"), [(7, 7_000_000), (13, 13_000_000)])
def test_the_shortest_and_the_longest_character(bits: int, time_ns: int) -> None:
    assert SerialLine(1000, bits).duration(1) == time_ns


def test_nothing_has_begun_before_the_start() -> None:
    assert SerialLine(9600).characters(-5_000_000) == 0


@pytest.mark.parametrize(
    ("baud", "bits", "message"),
    [
        (0, 10, "baud rate 0 bit/s is not positive"),
        (9600, 6, "a character of 6 bits on the wire is outside 7 to 13"),
        (9600, 14, "a character of 14 bits on the wire is outside 7 to 13"),
    ],
)
def test_lines_that_are_none(baud: int, bits: int, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        SerialLine(baud, bits)
    assert str(misuse.value) == message


def test_characters_follow_without_pause_while_the_line_is_busy() -> None:
    clock = CharacterClock(SerialLine(9600))
    assert clock.send(2, now=1_000) == 1_000 + 2_083_334
    assert clock.send(94, now=500_000) == 1_000 + 100_000_000
    assert clock.waiting(1_000) == 96
    assert clock.waiting(100_001_000) == 0
    assert clock.send(96, now=300_000_000) == 400_000_000
    assert clock.end_before(95) == 301_041_667
    assert clock.end_before(200) == 300_000_000


def test_what_comes_when_the_line_has_just_become_free_is_rounded_anew() -> None:
    clock = CharacterClock(SerialLine(38400))
    assert clock.send(8, now=0) == 2_083_334
    assert clock.send(8, now=2_083_334) == 4_166_668
    assert clock.end_before(8) == 2_083_334


@given(bauds, st.lists(st.integers(0, 300), min_size=1, max_size=30))
def test_pieces_take_as_long_as_the_whole(baud: int, pieces: list[int]) -> None:
    line = SerialLine(baud)
    clock = CharacterClock(line)
    end = 0
    for piece in pieces:
        end = clock.send(piece, now=0)
    assert end == line.duration(sum(pieces))
