"""Readers of values in descriptions: both sides of each of their bounds."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan, nextafter
from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.simulation.toml.values import (
    MOST,
    OUTPUT,
    PinOf,
    axis_number,
    flag,
    number,
    pair,
    pin_name,
    points,
    positive_time,
    texts,
    time_value,
    whole,
    word,
)

JUST_ABOVE_3, JUST_BELOW_3 = 3.0000000000000004, 2.9999999999999996


@pytest.mark.parametrize(
    ("read", "value", "found"),
    [
        (number(), -MOST, -MOST),
        (number(), MOST, MOST),
        (number(), nextafter(MOST, inf), None),
        (number(), -nextafter(MOST, inf), None),
        (number(), 3, 3.0),
        (number(3), 3, 3.0),
        (number(3), JUST_BELOW_3, None),
        (number(3, above=True), JUST_ABOVE_3, JUST_ABOVE_3),
        (number(3, above=True), 3, None),
        (number(1, 3), 1, 1.0),
        (number(1, 3), 3, 3.0),
        (number(1, 3), JUST_ABOVE_3, None),
        (number(None, 3), -5, -5.0),
        (number(None, 3), JUST_ABOVE_3, None),
        (number(), nan, None),
        (number(), inf, None),
        (number(), True, None),
        (number(), "3", None),
        (whole(1, 3), 1, 1),
        (whole(1, 3), 3, 3),
        (whole(1, 3), 0, None),
        (whole(1, 3), 4, None),
        (whole(0, 3), False, None),
        (whole(1, 3), 2.0, None),
        (flag, True, True),
        (flag, 1, None),
        (word("a", "b"), "b", "b"),
        (word("a", "b"), "c", None),
        (word("a", "b"), 3, None),
        (time_value, 0, 0),
        (time_value, 1.5, 3 * SECOND // 2),
        (positive_time, "1 ns", None),
        (positive_time, 1e-9, 1),
        (positive_time, 0, None),
        (pair, [1, 2], (1.0, 2.0)),
        (pair, [2, 2], None),
        (pair, [1], None),
        (pair, [1, 2, 3], None),
        (pair, (1, 2), None),
        (points, [[0, 5], [1, 5]], ((0.0, 5.0), (1.0, 5.0))),
        (points, [[0, 5]], ((0.0, 5.0),)),
        (points, [], None),
        (points, [[0, 5], [0, 6]], None),
        (points, [[0, 5, 1]], None),
        (points, [0, 5], None),
        (points, "x", None),
        (texts, ["a", "b"], ("a", "b")),
        (texts, [], ()),
        (texts, "a", None),
        (texts, ["a", " "], None),
        (pin_name, "c.out1", ("c", "OUT1")),
        (pin_name, "c.m1.x", ("c", "M1.X")),
        (pin_name, ".out1", None),
        (pin_name, "c.", None),
        (pin_name, "c", None),
        (pin_name, 3, None),
        (PinOf(OUTPUT), "c.out1", ("c", "OUT1")),
        (PinOf(OUTPUT), ["c.out1"], None),
        (PinOf(OUTPUT, 2), "c.out1", (("c", "OUT1"),)),
        (PinOf(OUTPUT, 2), ["c.out1", "d.a"], (("c", "OUT1"), ("d", "A"))),
        (PinOf(OUTPUT, 2), ["c.a", "c.b", "c.c"], None),
        (PinOf(OUTPUT, 2), [], None),
    ],
)
def test_what_is_read_and_what_is_refused(read: Callable[[Any], Any], value: object, found: object) -> None:
    if found is None:
        with pytest.raises(Misuse):
            read(value)
    else:
        assert read(value) == found
        assert type(read(value)) is type(found)


@pytest.mark.parametrize(
    ("name", "number"),
    [("M1", 1), ("M9", 9), ("M10", 10), ("M9999", 9999), ("M10000", 0), ("M0", 0), ("M", 0), ("m1", 0), ("M1x", 0), ("xM1", 0)],
)
def test_the_number_of_an_axis(name: str, number: int) -> None:
    assert axis_number(name) == number


def test_the_word_that_was_meant() -> None:
    assert word("parallel", "series").near("seris") == "series"
    assert word("parallel", "series").near("q") is None
    assert word("parallel", "series").near(3) is None
