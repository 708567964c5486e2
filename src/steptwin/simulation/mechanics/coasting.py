"""The motion of a rotor and its load that no motor drives: with weight, friction and brake, until it rests or stands at a stop.

The acceleration is constant between reversals and stops, so the motion is a profile, in closed form. A detent catches a rotor
that has not the energy to leave the full step that it is at.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, inf, sqrt

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.profile import cruise, ramp
from steptwin.simulation.mechanics.potential import PeriodicPotential

_NEAR_P = 1e-6


@dataclass(frozen=True, slots=True)
class CoastingRotor:
    """Torques on a coasting rotor, in pulses of its drive. Torques in N·m, ``inertia`` in N·m per pulse/s², above 0.

    ``load`` is positive if it pulls towards lower positions, ``friction`` acts against motion, and as much of it as is needed at
    rest. Stops are inelastic.
    """

    inertia: float
    load: float
    friction: float
    low: int | None
    high: int | None
    detent: PeriodicPotential | None = None
    """At whole multiples of its period."""

    @property
    def holding(self) -> float:
        """The torque up to which it stands once it does."""
        return self.friction + (0.0 if self.detent is None else self.detent.torque)

    def profile(self, now: Nanos, base: int, phase: float, velocity: float) -> Profile:
        """The motion from ``base`` + ``phase`` pulses with ``velocity`` pulses/s at ``now``."""
        segments = tuple(self._segments(base, phase, velocity))
        if not segments:
            return Profile(now, base, (), phase)
        last = segments[-1]
        end = 0.0 if last.end_s == inf else self._stopped(base, last.position(last.end_s), last.direction)
        if abs(end - round(end)) < _NEAR_P:
            end = float(round(end))
        return Profile(now, base, segments, end)

    def overrun(self, field: PeriodicPotential, now: Nanos, base: int, velocity: float) -> Profile | None:
        """The motion on from ``base`` with ``velocity`` at ``now``, where the field stops; None where it holds the rotor."""
        direction = 1 if velocity > 0.0 else -1
        resisting = self.friction + direction * self.load
        wells = field.passed(0.5 * self.inertia * velocity * velocity, resisting)
        if wells == 0:
            return None
        mean = sqrt(max(velocity * velocity - 2.0 * field.deep(resisting) / self.inertia, 0.0))
        if wells is None:
            return self.profile(now, base, 0.0, direction * mean)
        distance = round(wells * field.period)
        enough = mean * mean * self.inertia / (2.0 * distance) * (1.0 - 1e-9)  # so that it comes to the place
        stop = int(self._stopped(0, base + direction * distance, direction))
        low, high = (base, stop) if direction > 0 else (stop, base)
        driven = replace(self, load=0.0, friction=min(resisting, enough), low=low, high=high)
        return driven.profile(now, base, 0.0, direction * mean)

    def _stop(self, base: int, direction: int) -> float | None:
        """The stop in a direction, from ``base``."""
        stop = self.high if direction > 0 else self.low
        return None if stop is None else float(stop - base)

    def _stopped(self, base: int, position: float, direction: int) -> float:
        """``position``, but not beyond the stop."""
        stop = self._stop(base, direction)
        return position if stop is None else min(position, stop) if direction > 0 else max(position, stop)

    def _rate(self, direction: int) -> float:
        """The acceleration while it moves in ``direction``, pulses/s²."""
        return (-self.load - direction * self.friction) / self.inertia

    def _segments(self, base: int, position: float, velocity: float) -> Iterator[Segment]:
        begin_s = 0.0
        while True:
            direction = 1 if velocity > 0.0 else -1 if velocity < 0.0 else -1 if self.load > 0.0 else 1
            if velocity == 0.0 and abs(self.load) <= self.holding:
                return
            stop = self._stop(base, direction)
            if stop is not None and (stop - position) * direction <= 0.0:
                if velocity == 0.0:
                    return
                position, velocity = stop, 0.0
                continue
            found = self._segment(begin_s, position, velocity, direction, stop)
            if self.detent is not None and (caught := self._caught(self.detent, base, found, begin_s, position, velocity)):
                yield from caught
                return
            yield found
            if found.end_s == inf:
                return
            begin_s, position = found.end_s, self._stopped(base, found.position(found.end_s), direction)
            velocity = 0.0

    def _caught(self, detent: PeriodicPotential, base: int, s: Segment, begin_s: float, p: float, v: float) -> list[Segment]:
        """The motion to the full step that catches it, instead of the segment ``s`` from ``p`` with velocity ``v``; empty where
        none does."""
        direction, rate = s.direction, self._rate(s.direction)
        slow = detent.catches_below(self.inertia, self.friction + direction * self.load)
        if slow == 0.0:
            return []
        begun: list[Segment] = []
        if abs(v) > slow:
            if rate * direction >= 0.0 or abs(s.velocity(s.end_s)) > slow:
                return []
            begun.append(ramp(begin_s, p, v, direction * slow, abs(rate)))
        at = begun[0].position(begun[0].end_s) if begun else p
        well = self._well(detent, base, at, p, direction)
        if begun and (well - at) * direction <= 0.0:
            left = sqrt(max(v * v - 2.0 * abs(rate) * abs(well - p), 0.0))
            return [ramp(begin_s, p, v, direction * left, abs(rate))]
        speed, now = (slow, begun[0].end_s) if begun else (abs(v), begin_s)
        return [*begun, ramp(now, at, direction * speed, 0.0, speed * speed / (2.0 * abs(well - at)))]

    def _well(self, detent: PeriodicPotential, base: int, at: float, begin: float, direction: int) -> float:
        """The whole place of the full step nearest to ``at``, not before ``begin``; the stop, where that comes first."""
        well = detent.nearest(base + at) - base
        if (well - begin) * direction <= 0.0:
            well = detent.nearest(base + at + direction * detent.period) - base
        return self._stopped(base, float(well), direction)

    def _segment(self, begin_s: float, p: float, v: float, direction: int, stop: float | None) -> Segment:
        """From velocity ``v`` in one direction to rest, to ``stop``, or for ever."""
        rate = self._rate(direction)
        if rate * direction < 0.0:
            distance = v * v / (2.0 * abs(rate))
            if stop is None or (stop - p) * direction >= distance:
                return ramp(begin_s, p, v, 0.0, abs(rate))
            left = direction * sqrt(v * v - 2.0 * abs(rate) * (stop - p) * direction)
            found = ramp(begin_s, p, v, left, abs(rate))
        elif rate == 0.0:
            found = cruise(begin_s, inf, p, v)
        else:
            found = Segment(inf, begin_s, p, v, 0.5 * rate, 0.0, direction)
        if stop is not None:
            found.end_s = (ceil(found.when(stop) * SECOND) + 1) / SECOND  # so that it has come to the stop, whatever is rounded
        return found


def slow_from(profile: Profile, now: Nanos, speed: float) -> Nanos | None:
    """First moment from ``now`` on at which a coasting motion is not faster than ``speed`` pulses/s; None if it never is."""
    if abs(profile.velocity(now)) <= speed:
        return now
    part = bisect_right(profile.ends, now - profile.start)
    s, end = profile.segments[part], profile.ends[part]
    if end == inf:
        return None
    # At the end of each segment it stands. It is faster than ``speed`` now, so what ends slower brakes.
    brakes = abs(s.velocity(s.end_s)) < speed
    return max(now, profile.start + ceil(s.when_speed(speed) * SECOND)) if brakes else profile.start + int(end)
