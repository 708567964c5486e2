"""A coordinate that two axes move together: a weighted sum of their positions, as of the tool of a CoreXY drive."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil, floor, sqrt
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.motion.elastic import DriveInterval
from steptwin.points import FARTHEST_NS
from steptwin.simulation.components.axis import BuiltAxis, nm_per_pulse
from steptwin.simulation.mechanics.loadmotion import load_intervals
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.space.pieces import Motion, Piece, StillPiece, gear_of, geared, pieces_of_trajectory, summed

GRID_PER_UNIT = 10**9
"""Steps of the grid in a unit: nanometres of a metre."""


class Pulled(NamedTuple):
    """How an axis moves coordinates: what it moves stands at ``held``, or is ``behind`` it. In units of the axis."""

    held: float | None = None
    behind: float = 0.0


class Coordinate:
    """A `steptwin.simulation.logic.contacts.MovingPart`: its position on a grid of `GRID_PER_UNIT` is the nearest to the sum.
    ``pulled``: of both axes."""

    __slots__ = ("_axes", "_pulled", "_shares")

    def __init__(self, axes: tuple[BuiltAxis, BuiltAxis], shares: tuple[float, float], pulled: Sequence[Pulled]) -> None:
        self._axes, self._shares, self._pulled = axes, shares, pulled

    def value(self, now: Nanos) -> float:
        """In units of the axes."""
        one, other = (pulled_to(axis, its, now) for axis, its in zip(self._axes, self._pulled, strict=True))
        return self._shares[0] * one + self._shares[1] * other

    @property
    def motion(self) -> Motion:
        """In nm. Raises `Misuse` where the units of the axes are none of a place."""
        factors = [exact_fraction(share) * nm_per_pulse(axis) for share, axis in zip(self._shares, self._axes, strict=True)]
        per_unit = nm_per_pulse(self._axes[0]) * self._axes[0].scale.pulses_per_unit

        def moved(n: int, now: Nanos) -> Iterator[Piece]:
            axis, its, share = self._axes[n], self._pulled[n], self._shares[n]
            if its.held is not None:
                return iter((StillPiece(now, None, float(per_unit) * share * its.held),))
            gear = gear_of(factors[n], -float(per_unit) * share * its.behind)
            return geared(pieces_of_trajectory(axis.mechanism.trajectory(now), now), gear)

        return Motion(self.version, lambda now: summed([moved(n, now) for n in range(len(factors))]))

    def version(self) -> object:
        return *(axis.mechanism.version() for axis in self._axes), *self._pulled

    def grid_position(self, now: Nanos) -> int:
        return floor(self.value(now) * GRID_PER_UNIT + 0.5)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """As `MovingPart.reaches`."""
        for begin, end in pairwise((after, *self.turning_points(after), after + FARTHEST_NS)):
            if begin < end and self._is_short(position, direction, begin) and not self._is_short(position, direction, end):
                low, high = begin, end
                while high - low > 1:
                    middle = (low + high) // 2
                    if self._is_short(position, direction, middle):
                        low = middle
                    else:
                        high = middle
                return high
        return None

    def _is_short(self, position: int, direction: int, now: Nanos) -> bool:
        return (self.grid_position(now) - position) * direction < 0

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after ``now`` between which it moves one way. Along arcs the acceleration is taken as constant for 1 ms."""
        moves = [
            (share / float(axis.scale.pulses_per_unit), [*load_intervals(axis.mechanism.trajectory(now), now)])
            for axis, share, its in zip(self._axes, self._shares, self._pulled, strict=True)
            if its.held is None and share
        ]
        begins = sorted({now, *(max(interval.begin, now) for _, intervals in moves for interval in intervals)})
        at = [0] * len(moves)
        for n, begin in enumerate(begins):
            end = begins[n + 1] if n + 1 < len(begins) else now + FARTHEST_NS
            if begin > now:
                if begin - 1 > now:
                    yield begin - 1  # a rotor that is caught is at once somewhere else
                yield begin
            v = a = j = 0.0
            for m, (factor, intervals) in enumerate(moves):
                while at[m] + 1 < len(intervals) and intervals[at[m] + 1].begin <= begin:
                    at[m] += 1
                its_v, its_a, its_j = _motion(intervals[at[m]], begin)
                v, a, j = v + factor * its_v, a + factor * its_a, j + factor * its_j
            for root in rests(v, a, j):
                turn = begin + ceil(root * SECOND) if root * SECOND < end - begin else end
                if begin < turn < end:
                    yield turn


def pulled_to(axis: BuiltAxis, its: Pulled, now: Nanos) -> float:
    """Where an axis holds what it moves, in its units."""
    if its.held is not None:
        return its.held
    return axis.mechanism.trajectory(now).position(now) / float(axis.scale.pulses_per_unit) - its.behind


def _motion(interval: DriveInterval, now: Nanos) -> tuple[float, float, float]:
    """Velocity, acceleration and jerk."""
    s = (now - interval.begin) / SECOND
    return interval.at(now)[1], interval.a + s * interval.j, interval.j


def rests(v: float, a: float, j: float) -> list[float]:
    """Seconds above 0 at which a velocity with this acceleration and jerk is 0, in order."""
    if j == 0.0:
        found = [] if a == 0.0 else [-v / a]
    else:
        inner = a * a - 2.0 * j * v
        if inner < 0.0:
            return []
        # Without the difference of numbers that are nearly equal.
        q = -(a + (sqrt(inner) if a >= 0.0 else -sqrt(inner)))
        found = [q / j] + ([2.0 * v / q] if q != 0.0 else [])
    return sorted(root for root in found if root > 0.0)
