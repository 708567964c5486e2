"""A property in words: what decided it, as it would be written."""

from __future__ import annotations

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
)
from steptwin.durations import duration_text
from steptwin.simulation.logic.expression import Comparison
from steptwin.simulation.logic.quantities import Absolute, NumberLiteral, Product, Quantity, Remainder, SignalName, Sum


def quantity_text(node: Quantity) -> str:
    match node:
        case SignalName(text):
            return text
        case NumberLiteral(number, unit):
            return f"{number:.12g} {unit}".rstrip()
        case Sum(left, sign, right):
            return f"({quantity_text(left)} {'+' if sign > 0 else '-'} {quantity_text(right)})"
        case Product(left, right, divides):
            return f"({quantity_text(left)} {'/' if divides else '*'} {quantity_text(right)})"
        case Remainder(left, right):
            return f"({quantity_text(left)} % {quantity_text(right)})"
        case Absolute(inner):
            return f"abs({quantity_text(inner).removeprefix('(').removesuffix(')')})"
        case Comparison(SignalName(text), ("!=" | "==") as sign, NumberLiteral(0.0, "")):
            return text if sign == "!=" else f"not {text}"
        case Comparison(left, sign, right):
            return f"{quantity_text(left)} {sign} {quantity_text(right)}"
    return "(...)"


def found_text(comparison: Comparison, value: float, scale: float, unit: str) -> str:
    """Text of the value where a comparison did not hold: ``value`` is its distance from holding, as a share of ``scale``.

    A share of 1 is one of 1 or more, and that of an equality has no side: no more is said.
    """
    left, limit = quantity_text(comparison.left), quantity_text(comparison.right)
    is_alone = isinstance(comparison.left, SignalName)
    off, is_least = abs(value) * scale, abs(value) >= 1.0
    least = "at least " if is_least else ""
    if comparison.sign == "!=":
        return f"{left} is {limit}"
    if comparison.sign == "==":
        if is_alone and comparison.right == NumberLiteral(0.0):
            return f"{left} is not 0"
        if isinstance(comparison.right, NumberLiteral):
            number = comparison.right.number
            if is_least:
                return f"{left} is not {_measure(number, unit)}"
            return f"{left} is {_measure(number - off, unit)} or {_measure(number + off, unit)}, not {_measure(number, unit)}"
        return f"{left} is {least}{_measure(off, unit)} away from {limit}"
    is_below = comparison.sign in (">", ">=")
    if isinstance(comparison.right, NumberLiteral):
        there = comparison.right.number + (-off if is_below else off)
        shown = quantity_text(NumberLiteral(comparison.right.number, unit))
        beyond = "" if not is_least else " or less" if is_below else " or more"
        return f"{left} is {_measure(there, unit)}{beyond}, not {comparison.sign} {shown}"
    return f"{left} is {least}{_measure(off, unit)} {'below' if is_below else 'above'} {limit}"


def _measure(number: float, unit: str) -> str:
    return f"{number:.6g} {unit}".rstrip()


def formula_text(node: PropertyFormula) -> str:
    match node:
        case Atom(comparison):
            return quantity_text(comparison)
        case Combination(word, inner):
            return f" {word} ".join(map(_inner_text, inner))
        case Lasting(word, None, inner):
            return f"{word} {_inner_text(inner)}"
        case Lasting(word, int() as length, inner):
            text, time = _inner_text(inner), duration_text(length)
            return f"within {time} {text}" if word == "eventually" else f"{text} for {time}"
        case Delayed(length, inner):
            return f"at {duration_text(length)} {_inner_text(inner)}"
        case Holding(first, then, released):
            return f"{_inner_text(first)} {'unless' if released else 'until'} {_inner_text(then)}"
        case Becoming(inner, never):
            return f"{_inner_text(inner)} does {'not ' if never else ''}become true"
        case Tally(inner, sign, number):
            return f"count({formula_text(inner)}) {sign} {number:g}"
        case CycleTime(begin, end, sign, limit):
            return f"time between {_inner_text(begin)} and {_inner_text(end)} {sign} {duration_text(limit)}"
    raise AssertionError(node)


def _inner_text(node: PropertyFormula) -> str:
    return formula_text(node) if isinstance(node, Atom | Tally) else f"({formula_text(node)})"
