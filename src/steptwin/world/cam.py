"""The profile of a cam: the lift of its follower over the angle, linear between points, the same in every revolution.

Computed in fractions, so that a place at which the follower is at a level, and its lift there, fit together.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import pairwise
from math import ceil, floor

MOST_TURNS = 100
"""So many revolutions are looked through where a revolution is no whole number of pulses."""


class Cam:
    """``points``: (place in a revolution, lift), with places from 0 on, below ``turn``; ``turn``: pulses of a revolution."""

    __slots__ = ("_points", "_turns", "turn")

    def __init__(self, points: Iterable[tuple[Fraction, Fraction]], turn: Fraction) -> None:
        found = sorted(points)
        first, last = found[0], found[-1]
        self._points = [(last[0] - turn, last[1]), *found, (first[0] + turn, first[1])]
        self.turn = turn
        self._turns = min(turn.denominator, MOST_TURNS) + 1

    def lift(self, place: int) -> Fraction:
        x = place - floor(place / self.turn) * self.turn
        i = bisect_right(self._points, x, key=lambda point: point[0])
        (x0, y0), (x1, y1) = self._points[i - 1], self._points[i]
        return y0 + (y1 - y0) * (x - x0) / (x1 - x0)

    def _spans(self, level: Fraction, direction: int) -> Iterator[tuple[Fraction, Fraction]]:
        """Where in a revolution the lift is at the level, or beyond it in the direction."""
        for (x0, y0), (x1, y1) in pairwise(self._points[1:]):
            beyond = (y0 - level) * direction >= 0, (y1 - level) * direction >= 0
            if any(beyond):
                at = x0 if y0 == y1 else x0 + (level - y0) * (x1 - x0) / (y1 - y0)
                yield (x0 if beyond[0] else at), (x1 if beyond[1] else at)

    def next(self, level: Fraction, place: int, direction: int, way: int) -> int | None:
        """The next whole place in ``way`` from ``place`` at which the lift is at the level, or beyond it in ``direction``."""
        found = (self._first(span, place, way) for span in self._spans(level, direction))
        return min((one for one in found if one is not None), key=lambda one: one * way, default=None)

    def _first(self, span: tuple[Fraction, Fraction], place: int, way: int) -> int | None:
        low, high = span if way > 0 else (-span[1], -span[0])
        place *= way
        turn = ceil((place + 1 - high) / self.turn)
        for one in range(turn, turn + self._turns):
            shift = one * self.turn
            at = max(place + 1, ceil(low + shift))
            if at <= high + shift:
                return at * way
        return None

    def corners(self, place: int, way: int) -> Iterator[int]:
        """Whole places in ``way`` from ``place`` between which, as far as a revolution's end, the lift goes one way."""
        now = place
        for _ in range(self._turns * len(self._points)):
            now = min((self._beyond(x, now, way) for x, _ in self._points[1:-1]), key=lambda one: one * way)
            yield now

    def _beyond(self, x: Fraction, place: int, way: int) -> int:
        """The first whole place after ``place`` that is beyond a point of the profile, or at it."""
        turn = floor((place - x) * way / self.turn)
        while (found := ceil(x * way + turn * self.turn)) <= place * way:
            turn += 1
        return found * way
