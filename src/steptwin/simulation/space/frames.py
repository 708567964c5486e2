"""A tree of frames: where things are, and how they are carried. Positions in whole nm, angles in quarter turns.

The floor is right-handed, z up. A frame has its origin at a fixed place of the frame that it is on; a joint moves it along an
axis of that frame, or turns it about one. What is common to two frames is never calculated: their relative pose is that along the
path between them, as seen from the last frame that both are on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.motion.trig import cosine, sine
from steptwin.simulation.space.pieces import Motion

NM_PER_MM = 10**6
X, Y, Z = range(3)
AXES = "xyz"
TURN_Q = 4
"""Quarter turns in a turn."""

Vector: TypeAlias = tuple[int, int, int]
"""nm."""


class Direction(NamedTuple):
    """``+x``: axis 0, sign 1."""

    axis: int
    sign: int

    def __str__(self) -> str:
        return f"{'+' if self.sign > 0 else '-'}{AXES[self.axis]}"


class Joint(NamedTuple):
    """``motion`` moves along ``along``, in nm, or turns about it, in quarter turns."""

    motion: Motion
    along: Direction
    turns: bool = False
    signal: str = ""
    """Signal of its position; empty: none has it."""
    per_unit: float = 1.0
    """mm, or degrees, for a unit of that."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """``on``: the frame that it is on; None for the floor. ``at``: its origin there, while its joint is at 0."""

    name: str
    on: Frame | None
    at: Vector = (0, 0, 0)
    joint: Joint | None = None

    def line(self) -> list[Frame]:
        """Itself and all that it is on, up to the floor."""
        found: list[Frame] = [self]
        while (on := found[-1].on) is not None:
            found.append(on)
        return found


FLOOR = Frame("floor", None)


class Step(NamedTuple):
    """A step of a path: out to ``frame`` from what it is on, or back."""

    frame: Frame
    is_back: bool

    @property
    def joint(self) -> Joint | None:
        return self.frame.joint

    @property
    def motion(self) -> Motion | None:
        return None if self.frame.joint is None else self.frame.joint.motion

    @property
    def turns(self) -> bool:
        return self.frame.joint is not None and self.frame.joint.turns

    def reverse(self) -> Step:
        return Step(self.frame, not self.is_back)


def path(begin: Frame, end: Frame) -> list[Step]:
    """The way from one frame to another: back to the last frame that both are on, and out from there."""
    back, out = begin.line(), end.line()
    while back and out and back[-1] is out[-1]:
        back.pop()
        out.pop()
    return [*(Step(frame, is_back=True) for frame in back), *(Step(frame, is_back=False) for frame in reversed(out))]


NOT_PARALLEL = "{one} turns about {its} and {other} about {others}: turns are only compared where they are about one direction"


def turning_axis(steps: Sequence[Step]) -> int | None:
    """The axis about which frames of a path turn; None where none does. Raises `Misuse` where they turn about several."""
    turning = [step.frame for step in steps if step.turns]
    axes = [frame.joint.along.axis for frame in turning if frame.joint is not None]
    for frame, axis in zip(turning, axes, strict=True):
        if axis != axes[0]:
            raise Misuse(NOT_PARALLEL.format(one=turning[0].name, its=AXES[axes[0]], other=frame.name, others=AXES[axis]))
    return axes[0] if axes else None


class Placement(NamedTuple):
    """Where a frame is in another: its origin in nm, and the cosine and sine of its turn about one axis.

    The first two of ``place`` are in the plane of that turn, the third is along its axis: `in_plane`.
    """

    place: tuple[float, float, float]
    angle_q: float = 0.0

    def of(self, point: Sequence[float]) -> tuple[float, float, float]:
        """Where a point of that frame is."""
        (u, v, w), (du, dv, dw) = self.place, point
        if self.angle_q == 0.0:
            return u + du, v + dv, w + dw
        c, s = cosine(self.angle_q), sine(self.angle_q)
        return u + c * du - s * dv, v + s * du + c * dv, w + dw


HERE = Placement((0.0, 0.0, 0.0))


def in_plane(values: Sequence[float], axis: int) -> tuple[float, float, float]:
    """Three values by x, y and z, as those in the plane across an axis and that along it, right-handed."""
    return values[(axis + 1) % 3], values[(axis + 2) % 3], values[axis]


def out_of_plane(values: Sequence[float], axis: int) -> tuple[float, float, float]:
    """The opposite of `in_plane`."""
    return values[(2 - axis) % 3], values[(3 - axis) % 3], values[(4 - axis) % 3]


def along(steps: Sequence[Step], positions: Sequence[float], axis: int) -> list[Placement]:
    """Where each frame of a path is, seen from its beginning, which is the first. ``positions``: of the joint of each step, or
    anything."""
    at = HERE
    found = [at]
    for step, position in zip(steps, positions, strict=True):
        origin = in_plane(step.frame.at, axis)
        joint, sign = step.joint, -1 if step.is_back else 1
        angle_q = at.angle_q
        if joint is not None and joint.turns:
            angle_q += sign * joint.along.sign * position
        elif joint is not None:
            way = [0.0, 0.0, 0.0]
            way[joint.along.axis] = joint.along.sign * position
            shifts = in_plane(way, axis)
            origin = origin[0] + shifts[0], origin[1] + shifts[1], origin[2] + shifts[2]
        if step.is_back:
            origin = -origin[0], -origin[1], -origin[2]
            at = Placement(at.place, angle_q)
        at = Placement(at.of(origin), angle_q)
        found.append(at)
    return found


class Pose(NamedTuple):
    """Where a frame is in another. Turned by ``angle_q`` quarter turns about the axis ``about``."""

    at: Vector
    about: int = Z
    angle_q: float = 0.0


def placement(frame: Frame, seen_from: Frame, now: Nanos) -> tuple[int, Placement]:
    """The axis about which frames between them turn, z where none does, and where the first is in the plane across it. Raises
    `Misuse` where they turn about several axes."""
    steps = path(seen_from, frame)
    about = turning_axis(steps)
    axis = Z if about is None else about
    return axis, along(steps, [0.0 if step.motion is None else step.motion.at(now) for step in steps], axis)[-1]


def whole(values: Sequence[float], axis: int) -> Vector:
    """Values in the plane across an axis, rounded to whole nm, by x, y and z."""
    x, y, z = out_of_plane(values, axis)
    return floor(x + 0.5), floor(y + 0.5), floor(z + 0.5)


def pose(frame: Frame, seen_from: Frame, now: Nanos) -> Pose:
    """The pose of a frame in another, rounded once. As `placement`."""
    axis, at = placement(frame, seen_from, now)
    return Pose(whole(at.place, axis), axis, at.angle_q)
