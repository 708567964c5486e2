"""The value of a point of one controller: how it is read, and how it goes on between events."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.datasheet import Point
from steptwin.motion import Profile

FARTHEST_NS: Nanos = 1 << 55
"""A moment more than a year ahead counts as never."""
MOST_WRAPS = 3
"""Most wraps of a count in one segment: within two rounds it takes every value."""

TurningPoints: TypeAlias = Callable[[Nanos], Iterator[Nanos]]
"""Moments after one, in order, between which (and after the last of which) a value is monotonic."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryCells:
    """Words of a memory of a controller."""

    words: Callable[[], Sequence[int]]
    """The whole memory, as it is now."""
    cells: range
    value: Callable[[Sequence[int]], float]
    """Value that these words mean together."""

    def read(self, now: Nanos) -> float:
        return self.value(self.words()[self.cells.start : self.cells.stop])


@dataclass(frozen=True, slots=True)
class LivePoint:
    """A point of one controller. Between its events the value stays as it is unless there are ``turning_points``."""

    point: Point
    read: Callable[[Nanos], float] | None
    """The value at the moment to which the controller has come; reading changes nothing. None where it can only be written."""
    turning_points: TurningPoints | None = None
    version: Callable[[], object] | None = None
    """A value that changes whenever ``turning_points`` may have changed; None if that is unknown."""
    freeze: Callable[[Nanos], Callable[[Nanos], float]] | None = None
    """Gives the trajectory at a moment as a function that does not change any more; None where there is none."""
    is_kept: bool = False
    """Whether a write, by a request or a statement, only keeps the value, which is not an event of the controller. Besides, it
    becomes what it is after power-on."""
    memory: MemoryCells | None = None
    """Where it is, if it is part of a memory."""


def turning_points_of(profile: Callable[[], Profile]) -> TurningPoints:
    """The ends of the segments of a profile."""

    def turning_points(now: Nanos) -> Iterator[Nanos]:
        present = profile()
        gone = now - present.start
        return iter([present.start + int(end) for end in present.ends if gone < end < inf])

    return turning_points


def end_of(profile: Callable[[], Profile]) -> TurningPoints:
    """The end of a profile alone."""

    def turning_points(now: Nanos) -> Iterator[Nanos]:
        end = profile().end
        return iter(() if end is None or end <= now else (end,))

    return turning_points


def turning_points_of_round(profile: Callable[[], Profile], count: Callable[[Nanos], int], size: int) -> TurningPoints:
    """The same for a shown ``count`` that wraps, and jumps, at every multiple of ``size``."""
    ends = turning_points_of(profile)

    def turning_points(now: Nanos) -> Iterator[Nanos]:
        begin = now
        for end in ends(now):
            yield from _jumps(count, size, begin, end)
            yield end
            begin = end
        yield from _jumps(count, size, begin, now + FARTHEST_NS)

    return turning_points


def _jumps(count: Callable[[Nanos], int], size: int, begin: Nanos, end: Nanos) -> Iterator[Nanos]:
    """Moments before and at which a count that goes one way from ``begin`` to ``end`` jumps."""
    at = count(begin) // size
    last = count(end) // size
    for _ in range(MOST_WRAPS):
        if at == last:
            return
        low, high = begin, end
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if count(middle) // size == at else (low, middle)
        yield from (moment for moment in (high - 1, high) if moment > begin)
        begin, at = high, count(high) // size
