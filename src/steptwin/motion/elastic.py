"""A mass that a drive moves through a spring and a damper, in closed form.

The drive is at u(t), a polynomial of time in each interval; the mass is at x = u + e, where

    e″ + 2·ζ·ω·e′ + ω²·e = −u″,

with the angular frequency ω and the damping ratio ζ < 1 of the mass on a drive at rest. Within an interval e is a polynomial and
an oscillation that decays. Position and velocity of the mass are continuous; where the drive jumps, the damper gives it a blow.

Suffixes as in `steptwin.motion.profile`. Only + − × ÷ √, also in `decay` and `sine`. Deviations from the exact solution are
below 1e-9 of the amplitude.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import ceil, sqrt
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.motion.exponential import decay, logarithm
from steptwin.motion.trig import PI, QUARTER, cosine, sine

SETTLED_P = 1.0 / 1024
"""An oscillation of this amplitude (pulses) is over."""
FARTHEST_NS: Nanos = 1 << 55
"""Longest time; a position that is not reached by then is never reached."""


class Spring(NamedTuple):
    """``frequency`` in Hz and ``damping`` ratio, from above 0 to below 1, of the mass on a drive at rest."""

    frequency: float
    damping: float

    @property
    def omega(self) -> float:
        return 2.0 * PI * self.frequency

    @property
    def rate(self) -> float:
        """At which oscillations decay, 1/s."""
        return self.damping * self.omega

    @property
    def damped(self) -> float:
        """Angular frequency of oscillations, 1/s."""
        return self.omega * sqrt(1.0 - self.damping * self.damping)


class DriveInterval(NamedTuple):
    """A drive from ``begin`` on: at ``p`` with velocity ``v``, acceleration ``a`` and jerk ``j`` there (pulses, s)."""

    begin: Nanos
    p: float
    v: float
    a: float
    j: float

    def at(self, now: Nanos) -> tuple[float, float]:
        """Position and velocity."""
        s = (now - self.begin) / SECOND
        return self.p + s * (self.v + s * (0.5 * self.a + s * self.j / 6.0)), self.v + s * (self.a + s * 0.5 * self.j)


@dataclass(frozen=True, slots=True)
class ResponseInterval:
    """The mass in one interval of its drive. ``cosine_p`` and ``sine_p``: amplitudes of its oscillation at the beginning."""

    spring: Spring
    drive: DriveInterval
    cosine_p: float
    sine_p: float

    @staticmethod
    def of(spring: Spring, drive: DriveInterval, x: float, v: float) -> ResponseInterval:
        """With the mass at ``x`` pulses with ``v`` pulses/s at the beginning."""
        even, slope = _forced(spring, drive.a, drive.j)
        a = x - drive.p - even
        return ResponseInterval(spring, drive, a, (v - drive.v - slope + spring.rate * a) / spring.damped)

    @property
    def amplitude(self) -> float:
        """Amplitude of the oscillation at the beginning, pulses."""
        return sqrt(self.cosine_p * self.cosine_p + self.sine_p * self.sine_p)

    def settled(self) -> Nanos:
        """From when on the oscillation is over."""
        times = self.amplitude / SETTLED_P
        return self.drive.begin + (0 if times <= 1.0 else ceil(logarithm(times) / self.spring.rate * SECOND))

    def at(self, now: Nanos) -> tuple[float, float]:
        """Position (pulses) and velocity (pulses/s) of the mass."""
        s = (now - self.drive.begin) / SECOND
        p, v = self.drive.at(now)
        even, slope = _forced(self.spring, self.drive.a + self.drive.j * s, self.drive.j)
        if not self.cosine_p and not self.sine_p:
            return p + even, v + slope
        w, rate = self.spring.damped, self.spring.rate
        angle_q = w * s / QUARTER
        c, d, left = cosine(angle_q), sine(angle_q), decay(rate * s)
        e = left * (self.cosine_p * c + self.sine_p * d)
        swing = left * w * (self.sine_p * c - self.cosine_p * d)
        return p + even + e, v + slope + swing - rate * e

    def bounds(self, begin: Nanos, end: Nanos) -> tuple[float, float]:
        """The most that acceleration and jerk of the mass can be between two moments (pulses/s², pulses/s³)."""
        s = (begin - self.drive.begin) / SECOND
        left = self.amplitude * decay(self.spring.rate * s) if self.cosine_p or self.sine_p else 0.0
        a, j, w = self.drive.a, self.drive.j, self.spring.omega
        most = max(abs(a + j * s), abs(a + j * (end - self.drive.begin) / SECOND))
        return most + left * w * w, abs(j) + left * w * w * w


def _forced(spring: Spring, a: float, j: float) -> tuple[float, float]:
    """How far a mass without oscillation is from its drive, and the slope of that."""
    w = spring.omega
    return (2.0 * spring.damping * j / w - a) / (w * w), -j / (w * w)


class Response:
    """The motion of the mass from a moment on, while its drive goes through ``drives``; immutable."""

    __slots__ = ("intervals",)

    def __init__(self, spring: Spring, drives: Iterable[DriveInterval], x: float, v: float) -> None:
        """The mass is at ``x`` with ``v`` when the first interval begins. The last one has no end."""
        self.intervals: list[ResponseInterval] = []
        before: DriveInterval | None = None
        for drive in drives:
            if self.intervals and before is not None:
                last = self.intervals[-1]
                x, v = last.at(drive.begin)
                v += 2.0 * spring.rate * (drive.p - before.at(drive.begin)[0])
            before = drive
            self.intervals.append(ResponseInterval.of(spring, drive, x, v))
        self._let_settle()

    def _let_settle(self) -> None:
        """Leave oscillations out from when on they are over."""
        found: list[ResponseInterval] = []
        for number, interval in enumerate(self.intervals):
            end = self.intervals[number + 1].drive.begin if number + 1 < len(self.intervals) else None
            over = interval.settled()
            if end is not None and over >= end:
                found.append(interval)
                continue
            if over > interval.drive.begin:
                found.append(interval)
            s = (over - interval.drive.begin) / SECOND
            p, v = interval.drive.at(over)
            found.append(
                ResponseInterval(
                    interval.spring,
                    DriveInterval(over, p, v, interval.drive.a + interval.drive.j * s, interval.drive.j),
                    0.0,
                    0.0,
                )
            )
        self.intervals = found

    def interval(self, now: Nanos) -> ResponseInterval:
        return self.intervals[max(bisect_right(self.intervals, now, key=lambda one: one.drive.begin) - 1, 0)]

    def at(self, now: Nanos) -> tuple[float, float]:
        """Position and velocity of the mass."""
        return self.interval(now).at(now)

    def oscillates(self, now: Nanos) -> bool:
        found = self.interval(now)
        return bool(found.cosine_p or found.sine_p)

    def ends(self) -> Iterator[Nanos]:
        """When its intervals begin."""
        return (interval.drive.begin for interval in self.intervals)

    def _parts(self, after: Nanos) -> Iterator[tuple[ResponseInterval, Nanos, Nanos]]:
        """Each interval that ends after a moment, with its beginning, not before that moment, and its end."""
        for number, interval in enumerate(self.intervals):
            last = number + 1 == len(self.intervals)
            end = after + FARTHEST_NS if last else self.intervals[number + 1].drive.begin - 1
            if end > after:
                yield interval, max(interval.drive.begin, after), end

    def reaches(self, level: float, after: Nanos, direction: int) -> Nanos | None:
        """First moment > ``after`` at which the mass is at ``level`` pulses or beyond it in ``direction``."""
        for interval, begin, end in self._parts(after):
            first = begin + 1 if begin == after else begin
            found = _first(
                lambda now, of=interval: (of.at(now)[0] - level) * direction,
                lambda a, b, of=interval: of.bounds(a, b)[0],
                first,
                end,
            )
            if found is not None:
                return found
        return None

    def turning_points(self, after: Nanos) -> Iterator[Nanos]:
        """Moments after one between which the mass goes one way, but for less than a nanosecond."""
        for interval, begin, end in self._parts(after):
            if begin > after:
                yield begin
            if not interval.cosine_p and not interval.sine_p and not interval.drive.j:
                # A parabola turns once at most.
                if interval.drive.a and (s := -interval.drive.v / interval.drive.a) > 0.0:
                    moment = interval.drive.begin + ceil(s * SECOND)
                    if begin < moment <= end:
                        yield moment
                continue
            now = begin
            while now < end:
                direction = 1 if interval.at(now)[1] >= 0.0 else -1
                found = _first(
                    lambda moment, of=interval, direction=direction: -of.at(moment)[1] * direction,
                    lambda a, b, of=interval: of.bounds(a, b)[1],
                    now + 1,
                    end,
                )
                if found is None:
                    break
                yield found
                now = found


def _first(f: Callable[[Nanos], float], bend: Callable[[Nanos, Nanos], float], begin: Nanos, end: Nanos) -> Nanos | None:
    """First moment from ``begin`` to ``end`` at which f is not below 0. ``bend``: the most that its second derivative (per s²)
    can be between two moments: where even that does not lead to 0, nothing is searched."""
    if begin > end:
        return None
    parts = [(begin, f(begin), end, f(end))]
    while parts:
        a, fa, b, fb = parts.pop()
        if fa >= 0.0:
            return a
        if b - a <= 1:
            if fb >= 0.0:
                return b
            continue
        width = (b - a) / SECOND
        if fb < 0.0 and max(fa, fb) + bend(a, b) * width * width / 8.0 < 0.0:
            continue
        middle = (a + b) // 2
        fm = f(middle)
        parts.append((middle, fm, b, fb))
        parts.append((a, fa, middle, fm))
    return None
