"""Start/stop motion: a jump to a start speed, a linear ramp, a parabolic one, the mirror image down again.

One unit ``u`` of position throughout: u, u/s, u/s². For the M1486 it is the minimum microstep (full step/64): its speeds and
accelerations, which are in full steps, are multiplied by 64 by the caller.

Suffixes: ``_u`` positions and distances, ``_s`` seconds.
"""

from __future__ import annotations

from math import ceil, inf, sqrt
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion.planner import FARTHEST_P, MotionState, refuse_range
from steptwin.motion.profile import Profile, Segment, at_rest, cruise

_SAME_U = 1e-3
"""A forced stop that would end this little beyond a landing position ends on it. A rounding error must not move a stop that is
forced in the last ramp of a move a microstep further; near the top of a parabola the speed determines the position badly."""


class SpeedCurve(NamedTuple):
    """The speed of a motion as it rises; it falls along the mirror image."""

    start: float
    """S: the motion begins and ends with this speed (u/s)."""
    acc: float
    """A: constant acceleration (u/s²) up to ``knee``."""
    knee: float
    """P: from this speed (u/s) on the acceleration falls linearly in time to 0 at ``top``, M-6. Not below ``top``: unused."""
    top: float
    """V: highest speed (u/s). At or below ``start`` there is no ramp: constant ``top``, M-8."""


DISTANCE_OF_RAMPS_OUT_OF_RANGE = Message(
    "motion.distance-of-ramps-out-of-range", "distance = {distance} u: must be within ±{most}"
)


def plan_distance(now: Nanos, begin: int, target: float, curve: SpeedCurve) -> Profile:
    """From rest at ``begin`` to rest at ``target`` (u; whole but where a distance is sought). A short move leaves the curve
    half-way, at the speed at which the remaining distance is the braking distance, M-7.

    Raises `Misuse` for speeds and accelerations that are not finite and positive.
    """
    _check(curve)
    if abs(target - begin) > FARTHEST_P:
        raise Misuse(DISTANCE_OF_RAMPS_OUT_OF_RANGE(distance=target - begin, most=FARTHEST_P))
    distance = float(abs(target - begin))
    if distance == 0.0:
        return at_rest(now, begin)
    sign = 1 if target > begin else -1
    rise: list[_RampSection] = []
    left = 0.5 * distance
    for section in _sections(curve):
        if section.distance >= left:
            rise.append(section.until_distance(left))
            left = 0.0
            break
        rise.append(section)
        left -= section.distance
    segments = _rising(rise, sign)
    t = segments[-1].end_s if segments else 0.0
    if left > 0.0:
        from_u = 0.5 * distance - left
        end = t + 2.0 * left / curve.top
        segments.append(cruise(t, end, sign * from_u, sign * curve.top))
        t = end
    for section in rise:
        t += section.duration
    segments += _falling(rise, sign, t, distance)
    return Profile(now, begin, tuple(segments), sign * distance)


def longest_within(duration: Nanos, grid: int, curve: SpeedCurve) -> int:
    """The longest distance (u) from rest to rest, in whole ``grid``, that is over within ``duration``; one ``grid`` at least.

    Errors as `plan_distance`.
    """
    low, high = 1, max(1, round(curve.top * duration / SECOND) // grid)
    while low < high:
        middle = (low + high + 1) // 2
        is_in_time = (plan_distance(0, 0, middle * grid, curve).end or 0) <= duration
        low, high = (middle, high) if is_in_time else (low, middle - 1)
    return low * grid


def plan_endless(now: Nanos, begin: int, direction: int, curve: SpeedCurve) -> Profile:
    """From rest at ``begin`` (u) to ``top``, without an end. ``direction`` is +1 or −1. Errors as `plan_distance`."""
    _check(curve)
    sections = _sections(curve)
    segments = _rising(sections, direction)
    t = segments[-1].end_s if segments else 0.0
    segments.append(cruise(t, inf, direction * sum(section.distance for section in sections), direction * curve.top))
    return Profile(now, begin, tuple(segments), 0.0)


def plan_forced_stop(state: MotionState, curve: SpeedCurve, landing: int, origin: int = 0) -> Profile:
    """From any point of a motion with ``curve``: down its slope to the start speed (no ramp where the speed is not above it),
    then on to the first position that is ``origin`` + n·``landing`` (u), and rest there.

    Errors as `plan_distance`.
    """
    _check(curve)
    now, count, phase, velocity = state
    if velocity == 0.0:
        return Profile(now, count, (), phase)
    sign = 1 if velocity > 0.0 else -1
    speed = abs(velocity)
    fall: list[_RampSection] = []
    for section in _sections(curve):
        if section.speed >= speed:
            break
        fall.append(section.until_speed(speed))
    # Along the direction of motion, from the counted position.
    stop_u = sign * phase + sum(section.distance for section in fall)
    lead = sign * (count - origin) % landing
    landing_u = float(ceil((stop_u - _SAME_U + lead) / landing) * landing - lead)
    t = sum(section.duration for section in fall)
    segments = _falling(fall, sign, t, min(stop_u, landing_u))
    if landing_u > stop_u:
        final_speed = min(speed, curve.start)
        segments.append(cruise(t, t + (landing_u - stop_u) / final_speed, sign * stop_u, sign * final_speed))
    return Profile(now, count, tuple(segments), sign * landing_u)


class _RampSection(NamedTuple):
    """One section of the speed curve, from its slow end: ``speed·t + c2·t² + c3·t³``."""

    speed: float
    c2: float
    c3: float
    duration: float
    distance: float

    def until_distance(self, distance: float) -> _RampSection:
        """The slow end of this section, ``distance`` long."""
        return self._replace(duration=self._segment().when(distance), distance=distance)

    def until_speed(self, speed: float) -> _RampSection:
        """The slow end of this section, up to ``speed``; the whole section when it does not reach it."""
        segment = self._segment()
        duration = segment.when_speed(speed)
        return self if duration >= self.duration else self._replace(duration=duration, distance=segment.position(duration))

    def _segment(self) -> Segment:
        return Segment(self.duration, 0.0, 0.0, self.speed, self.c2, self.c3, 1)


def _sections(curve: SpeedCurve) -> list[_RampSection]:
    """The sections of the curve, slow to fast; empty when there is no ramp (M-8)."""
    start, acc, knee, top = curve
    sections: list[_RampSection] = []
    middle = min(knee, top)
    if start < middle:
        duration = (middle - start) / acc
        sections.append(_RampSection(start, 0.5 * acc, 0.0, duration, 0.5 * (start + middle) * duration))
    low = max(knee, start)
    if low < top:
        # M-6: v(t) = P + A·t − A²·t² / (4·(V − P)). A motion that starts above P enters this curve at its start speed.
        steepness = acc * sqrt((top - low) / (top - knee))
        duration = 2.0 * (top - low) / steepness
        c3 = -steepness * steepness / (12.0 * (top - low))
        sections.append(_RampSection(low, 0.5 * steepness, c3, duration, duration * (low + 2.0 * top) / 3.0))
    return sections


def _rising(sections: list[_RampSection], sign: int) -> list[Segment]:
    segments: list[Segment] = []
    t = p = 0.0
    for speed, c2, c3, duration, distance in sections:
        segments.append(Segment(t + duration, t, sign * p, sign * speed, sign * c2, sign * c3, sign))
        t += duration
        p += distance
    return segments


def _falling(sections: list[_RampSection], sign: int, end_s: float, end_u: float) -> list[Segment]:
    """The mirror image of `_rising`: ends at ``end_s``, ``end_u`` along the direction of motion."""
    segments: list[Segment] = []
    for speed, c2, c3, duration, distance in sections:
        segments.append(Segment(end_s, end_s, sign * end_u, sign * speed, -sign * c2, sign * c3, sign))
        end_s -= duration
        end_u -= distance
    segments.reverse()
    return segments


def _check(curve: SpeedCurve) -> None:
    refuse_range(start=(curve.start, "u/s"), acc=(curve.acc, "u/s²"), knee=(curve.knee, "u/s"), top=(curve.top, "u/s"))
