"""Top faces: what a suction cup can hold, and what carries what is put down."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.space.bodies import Body, Box, half_height
from steptwin.simulation.space.frames import TURN_Q, Frame, Vector, Z, in_plane, placement, whole


class Above(NamedTuple):
    """A point is ``gap`` nm above the top face of a body."""

    gap: int
    body: Body


def height_over(body: Body, frame: Frame, point: Vector, now: Nanos, radius: int = 0) -> int | None:
    """How far a point of a frame is above the top face of a body, nm; negative: below. None where the disc about it does not lie
    within that face, whose edge belongs to it, and where the face is not level with the disc."""
    axis, at = placement(frame, body.frame, now)
    if axis != Z and at.angle_q % TURN_Q:
        return None
    x, y, z = (p - c for p, c in zip(whole(at.of(in_plane(point, axis)), axis), body.centre, strict=True))
    shape = body.shape
    if isinstance(shape, Box):
        half_x, half_y, half_z = shape.half
        return z - half_z if abs(x) + radius <= half_x and abs(y) + radius <= half_y else None
    room = shape.radius - radius
    return z - shape.half if room >= 0 and x * x + y * y <= room * room else None


def top_below(bodies: Iterable[Body], frame: Frame, point: Vector, now: Nanos) -> Above | None:
    """The highest top face that a point of a frame is on or above. Of those that are equally high, a mere face, such as a nest on
    a plate, is before a body; then the name that is first."""
    found: Above | None = None
    for body in sorted(bodies, key=lambda one: (half_height(one.shape) > 0, one.name)):
        gap = height_over(body, frame, point, now)
        if gap is not None and gap >= 0 and (found is None or gap < found.gap):
            found = Above(gap, body)
    return found
