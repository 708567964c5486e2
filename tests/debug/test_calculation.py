"""Expressions of a user: what they give, and what is wrong with them. No text makes them hang or fail otherwise."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import pytest
from debug_rig import BOTH, make
from hypothesis import given
from hypothesis import strategies as st

from steptwin.debug.calculation import HitCount, LogText, ResolvedExpression
from steptwin.errors import Misuse

AXIS = '[[axis]]\nname = "x-slide"\ndrive = "m.M1"\npulses_per_unit = 100\nunit = "mm"\nstart = 12.5\ntravel = [0, 100]\n'
WORLD = make("n = 7\nWAIT IN8 = ON", BOTH + AXIS)
WORLD.run_to(10**7)


def value(text: str) -> float:
    return ResolvedExpression(WORLD, "m", text).value(WORLD.now)


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("n", 7.0),
        ("n + 1 * 2", 9.0),
        ("(n + 1) * 2", 16.0),
        ("-n % 4", -3.0),
        ("n-1", 6.0),
        ("n / 2", 3.5),
        ("n = 7", 1.0),
        ("n <> 7", 0.0),
        ("n == 7 and IN3 = OFF", 1.0),
        ("not n > 3 || x-slide.position >= 12.5", 1.0),
        ("n && n - 7", 0.0),
        ("n - 2 - 1", 4.0),
        ("(n > 3) + (n > 5) + (n > 7)", 2.0),
        ("x-slide.position = 1.25 cm", 1.0),
        ("x-slide.position + 1 cm", 22.5),
        ("abs(3 - n)", 4.0),
        ("M2.position", 0.0),
        ("c.variable >= 0", 1.0),
    ],
)
def test_values(text: str, result: float) -> None:
    assert value(text) == result


def test_what_an_expression_depends_on() -> None:
    local, own, other = (ResolvedExpression(WORLD, "m", text) for text in ("n + OUT1", "n > x-slide.position", "n > c.variable"))
    assert [one.is_local for one in (local, own, other)] == [True, False, False]
    assert [one.reads_others for one in (local, own, other)] == [False, False, True]


@given(
    st.text(max_size=60) | st.lists(st.sampled_from(["n", "(", ")", "-", "+", "not", "=", "1", " "]), max_size=300).map(" ".join)
)
def test_no_text_does_anything_else_than_give_a_number_or_a_reason(text: str) -> None:
    with suppress(Misuse):
        assert isinstance(value(text), float)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("1e999", "column 1: found '1e999', expected a number up to 1e[+]200"),
        ("9e190 * 9e190", r"too large: permitted are numbers up to 1\.8e\+308"),
        ("1e200 * 1e200 - 1e200 * 1e200", "too large"),
        ("n / 0 % 3", "division by zero"),
        ("n / 0 > 3", "division by zero"),
        ("n % 0", "division by zero"),
        ("nothing", "'nothing' means nothing to m: its variables are n"),
        ("nobody.OUT1", "'nobody.OUT1' means nothing to m: its variables are n"),
        ("c.nothing", "no signal 'c.nothing'"),
        ("n > 3 mm", "3 mm is compared with what has no unit"),
        ("n 5", "column 3: found '5', expected the end or an operator"),
    ],
)
def test_what_has_no_value_has_a_reason(text: str, problem: str) -> None:
    with pytest.raises(Misuse, match=problem):
        value(text)


def test_logs() -> None:
    calculate = partial(ResolvedExpression, WORLD, "m")
    assert LogText("n is {n}, then {n + 0.5}", calculate).formatted(WORLD.now) == "n is 7, then 7.5"
    with pytest.raises(Misuse, match="only names of the program can be in it"):
        LogText("x is {x-slide.position}", calculate)


def test_hit_counts() -> None:
    assert [hit for hit in range(1, 8) if HitCount("% 3").counts(hit)] == [3, 6]
    assert [hit for hit in range(1, 5) if HitCount(">= 3").counts(hit)] == [3, 4]
    assert [hit for hit in range(1, 5) if HitCount("3").counts(hit)] == [3]
