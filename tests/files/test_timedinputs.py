"""Times and inputs as people write them after --for and --input."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.files.timedinputs import TimedInput, parse_duration, parse_inputs


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    [
        ("10s", 10_000_000_000),
        ("10", 10_000_000_000),
        (" 1.5 S ", 1_500_000_000),
        ("500ms", 500_000_000),
        ("7us", 7_000),
        ("0.1", 100_000_000),
        ("2min", 120_000_000_000),
        ("24h", 86_400_000_000_000),
        ("0", 0),
    ],
)
def test_durations(text: str, nanoseconds: int) -> None:
    assert parse_duration(text, "--for") == nanoseconds


@pytest.mark.parametrize("text", ["", "s", "-1s", "1,5s", "1e3", "1.s", "2 days", "nan", "٣s"])
def test_what_is_no_duration(text: str) -> None:
    permitted = "us, ms, s, min, h, such as '90 s' or '500 ms'"
    with pytest.raises(Misuse, match=rf"^--for: '.*' is not a time: expected a number with {permitted}$"):
        parse_duration(text, "--for")


def test_longest_duration() -> None:
    assert parse_duration("8784h", "--for") == 8784 * 3600 * 10**9
    with pytest.raises(Misuse, match="permitted are 0 to 8784 h"):
        parse_duration("8785h", "--for")


def test_inputs_come_in_the_order_of_their_times_and_else_as_written() -> None:
    assert parse_inputs("IN3=1@2s, ain1 = 4.25 @ 500ms,IN3=0@2s,") == [
        TimedInput(500_000_000, "AIN1", 4.25),
        TimedInput(2_000_000_000, "IN3", 1.0),
        TimedInput(2_000_000_000, "IN3", 0.0),
    ]
    assert parse_inputs("") == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("IN1=1@1s,IN3=1", "--input IN3=1: expected PIN=VALUE@TIME, such as IN3=1@2s or AIN1=4.2@500ms"),
        ("IN3=on@1s", "--input IN3=on@1s: expected PIN=VALUE@TIME"),
        ("IN3=1@soon", "--input IN3=1@soon: 'soon' is not a time: expected a number with us, ms"),
    ],
)
def test_what_is_no_input(text: str, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        parse_inputs(text)
    assert str(refused.value).startswith(message)
