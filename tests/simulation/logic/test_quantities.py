"""What expressions calculate with: values, ranges from the ranges of signals, units."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, isnan, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.simulation.logic.expression import parse_expression
from steptwin.simulation.logic.quantities import (
    NO_NUMBER,
    Absolute,
    NumberLiteral,
    Product,
    Quantity,
    Range,
    Remainder,
    SignalName,
    Sum,
    negative,
    next_change,
    sides,
    unit_of_all,
)

A, B = SignalName("a"), SignalName("b")
UNITS = {"a": "mm", "b": "s", "n": ""}
SUM, DIFFERENCE, PRODUCT = Sum(A, 1, B), Sum(A, -1, B), Product(A, B)
QUOTIENT, REMAINDER, ABSOLUTE = Product(A, B, divides=True), Remainder(A, B), Absolute(A)


@pytest.mark.parametrize(
    ("quantity", "a", "b", "value"),
    [
        (SUM, 3.0, 4.0, 7.0),
        (DIFFERENCE, 3.0, 4.0, -1.0),
        (PRODUCT, 3.0, -4.0, -12.0),
        (QUOTIENT, 3.0, -4.0, -0.75),
        (QUOTIENT, 3.0, 0.0, inf),
        (QUOTIENT, -3.0, 0.0, -inf),
        (QUOTIENT, 0.0, 0.0, nan),
        (QUOTIENT, 0.0, 3.0, 0.0),
        (REMAINDER, 7.5, 2.0, 1.5),
        (REMAINDER, -7.5, 2.0, -1.5),
        (REMAINDER, 7.5, -2.0, 1.5),
        (REMAINDER, 7.5, 0.0, nan),
        (REMAINDER, inf, 2.0, nan),
        (REMAINDER, 2.0, inf, 2.0),
        (ABSOLUTE, -3.0, 0.0, 3.0),
        (negative(A), 3.0, 0.0, -3.0),
        (negative(NumberLiteral(5.0)), 0.0, 0.0, -5.0),
    ],
)
def test_values(quantity: Quantity, a: float, b: float, value: float) -> None:
    assert quantity.value({"a": a, "b": b}.__getitem__) == pytest.approx(value, nan_ok=True, abs=0.0)


@pytest.mark.parametrize(
    ("quantity", "a", "b", "found"),
    [
        (NumberLiteral(4.0), (0, 0), (0, 0), (4, 4)),
        (A, (1, 2), (0, 0), (1, 2)),
        (SUM, (1, 2), (10, 20), (11, 22)),
        (DIFFERENCE, (1, 2), (10, 20), (-19, -8)),
        (PRODUCT, (1, 2), (10, 20), (10, 40)),
        (PRODUCT, (-1, 2), (10, 20), (-20, 40)),
        (PRODUCT, (-3, -2), (-5, 7), (-21, 15)),
        (PRODUCT, (0, 1), (0, inf), (nan, nan)),
        (QUOTIENT, (10, 20), (2, 5), (2, 10)),
        (QUOTIENT, (-10, 20), (2, 5), (-5, 10)),
        (QUOTIENT, (10, 20), (-5, -2), (-10, -2)),
        (QUOTIENT, (10, 20), (0, 5), (-inf, inf)),
        (QUOTIENT, (10, 20), (-5, 0), (-inf, inf)),
        (QUOTIENT, (10, 20), (0, 0), (inf, inf)),
        (QUOTIENT, (-20, -10), (0, 0), (-inf, -inf)),
        (QUOTIENT, (0, 20), (0, 5), (nan, nan)),
        (QUOTIENT, (-20, 0), (-5, 5), (nan, nan)),
        (QUOTIENT, (0, 20), (1, 5), (0, 20)),
        (REMAINDER, (7, 7.5), (2, 2), (1, 1.5)),
        (REMAINDER, (7, 8.5), (2, 2), (0, 2)),
        (REMAINDER, (-7.5, -7), (2, 2), (-1.5, -1)),
        (REMAINDER, (-1, 1), (5, 5), (-1, 1)),
        (REMAINDER, (-9, 9), (3, 5), (-5, 5)),
        (REMAINDER, (1, 9), (-5, -3), (0, 5)),
        (REMAINDER, (-9, 0), (3, 5), (-5, 0)),
        (REMAINDER, (0, 9), (3, 5), (0, 5)),
        (REMAINDER, (1, 9), (0, 5), (nan, nan)),
        (REMAINDER, (1, 9), (-5, 0), (nan, nan)),
        (REMAINDER, (1, inf), (2, 2), (nan, nan)),
        (REMAINDER, (-inf, 1), (2, 2), (nan, nan)),
        (REMAINDER, (1, 2), (2, inf), (nan, nan)),
        (ABSOLUTE, (1, 2), (0, 0), (1, 2)),
        (ABSOLUTE, (0, 2), (0, 0), (0, 2)),
        (ABSOLUTE, (-2, -1), (0, 0), (1, 2)),
        (ABSOLUTE, (-2, 0), (0, 0), (0, 2)),
        (ABSOLUTE, (-3, 2), (0, 0), (0, 3)),
        (ABSOLUTE, (-2, 3), (0, 0), (0, 3)),
        (ABSOLUTE, (nan, nan), (0, 0), (nan, nan)),
        (SUM, (-inf, 1), (inf, inf), (nan, nan)),
        (SUM, (-inf, inf), (-inf, -inf), (nan, nan)),
        (DIFFERENCE, (-inf, 1), (-inf, -inf), (nan, nan)),
    ],
)
def test_ranges(quantity: Quantity, a: Range, b: Range, found: Range) -> None:
    assert quantity.range({"a": a, "b": b}.__getitem__) == pytest.approx(found, nan_ok=True, abs=0.0)


NUMBER = st.one_of(st.sampled_from([-7.5, -2.0, -1.0, 0.0, 1.0, 2.0, 7.5]), st.floats(-100.0, 100.0))
PAIR = st.tuples(NUMBER, NUMBER).map(sorted)


@given(st.sampled_from([SUM, DIFFERENCE, PRODUCT, QUOTIENT, REMAINDER, ABSOLUTE]), PAIR, PAIR, st.floats(0, 1), st.floats(0, 1))
def test_no_value_is_outside_its_range(quantity: Quantity, a: list[float], b: list[float], share: float, other: float) -> None:
    low, high = quantity.range({"a": (a[0], a[1]), "b": (b[0], b[1])}.__getitem__)
    x = min(max(a[0] + share * (a[1] - a[0]), a[0]), a[1])
    y = min(max(b[0] + other * (b[1] - b[0]), b[0]), b[1])
    value = quantity.value({"a": x, "b": y}.__getitem__)
    assert isnan(low) or low <= value <= high


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [
        (1.0, 2.0, {1}),
        (-2.0, -1.0, {-1}),
        (0.0, 0.0, {0}),
        (0.0, 2.0, {0, 1}),
        (-2.0, 0.0, {-1, 0}),
        (-2.0, 2.0, {-1, 0, 1}),
        (nan, 2.0, {-1, 0, 1, NO_NUMBER}),
        (1.0, nan, {-1, 0, 1, NO_NUMBER}),
    ],
)
def test_sides_of_0(low: float, high: float, found: set[int]) -> None:
    assert sides(low, high) == found


@pytest.mark.parametrize(
    "text", ["a + 2 cm", "a - 2 cm", "2 cm - a", "a * 1 + 2 cm", "a % 2 cm", "2 cm % a", "abs(2 cm) + a", "-(2 cm) + a"]
)
def test_numbers_take_the_unit_of_what_they_are_calculated_with(text: str) -> None:
    quantity = parse_expression(text).in_unit("mm", UNITS.__getitem__)
    plain = parse_expression(text.replace("2 cm", "20"))
    assert quantity.value({"a": 7.0}.__getitem__) == plain.value({"a": 7.0}.__getitem__)


@pytest.mark.parametrize(
    ("unit", "of", "number"),
    [("cm", "mm", 20.0), ("mm", "cm", 0.2), ("rev", "degree", 720.0), ("min", "s", None), ("ms", "s", 0.002), ("mV", "V", 0.002)],
)
def test_units(unit: str, of: str, number: float | None) -> None:
    literal = NumberLiteral(2.0, unit)
    if number is None:
        with pytest.raises(Misuse, match=r"^2 min is compared with 's'$"):
            literal.in_unit(of, UNITS.__getitem__)
    else:
        assert literal.in_unit(of, UNITS.__getitem__) == NumberLiteral(number)


def test_a_number_without_a_unit_and_what_has_none() -> None:
    assert NumberLiteral(2.0).in_unit("mm", UNITS.__getitem__) == NumberLiteral(2.0)
    assert NumberLiteral(2.0, "mm").in_unit("mm", UNITS.__getitem__) == NumberLiteral(2.0, "mm")
    with pytest.raises(Misuse, match=r"^2 mm is compared with what has no unit$"):
        NumberLiteral(2.0, "mm").in_unit("", UNITS.__getitem__)


def test_signals_of_a_quantity_and_their_unit() -> None:
    quantity = Sum(Product(SignalName("n"), Absolute(B)), 1, Remainder(A, SignalName("n")))
    assert list(quantity.names()) == ["n", "b", "a", "n"]
    assert unit_of_all(quantity, UNITS.__getitem__) == "s"
    assert unit_of_all(SignalName("n"), UNITS.__getitem__) == ""


class Line:
    """A signal on a straight line, with turns."""

    def __init__(self, slope: float, at_0: float, turning_points: list[int]) -> None:
        self.slope, self.at_0, self._turning_points = slope, at_0, turning_points

    def value(self, now: int) -> float:
        return self.at_0 + self.slope * now

    def turning_points(self, now: int) -> Iterator[int]:
        return (turn for turn in self._turning_points if turn > now)


@pytest.mark.parametrize(
    ("text", "now", "due"),
    [
        ("x - 1000", 0, 1000),  # from below to equal
        ("x - 1000", 999, 1000),
        ("x - 1000", 1000, 1001),  # from equal to above
        ("x - 1000", 1001, None),
        ("1000 - x", 0, 1000),
        ("x - y", 0, 500),  # y falls from 1000
        ("x + y - 1000", 0, None),
        ("x * y", 0, 1),
        ("x * y", 1, 1000),
        ("abs(x - 700) - 200", 0, 500),
        ("abs(x - 700) - 200", 501, 900),
        ("k - x", 0, 250),
        ("x / (x - 64)", 1, 64),
    ],
)
def test_when_a_quantity_comes_to_another_side_of_0(text: str, now: int, due: int | None) -> None:
    moving = {"x": Line(1.0, 0.0, []), "y": Line(-1.0, 1000.0, [])}
    assert next_change(parse_expression(text), moving, {"k": 250.0}.__getitem__, now) == due


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 mm * 3", 0.006),
        ("3 * 2 mm", 0.006),
        ("6 mm / 2", 0.003),
        ("7 mm % 4 mm", 0.003),
        ("1 mm + 2 mm", 0.003),
        ("1 m - 2 mm", 0.998),
        ("abs(2 mm - 5 mm)", 0.003),
    ],
)
def test_all_numbers_of_a_quantity_come_in_the_unit(text: str, value: float) -> None:
    found = parse_expression(text).in_unit("m", lambda name: "")
    assert found.value(lambda name: 0.0) == pytest.approx(value)
