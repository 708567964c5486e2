"""Ranges of permitted numbers: what is in them, and how they are shown."""

from __future__ import annotations

import math

import pytest

from steptwin.mic488.ranges import FINITE, POSITIVE, ValueRange


@pytest.mark.parametrize(
    ("permitted", "text", "inside", "outside"),
    [
        (FINITE, "any finite number", (-1e300, 0.0, 1e300), ()),
        (POSITIVE, "> 0", (0.001, 1e300), (0.0, -1.0)),
        (ValueRange(-2.5), "≥ -2.5", (-2.5, 1e300), (-2.6,)),
        (ValueRange(high=64000), "≤ 64000", (-1e300, 64000.0), (64000.1,)),
        (ValueRange(1, 247), "1…247", (1.0, 247.0), (0.9, 247.1)),
        (ValueRange(0, 0.123456, above=True), "> 0, ≤ 0.123456", (0.001, 0.123456), (0.0, 0.1235)),
        (ValueRange(-1e15, 1e300), "-1e+15…1e+300", (-1e15, 1e300), (-1.1e15, 1.1e300)),
    ],
)
def test_what_is_in_a_range_and_how_it_is_shown(
    permitted: ValueRange, text: str, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    assert str(permitted) == text
    assert [value for value in inside if value not in permitted] == []
    assert [value for value in (*outside, math.nan, math.inf, -math.inf) if value in permitted] == []
