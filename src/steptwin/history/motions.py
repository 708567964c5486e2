"""A motion that was kept: positions at any moment in which it held."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

from steptwin.controller import MICROSECOND, SECOND, Nanos
from steptwin.motion.divisions import Plan, profile_of


@dataclass(frozen=True, slots=True)
class KeptMotion:
    """It holds from ``time`` to ``end``, of the subject; ``at_us`` and ``end_us`` are the wall clock then."""

    run: int
    time: Nanos
    at_us: int
    end: Nanos
    end_us: int
    plan: Plan
    origin: int
    scale: float
    round_p: int | None

    def position(self, moment: Nanos) -> float:
        """Counted, in the unit of the axis."""
        count = self.plan.count(moment) + self.origin
        if self.round_p is not None:
            count = (count + self.round_p // 2) % self.round_p - self.round_p // 2
        return count / self.scale

    def velocity(self, moment: Nanos) -> float:
        """In units per second."""
        return profile_of(self.plan).velocity(moment) / self.scale

    def moment(self, at_us: int) -> Nanos:
        """The moment of the subject at a wall clock within it."""
        if self.end_us <= self.at_us:
            return self.time
        part = min(1.0, max(0.0, (at_us - self.at_us) / (self.end_us - self.at_us)))
        return self.time + round((self.end - self.time) * part)

    def wall_us(self, moment: Nanos) -> int:
        """The wall clock at a moment of the subject."""
        if self.end <= self.time:
            return self.at_us
        return self.at_us + round((self.end_us - self.at_us) * (moment - self.time) / (self.end - self.time))

    def moments(self, begin: Nanos, end: Nanos, grid: tuple[Nanos, float]) -> Iterator[Nanos]:
        """Moments of a grid (its origin, and the step in s) from one to another, which is before the end of the motion."""
        begin, end = max(begin, self.time), min(end + 1, self.end)
        origin, step_s = grid
        step = max(1, round(step_s * SECOND))
        yield from range(origin + -(-(begin - origin) // step) * step, end, step)

    def ends(self, begin: Nanos, end: Nanos, moving_s: float | None) -> Iterator[Nanos]:
        """The ends of its parts between two moments; with ``moving_s`` also one in so many seconds within a part."""
        begin, end = max(begin, self.time), min(end, self.end)
        yield begin
        last, profile = begin, profile_of(self.plan)
        for segment in profile.segments:
            over = end if segment.end_s == inf else min(end, profile.start + round(segment.end_s * SECOND))
            if over <= last:
                continue
            if moving_s is not None:
                yield from range(last + round(moving_s * SECOND), over, round(moving_s * SECOND))
            if over < end:
                yield over
            last = over
        if end - MICROSECOND > begin:
            yield end
