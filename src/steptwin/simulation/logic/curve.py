"""A quantity that follows a signal by a table: linear between its points, in steps, each at the exact moment."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from math import floor, isnan
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.logic.condition import Signal, crossing
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.toml.values import MOST
from steptwin.state import Plain, Stateful


class Curve:
    """A quantity over values: ``points``, interpolated linearly, constant before the first and after the last, in steps.

    Computed in fractions: a value at which the level changes, and the level there, fit together whatever is rounded.
    """

    __slots__ = ("_points", "step")

    def __init__(self, points: Iterable[tuple[float, float]], step: float) -> None:
        self._points = tuple((exact_fraction(x), exact_fraction(y)) for x, y in points)
        self.step = exact_fraction(step)

    def level(self, value: float) -> int:
        """The nearest whole number of steps."""
        return floor(self._at(Fraction(value)) / self.step + Fraction(1, 2))

    @property
    def highest(self) -> float:
        return float(max(y for _, y in self._points))

    def _at(self, value: Fraction) -> Fraction:
        i = bisect_right(self._points, value, key=lambda point: point[0])
        if i == 0:
            return self._points[0][1]
        if i == len(self._points):
            return self._points[-1][1]
        (x0, y0), (x1, y1) = self._points[i - 1], self._points[i]
        return y0 + (y1 - y0) * (value - x0) / (x1 - x0)

    def ends(self, value: float) -> list[Fraction]:
        """The values next to this one, below, above or here, beyond which the level may be another."""
        level = self.level(value)
        bounds = [(level + side) * self.step for side in (Fraction(-1, 2), Fraction(1, 2))]
        found = [
            x0 + (bound - y0) * (x1 - x0) / (y1 - y0)
            for (x0, y0), (x1, y1) in pairwise(self._points)
            for bound in bounds
            if y0 != y1 and min(y0, y1) <= bound <= max(y0, y1)
        ]
        below, above = [at for at in found if at <= value], [at for at in found if at >= value]
        return [*([max(below)] if below else []), *([min(above)] if above else [])]


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
            self.due = self._next(value, now)

    def _next(self, value: float, now: Nanos) -> Nanos | None:
        if not self._signal.continuous:
            return None
        deadlines = (crossing(self._signal, end, now) for end in self._curve.ends(value))
        return min((due for due in deadlines if due is not None), default=None)

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._version = None  # a restored signal may have a version that it had in another past
