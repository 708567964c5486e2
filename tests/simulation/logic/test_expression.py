"""The values of expressions and conditions, as a parsed node and as a function of time."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.logic.expression import parse_condition, parse_expression, truth_of, value_of

VALUES = {"a": 3.0, "b": -2.0, "c": 0.0}
READS = {name: (lambda now, value=value: value + now) for name, value in VALUES.items()}  # type: ignore[misc]
"""At a moment 10 each is by 10 higher."""

TRUTHS = [
    ("a > 2 and b < 0", True),
    ("a > 2 and b > 0", False),
    ("a < 2 or b < 0", True),
    ("a < 2 or b > 0", False),
    ("not a < 2", True),
    ("not (a > 2 or b > 0)", False),
    ("a > 2 and b < 0 and c > 0", False),
]


@pytest.mark.parametrize(("text", "truth"), TRUTHS)
def test_truths_are_1_and_0(text: str, truth: bool) -> None:
    for node in (parse_condition(text), parse_expression(text)):
        assert node.value(VALUES.__getitem__) == float(truth)
    assert truth_of(parse_condition(text), READS)(0) is truth
    assert value_of(parse_expression(text), READS)(0) == float(truth)


NUMBERS = [("a + b * 2", -1.0, 29.0), ("a", 3.0, 13.0), ("4.5", 4.5, 4.5), ("a - b", 5.0, 5.0), ("a > 12", 0.0, 1.0)]


@pytest.mark.parametrize(("text", "first", "later"), NUMBERS)
def test_numbers(text: str, first: float, later: float) -> None:
    value = value_of(parse_expression(text), READS)
    assert (value(0), value(10)) == (first, later)


def test_each_calculated_number_is_checked() -> None:
    """Those that are read, and those in the text, need not be."""
    checked: list[float] = []

    def check(value: float) -> float:
        checked.append(value)
        return value

    assert value_of(parse_expression("a + b"), READS, check)(0) == 1.0
    assert value_of(parse_expression("a + b > 0 and c = 0"), READS, check)(0) == 1.0
    assert truth_of(parse_condition("not a * 2 > 100"), READS, check)(0)
    assert value_of(parse_expression("a"), READS, check)(0) == 3.0
    assert checked == [1.0, 1.0, 6.0]


def test_an_expression_ends_with_its_text() -> None:
    with pytest.raises(Misuse, match="column 3"):
        parse_expression("a b")


RANGES = {"a": (1.0, 4.0), "b": (-3.0, -1.0), "c": (0.0, 0.0), "d": (-1.0, 1.0)}


@pytest.mark.parametrize(
    ("text", "least", "most"),
    [
        ("a > 0", 1.0, 1.0),
        ("a > 4", 0.0, 0.0),
        ("a >= 4", 0.0, 1.0),
        ("a < 1", 0.0, 0.0),
        ("a <= 1", 0.0, 1.0),
        ("c == 0", 1.0, 1.0),
        ("c != 0", 0.0, 0.0),
        ("b == -2", 0.0, 1.0),
        ("a == b", 0.0, 0.0),
        ("a != b", 1.0, 1.0),
        ("a > 0 and b > 0", 0.0, 0.0),
        ("a > 0 and d > 0", 0.0, 1.0),
        ("a > 0 and b < 0", 1.0, 1.0),
        ("a > 4 or b > 0", 0.0, 0.0),
        ("a > 4 or d > 0", 0.0, 1.0),
        ("a > 0 or d > 0", 1.0, 1.0),
        ("not a > 0", 0.0, 0.0),
        ("not d > 0", 0.0, 1.0),
        ("not (a > 4 or b > 0)", 1.0, 1.0),
        ("a / d > 0", 0.0, 1.0),
        ("d / d > 0", 0.0, 1.0),
        ("1 / abs(d / d) > 2", 0.0, 1.0),
        ("1 / (a / d - a / c) > 2", 0.0, 1.0),
        ("(a / c - a / c) / (a / c - c) != 0", 0.0, 1.0),
    ],
)
def test_what_a_condition_can_be_within_ranges(text: str, least: float, most: float) -> None:
    assert parse_condition(text).range(RANGES.__getitem__) == (least, most)


@pytest.mark.parametrize("before", ["(a > 0) and ", "not a > 0 and ", "- a > 0 and ", "abs(a) > 0 and "])
def test_nesting_before_does_not_count(before: str) -> None:
    """64 deep is permitted, 65 is not, whatever is closed before."""
    deep = "(" * 63 + "{}" + ")" * 63
    for inner in ("(a > 0)", "not a > 0", "- a > 0", "abs(a) > 0"):
        assert parse_condition(before * 3 + deep.format(inner))
        with pytest.raises(Misuse, match="nested more than 64 deep"):
            parse_condition(before * 3 + f"({deep.format(inner)})")
