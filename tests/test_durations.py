"""Times as people write them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import SECOND
from steptwin.durations import LONGEST_NS, duration, duration_text
from steptwin.errors import Misuse

NANOSECONDS = {"us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9, "h": 3600 * 10**9}


@given(unit=st.sampled_from([*NANOSECONDS]), whole=st.integers(0, 8784), thousandths=st.integers(0, 999), blank=st.booleans())
def test_a_number_with_a_unit(unit: str, whole: int, thousandths: int, blank: bool) -> None:
    text = f"{whole}.{thousandths:03}{' ' * blank}{unit}"
    expected = whole * NANOSECONDS[unit] + thousandths * NANOSECONDS[unit] // 1000
    if expected > 8784 * NANOSECONDS["h"]:
        with pytest.raises(Misuse, match=r"is too long: permitted are 0 to 8784 h$"):
            duration(text)
    else:
        assert duration(text) == duration(f"  {text.upper()} ") == expected


@pytest.mark.parametrize(
    ("value", "nanoseconds"),
    [
        *(("1.5s", SECOND * 3 // 2), (".5 s", SECOND // 2), (2, 2 * SECOND), (0.25, SECOND // 4), (1e-5, 10_000)),
        *((0, 0), ("0", 0), ("0.0", 0)),
    ],
)
def test_a_number_that_is_no_text_is_of_seconds(value: object, nanoseconds: int) -> None:
    assert duration(value) == nanoseconds


def test_the_longest_is_a_leap_year() -> None:
    assert 8784 * NANOSECONDS["h"] == LONGEST_NS
    assert duration("8784 h") == LONGEST_NS
    with pytest.raises(Misuse, match="too long"):
        duration(31_622_400.001)


@pytest.mark.parametrize("value", ["", "ms", "5 parsec", "-1 s", "1.", True, None, [1], -1e-5, float("inf"), float("nan")])
def test_what_is_no_duration_is_misuse(value: object) -> None:
    with pytest.raises(Misuse, match=r"is not a time: expected a number with us, ms, s, min, h, such as '90 s' or '500 ms'$"):
        duration(value)


@pytest.mark.parametrize("value", ["400", " 1.5", "0.1", ".5"])
def test_a_text_needs_a_unit(value: str) -> None:
    with pytest.raises(Misuse, match=rf"^{value!r} has no unit: expected a number with us, ms, s, min, h, such as '90 s'"):
        duration(value)


@pytest.mark.parametrize(("time", "text"), [(0, "0 s"), (1, "0.001 us"), (-1, "-0.001 us"), (-90 * SECOND, "-90 s")])
def test_a_duration_as_text(time: int, text: str) -> None:
    assert duration_text(time) == text
