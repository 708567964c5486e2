"""A belt in space: where its workpieces are, and how others are put on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction

from steptwin.controller import SECOND, Nanos
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.conveyor import CONVEYOR, Conveyor
from steptwin.simulation.components.frames import Frames, check_upright, sources_of
from steptwin.simulation.components.mount import to_nm
from steptwin.simulation.components.workpieces import Lie, body_in
from steptwin.simulation.mechanics.belt import Belt, BeltDrive, ConstantDrive, Placed
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.frames import NM_PER_MM, Frame, Joint, Vector, X
from steptwin.simulation.space.pieces import Motion, Piece, SteadyPiece, StillPiece, gear_of, geared, pieces_of_trajectory


class BeltSpace:
    """A `steptwin.simulation.components.workpieces.Holder`: a conveyor that has a place.

    Along the belt a workpiece is where that has its front; across it, and about z, it stays as it was put.
    """

    def __init__(self, conveyor: Conveyor, frames: Frames) -> None:
        self._conveyor = conveyor
        self._frames = frames
        spec = conveyor.spec
        self._frame = frames.base(spec.name)
        check_upright(spec.name, self._frame)
        self._along = spec.towards()
        self._belt_q = float((self._along.axis + 2 * (self._along.sign < 0)) % 4)
        """The direction of the belt, quarter turns from +x."""
        half, length = to_nm(spec.width) // 2, to_nm(spec.length)
        box = Box((length // 2, half, 0) if self._along.axis == X else (half, length // 2, 0))
        self._top = Body(spec.name, self._frame, box, self._at(length // 2, 0))
        self._made: dict[Placed, Body] = {}

    def _at(self, along: int, across: int) -> Vector:
        """A point of the belt: so far along it, and to its left."""
        axis, sign = self._along
        return (sign * along, sign * across, 0) if axis == X else (-sign * across, sign * along, 0)

    def _on_belt(self, at: Vector) -> tuple[int, int]:
        """The reverse of `_at`."""
        (axis, sign), (x, y, _) = self._along, at
        return (sign * x, sign * y) if axis == X else (sign * y, -sign * x)

    # ------------------------------------------------------------------ a holder

    @property
    def sources(self) -> Iterable[str]:
        conveyor = self._conveyor
        return (*conveyor.depends_on, *sources_of(self._frames.carrying(self._frame)))

    def version(self) -> object:
        return self._conveyor.belt.workpieces

    def supports(self) -> Iterable[Body]:
        return (self._top,)

    def bodies(self) -> Mapping[str, Body]:
        belt = self._conveyor.belt
        self._made = {placed: self._made.get(placed) or self._body(belt, placed) for placed in belt.workpieces}
        return {placed.workpiece.name: body for placed, body in self._made.items()}

    def _body(self, belt: Belt, placed: Placed) -> Body:
        frame, way = self._frame, -placed.workpiece.extent(placed.yaw_q) // 2
        if placed.held is not None:
            at = self._at(belt.to_nm(placed.held) + way, placed.across)
        else:
            per_step = NM_PER_MM / belt.per_mm
            motion = belt_motion(belt, per_step, float(way - placed.origin * per_step))
            frame = Frame(f"{placed.workpiece.name}.belt", frame, self._at(0, placed.across), Joint(motion, self._along))
            at = (0, 0, 0)
        return body_in(placed.workpiece, frame, Lie(at, self._belt_q + placed.yaw_q))

    def take(self, name: str, now: Nanos) -> Workpiece:
        (found,) = (placed for placed in self._conveyor.belt.workpieces if placed.workpiece.name == name)
        self._conveyor.remove(self._conveyor.belt, found)
        return found.workpiece

    def put(self, workpiece: Workpiece, on: Body, lie: Lie, now: Nanos) -> bool:
        along, across = self._on_belt(lie.at)
        yaw_q = lie.yaw_q - self._belt_q
        front = self._conveyor.belt.from_nm(along + workpiece.extent(yaw_q) // 2)
        return self._conveyor.lay(workpiece, front, now, across, yaw_q)


def belt_motion(belt: Belt, per_step: Fraction, shift: float) -> Motion:
    """The motion of what a belt moves, ``per_step`` nm for a step of its drive."""
    gear = gear_of(per_step, shift)
    return Motion(belt.drive.version, lambda now: geared(_pieces_of_drive(belt.drive, now), gear))


def _pieces_of_drive(drive: BeltDrive, now: Nanos) -> Iterator[Piece]:
    """Steps of a drive."""
    if isinstance(drive, Mechanism):
        yield from pieces_of_trajectory(drive.trajectory(now), now)
        return
    if isinstance(drive, RampedDrive) and now < (straight := drive.straight_from()):
        rate, acceleration = float(drive.whole_speed * SECOND), float(drive.acceleration * SECOND * SECOND)
        yield SteadyPiece(now, straight, drive.grid_position, rate, acceleration)
        now = straight
    if isinstance(drive, ConstantDrive | RampedDrive) and drive.runs:
        yield SteadyPiece(now, None, drive.grid_position, float(drive.whole_speed * SECOND))
    else:
        yield StillPiece(now, None, float(drive.grid_position(now)))


def add_belts(objects: BuiltObjects) -> None:
    """Add the conveyors that have a place to what has workpieces in space, unless they are there."""
    holders, frames = objects.workpieces.holders, objects.frames
    if not any(isinstance(one, BeltSpace) for one in holders):
        holders += (BeltSpace(one, frames) for name, one in objects.built(CONVEYOR).items() if name in frames)
