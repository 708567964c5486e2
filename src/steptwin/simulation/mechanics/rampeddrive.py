"""The drive of a belt with ramps, as a frequency converter gives them: its speed rises and falls in a straight line over time.

With D, the least common multiple of the ramps R in ns, its speed is n/D of the whole one, and n changes by D/R in a nanosecond:
all is whole. In t ns from n₀ it moves, in units of the way at whole speed in 1/(2·D·(D/R)) ns,

    (n₀ + (D/R)·t)² − n₀² on the ramp, 2·(D/R)·D·t − (D − n₀)² after it,

so that places and moments are exact to the step and the nanosecond.
"""

from __future__ import annotations

from fractions import Fraction
from math import ceil, isqrt, lcm
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.mechanics.integral import Straight
from steptwin.state import Stateful


class RampedDrive(Stateful):
    """As a `steptwin.simulation.mechanics.belt.ConstantDrive`, but from rest to speed in ``up_ns`` and back in ``down_ns``; 0: at
    once. A change that begins in between takes its share of the ramp."""

    FIXED: ClassVar[tuple[str, ...]] = ("_divisor", "_down", "_speed", "_up", "_whole", "stride")
    __slots__ = (*FIXED, "_base", "_begin", "_level", "runs")

    def __init__(self, speed: Fraction, up_ns: Nanos, down_ns: Nanos, now: Nanos) -> None:
        """``speed`` in mm/s."""
        self._speed, self._divisor = speed.as_integer_ratio()
        self.stride = ceil(speed)
        """The most that it moves within a nanosecond."""
        self._whole = lcm(up_ns or 1, down_ns or 1)
        self._up = self._whole // up_ns if up_ns else 0
        self._down = self._whole // down_ns if down_ns else 0
        self._base = 0
        self._begin = now
        self._level = 0
        """The speed at that moment, of ``_whole``."""
        self.runs = False

    def run(self, runs: bool, now: Nanos) -> None:
        if runs is not self.runs:
            level = self._reached(now - self._begin)
            if not (self._up if runs else self._down):
                level = self._whole if runs else 0
            self._base, self._begin, self._level, self.runs = self.grid_position(now), now, level, runs

    def version(self) -> object:
        return self._begin, self.runs

    def _reached(self, t: Nanos) -> int:
        """Its speed ``t`` ns after the last change, of ``_whole``."""
        return min(self._level + self._up * t, self._whole) if self.runs else max(self._level - self._down * t, 0)

    @property
    def _rate(self) -> int:
        return (self._up if self.runs else self._down) or 1

    def grid_position(self, now: Nanos) -> int:
        t, before, reached = now - self._begin, self._level, self._reached(now - self._begin)
        moved = abs(reached * reached - before * before)
        if self.runs and reached == self._whole:
            moved = 2 * self._rate * self._whole * t - (self._whole - before) ** 2
        return self._base + self._speed * moved // (self._divisor * 2 * self._rate * self._whole)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """As `MovingPart.reaches`."""
        if direction < 0 or position <= self.grid_position(after):
            return None
        rate, before, whole = self._rate, self._level, self._whole
        needed = -(-(position - self._base) * self._divisor * 2 * rate * whole // self._speed)
        if not self.runs:
            return None if needed > before * before else self._begin - (isqrt(before * before - needed) - before) // rate
        if needed <= whole * whole - before * before:
            level = isqrt(needed + before * before - 1) + 1
            return self._begin - (before - level) // rate
        return self._begin - -(needed + (whole - before) ** 2) // (2 * rate * whole)

    def speed(self, now: Nanos) -> Straight:
        """Its speed in steps/ns, up to the end of its ramp."""
        rate, end = self.whole_speed, self.straight_from()
        ramp = Fraction(0) if now >= end else self.acceleration
        return Straight(rate * self._reached(now - self._begin) / self._whole, ramp, None if now >= end else end)

    def line(self, now: Nanos) -> tuple[Fraction, Fraction] | None:
        """Its position at 0 ns and its speed in steps/ns; None on a ramp."""
        if now < self.straight_from():
            return None
        if not self.runs:
            return Fraction(self.grid_position(now)), Fraction(0)
        rate = Fraction(self._speed, self._divisor)
        lost = Fraction((self._whole - self._level) ** 2, 2 * self._rate * self._whole)
        return self._base - rate * (self._begin + lost), rate

    def straight_from(self) -> Nanos:
        """The moment, ns, at which the present ramp ends."""
        left = self._whole - self._level if self.runs else self._level
        return self._begin - -left // self._rate

    @property
    def whole_speed(self) -> Fraction:
        """Its greatest speed, steps/ns."""
        return Fraction(self._speed, self._divisor)

    @property
    def acceleration(self) -> Fraction:
        """That of its present ramp, steps/ns²."""
        return self.whole_speed * (self._rate if self.runs else -self._rate) / self._whole

    def lead_over(self, other: object) -> int | None:
        """How far it is ahead of another drive that moves as it does at any time; None if they move differently."""
        return self._base - other._base if isinstance(other, RampedDrive) and self._motion == other._motion else None

    @property
    def _motion(self) -> tuple[int, ...]:
        return self._speed, self._divisor, self._up, self._down, self._begin, self._level, self.runs
