"""Expressions that go on in a straight line as the one signal of a product does that moves, exact in fractions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from math import isfinite

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.logic.quantities import NumberLiteral, Product, Quantity, SignalName, Sum
from steptwin.simulation.mechanics.integral import Straight
from steptwin.simulation.mechanics.scale import exact_fraction

NOT_STRAIGHT = Message(
    "simulation.not-straight",
    "{names}: multiplied with each other, divided by, compared, or in abs or %, what changes between events is no straight line",
)


def check_linear(quantity: Quantity, moving: Collection[str]) -> None:
    """Raise `Misuse` for an expression that goes on in no straight line while the signals ``moving`` do."""
    names = list(dict.fromkeys(name for name in quantity.names() if name in moving))
    if not names:
        return
    match quantity:
        case SignalName():
            return
        case Sum(left, _, right):
            check_linear(left, moving)
            check_linear(right, moving)
        case Product(left, right) if not any(name in moving for name in right.names()):
            check_linear(left, moving)
        case Product(left, right, False) if not any(name in moving for name in left.names()):
            check_linear(right, moving)
        case _:
            raise Misuse(NOT_STRAIGHT(names=names))


def straight_of(quantity: Quantity, lines: Mapping[str, Straight], values: Callable[[str], float]) -> Straight:
    """The line of an expression that `check_linear` has accepted. ``lines``: those of the signals that move, ``values`` gives the
    others. What is no number, or infinite, is 0."""
    value, slope = _line(quantity, lines, values)
    until = min((line.until for line in lines.values() if line.until is not None), default=None)
    return Straight(value, slope, until)


def _line(quantity: Quantity, lines: Mapping[str, Straight], values: Callable[[str], float]) -> tuple[Fraction, Fraction]:
    match quantity:
        case NumberLiteral(number):
            return exact_fraction(number), Fraction(0)
        case SignalName(name) if name in lines:
            return lines[name].value, lines[name].slope
        case Sum(left, sign, right):
            (a, b), (c, d) = _line(left, lines, values), _line(right, lines, values)
            return a + sign * c, b + sign * d
        case Product(left, right, divides):
            (a, b), (c, d) = _line(left, lines, values), _line(right, lines, values)
            if not divides:
                return a * c, a * d + b * c
            return (a / c, b / c) if c else (Fraction(0), Fraction(0))
        case _:
            found = quantity.value(values)
            return Fraction(found) if isfinite(found) else Fraction(0), Fraction(0)
