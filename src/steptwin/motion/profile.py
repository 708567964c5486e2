"""A commanded motion in closed form, and the whole pulses it gives.

Suffixes: ``_ns`` whole nanoseconds, ``_s`` seconds from the start of the profile, ``_p`` pulses (the M1486 twin uses minimum
microsteps as the pulse).

Pulses are whole, profiles are real. A pulse is due when the profile reaches the next whole position in its direction, with
one pulse of hysteresis on reversal: while the counted position is ``c`` the profile stays strictly between ``c - 1`` and
``c + 1``. Pulse ``k`` belongs to the first whole nanosecond at or after the exact moment at which the profile is at ``k``,
and always to a moment after the start of the profile: what is due at the start was given by the profile before.

Everything here uses + − × ÷ √ only, so results are the same on every machine. Pulse times are those of the exact solution
as far as a double can tell: within 1 ns while a motion lasts less than 2^49 ns (six days), relative 2^-49 beyond.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, floor, inf, sqrt

from steptwin.controller import Nanos

NEAR_P = 1 / 128
"""Within this distance of a whole position the rounding error of a position (2^-49 of its distance from the base) could decide
the count; then the time of the pulse decides. Large enough for motions of 1e12 pulses, small enough to be rarely needed."""
_FAR_P = 1.0 - NEAR_P

NEWTON_STEPS = 4
"""For a cubic: the first guess is at most 23 % too large, and each step squares the relative error and halves it."""


@dataclass(slots=True)
class Segment:
    """A polynomial of time with velocity of one sign: ``c0 + c1·u + c2·u² + c3·u³``, ``u = t_s − anchor_s``. Immutable.

    It begins where the segment before it ends. The anchor is the slower end, so that solving for time never subtracts
    nearly equal numbers. A cubic part (only with c1 ≠ 0) lessens the acceleration away from the anchor and never reverses it.
    """

    end_s: float
    anchor_s: float
    c0: float
    c1: float
    c2: float
    c3: float
    direction: int
    """+1 or −1."""

    def position(self, t_s: float) -> float:
        u = t_s - self.anchor_s
        return self.c0 + u * (self.c1 + u * (self.c2 + u * self.c3))

    def velocity(self, t_s: float) -> float:
        u = t_s - self.anchor_s
        return self.c1 + u * (2.0 * self.c2 + u * (3.0 * self.c3))

    def when(self, position: float) -> float:
        """Seconds at which the polynomial is at ``position``; short of the anchor, the anchor.

        `steptwin.motion.pulses` does the same operations in the same order.
        """
        d = position - self.c0
        if self.c2 == 0.0:
            return self.anchor_s + d / self.c1
        if self.c3 != 0.0:
            return self._when_cubic(d)
        if self.c1 == 0.0:
            u = sqrt(max(d / self.c2, 0.0))
            return self.anchor_s + u if self.c2 * self.direction > 0.0 else self.anchor_s - u
        half = 0.5 * self.c1
        root = sqrt(max(half * half + self.c2 * d, 0.0))
        return self.anchor_s + d / (half + root if self.direction > 0 else half - root)

    def when_speed(self, speed: float) -> float:
        """Seconds at which the speed (pulses/s, of either direction) is ``speed``; only where the speed changes."""
        b1, b2, b3 = abs(self.c1), abs(self.c2), abs(self.c3)
        x = (speed - b1) / (b2 + sqrt(max(b2 * b2 - 3.0 * b3 * (speed - b1), 0.0)))
        return self.anchor_s + x if self.c2 * self.direction > 0.0 else self.anchor_s - x

    def _when_cubic(self, d: float) -> float:
        """Newton on ``b1·x + b2·x² − b3·x³ = |d|``, which grows and bends upwards as far as the segment goes.

        The first guess solves ``b1·x + ⅔·b2·x² = |d|``: right at the far end of the longest possible segment and too large
        before it, so that every step comes nearer from the same side.
        """
        b1, b2, b3 = abs(self.c1), abs(self.c2), abs(self.c3)
        d = abs(d) if d * self.c2 > 0.0 else 0.0
        half = 0.5 * b1
        x = d / (half + sqrt(half * half + b2 / 1.5 * d))
        for _ in range(NEWTON_STEPS):
            x = (d + x * x * (b2 - 2.0 * b3 * x)) / (b1 + x * (2.0 * b2 - 3.0 * b3 * x))
        return self.anchor_s + x if self.c2 * self.direction > 0.0 else self.anchor_s - x


class Profile:
    """Position and velocity over time from ``start`` on; immutable. Questions about moments before ``start`` have no meaning.

    ``base`` is the counted position (pulses) at the start; segments and ``final_p`` are relative to it. After the last
    segment the profile rests at ``final_p``; a last segment that ends at infinity makes it endless.
    """

    __slots__ = ("base", "counts", "end", "ends", "final_p", "segments", "start")

    def __init__(self, start: Nanos, base: int, segments: tuple[Segment, ...], final_p: float) -> None:
        self.start = start
        self.base = base
        self.segments = segments
        self.final_p = final_p
        self.ends: list[float] = []
        """first whole nanosecond, from ``start``, that no longer belongs to each segment"""
        self.counts: list[int] = [0]
        """counted position, relative to ``base``, when each segment begins, and at the end"""
        self.end: Nanos | None = start
        """first whole nanosecond at which the motion is finished; None when endless"""
        if not segments:
            return
        count = 0
        last = segments[-1]
        for s in segments:
            if s.end_s == inf:
                self.ends.append(inf)
                self.end = None
                return
            end_ns = ceil(s.end_s * 1e9)
            self.ends.append(end_ns)
            p = final_p if s is last else s.position(s.end_s)
            if s.direction > 0:
                count = max(count, floor(p))
            else:
                count = min(count, ceil(p))
            self.counts.append(count)
        self.end = start + end_ns

    def __repr__(self) -> str:
        return f"Profile(start={self.start}, base={self.base}, end={self.end}, segments={len(self.segments)})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Profile):
            return NotImplemented
        return (self.start, self.base, self.segments, self.final_p) == (other.start, other.base, other.segments, other.final_p)

    def __hash__(self) -> int:
        return hash((self.start, self.base, self.final_p))

    def moving(self, now: Nanos) -> bool:
        return self.end is None or now < self.end

    # `position`, `velocity` and `count` are read in every request of a master: each has its own copy of the search.

    def position(self, now: Nanos) -> float:
        """Real commanded position at ``now`` in pulses."""
        n = now - self.start
        i = 0
        for end in self.ends:
            if n < end:
                s = self.segments[i]
                u = n / 1e9 - s.anchor_s
                return self.base + (s.c0 + u * (s.c1 + u * (s.c2 + u * s.c3)))
            i += 1
        return self.base + self.final_p

    def velocity(self, now: Nanos) -> float:
        """Commanded velocity at ``now`` in pulses/s."""
        n = now - self.start
        i = 0
        for end in self.ends:
            if n < end:
                s = self.segments[i]
                u = n / 1e9 - s.anchor_s
                return s.c1 + u * (2.0 * s.c2 + u * (3.0 * s.c3))
            i += 1
        return 0.0

    def count(self, now: Nanos) -> int:
        """Counted position at ``now``, with every pulse due by ``now``."""
        n = now - self.start
        i = 0
        for end in self.ends:
            if n < end:
                s = self.segments[i]
                u = n / 1e9 - s.anchor_s
                p = s.c0 + u * (s.c1 + u * (s.c2 + u * s.c3))
                count = self.counts[i]
                reached = floor(p)
                if not NEAR_P < p - reached < _FAR_P:
                    reached = self._count_near(i, p, n)
                elif s.direction < 0:
                    reached += 1
                return self.base + (reached if (reached - count) * s.direction > 0 else count)
            i += 1
        return self.base + self.counts[-1]

    def _count_near(self, index: int, p: float, n: int) -> int:
        """Last whole position reached by ``n`` ns, from the times of pulses: ``p`` is too close to a whole position to decide."""
        k = round(p)
        return k if self.pulse_ns(index, k) <= n else k - self.segments[index].direction

    def pulse_ns(self, index: int, k: int) -> int:
        """Nanoseconds from ``start`` of pulse ``k`` (relative to ``base``) of segment ``index``."""
        n = ceil(self.segments[index].when(k) * 1e9)
        first = self.ends[index - 1] if index else 1
        if n < first:
            return int(first)
        return n if n < self.ends[index] else int(self.ends[index])

    def state(self, now: Nanos) -> tuple[int, float, float]:
        """Counted position, phase and velocity (pulses/s) at ``now``. The phase is the real position minus the counted one,
        strictly between −1 and +1 but for rounding errors."""
        n = now - self.start
        for s, end in zip(self.segments, self.ends, strict=True):
            if n < end:
                count, t_s = self.count(now), n / 1e9
                return count, s.position(t_s) - (count - self.base), s.velocity(t_s)
        rests = self.counts[-1]
        return self.base + rests, self.final_p - rests, 0.0

    def phase(self, now: Nanos) -> float:
        return self.state(now)[1]

    def legs(self, now: Nanos) -> Iterator[tuple[Nanos, int]]:
        """(moment, direction) of the segment in progress at ``now``, then of each later one as it begins."""
        begin = self.start
        for s, end in zip(self.segments, self.ends, strict=True):
            if now - self.start < end:
                yield max(begin, now), s.direction
            if end != inf:
                begin = self.start + int(end)

    def pulse_time(self, count: int, after: Nanos) -> Nanos | None:
        """First moment > ``after`` at which a pulse makes the counted position equal to ``count``; None if never."""
        k = count - self.base
        for i, s in enumerate(self.segments):
            if (k - self.counts[i]) * s.direction <= 0:
                continue
            if s.end_s != inf and (k - self.counts[i + 1]) * s.direction > 0:
                continue
            time = self.start + self.pulse_ns(i, k)
            if time > after:
                return time
        return None


def at_rest(now: Nanos, count: int, phase: float = 0.0) -> Profile:
    """A profile that stands at ``count`` pulses from ``now`` on."""
    return Profile(now, count, (), phase)


def ramp(begin_s: float, p: float, v0: float, v1: float, rate: float) -> Segment:
    """A segment of constant acceleration ``rate`` (pulses/s², > 0) from velocity ``v0`` to ``v1``, of the same sign or zero.

    Begins at ``begin_s`` seconds at position ``p``.
    """
    duration = abs(v1 - v0) / rate
    end_s = begin_s + duration
    direction = 1 if v0 + v1 > 0.0 else -1
    half = 0.5 * (rate if v1 > v0 else -rate)
    if abs(v0) <= abs(v1):
        return Segment(end_s, begin_s, p, v0, half, 0.0, direction)
    return Segment(end_s, end_s, p + 0.5 * (v0 + v1) * duration, v1, half, 0.0, direction)


def cruise(begin_s: float, end_s: float, p: float, v: float) -> Segment:
    """A segment of constant velocity ``v`` (pulses/s, not 0) from ``begin_s`` at position ``p``."""
    return Segment(end_s, begin_s, p, v, 0.0, 0.0, 1 if v > 0.0 else -1)
