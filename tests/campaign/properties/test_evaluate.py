"""The evaluation of properties against one by definition, moment by moment, on small whole-number signals."""

from __future__ import annotations

import itertools
import random
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.campaign.properties.evaluate import Evaluation, forced
from steptwin.campaign.properties.slopes import TINY, Slope, value_at
from steptwin.campaign.properties.text import parse_property
from steptwin.campaign.properties.tree import (
    Atom,
    Becoming,
    Combination,
    CycleTime,
    Delayed,
    Holding,
    Lasting,
    PropertyFormula,
    Tally,
    nodes,
)

Values = list[Fraction]
"""One value for each nanosecond, positive where true; never 0."""


def steps_of(values: Values) -> list[Slope]:
    return [Slope(at, at, float(value), float(value)) for at, value in enumerate(values)]


# ---------------------------------------------------------------------- by definition


def truth(node: PropertyFormula, signals: dict[Any, Values], t: int, *, open_is: bool) -> bool:
    """Whether a formula holds at ``t``; ``open_is``: what a window that ends after the last moment is, if nothing decides it."""
    end = len(next(iter(signals.values()))) - 1

    def of(one: PropertyFormula, at: int, way: bool) -> bool:
        return truth(one, signals, at, open_is=way)

    match node:
        case Atom():
            return signals[node][t] > 0
        case Combination(word, inner):
            found = [of(one, t, open_is) for one in inner]
            return all(found) if word == "and" else any(found)
        case Lasting(word, None, inner):
            some = [of(inner, at, word == "always") for at in range(t, end + 1)]
            return all(some) if word == "always" else any(some)
        case Lasting(word, int() as length, inner):
            some = [of(inner, at, open_is) for at in range(t, min(end, t + length) + 1)]
            decided = any(some) if word == "eventually" else not all(some)
            if decided:
                return word == "eventually"
            return (word == "always") if t + length <= end else open_is
        case Delayed(length, inner):
            return of(inner, t + length, open_is) if t + length <= end else open_is
        case Holding(first, then, released):
            if released:
                opposite = Holding(first.negated(), then.negated())
                return not truth(opposite, signals, t, open_is=open_is)
            return any(
                of(then, at, False) and all(of(first, before, True) for before in range(t, at)) for at in range(t, end + 1)
            )
        case Becoming(inner, never):
            now = of(inner, t, False)
            came = now and (t == 0 or not of(inner, t - 1, False))
            return came is not never
    raise AssertionError(node)


def distance(node: PropertyFormula, signals: dict[Any, Values], t: int) -> Fraction:
    """Quantitative semantics without windows."""
    end = len(next(iter(signals.values()))) - 1
    match node:
        case Atom():
            return signals[node][t]
        case Combination(word, inner):
            return (min if word == "and" else max)(distance(one, signals, t) for one in inner)
        case Lasting(word, None, inner):
            return (min if word == "always" else max)(distance(inner, signals, at) for at in range(t, end + 1))
        case Holding(first, then, released):
            sign = -1 if released else 1
            return sign * max(
                min([sign * distance(then, signals, at), *(sign * distance(first, signals, one) for one in range(t, at))])
                for at in range(t, end + 1)
            )
    raise AssertionError(node)


# ---------------------------------------------------------------------- random ones

VALUES = st.builds(Fraction, st.integers(-8, 8).filter(bool), st.just(8))
TIMES = st.integers(0, 6)


def formulas(*, windows: bool) -> st.SearchStrategy[str]:
    atoms = st.sampled_from(["a.x > 0", "b.x > 0", "a.x <= 0"])
    time = TIMES.map(lambda n: f"{n} ns")

    def more(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        pair = st.tuples(inner, inner)
        kinds = [
            pair.map(lambda two: f"({two[0]}) and ({two[1]})"),
            pair.map(lambda two: f"({two[0]}) or ({two[1]})"),
            pair.map(lambda two: f"({two[0]}) implies ({two[1]})"),
            pair.map(lambda two: f"({two[0]}) until ({two[1]})"),
            inner.map(lambda one: f"always ({one})"),
            inner.map(lambda one: f"never ({one})"),
            inner.map(lambda one: f"not ({one})"),
            inner.map(lambda one: f"eventually ({one})"),
        ]
        if windows:
            kinds += [
                st.tuples(time, inner).map(lambda two: f"within {two[0]} ({two[1]})"),
                st.tuples(time, inner).map(lambda two: f"at {two[0]} ({two[1]})"),
                st.tuples(inner, time).map(lambda two: f"({two[0]}) for {two[1]}"),
                st.tuples(inner, time, inner).map(lambda three: f"after ({three[0]}) within {three[1]} ({three[2]})"),
                st.tuples(inner, time, inner).map(lambda three: f"({three[0]}) until within {three[1]} ({three[2]})"),
            ]
        return st.one_of(kinds)

    return st.recursive(atoms, more, max_leaves=4)


def signals_of(formula: PropertyFormula, a: Values, b: Values) -> dict[Any, Values]:
    found: dict[Any, Values] = {}
    for node in nodes(formula):
        for atom in (node, node.negated()) if isinstance(node, Atom) else ():
            values = a if "a.x" in tuple(atom.comparison.names()) else b
            found[atom] = values if atom.comparison.sign == ">" else [-one for one in values]
    return found


BOTH = st.integers(1, 12).flatmap(lambda n: st.tuples(*[st.lists(VALUES, min_size=n, max_size=n)] * 2))


@settings(max_examples=100)
@given(formulas(windows=True), BOTH)
@example("always (within 3 ns a.x > 0)", ([Fraction(-1)] * 5, [Fraction(1)] * 5))
@example("eventually ((a.x > 0) for 3 ns)", ([Fraction(-1), Fraction(1)], [Fraction(1)] * 2))
def test_the_sign_of_a_value_is_the_truth_at_every_moment(text: str, both: tuple[Values, Values]) -> None:
    formula = parse_property(text)
    signals = signals_of(formula, *both)
    found = Evaluation({atom: steps_of(values) for atom, values in signals.items()}).shape(formula)
    for t in range(len(both[0])):
        assert (value_at(found, t) > 0) is truth(formula, signals, t, open_is=True), t


@settings(max_examples=100)
@given(formulas(windows=False), BOTH)
def test_without_windows_the_value_is_that_of_signal_temporal_logic(text: str, both: tuple[Values, Values]) -> None:
    formula = parse_property(text)
    signals = signals_of(formula, *both)
    found = Evaluation({atom: steps_of(values) for atom, values in signals.items()}).shape(formula)
    for t in range(len(both[0])):
        assert value_at(found, t) == float(distance(formula, signals, t))


def line_of(knots: list[tuple[int, Fraction]]) -> tuple[list[Slope], Values]:
    """Straight from knot to knot, and its value at every moment; split where the sign changes."""
    slopes: list[Slope] = []
    values: Values = []
    at = 0
    for (steps, first), (_, last) in itertools.pairwise(knots):
        here = [first + (last - first) * Fraction(n, steps) for n in range(steps)]
        here = [one or Fraction(1, 10**12) for one in here]
        begin = 0
        for n in range(1, steps + 1):
            if n == steps or (here[n] > 0) != (here[begin] > 0):
                slopes.append(Slope(at + begin, at + n - 1, float(here[begin]), float(here[n - 1])))
                begin = n
        values += here
        at += steps
    return slopes, values


KNOTS = st.lists(VALUES, min_size=3, max_size=3).map(lambda some: [(7, one) for one in some])


@settings(max_examples=80)
@given(formulas(windows=True), KNOTS, KNOTS)
def test_straight_intervals_are_true_and_false_where_their_moments_are(text: str, a: Any, b: Any) -> None:
    formula = parse_property(text)
    (slopes_a, values_a), (slopes_b, values_b) = line_of(a), line_of(b)
    signals = signals_of(formula, values_a, values_b)
    shapes = {}
    for atom in signals:
        slopes = slopes_a if "a.x" in tuple(atom.comparison.names()) else slopes_b
        shapes[atom] = slopes if atom.comparison.sign == ">" else [Slope(s, e, -f, -g) for s, e, f, g in slopes]
    found = Evaluation(shapes).shape(formula)
    for t in range(len(values_a)):
        assert (value_at(found, t) > 0) is truth(formula, signals, t, open_is=True), t


def meeting_at_a_moment(*eighths: int) -> list[tuple[int, Fraction]]:
    return [(7, Fraction(one, 8)) for one in eighths]


@settings(max_examples=80)
@given(formulas(windows=False), KNOTS, KNOTS)
@example("(a.x > 0) implies (b.x > 0)", meeting_at_a_moment(3, 1, 1), meeting_at_a_moment(-7, 2, 1))
def test_straight_intervals_have_the_distances_of_their_moments(text: str, a: Any, b: Any) -> None:
    formula = parse_property(text)
    (slopes_a, values_a), (slopes_b, values_b) = line_of(a), line_of(b)
    signals = signals_of(formula, values_a, values_b)
    shapes = {}
    for atom in signals:
        slopes = slopes_a if "a.x" in tuple(atom.comparison.names()) else slopes_b
        shapes[atom] = slopes if atom.comparison.sign == ">" else [Slope(s, e, -f, -g) for s, e, f, g in slopes]
    found = Evaluation(shapes).shape(formula)
    for t in range(len(values_a)):
        assert value_at(found, t) == pytest.approx(float(distance(formula, signals, t)), abs=1e-9)


# ---------------------------------------------------------------------- by hand


def value(text: str, **signals: list[int]) -> float:
    formula = parse_property(text)
    atoms = [node for node in nodes(formula) if isinstance(node, Atom)]
    shapes = {
        atom: steps_of(
            [
                Fraction(1) if (one > 0) is (atom.comparison.sign in (">", "!=")) else Fraction(-1)
                for one in signals[next(iter(atom.comparison.names())).partition(".")[0]]
            ]
        )
        for atom in atoms
    }
    evaluation = Evaluation(shapes)
    return value_at(evaluation.shape(formula), 0)


def test_what_comes_late_is_true_by_the_share_of_its_window_that_is_left() -> None:
    assert value("within 4 ns a.x", a=[0, 0, 0, 1, 0]) == pytest.approx(0.25)
    assert value("within 4 ns a.x", a=[0, 0, 0, 0, 1]) == pytest.approx(TINY)
    assert value("within 3 ns a.x", a=[0, 0, 0, 0, 1]) == -1.0


def test_after_is_decided_by_the_worst_of_its_moments() -> None:
    assert value("after a.x within 4 ns b.x", a=[0, 1, 1, 0, 1, 0, 0], b=[0, 0, 1, 0, 0, 0, 1]) == pytest.approx(0.5)
    assert value("after a.x within 1 ns b.x", a=[0, 1, 1, 0, 1, 0, 0], b=[0, 0, 1, 0, 0, 0, 1]) == -1.0


@pytest.mark.parametrize(("text", "expected"), [("count(a.x) <= 2", 0.25), ("count(a.x) <= 1", -0.5), ("count(a.x) == 2", 1.0)])
def test_counts_are_of_moments_at_which_it_becomes_true(text: str, expected: float) -> None:
    assert value(text, a=[1, 1, 0, 1, 0]) == pytest.approx(expected)


def test_cycle_times_are_from_each_beginning_to_the_next_end() -> None:
    a, b = [0, 1, 0, 0, 0, 1, 0, 0], [0, 0, 0, 1, 0, 0, 1, 0]
    assert value("time between a.x and b.x <= 4 ns", a=a, b=b) == pytest.approx(0.5)
    assert value("time between a.x and b.x < 2 ns", a=a, b=b) == pytest.approx(-TINY)
    assert value("time between a.x and a.x >= 2 ns", a=a) == pytest.approx(1.0)


def test_a_cycle_that_has_not_ended_counts_once_it_is_too_long() -> None:
    a = [0, 1, 0, 0, 0, 0]
    assert value("time between a.x and b.x <= 4 ns", a=a, b=[0] * 6) == 1.0
    assert value("time between a.x and b.x <= 3 ns", a=a, b=[0] * 6) == pytest.approx(-1 / 3)


def test_values_are_forced_to_the_side_of_their_truth() -> None:
    assert forced(0.0, holds=True) == TINY
    assert forced(0.0, holds=False) == -TINY
    assert forced(3.0, holds=True) == 1.0
    assert forced(0.5, holds=False) == -TINY


def test_cycle_times_are_found_in_a_formula() -> None:
    found = [node for node in nodes(parse_property("always a.x and count(b.x) > 1")) if isinstance(node, Tally | CycleTime)]
    assert found == [Tally(parse_property("b.x"), ">", 1.0)]


# ---------------------------------------------------------------------- by which moment something is violated


def counted() -> st.SearchStrategy[str]:
    sign, inner = st.sampled_from(["<", "<=", ">", ">="]), formulas(windows=True)
    return st.one_of(
        inner,
        st.tuples(inner, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), st.integers(0, 3)).map(
            lambda three: f"count({three[0]}) {three[1]} {three[2]}"
        ),
        st.tuples(st.sampled_from(["", "not "]), inner, inner, sign, TIMES).map(
            lambda five: f"{five[0]}(time between ({five[1]}) and ({five[2]}) {five[3]} {five[4]} ns)"
        ),
    )


@settings(max_examples=100)
@given(counted(), BOTH, st.randoms(use_true_random=False))
@example("count(a.x > 0) >= 2", ([Fraction(-1)] * 2, [Fraction(1)] * 2), random.Random(1))
@example("count(a.x > 0) < 0", ([Fraction(-1)] * 2, [Fraction(1)] * 2), random.Random(1))
@example("(always a.x > 0) or (eventually b.x > 0)", ([Fraction(-1)] * 3, [Fraction(-1)] * 3), random.Random(1))
def test_what_is_violated_at_a_moment_stays_so_whatever_comes_later(
    text: str, both: tuple[Values, Values], chance: random.Random
) -> None:
    def value(a: Values, b: Values) -> tuple[float, int]:
        found = Evaluation({atom: steps_of(values) for atom, values in signals_of(formula, a, b).items()})
        return value_at(found.shape(formula), 0), found.decided(formula, 0)[0]

    formula = parse_property(text)
    (present, at), end = value(*both), len(both[0])
    assert 0 <= at < end
    if present <= 0.0:
        assert value(both[0][: at + 1], both[1][: at + 1])[0] <= 0.0
        for _ in range(3 if at + 1 < end else 0):
            a, b = ([*one[: at + 1], *(chance.choice((1, -1)) * later for later in one[at + 1 :])] for one in both)
            assert value(a, b)[0] <= 0.0
