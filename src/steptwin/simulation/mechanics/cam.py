"""The profile of a cam: the lift of its follower over the angle, linear between points, the same in every revolution.

Computed in whole numbers and fractions, so that a place at which the follower is at a level, and its lift there, fit together.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from math import floor, lcm
from typing import NamedTuple

MOST_TURNS = 100
"""So many revolutions are looked through where a revolution is no whole number of pulses."""


class _Ratio(NamedTuple):
    """``above`` / ``below``, which is positive. Cheaper than a `Fraction`, because it is not reduced."""

    above: int
    below: int


class Cam:
    """``points``: (place in a revolution, lift), with places from 0 on, below ``turn``; ``turn``: pulses of a revolution."""

    __slots__ = ("_lifts", "_places", "_turn", "_turns", "_x", "_y", "turn")

    def __init__(self, points: Iterable[tuple[Fraction, Fraction]], turn: Fraction) -> None:
        found = sorted(points)
        first, last = found[0], found[-1]
        around = [(last[0] - turn, last[1]), *found, (first[0] + turn, first[1])]
        self._places = lcm(turn.denominator, *(x.denominator for x, _ in around))
        """Places are kept as whole numbers of 1 / this, lifts of 1 / the next."""
        self._lifts = lcm(*(y.denominator for _, y in around))
        self._x = _whole((x for x, _ in around), self._places)
        self._y = _whole((y for _, y in around), self._lifts)
        self.turn = turn
        (self._turn,) = _whole([turn], self._places)
        self._turns = min(turn.denominator, MOST_TURNS) + 1

    def lift(self, place: int) -> Fraction:
        return Fraction(*self._lift(place))

    def nearest(self, place: int, steps: int) -> int:
        """The lift in whole steps, of which a unit of the lift has so many; upwards from the middle between two."""
        above, below = self._lift(place)
        return (2 * steps * above + below) // (2 * below)

    def _lift(self, place: int) -> _Ratio:
        x = place * self._places % self._turn
        i = bisect_right(self._x, x)
        x0, x1, y0, y1 = self._x[i - 1], self._x[i], self._y[i - 1], self._y[i]
        return _Ratio(y0 * (x1 - x0) + (y1 - y0) * (x - x0), (x1 - x0) * self._lifts)

    def span(self, place: float, heading: int) -> tuple[float, float, float, float]:
        """The least and greatest place of an interval, and ``rise`` and ``shift``: in it the lift is ``rise`` · place +
        ``shift``.

        ``place``, which need not be whole, is in it; at a corner, the interval in ``heading`` from there.
        """
        turns = floor(place / self.turn)
        x = (place - turns * float(self.turn)) * self._places
        i = bisect_right(self._x, x) if heading > 0 else bisect_left(self._x, x)
        i = min(max(i, 1), len(self._x) - 1)
        x0, x1, y0, y1 = self._x[i - 1], self._x[i], self._y[i - 1], self._y[i]
        low, high = (float(x / self._places + turns * self.turn) for x in (x0, x1))
        rise = (y1 - y0) * self._places / ((x1 - x0) * self._lifts)
        return low, high, rise, y0 / self._lifts - rise * low

    def _spans(self, level: Fraction, direction: int) -> Iterator[tuple[_Ratio, _Ratio]]:
        """Where in a revolution the lift is at the level, or beyond it in the direction."""
        above, below = level.numerator * self._lifts, level.denominator
        for (x0, y0), (x1, y1) in pairwise(zip(self._x[1:], self._y[1:], strict=True)):
            over0, over1 = y0 * below - above, y1 * below - above
            if max(over0 * direction, over1 * direction) >= 0:
                rise = abs(over1 - over0)
                at = _Ratio(x0 * rise + abs(over0) * (x1 - x0), rise)  # used only where one of them is on the other side
                yield _Ratio(x0, 1) if over0 * direction >= 0 else at, _Ratio(x1, 1) if over1 * direction >= 0 else at

    def next(self, level: Fraction, place: int, direction: int, heading: int) -> int | None:
        """The next whole place in ``heading`` from ``place`` at which the lift is at the level, or beyond it in ``direction``."""
        found = (self._first(low, high, place, heading) for low, high in self._spans(level, direction))
        return min((one for one in found if one is not None), key=lambda one: one * heading, default=None)

    def _first(self, low: _Ratio, high: _Ratio, place: int, heading: int) -> int | None:
        if heading < 0:
            low, high = _Ratio(-high.above, high.below), _Ratio(-low.above, low.below)
        after = place * heading + 1
        turn = -((high.above - after * self._places * high.below) // (self._turn * high.below))
        for one in range(turn, turn + self._turns):
            shift = one * self._turn
            at = max(after, -((-low.above - shift * low.below) // (low.below * self._places)))
            if at * self._places * high.below <= high.above + shift * high.below:
                return at * heading
        return None

    def corners(self, place: int, heading: int) -> Iterator[int]:
        """Whole places in ``heading`` from ``place`` between which, as far as a revolution's end, the lift goes one way."""
        now = place
        for _ in range(self._turns * len(self._x)):
            now = min((self._beyond(x, now, heading) for x in self._x[1:-1]), key=lambda one: one * heading)
            yield now

    def _beyond(self, x: int, place: int, heading: int) -> int:
        """The first whole place after ``place`` that is beyond a point of the profile, or at it."""
        turn = (place * self._places - x) * heading // self._turn
        while (found := -((-x * heading - turn * self._turn) // self._places)) <= place * heading:
            turn += 1
        return found * heading


def _whole(values: Iterable[Fraction], below: int) -> Sequence[int]:
    """``values`` as whole numbers of 1 / ``below``, a multiple of all their denominators."""
    return [value.numerator * (below // value.denominator) for value in values]
