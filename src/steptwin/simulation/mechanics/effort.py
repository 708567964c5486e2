"""Effort of the motor of an axis for its motion: speed, torque, and the torque that it has left, in closed form from the plans.

Torques in N·m at the motor, positive towards higher positions; speeds in pulses/s of the mechanics.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from heapq import merge
from itertools import pairwise
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile
from steptwin.motion.divisions import profile_of
from steptwin.simulation.mechanics.loadmotion import polynomials
from steptwin.simulation.mechanics.motor import StepperMotor, roots
from steptwin.simulation.mechanics.trajectory import Trajectory


class Effort(NamedTuple):
    """An axis on one trajectory, as its motor feels it. Immutable."""

    trajectory: Trajectory
    has_current: bool
    reduced: Nanos | None
    """From when on its motor has the reduced current of rest; None: never."""

    def speed(self, now: Nanos) -> float:
        """Speed of the load."""
        trajectory = self.trajectory
        return trajectory.build.sign * self._lead.velocity(now) if trajectory.carries(now) else 0.0

    def torque(self, now: Nanos) -> float:
        """The torque that the motion takes, and at rest what friction does not hold; 0 where the motor has no mean torque: it
        has no current, or its rotor does not follow the field."""
        motor = self._pulling(now)
        if motor is None:
            return 0.0
        profile = profile_of(self.trajectory.plan)
        part = bisect_right(profile.ends, now - profile.start)
        if part < len(profile.segments):
            return motor.need_at(profile.segments[part], (now - profile.start) / SECOND, self.trajectory.build.sign)
        return max(motor.load - motor.friction, 0.0) + min(motor.load + motor.friction, 0.0)

    def reserve(self, now: Nanos) -> float:
        """By how much the torque of the curve at the speed of the field is more than that; 0 where the motor has none."""
        motor = self._pulling(now)
        if motor is None:
            return 0.0
        profile = profile_of(self.trajectory.plan)
        has = motor.torque(abs(profile.velocity(now)))
        if not profile.moving(now) and self.reduced is not None and now >= self.reduced:
            has *= motor.hold
        return max(has - abs(self.torque(now)), 0.0)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after ``now`` between which all of them go one way. They may jump at each, so the moment before is one, too."""
        last = now
        for moment in merge(self._begins(now), self._kinks(now)):
            for turn in (moment - 1, moment):
                if turn > last:
                    last = turn
                    yield turn

    @property
    def _lead(self) -> Profile:
        """Motion that the rotor follows."""
        trajectory = self.trajectory
        return profile_of(trajectory.plan) if trajectory.coasting is None else trajectory.coasting

    def _pulling(self, now: Nanos) -> StepperMotor | None:
        """The motor with all of its load while it moves or holds the rotor; otherwise None."""
        trajectory = self.trajectory
        return trajectory.build.motor if self.has_current and trajectory.is_in_field(now) else None

    def _begins(self, now: Nanos) -> Iterator[Nanos]:
        found = {section.begin for section in self.trajectory.sections}
        if self.reduced is not None:
            found.add(self.reduced)
        yield from sorted(moment for moment in found if moment > now)

    def _kinks(self, now: Nanos) -> Iterator[Nanos]:
        """Where a part of the motion begins, and where in it the torque that is left turns."""
        parts = polynomials(self._lead, now, None)
        part = next(parts, None)
        while part is not None:
            following = next(parts, None)
            yield part[0]
            at, (_, _, v, a, j) = part[0], part
            end_s = None if following is None else (following[0] - at) / SECOND
            turns = {at + round(u * SECOND) for u in self._turns(v, a, j) if u > 0.0 and (end_s is None or u < end_s)}
            yield from sorted(turns)
            part = following

    def _turns(self, v: float, a: float, j: float) -> Iterator[float]:
        """Seconds into a part of the motion at which the torque needed or that of the curve turns."""
        motor, sign = self.trajectory.build.motor, self.trajectory.build.sign
        if motor is None:
            return
        for speed, _ in motor.curve:
            yield from roots((v - speed, a, 0.5 * j))
            yield from roots((-v - speed, -a, -0.5 * j))
        for way in (1, -1):
            need = motor.needs(sign * a, sign * way), motor.inertia * sign * j
            yield from roots((*need, 0.0))
            for (s0, t0), (s1, t1) in pairwise(motor.curve):
                slope = (t1 - t0) / (s1 - s0)
                for side in (1.0, -1.0):
                    yield from roots((way * slope * a - side * need[1], way * slope * j, 0.0))
