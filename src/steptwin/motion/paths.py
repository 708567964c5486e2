"""Straight lines and circular arcs of two axes: a path profile drives both, and each follows a profile of its own.

The *travel* is a profile of the position along the path, in any unit of length; it only goes forward. A *curve* gives
the place of one axis at each position along the path. Axes along a line follow ordinary profiles; along an arc they follow an
`ArcProfile`.

Suffixes as in `steptwin.motion.profile`; ``_q`` quarter turns, counted from +X towards +Y; ``w`` positions along the path.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, floor, inf, sqrt
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion.profile import NEAR_P, Profile, Segment
from steptwin.motion.trig import QUARTER, arcsine_below_45, cosine, direction, length, sine

MOST_TURNS = 1000
"""Most revolutions of one arc, which bounds the number of its segments."""

BEYOND_P = 1e-6
"""An axis crosses an edge when it is farther beyond it than this (pulses): more than rounding errors, less than any pulse."""


# ---------------------------------------------------------------------- shapes in the plane


class Arc(NamedTuple):
    """Part of a circle, in the units of the plane; ``sweep_q`` > 0 is counter-clockwise (X right, Y up)."""

    centre_x: float
    centre_y: float
    radius: float
    begin_q: float
    sweep_q: float

    @property
    def length(self) -> float:
        return abs(self.sweep_q) * QUARTER * self.radius

    @property
    def begin(self) -> tuple[float, float]:
        return self.at(self.begin_q)

    @property
    def end(self) -> tuple[float, float]:
        return self.at(self.begin_q + self.sweep_q)

    def at(self, angle_q: float) -> tuple[float, float]:
        return self.centre_x + self.radius * cosine(angle_q), self.centre_y + self.radius * sine(angle_q)


def circle(centre_x: float, centre_y: float, radius: float, sweep_q: float) -> Arc:
    """An arc that begins at the point of the circle nearest to (0, 0); at its +X side where all are equally near.

    `Misuse` for a radius not above 0 and for more than `MOST_TURNS`.
    """
    _check(radius, sweep_q)
    here = centre_x == 0.0 and centre_y == 0.0
    return Arc(centre_x, centre_y, radius, 0.0 if here else direction(-centre_x, -centre_y), sweep_q)


ARC_WITHOUT_END = Message("motion.arc-without-end", "an arc needs an end point other than its beginning")
RADIUS_IS_TOO_SMALL = Message(
    "motion.radius-is-too-small", "radius = {radius:g}: must be at least {half:g}, half the distance of the ends"
)


def arc_between(x0: float, y0: float, x1: float, y1: float, radius: float, *, outward: bool, slack: float = 0.0) -> Arc:
    """The arc of at most half a turn from (x0, y0) to (x1, y1).

    ``outward``: bulging away from (0, 0), else towards it; where the chord points at (0, 0), outward is clockwise. A radius
    that is up to ``slack`` too small to reach is taken as half the distance. `Misuse` where there is no such arc.
    """
    _check(radius)
    chord = length(x1 - x0, y1 - y0)
    half = 0.5 * chord
    if chord == 0.0:
        raise Misuse(ARC_WITHOUT_END())
    if radius < half:
        if half - radius > slack:
            raise Misuse(RADIUS_IS_TOO_SMALL(radius=radius, half=half))
        radius = half
    # The unit vector to the left of the chord decides on which side of it the origin is.
    left_x, left_y = (y0 - y1) / chord, (x1 - x0) / chord
    middle_x, middle_y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    clockwise = (left_x * middle_x + left_y * middle_y >= 0.0) is outward
    bulge = 1.0 if clockwise else -1.0
    rise = sqrt(max((radius - half) * (radius + half), 0.0))
    centre_x, centre_y = middle_x - bulge * left_x * rise, middle_y - bulge * left_y * rise
    # The angle follows from both legs of the triangle: its sine alone loses half the digits of an arc of nearly half a turn.
    sweep_q = 2.0 * direction(rise, half)
    return Arc(centre_x, centre_y, radius, direction(x0 - centre_x, y0 - centre_y), -bulge * sweep_q)


WRONG_RADIUS = Message("motion.wrong-radius", "radius = {radius:g}: must be greater than 0")
WRONG_ANGLE = Message("motion.wrong-angle", "angle = {angle:g}°: must be within ±{most}°")


def _check(radius: float, sweep_q: float = 0.0) -> None:
    if not 0.0 < radius < inf:
        raise Misuse(WRONG_RADIUS(radius=radius))
    if not abs(sweep_q) <= 4 * MOST_TURNS:
        raise Misuse(WRONG_ANGLE(angle=90 * sweep_q, most=360 * MOST_TURNS))


# ---------------------------------------------------------------------- curves of one axis


@dataclass(frozen=True, slots=True)
class Straight:
    """One axis along a line. It is at ``origin_p`` where the path begins and moves ``slope`` pulses per unit of the path."""

    origin_p: float
    slope: float

    def position(self, w: float) -> float:
        return self.origin_p + self.slope * w

    def first_beyond(self, edge_p: float, side: int, begin_w: float, end_w: float) -> float | None:
        """Position along the path at which the axis first goes beyond ``edge_p`` towards ``side`` (±1); None if it does not."""
        if self.slope * side <= 0.0 or (self.position(end_w) - edge_p) * side <= BEYOND_P:
            return None
        return max((edge_p - self.origin_p) / self.slope, begin_w)

    def profile(self, travel: Profile, count: int, final: int | None) -> Profile:
        """The profile of the axis that stands at ``count`` when the travel begins; it ends at ``final``, if that is given."""
        origin = self.origin_p - count + self.slope * travel.base
        end_p = origin + self.slope * travel.final_p if final is None else float(final - count)
        if self.slope == 0.0:
            return Profile(travel.start, count, (), end_p)
        k = self.slope
        sign = 1 if k > 0.0 else -1
        segments = [
            Segment(s.end_s, s.anchor_s, origin + k * s.c0, k * s.c1, k * s.c2, k * s.c3, sign * s.direction)
            for s in travel.segments
        ]
        if segments and segments[-1].anchor_s == segments[-1].end_s:
            segments[-1].c0 = end_p
        return Profile(travel.start, count, tuple(segments), end_p)


@dataclass(frozen=True, slots=True)
class Circular:
    """One axis along an arc: ``centre_p + radius_p · cos(angle_q + turn_q · w)``."""

    centre_p: float
    radius_p: float
    angle_q: float
    turn_q: float

    def position(self, w: float) -> float:
        return self.centre_p + self.radius_p * cosine(self.angle_q + self.turn_q * w)

    def first_beyond(self, edge_p: float, side: int, begin_w: float, end_w: float) -> float | None:
        """As `Straight.first_beyond`."""
        for section in self.sections(begin_w, end_w):
            if section.direction != side or (section.end_p - edge_p) * side <= BEYOND_P:
                continue
            if (self.position(section.begin_w) - edge_p) * side >= 0.0:
                return section.begin_w
            return min(max((_angle_q(self, section.half, edge_p) - self.angle_q) / self.turn_q, section.begin_w), section.end_w)
        return None

    def sections(self, begin_w: float, end_w: float) -> Iterator[ArcSection]:
        """The intervals in which the axis moves in one direction, in order."""
        forward = self.turn_q > 0.0
        angle_q = self.angle_q + self.turn_q * begin_w
        half = floor(0.5 * angle_q)
        if not forward and angle_q == 2.0 * half:
            half -= 1
        while begin_w < end_w:
            turning_q = 2.0 * (half + 1 if forward else half)
            until_w = (turning_q - self.angle_q) / self.turn_q
            falls = (half & 1 == 0) is forward
            if until_w >= end_w:
                yield ArcSection(begin_w, end_w, half, -1 if falls else 1, self.position(end_w))
                return
            if until_w > begin_w:
                yield ArcSection(
                    begin_w, until_w, half, -1 if falls else 1, self.centre_p + self.radius_p * (-1.0 if falls else 1.0)
                )
            begin_w = until_w
            half += 1 if forward else -1

    def profile(self, travel: Profile, count: int, final: int | None) -> ArcProfile:
        """As `Straight.profile`."""
        local = Circular(self.centre_p - count, self.radius_p, self.angle_q + self.turn_q * travel.base, self.turn_q)
        segments: list[ArcSegment] = []
        begin_w = travel.segments[0].position(0.0) if travel.segments else travel.final_p
        for i, s in enumerate(travel.segments):
            end_w = travel.final_p if i == len(travel.segments) - 1 else s.position(s.end_s)
            for section in local.sections(begin_w, end_w):
                end_s = s.end_s if section.end_w >= end_w else s.when(section.end_w)
                segments.append(ArcSegment(end_s, section.direction, s, local, section.half, section.end_p))
            begin_w = end_w
        if travel.segments and (not segments or segments[-1].end_s < travel.segments[-1].end_s):
            # The last interval is too short to lead anywhere, but it takes its time.
            s = travel.segments[-1]
            half = floor(0.5 * (local.angle_q + local.turn_q * begin_w))
            falls = (half & 1 == 0) is (local.turn_q > 0.0)
            segments.append(ArcSegment(s.end_s, -1 if falls else 1, s, local, half, local.position(begin_w)))
        profile = ArcProfile(travel.start, count, tuple(segments), local.position(travel.final_p))
        if final is None:
            return profile
        missing = final - count - profile.counts[-1]
        if segments and missing * segments[-1].direction < 0:
            # The axis has just turned round and lacks a pulse, which comes at the very end.
            segments.append(replace(segments[-1], direction=-segments[-1].direction))
        return ArcProfile(travel.start, count, tuple(segments), float(final - count))


class ArcSection(NamedTuple):
    """An interval of a `Circular` curve in which the axis does not turn round.

    The angle is between ``2 · half`` and ``2 · half + 2`` quarter turns; the axis goes in ``direction`` to ``end_p``.
    """

    begin_w: float
    end_w: float
    half: int
    direction: int
    end_p: float


def _angle_q(curve: Circular, half: int, position: float) -> float:
    """The angle within ``half`` at which the axis is at ``position``; beyond a turning point, that point.

    `steptwin.motion.pulses` does the same operations in the same order.
    """
    x = (position - curve.centre_p) / curve.radius_p
    x = min(max(x, -1.0), 1.0)
    angle_q = 2.0 * arcsine_below_45(sqrt(0.5 * (1.0 - abs(x))), sqrt)
    if (x < 0.0) is (half & 1 == 0):
        angle_q = 2.0 - angle_q
    return 2.0 * half + angle_q


@dataclass(slots=True)
class ArcSegment:
    """An interval of an arc in which neither the axis turns round nor the acceleration of the travel changes. Immutable.

    Answers as a `Segment` does.
    """

    end_s: float
    direction: int
    travel: Segment
    curve: Circular
    half: int
    """As in `ArcSection`."""
    end_p: float

    def position(self, t_s: float) -> float:
        return self.curve.position(self.travel.position(t_s))

    def velocity(self, t_s: float) -> float:
        curve = self.curve
        angle_q = curve.angle_q + curve.turn_q * self.travel.position(t_s)
        return -curve.radius_p * sine(angle_q) * QUARTER * curve.turn_q * self.travel.velocity(t_s)

    def when(self, position: float) -> float:
        """Seconds at which the axis is at ``position``."""
        curve = self.curve
        return self.travel.when((_angle_q(curve, self.half, position) - curve.angle_q) / curve.turn_q)


class ArcProfile(Profile):
    """One axis along an arc. Pulses and rounding are those of `Profile`."""

    __slots__ = ()

    segments: Any
    """`ArcSegment`s, which have the methods of a `Segment`."""

    def __init__(self, start: Nanos, base: int, segments: Any, final_p: float) -> None:
        super().__init__(start, base, segments, final_p)

    def position(self, now: Nanos) -> float:
        n = now - self.start
        for s, end in zip(self.segments, self.ends, strict=True):
            if n < end:
                return self.base + s.position(n / 1e9)
        return self.base + self.final_p

    def velocity(self, now: Nanos) -> float:
        n = now - self.start
        for s, end in zip(self.segments, self.ends, strict=True):
            if n < end:
                return s.velocity(n / 1e9)
        return 0.0

    def count(self, now: Nanos) -> int:
        n = now - self.start
        for i, end in enumerate(self.ends):
            if n < end:
                s = self.segments[i]
                p = s.position(n / 1e9)
                reached = floor(p) if s.direction > 0 else ceil(p)
                if abs(p - round(p)) < NEAR_P:
                    reached = self._count_near(i, p, n)
                count = self.counts[i]
                return self.base + (reached if (reached - count) * s.direction > 0 else count)
        return self.base + self.counts[-1]
