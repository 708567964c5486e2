"""Planning: from any position and velocity to a position, to a velocity, to a stop.

Pulses, pulses/s, pulses/s². Velocity is continuous; the speed limit is exceeded only while slowing from a higher old speed.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion.profile import Profile, Segment, cruise, ramp

LEAST, MOST = 1e-60, 1e60
"""Bounds of speeds and rates, and the least distance: wider than any 32-bit REAL, narrow enough that nothing under- or
overflows on the way."""
FARTHEST_P = 2**48
"""Bound of distances: below it a position in the middle of a move is exact to less than half a pulse."""


class MotionState(NamedTuple):
    """Beginning of a motion: moment, counted position (pulses), phase (real minus counted, pulses), velocity (pulses/s)."""

    now: Nanos
    count: int
    phase: float
    velocity: float

    @classmethod
    def of(cls, profile: Profile, now: Nanos) -> MotionState:
        return cls(now, *profile.state(now))


DISTANCE_OUT_OF_RANGE = Message("motion.distance-out-of-range", "distance = {distance} pulses: must be within ±{most}")


def plan_position(state: MotionState, target: float, acc: float, dec: float, vmax: float) -> Profile:
    """To rest at ``target`` (whole but on the way of a path): trapezoid or triangle, through zero where it must turn.

    ``acc`` for speeding up, ``dec`` for slowing down (pulses/s²), ``vmax`` cruise (pulses/s), each from `LEAST` to `MOST`;
    at most `FARTHEST_P` pulses away; else `Misuse`.
    """
    now, count, p, v = state
    if not (LEAST <= acc <= MOST and LEAST <= dec <= MOST and LEAST <= vmax <= MOST and -MOST <= v <= MOST):
        refuse_range(acc=(acc, "pulses/s²"), dec=(dec, "pulses/s²"), vmax=(vmax, "pulses/s"))
        _refuse_velocity(v)
    if not -FARTHEST_P <= target - count <= FARTHEST_P:
        raise Misuse(DISTANCE_OUT_OF_RANGE(distance=target - count, most=FARTHEST_P))
    goal = float(target - count)
    distance = goal - p
    segments: list[Segment] = []
    t = 0.0
    if v != 0.0 and (distance * v <= 0.0 or v * v > 2.0 * dec * abs(distance)):
        # The target is too near to brake for, or behind: the motion comes to rest, then goes back.
        s = ramp(0.0, p, v, 0.0, dec)
        segments.append(s)
        t, p, v = s.end_s, s.c0, 0.0
        distance = goal - p
        if -_SAME_P < distance < _SAME_P:
            s.c0 = goal
            return Profile(now, count, (s,), goal)
    if -LEAST < distance < LEAST:
        return Profile(now, count, (), goal)
    sign, direction = (1.0, 1) if distance > 0.0 else (-1.0, -1)
    speed = v * sign
    if speed > vmax:
        s = ramp(t, p, v, vmax * sign, dec)
        segments.append(s)
        t, p, peak = s.end_s, s.c0, vmax
    else:
        #      peak         With d1 + d2 = d, v0 the present speed, a and b the rates:
        #     ╱    ╲        peak² = v0² + 2·a·d1 = 2·b·d2, so peak² = v0² + 2·(d − v0²/2b)·a·b/(a + b).
        # v0 ╱ a  b ╲       The second term is ``gain``; peak − v0 = gain/(peak + v0) avoids a difference of nearly equal speeds.
        #     d1   d2
        gain = 2.0 * (abs(distance) - speed * speed / (2.0 * dec)) * acc * dec / (acc + dec)
        peak = speed
        if gain > 0.0 and speed < vmax:
            peak = sqrt(speed * speed + gain)
            duration = gain / (peak + speed) / acc
            if peak > vmax:
                peak = vmax
                duration = (vmax - speed) / acc
            s = Segment(t + duration, t, p, v, 0.5 * acc * sign, 0.0, direction)
            segments.append(s)
            t = s.end_s
            p += sign * duration * (speed + 0.5 * acc * duration)
    duration = peak / dec
    gap = (goal - p) * sign - 0.5 * peak * duration
    if gap > 0.0:
        end = t + gap / peak
        if end > t:
            segments.append(cruise(t, end, p, peak * sign))
            t = end
    t += duration
    segments.append(Segment(t, t, goal, 0.0, -0.5 * dec * sign, 0.0, direction))
    return Profile(now, count, tuple(segments), goal)


def plan_velocity(state: MotionState, velocity: float, acc: float, dec: float) -> Profile:
    """A motion to a constant ``velocity`` (pulses/s), slowing with ``dec`` and speeding up with ``acc``; velocity 0 is a stop.

    Ranges as for `plan_position`; a ``velocity`` nearer to 0 than `LEAST` is 0.
    """
    now, count, p, v = state
    if -LEAST < velocity < LEAST:
        velocity = 0.0
    if not (LEAST <= acc <= MOST and LEAST <= dec <= MOST and -MOST <= velocity <= MOST and -MOST <= v <= MOST):
        refuse_range(acc=(acc, "pulses/s²"), dec=(dec, "pulses/s²"))
        _refuse_velocity(velocity)
        _refuse_velocity(v)
    segments: list[Segment] = []
    t = 0.0
    if v != 0.0 and (v * velocity <= 0.0 or abs(velocity) < abs(v)):
        slower = velocity if v * velocity > 0.0 else 0.0
        s = ramp(t, p, v, slower, dec)
        segments.append(s)
        t, p, v = s.end_s, s.c0, slower
    if abs(velocity) > abs(v):
        s = ramp(t, p, v, velocity, acc)
        segments.append(s)
        t, p = s.end_s, s.position(s.end_s)
    if velocity != 0.0:
        segments.append(cruise(t, inf, p, velocity))
    return Profile(now, count, tuple(segments), p)


def plan_stop(state: MotionState, dec: float) -> Profile:
    """Come to rest with ``dec`` (pulses/s²)."""
    return plan_velocity(state, 0.0, dec, dec)


_SAME_P = 1e-6
"""A braking that ends this close to its target (pulses) ends on it: the target of a move in its last ramp, given again, must
not overshoot by a rounding error and come back."""


VALUE_OUT_OF_RANGE = Message(
    "motion.value-out-of-range", "{name} = {value} {unit}: must be finite and greater than 0 (from {least:g} to {most:g})"
)


def refuse_range(**parameters: tuple[float, str]) -> None:
    """Raise `Misuse` for the first ``name=(value, unit)`` that is not a number from `LEAST` to `MOST`."""
    for name, (value, unit) in parameters.items():
        if not LEAST <= value <= MOST:
            raise Misuse(VALUE_OUT_OF_RANGE(name=name, value=value, unit=unit, least=LEAST, most=MOST))


VELOCITY_OUT_OF_RANGE = Message("motion.velocity-out-of-range", "velocity = {value} pulses/s: must be finite (within ±{most:g})")


def _refuse_velocity(value: float) -> None:
    if not -MOST <= value <= MOST:
        raise Misuse(VELOCITY_OUT_OF_RANGE(value=value, most=MOST))
