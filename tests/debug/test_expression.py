"""Expressions of a person: what they give, and what is wrong with them. No text makes them hang or fail otherwise."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.debug.expression import Expression, HitCount, LogText
from steptwin.errors import Misuse

NAMES = {"n": 7.0, "$R0": 0.5, "x.position": 12.5, "IN3": 1.0, "ON": 1.0}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("n", 7.0),
        ("n + 1 * 2", 9.0),
        ("(n + 1) * 2", 16.0),
        ("-n % 4", -3.0),
        ("n / $R0", 14.0),
        ("n = 7", 1.0),
        ("n <> 7", 0.0),
        ("n == 7 and IN3 = ON", 1.0),
        ("not n > 3 || x.position >= 12.5", 1.0),
        ("n - 2 - 1", 4.0),
    ],
)
def test_values(text: str, value: float) -> None:
    assert Expression(text).value(NAMES.__getitem__) == value


def test_names_and_whether_they_are_of_the_program() -> None:
    assert Expression("n + $R0").names == {"n", "$R0"}
    assert Expression("n + $R0").is_local
    assert not Expression("n > x.position").is_local


@given(
    st.text(max_size=60) | st.lists(st.sampled_from(["n", "(", ")", "-", "+", "not", "=", "1", " "]), max_size=300).map(" ".join)
)
def test_no_text_does_anything_else_than_give_a_number_or_a_reason(text: str) -> None:
    with suppress(Misuse):
        assert isinstance(Expression(text).value(lambda name: 1.0), float)


@pytest.mark.parametrize("text", ["1e999", "9e300 * 9e300", "1e308 + 1e308 - 1e308", "1 / 4e-324 % 3", "-1e308 - 1e308"])
def test_numbers_stay_finite(text: str) -> None:
    with pytest.raises(Misuse, match=r"too large: permitted are numbers up to 1\.8e\+308"):
        Expression(text).value(NAMES.__getitem__)


def test_logs_and_hit_counts() -> None:
    assert LogText("n is {n}, then {n + 0.5}").shown(NAMES.__getitem__) == "n is 7, then 7.5"
    assert [hit for hit in range(1, 8) if HitCount("% 3").counts(hit)] == [3, 6]
    assert [hit for hit in range(1, 5) if HitCount(">= 3").counts(hit)] == [3, 4]
    assert [hit for hit in range(1, 5) if HitCount("3").counts(hit)] == [3]
