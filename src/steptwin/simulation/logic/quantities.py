"""Quantities of expressions: numbers with units, signals, and what is made of them; and when a comparison changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from heapq import merge
from itertools import chain
from math import fmod, inf, isfinite, isnan, nan
from typing import Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.points import FARTHEST_NS
from steptwin.simulation.mechanics.scale import LENGTHS, TURNS

TIMES: Mapping[str, Fraction] = {"ns": Fraction(1, 10**9), "us": Fraction(1, 10**6), "ms": Fraction(1, 1000), "s": Fraction(1)}
VOLTS: Mapping[str, Fraction] = {"mV": Fraction(1, 1000), "V": Fraction(1)}
UNITS: tuple[Mapping[str, Fraction], ...] = (LENGTHS, TURNS, TIMES, VOLTS)
"""Units that convert into each other."""
UNIT_NAMES = frozenset(unit for kin in UNITS for unit in kin)
LARGEST = 1e200
"""Largest number in a condition: no unit converts it to one that overflows."""
MOST_LOOKS = 20_000
"""Limit of intervals that one search resolves to the nanosecond. Beyond it the resolution halves with each `LOOKS_MORE`."""
LOOKS_MORE = 1000

Range: TypeAlias = tuple[float, float]
"""Lowest and highest value."""
UnitOf: TypeAlias = Callable[[str], str]
"""The unit of the signal of a name; empty: none."""
NO_NUMBER = 2
"""The side of 0 of what is not a number, besides -1, 0 and 1."""


class Quantity(Protocol):
    """A number, a signal, or what is calculated from them."""

    def names(self) -> Iterator[str]:
        """Its signals."""
        ...

    def value(self, values: Callable[[str], float]) -> float: ...
    def range(self, ranges: Callable[[str], Range]) -> Range:
        """All values that it can have while signals are within their ranges, or more; NaN if it may have no value."""
        ...

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        """With numbers in this unit, within comparisons in that of what they are compared with. Raises `Misuse` for a number
        whose unit is of another kind."""
        ...


OTHER_UNIT = Message("simulation.compared-with-another-unit", "{number:g} {unit} is compared with {other!r}")
NO_UNIT = Message("simulation.compared-without-unit", "{number:g} {unit} is compared with what has no unit")


@dataclass(frozen=True, slots=True)
class NumberLiteral:
    number: float
    unit: str = ""

    def names(self) -> Iterator[str]:
        yield from ()

    def value(self, values: Callable[[str], float]) -> float:
        return self.number

    def range(self, ranges: Callable[[str], Range]) -> Range:
        return self.number, self.number

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        if not self.unit or self.unit == unit:
            return self
        for kin in UNITS:
            if unit in kin and self.unit in kin:
                return NumberLiteral(float(Fraction(str(self.number)) * kin[self.unit] / kin[unit]))
        if unit:
            raise Misuse(OTHER_UNIT(number=self.number, unit=self.unit, other=unit))
        raise Misuse(NO_UNIT(number=self.number, unit=self.unit))


@dataclass(frozen=True, slots=True)
class SignalName:
    text: str

    def names(self) -> Iterator[str]:
        yield self.text

    def value(self, values: Callable[[str], float]) -> float:
        return values(self.text)

    def range(self, ranges: Callable[[str], Range]) -> Range:
        return ranges(self.text)

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        return self


@dataclass(frozen=True, slots=True)
class Sum:
    """``sign`` −1: a difference."""

    left: Quantity
    sign: int
    right: Quantity

    def names(self) -> Iterator[str]:
        yield from self.left.names()
        yield from self.right.names()

    def value(self, values: Callable[[str], float]) -> float:
        return self.left.value(values) + self.sign * self.right.value(values)

    def range(self, ranges: Callable[[str], Range]) -> Range:
        (a, b), (c, d) = self.left.range(ranges), self.right.range(ranges)
        return _numbers(a + c, b + d) if self.sign > 0 else _numbers(a - d, b - c)

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        return Sum(self.left.in_unit(unit, unit_of), self.sign, self.right.in_unit(unit, unit_of))


@dataclass(frozen=True, slots=True)
class Product:
    """``divides``: a quotient; one by 0 is infinite, 0/0 is not a number, with which no comparison but ``!=`` is true."""

    left: Quantity
    right: Quantity
    divides: bool = False

    def names(self) -> Iterator[str]:
        yield from self.left.names()
        yield from self.right.names()

    def value(self, values: Callable[[str], float]) -> float:
        left, right = self.left.value(values), self.right.value(values)
        if not self.divides:
            return left * right
        return left / right if right else nan if not left else inf if left > 0.0 else -inf

    def range(self, ranges: Callable[[str], Range]) -> Range:
        (a, b), (c, d) = self.left.range(ranges), self.right.range(ranges)
        if self.divides and c <= 0.0 <= d:
            if a <= 0.0 <= b:
                return nan, nan
            return (-inf, inf) if c < d else (inf, inf) if a > 0.0 else (-inf, -inf)
        ends = [x / y if self.divides else x * y for x in (a, b) for y in (c, d)]
        return (nan, nan) if any(map(isnan, ends)) else (min(ends), max(ends))

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        return Product(self.left.in_unit(unit, unit_of), self.right.in_unit(unit, unit_of), self.divides)


@dataclass(frozen=True, slots=True)
class Remainder:
    """Remainder of a division whose quotient is rounded towards 0; for one by 0 it is not a number."""

    left: Quantity
    right: Quantity

    def names(self) -> Iterator[str]:
        yield from self.left.names()
        yield from self.right.names()

    def value(self, values: Callable[[str], float]) -> float:
        left, right = self.left.value(values), self.right.value(values)
        return fmod(left, right) if right and isfinite(left) else nan

    def range(self, ranges: Callable[[str], Range]) -> Range:
        (a, b), (c, d) = self.left.range(ranges), self.right.range(ranges)
        if c <= 0.0 <= d or not all(map(isfinite, (a, b, c, d))):
            return nan, nan
        if c == d and a - fmod(a, c) == b - fmod(b, c):
            return fmod(a, c), fmod(b, c)
        most = max(abs(c), abs(d))
        return (-most if a < 0.0 else 0.0), (most if b > 0.0 else 0.0)

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        return Remainder(self.left.in_unit(unit, unit_of), self.right.in_unit(unit, unit_of))


@dataclass(frozen=True, slots=True)
class Absolute:
    inner: Quantity

    def names(self) -> Iterator[str]:
        yield from self.inner.names()

    def value(self, values: Callable[[str], float]) -> float:
        return abs(self.inner.value(values))

    def range(self, ranges: Callable[[str], Range]) -> Range:
        low, high = self.inner.range(ranges)
        return (low, high) if low >= 0.0 else (-high, -low) if high <= 0.0 else _numbers(0.0, max(-low, high))

    def in_unit(self, unit: str, unit_of: UnitOf) -> Quantity:
        return Absolute(self.inner.in_unit(unit, unit_of))


def unit_of_all(quantity: Quantity, unit_of: UnitOf) -> str:
    """The unit of the first of its signals that has one; empty: none has."""
    return next(filter(None, map(unit_of, quantity.names())), "")


def _numbers(low: float, high: float) -> Range:
    """The range between these; no number at all where one of them is none."""
    return (nan, nan) if isnan(low) or isnan(high) else (low, high)


def negative(quantity: Quantity) -> Quantity:
    if isinstance(quantity, NumberLiteral):
        return NumberLiteral(-quantity.number, quantity.unit)
    return Product(NumberLiteral(-1.0), quantity)


def sides(low: float, high: float) -> set[int]:
    """The sides of 0 that a range touches: -1 below, 0 at, 1 above, `NO_NUMBER`."""
    if isnan(low) or isnan(high):
        return {-1, 0, 1, NO_NUMBER}
    return {side for side, touches in ((-1, low < 0.0), (0, low <= 0.0 <= high), (1, high > 0.0)) if touches}


# ---------------------------------------------------------------------- when it changes


class MovingSignal(Protocol):
    """A signal that moves, as `steptwin.simulation.logic.condition.Signal`."""

    def value(self, now: Nanos) -> float: ...
    def turning_points(self, now: Nanos) -> Iterator[Nanos]: ...


def next_change(
    quantity: Quantity, moving: Mapping[str, MovingSignal], at_rest: Callable[[str], float], now: Nanos
) -> Nanos | None:
    """First whole nanosecond after ``now`` at which a quantity is on another side of 0 (below, at, above, no number); None if
    never.

    Between their turning points signals are monotonic, so that the ranges of an interval follow from its ends; it is halved until
    its range is on one side, or it is a nanosecond long. Where signals stay equal, as of two cylinders on one valve, that
    has no end: after `MOST_LOOKS` intervals, changes of less than a growing time may be overlooked.
    """
    search = _Search(quantity, {name: signal.value for name, signal in moving.items()}, at_rest)
    return search.first(now, merge(*(signal.turning_points(now) for signal in moving.values())))


def change_between(quantity: Quantity, reads: Mapping[str, Callable[[Nanos], float]], begin: Nanos, end: Nanos) -> Nanos | None:
    """As `next_change` of a quantity all of whose signals are read by ``reads``, after ``begin`` and up to ``end``, between which
    none of them turns."""
    nothing: Mapping[str, float] = {}
    return _Search(quantity, reads, nothing.__getitem__).between(begin, end)


class _Search:
    __slots__ = ("_at_rest", "_looks", "_quantity", "_reads")

    def __init__(
        self, quantity: Quantity, reads: Mapping[str, Callable[[Nanos], float]], at_rest: Callable[[str], float]
    ) -> None:
        """``reads``: the values of what moves; ``at_rest`` gives those of what does not."""
        self._quantity = quantity
        self._reads = reads
        self._at_rest = at_rest
        self._looks = 0

    def first(self, now: Nanos, turning_points: Iterable[Nanos]) -> Nanos | None:
        """``turning_points`` are in order."""
        values = self._values(now)
        side = self._side(values)
        begin = now
        for end in chain(turning_points, (now + FARTHEST_NS,)):
            if end > begin:
                there = self._values(end)
                found = self._within(begin, values, end, there, side)
                if found is not None:
                    return found
                begin, values = end, there
        return None

    def between(self, begin: Nanos, end: Nanos) -> Nanos | None:
        """In a time without turning points."""
        values = self._values(begin)
        return self._within(begin, values, end, self._values(end), self._side(values))

    @property
    def _finest(self) -> Nanos:
        """The length of intervals that are not halved any more while the ends are on the same side."""
        return 1 << max(0, -((MOST_LOOKS - self._looks) // LOOKS_MORE))

    def _values(self, now: Nanos) -> Mapping[str, float]:
        return {name: read(now) for name, read in self._reads.items()}

    def _side(self, values: Mapping[str, float]) -> int:
        value = self._quantity.value(lambda name: values[name] if name in values else self._at_rest(name))
        return NO_NUMBER if isnan(value) else (value > 0.0) - (value < 0.0)

    def _sides(self, ends: Iterable[Mapping[str, float]]) -> set[int]:
        """The sides of 0 that the range between the ends touches."""
        one, other = ends

        def between(name: str) -> Range:
            if name not in one:
                value = self._at_rest(name)
                return value, value
            return min(one[name], other[name]), max(one[name], other[name])

        return sides(*self._quantity.range(between))

    def _within(self, begin: Nanos, first: Mapping[str, float], end: Nanos, last: Mapping[str, float], side: int) -> Nanos | None:
        if first == last or self._sides((first, last)) == {side}:
            return None
        self._looks += 1
        if end - begin <= self._finest and self._side(last) == side:
            return None
        if end - begin == 1:
            return end
        middle = (begin + end) // 2
        values = self._values(middle)
        found = self._within(begin, first, middle, values, side)
        return self._within(middle, values, end, last, side) if found is None else found
