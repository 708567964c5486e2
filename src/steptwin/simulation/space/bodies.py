"""Boxes and upright cylinders on frames, and how far two of them are apart. Sizes in whole nm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple, TypeAlias

from steptwin.errors import Misuse
from steptwin.motion.trig import cosine, length, sine
from steptwin.simulation.space.frames import AXES, Frame, Placement, Vector, Z, in_plane

Unit: TypeAlias = tuple[float, float, float]
"""A unit vector, in the plane or along its axis."""


class Box(NamedTuple):
    """``half`` of its length along each axis. One of 0 makes it flat, two of 0 a line, such as the beam of a sensor."""

    half: Vector


class Cylinder(NamedTuple):
    """Upright on its frame; ``half`` of its height."""

    radius: int
    half: int


Shape: TypeAlias = Box | Cylinder


def half_height(shape: Shape) -> int:
    return shape.half[2] if isinstance(shape, Box) else shape.half


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    name: str
    frame: Frame
    shape: Shape
    centre: Vector = (0, 0, 0)

    def is_on(self, frame: Frame) -> bool:
        """Whether a frame carries it, perhaps through others."""
        return any(one is frame for one in self.frame.line())


class Outline(NamedTuple):
    """A body as seen along an axis: a rectangle with these halves, or a disc, where they are 0; and its half along the axis."""

    half_u: float
    half_v: float
    half_w: float
    radius: float = 0.0

    @property
    def reach(self) -> float:
        """From the centre to what is farthest from it in the plane."""
        return length(self.half_u, self.half_v) + self.radius


def outline(body: Body, axis: int) -> Outline:
    """Raises `Misuse` for a cylinder that does not stand along the axis."""
    shape = body.shape
    if isinstance(shape, Box):
        return Outline(*in_plane(shape.half, axis))
    if axis != Z:
        raise Misuse(f"{body.name} is a cylinder along z: what turns about {AXES[axis]} is only compared with boxes")
    return Outline(0, 0, shape.half, shape.radius)


class Placed(NamedTuple):
    """An outline with its centre and the direction of its u."""

    outline: Outline
    place: tuple[float, float, float]
    cosine: float
    sine: float

    @staticmethod
    def at(its: Outline, centre: Sequence[float], placement: Placement) -> Placed:
        """``centre`` in its frame, which is at ``placement``."""
        return Placed(its, placement.of(centre), cosine(placement.angle_q), sine(placement.angle_q))

    @property
    def sides(self) -> tuple[Unit, Unit]:
        """Across its sides."""
        return (self.cosine, self.sine, 0.0), (-self.sine, self.cosine, 0.0)

    def half_along(self, u: float, v: float) -> float:
        """How far it reaches from its centre in a direction of the plane."""
        its, c, s = self.outline, self.cosine, self.sine
        return its.half_u * abs(c * u + s * v) + its.half_v * abs(c * v - s * u) + its.radius

    def corners(self) -> list[tuple[float, float]]:
        its, c, s, (u, v, _) = self.outline, self.cosine, self.sine, self.place
        halves = [(x, y) for x in (its.half_u, -its.half_u) for y in (its.half_v, -its.half_v)]
        return [(u + c * x - s * y, v + s * x + c * y) for x, y in halves]

    def corner_from(self, u: float, v: float) -> tuple[float, float]:
        """From the nearest point of its rectangle to the place (u, v)."""
        its, c, s = self.outline, self.cosine, self.sine
        u, v = u - self.place[0], v - self.place[1]
        x, y = c * u + s * v, c * v - s * u
        x -= min(max(x, -its.half_u), its.half_u)
        y -= min(max(y, -its.half_v), its.half_v)
        return c * x - s * y, s * x + c * y


class Gap(NamedTuple):
    """``apart`` nm along ``direction``, from the first body to the second; negative where they overlap."""

    apart: float
    direction: Unit


def gap_along(direction: Unit, one: Placed, other: Placed) -> float:
    """How far two bodies are apart along a direction."""
    u, v, w = direction
    if w != 0.0:
        return (other.place[2] - one.place[2]) * w - one.outline.half_w - other.outline.half_w
    way = (other.place[0] - one.place[0]) * u + (other.place[1] - one.place[1]) * v
    return way - one.half_along(u, v) - other.half_along(u, v)


def gap(one: Placed, other: Placed) -> Gap:
    """Along the direction in which they are farthest apart, or overlap least."""
    across, along = gap_across(one, other), apart_along_axis(one, other)
    if across.apart > along:
        return across
    return Gap(along, (0.0, 0.0, 1.0 if other.place[2] >= one.place[2] else -1.0))


def gap_across(one: Placed, other: Placed) -> Gap:
    """In the plane. Rectangles are apart along a normal of one of their sides if they are apart at all; a disc and a corner may
    be so along the way between them only."""
    du, dv = other.place[0] - one.place[0], other.place[1] - one.place[1]
    found = Gap(-inf, (1.0, 0.0, 0.0))
    for its in (one, other):
        for u, v, _ in its.sides:
            way = du * u + dv * v
            apart = abs(way) - one.half_along(u, v) - other.half_along(u, v)
            if apart > found.apart:
                found = Gap(apart, (u, v, 0.0) if way >= 0.0 else (-u, -v, 0.0))
    radius = one.outline.radius + other.outline.radius
    if radius:
        u, v = one.corner_from(*other.place[:2]) if other.outline.radius else other.corner_from(*one.place[:2])
        if not other.outline.radius:
            u, v = -u, -v
        far = length(u, v)
        if far - radius > found.apart and far > 0.0:
            found = Gap(far - radius, (u / far, v / far, 0.0))
    return found


def apart_along_axis(one: Placed, other: Placed) -> float:
    return abs(other.place[2] - one.place[2]) - one.outline.half_w - other.outline.half_w


def most_apart(one: Placed, other: Placed, one_then: Placed, other_then: Placed) -> float:
    """How far another body is beyond the sides of one, in the plane, at two moments: for each side the corner that is nearest to
    it at both; a disc by its distance.

    Between these moments each of those goes a way of its own. Rectangles overlap while one of the corners is behind each side.
    """
    radius = one.outline.radius + other.outline.radius
    if radius:
        if one.outline.radius and not other.outline.radius:
            return -inf  # the sides of the other one decide
        return max(length(*a.corner_from(*b.place[:2])) for a, b in ((one, other), (one_then, other_then))) - radius
    sides = zip(_beyond_sides(one, other), _beyond_sides(one_then, other_then), strict=True)
    return max(min(map(max, *its)) for its in sides)


def _beyond_sides(one: Placed, other: Placed) -> list[list[float]]:
    """How far each corner of another rectangle is beyond each side of one."""
    its, c, s, (u, v, _) = one.outline, one.cosine, one.sine, one.place
    local = [(c * (x - u) + s * (y - v), c * (y - v) - s * (x - u)) for x, y in other.corners()]
    return [
        [sign * corner[n] - half for corner in local] for n, half in enumerate((its.half_u, its.half_v)) for sign in (1.0, -1.0)
    ]


def contains(outer: Placed, inner: Placed) -> bool:
    """Whether a body lies inside another; faces may be common."""
    its, (u, v, w), radius = outer.outline, outer.place, inner.outline.radius
    if abs(inner.place[2] - w) + inner.outline.half_w > its.half_w:
        return False
    corners = [(x - u, y - v) for x, y in inner.corners()]
    if its.radius:
        return all(length(x, y) + radius <= its.radius for x, y in corners)
    c, s = outer.cosine, outer.sine
    return all(abs(c * x + s * y) + radius <= its.half_u and abs(c * y - s * x) + radius <= its.half_v for x, y in corners)


OVERLAP_NM = -0.5
"""Bodies overlap that are less than this apart: by half of the unit of poses, so that faces that touch do not."""
