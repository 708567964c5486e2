"""A belt in space: where its workpieces are, and how others are put on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from math import floor

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.conveyor import CONVEYOR, Conveyor
from steptwin.simulation.components.frames import Frames, check_upright, sources_of
from steptwin.simulation.components.mount import UPRIGHT, to_nm
from steptwin.simulation.components.workpieces import REACH_NM, Lie, body_in
from steptwin.simulation.mechanics.belt import Belt, BeltDrive, ConstantDrive, Placed
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.frames import (
    NM_PER_MM,
    Direction,
    Frame,
    Joint,
    Vector,
    X,
    in_plane,
    out_of_plane,
    path,
    placement,
    pose,
)
from steptwin.simulation.space.pieces import (
    Gear,
    Motion,
    Piece,
    StillPiece,
    gear_of,
    geared,
    pieces_of_drive,
    pieces_of_trajectory,
    standing,
    summed,
)

FAR_ASIDE_NM = 10 * 10**9
EDGE_NM = 2
"""Beyond the edge of a belt, which belongs to it: there a workpiece has left it, whatever is rounded."""
TURNS_AGAINST = Message(
    "simulation.turns-against-a-belt", "{pusher!r} pushes, but {name!r} turns it against {belt!r}: what pushes moves straight"
)


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
        length = to_nm(spec.length)
        box = self._box(length // 2, to_nm(spec.width) // 2, 0)
        self._left = Direction(1 - self._along.axis, self._along.sign if self._along.axis == X else -self._along.sign)
        self._pushing: dict[str, Motion] = {}
        self._pushers: dict[str, Body] = {}
        conveyor.belt.across_at = self._across_at
        conveyor.belt.is_in_the_way = self._is_in_the_way
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
    def name(self) -> str:
        return self._conveyor.spec.name

    @property
    def scheduler(self) -> Scheduler:
        return self._conveyor.block.scheduler

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
        frame, at = self._carried(belt, placed, self._pushed(placed))
        return body_in(placed.workpiece, frame, Lie(at, self._belt_q + placed.yaw_q))

    def _carried(self, belt: Belt, placed: Placed, frame: Frame) -> tuple[Frame, Vector]:
        """The frame that carries a workpiece along the belt, and where it is on that."""
        way = -placed.workpiece.extent(placed.yaw_q) // 2
        if placed.held is not None:
            return frame, self._at(belt.to_nm(placed.held) + way, placed.across)
        per_step = NM_PER_MM / belt.per_mm
        motion = belt_motion(belt, per_step, float(way - placed.origin * per_step))
        joint = Joint(motion, self._along, signal=f"{self.name}.travel")
        return Frame(f"{placed.workpiece.name}.belt", frame, self._at(0, placed.across), joint), (0, 0, 0)

    # ------------------------------------------------------------------ pushing across

    @property
    def conveyor(self) -> Conveyor:
        return self._conveyor

    @property
    def frame(self) -> Frame:
        return self._frame

    def joints_to(self, pusher: str) -> Iterator[tuple[Frame, int]]:
        """Frames that move a pusher across the belt, and whether to the left (+1) or to the right (-1). Raises `Misuse` for one
        that turns against the belt."""
        for step in path(self._frame, self._frames[pusher].frame):
            if step.turns:
                raise Misuse(TURNS_AGAINST(pusher=pusher, name=step.frame.name, belt=self._conveyor.spec.name))
            if step.joint is not None and step.joint.along.axis == self._left.axis:
                yield step.frame, self._left.sign * step.joint.along.sign * (-1 if step.is_back else 1)

    @property
    def pushers(self) -> Mapping[str, Body]:
        return self._pushers

    def add_pusher(self, pusher: Body) -> None:
        """Raises `Misuse` for one that turns against the belt."""
        self.pushing(pusher.name)
        self._pushers[pusher.name] = pusher

    def _is_in_the_way(self, placed: Placed, now: Nanos) -> bool:
        room = self.rectangle(placed)
        return any(Pair(pusher, room).overlap(now) for pusher in self._pushers.values())

    def pushing(self, pusher: str) -> Motion:
        """How a pusher moves to the left."""
        if pusher not in self._pushing:
            joints = ((frame.joint, sign) for frame, sign in self.joints_to(pusher))
            parts = [(joint.motion, Gear(float(sign))) for joint, sign in joints if joint is not None]
            self._pushing[pusher] = Motion(
                lambda: tuple(motion.version() for motion, _ in parts),
                lambda now: summed([geared(motion.pieces(now), gear) for motion, gear in parts]),
            )
        return self._pushing[pusher]

    def gaining(self, pusher: str, other: str) -> Motion:
        """How a pusher moves to the left against another one, or (an empty name) against the belt."""
        own = self.pushing(pusher)
        if not other:
            return own
        its = self.pushing(other)
        return Motion(
            lambda: (own.version(), its.version()),
            lambda now: summed([own.pieces(now), geared(its.pieces(now), Gear(-1.0))]),
        )

    def way(self, pusher: str, placed: Placed, now: Nanos) -> int:
        """To which side of the belt one pushes a workpiece: left (+1) or right (-1)."""
        return 1 if self.in_belt(self.rectangle(placed), now)[1] > self.in_belt(self._pushers[pusher], now)[1] else -1

    def _pushed(self, placed: Placed) -> Frame:
        """The frame across which a workpiece is as its table says."""
        frame = self._frame
        for mover, sign in self.joints_to(placed.pusher) if placed.pusher else ():
            if mover.joint is not None:
                along = Direction(self._left.axis, self._left.sign * sign)
                frame = Frame(f"{placed.workpiece.name}.push", frame, (0, 0, 0), mover.joint._replace(along=along))
        return frame

    def _across_at(self, placed: Placed, now: Nanos) -> int:
        return placed.across + (floor(self.pushing(placed.pusher).at(now) + 0.5) if placed.pusher else 0)

    def placed(self, name: str) -> Placed | None:
        """The workpiece called ``name``, if it is here."""
        return next((one for one in self._conveyor.belt.workpieces if one.workpiece.name == name), None)

    def rectangle(self, placed: Placed, along: int = 0, across: int = 0) -> Body:
        """The space that a workpiece takes along and across the belt, moved by so many nm."""
        return self._space(placed, self._pushed(placed), self._at(along, across), placed.width // 2)

    def lane(self, placed: Placed) -> Body:
        """The space that it takes along the belt, whatever is beside it."""
        return self._space(placed, self._frame, (0, 0, 0), FAR_ASIDE_NM)

    def entry(self, now: Nanos) -> Body:
        """The space that the next workpiece takes at the beginning."""
        return self.rectangle(self._conveyor.next_at(0, now))

    def strip(self, placed: Placed) -> Body:
        """The width that it takes, all along the belt."""
        x, y, _ = self._at(0, placed.across)
        return Body(placed.workpiece.name, self._pushed(placed), self._box(FAR_ASIDE_NM, placed.width // 2, 1), (x, y, 0))

    def _space(self, placed: Placed, frame: Frame, shift: Vector, across: int) -> Body:
        frame, at = self._carried(self._conveyor.belt, placed, frame)
        workpiece = placed.workpiece
        x, y, z = (one + other for one, other in zip(at, shift, strict=True))
        half = workpiece.height // 2
        return Body(workpiece.name, frame, self._box(workpiece.extent(placed.yaw_q) // 2, across, half), (x, y, z + half))

    @property
    def surface(self) -> Body:
        """The belt and all before and behind it, above which a workpiece has its middle until it is pushed off."""
        return Body(self._top.name, self._frame, self._box(FAR_ASIDE_NM, to_nm(self._conveyor.spec.width) // 2 + EDGE_NM, 1))

    def _box(self, along: int, across: int, up: int) -> Box:
        return Box((along, across, up) if self._along.axis == X else (across, along, up))

    def in_belt(self, body: Body, now: Nanos) -> tuple[float, float]:
        """How far the middle of a body is along the belt, and to its left, nm."""
        axis, at = placement(body.frame, self._frame, now)
        x, y, _ = out_of_plane(at.of(in_plane(body.centre, axis)), axis)
        sign = self._along.sign
        return (sign * x, sign * y) if self._along.axis == X else (sign * y, -sign * x)

    def halves(self, body: Body) -> tuple[int, int]:
        """How far a box reaches along and across the belt from its middle."""
        x, y = body.shape.half[:2] if isinstance(body.shape, Box) else (body.shape.radius, body.shape.radius)
        return (x, y) if self._along.axis == X else (y, x)

    # ------------------------------------------------------------------ its end

    def beyond_end(self, placed: Placed, now: Nanos) -> Frame | None:
        """Where a workpiece is when its middle has left the end of the belt; None where the following belt begins there now: not
        more than 2 mm lower or higher, and no farther away than it is long, besides half of both widths."""
        following, spec = self._conveyor.following, self._conveyor.spec
        if following is None or following.spec.name not in self._frames:
            return None
        beginning, end = self._frames.base(following.spec.name), self._at(to_nm(spec.length), 0)
        x, y, z = (there - here for there, here in zip(pose(beginning, self._frame, now).at, end, strict=True))
        room = placed.workpiece.length + (to_nm(spec.width) + to_nm(following.spec.width)) // 2
        if abs(z) <= REACH_NM and max(abs(x), abs(y)) <= room:
            return None
        at = self._at(to_nm(spec.length) + EDGE_NM, self._across_at(placed, now))
        return Frame(placed.workpiece.name, self._frame, at, Joint(standing(self._belt_q + placed.yaw_q), UPRIGHT, turns=True))

    # ------------------------------------------------------------------ taking and putting

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
        return pieces_of_trajectory(drive.trajectory(now), now)
    if isinstance(drive, ConstantDrive | RampedDrive):
        return pieces_of_drive(drive, now)
    return iter((StillPiece(now, None, float(drive.grid_position(now))),))


def add_belts(objects: BuiltObjects) -> None:
    """Add the conveyors that have a place to what has workpieces in space, unless they are there."""
    workpieces, frames = objects.workpieces, objects.frames
    if not workpieces.of(BeltSpace):
        workpieces.holders += (BeltSpace(one, frames) for name, one in objects.built(CONVEYOR).items() if name in frames)
