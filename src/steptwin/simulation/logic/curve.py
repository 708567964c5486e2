"""A quantity that follows a signal by a table: linear between its points, in steps, each at the exact moment."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from math import isnan, lcm
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.logic.condition import Border, Signal, first_crossing
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.toml.values import MOST
from steptwin.state import Plain, Stateful

MOST_KNOWN = 4096
"""Levels whose ends are kept."""


class Curve:
    """A quantity over values: ``points``, interpolated linearly, constant before the first and after the last, in steps.

    Computed in fractions: a value at which the level changes, and the level there, fit together whatever is rounded.
    """

    __slots__ = ("_ends", "_first", "_lines", "_points", "step")

    def __init__(self, points: Iterable[tuple[float, float]], step: float) -> None:
        self._points = tuple((exact_fraction(x), exact_fraction(y)) for x, y in points)
        self.step = exact_fraction(step)
        self._first = [Border.of(x).above for x, _ in self._points]
        """The first value from each point on."""
        constant = Fraction(0)
        slopes = [(y1 - y0) / (x1 - x0) if x1 > x0 else constant for (x0, y0), (x1, y1) in pairwise(self._points)]
        begins = [self._points[0], *self._points]
        self._lines = [self._line(*begin, slope) for begin, slope in zip(begins, (constant, *slopes, constant), strict=True)]
        """Before each point, and after the last, each in whole numbers: (slope · value + constant) / scale, rounded down, is the
        level."""
        self._ends: dict[int, tuple[Border, ...]] = {}

    def _line(self, x: Fraction, y: Fraction, slope: Fraction) -> tuple[int, int, int]:
        by_value, constant = slope / self.step, (y - slope * x) / self.step + Fraction(1, 2)
        scale = lcm(by_value.denominator, constant.denominator)
        return int(by_value * scale), int(constant * scale), scale

    def level(self, value: float) -> int:
        """The nearest whole number of steps."""
        slope, constant, scale = self._lines[bisect_right(self._first, value)]
        over, under = value.as_integer_ratio()
        return (slope * over + constant * under) // (scale * under)

    @property
    def highest(self) -> float:
        return float(max(y for _, y in self._points))

    def ends(self, value: float, level: int) -> Sequence[Border]:
        """The values next to one with its level, below, above or here, beyond which the level may be another."""
        if level not in self._ends:
            if len(self._ends) == MOST_KNOWN:
                self._ends.clear()
            self._ends[level] = tuple(map(Border.of, sorted(self._ends_of(level))))
        below: list[Border] = []
        for border in self._ends[level]:
            side = border.side(value)
            if side <= 0:
                return (*below, border)
            below = [border]
        return below

    def _ends_of(self, level: int) -> Iterator[Fraction]:
        bounds = [(level + side) * self.step for side in (Fraction(-1, 2), Fraction(1, 2))]
        for (x0, y0), (x1, y1) in pairwise(self._points):
            for bound in bounds:
                if y0 != y1 and min(y0, y1) <= bound <= max(y0, y1):
                    yield x0 + (bound - y0) * (x1 - x0) / (y1 - y0)


class Stepped(Stateful):
    """The quantity. It is due whenever the signal comes to a value at which it is another one."""

    FIXED: ClassVar[tuple[str, ...]] = ("_curve", "_signal", "_version")
    __slots__ = (*FIXED, "_level", "due")

    def __init__(self, signal: Signal, points: Iterable[tuple[float, float]], step: float) -> None:
        self._signal = signal
        self._curve = Curve(points, step)
        self._version: object = None
        self._level = 0
        self.due: Nanos | None = None

    @property
    def value(self) -> float:
        return float(self._level * self._curve.step)

    @property
    def most(self) -> float:
        return self._curve.highest

    def update(self, now: Nanos) -> None:
        version = self._signal.version()
        if version is not None and version == self._version and (self.due is None or now < self.due):
            return
        self._version = version
        value = self._signal.value(now)
        self.due = None
        if not isnan(value):  # it stays where it is: a register can have a value that is not a number
            value = min(max(value, -MOST), MOST)
            self._level = self._curve.level(value)
            if self._signal.continuous:
                self.due = first_crossing(self._signal, self._curve.ends(value, self._level), now)

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._version = None  # a restored signal may have a version that it had in another past
