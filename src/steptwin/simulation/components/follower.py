"""``[[follower]]``: a slide or lever that a cam disc on a shaft moves: its place is a table over the angle of the shaft."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import floor
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS, moves, turning_points_of_axis
from steptwin.simulation.components.coordinate import GRID_PER_UNIT
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.mount import Movement, MoverSpec
from steptwin.simulation.components.shaft import SHAFT, TURN, GearedShaft
from steptwin.simulation.components.switch import SwitchSpec, channel_of, put_switch, zone_of
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.cam import Cam
from steptwin.simulation.mechanics.channels import LIFT_SHARE, STUCK, MovedChannel
from steptwin.simulation.mechanics.drawing import ROD, Drawing
from steptwin.simulation.mechanics.scale import LENGTHS, exact_fraction
from steptwin.simulation.space.frames import NM_PER_MM
from steptwin.simulation.space.pieces import Motion, Piece, StillPiece, gear_of, geared, pieces_of_cam
from steptwin.simulation.toml.names import Unknown
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import NameOf, name_value, points, text_value
from steptwin.state import Stateful


@table("[[follower]]")
class FollowerSpec(NamedSpec, MoverSpec):
    name: str = key(name_value, "how conditions and faults name it")
    shaft: str = key(NameOf("shaft"), "the shaft that its cam disc is on")
    points: tuple[tuple[float, float], ...] = key(
        points, "[[degrees, lift], ...], linear between, also from the last to the first"
    )
    unit: str = key(text_value, "of its lift: mm, cm, m, degree or anything", default="mm")
    switches: tuple[SwitchSpec, ...] = tables_in("switch", SwitchSpec)

    @property
    def highest(self) -> float:
        return max(lift for _, lift in self.points)

    def check(self, text: TomlText) -> None:
        angles = [angle for angle, _ in self.points]
        where = (*self.path, "points")
        if len(angles) < 2 or not (angles[0] >= 0.0 and angles[-1] < TURN):
            text.wrong(where, "D007", f"{len(angles)} angles: a cam has at least two, from 0 to below {TURN} degrees")
        if min(lift for _, lift in self.points) < 0.0 or self.highest == 0.0:
            text.wrong(where, "D007", "lifts are counted from 0, and one of them is above 0")


class Follower(Stateful):
    """Is where the cam lifts it at the whole pulse of the axis that turns the shaft; it never leaves the cam."""

    FIXED: ClassVar[tuple[str, ...]] = ("_cam", "shaft", "spec")
    __slots__ = (*FIXED, "_held", "_share")

    def __init__(self, spec: FollowerSpec, shaft: GearedShaft, cam: Cam) -> None:
        self.spec = spec
        self.shaft = shaft
        self._cam = cam
        self._held: Fraction | None = None
        """Fault: the place at which it is stuck."""
        self._share = Fraction(1)
        """Fault: of its lift that a worn cam gives it."""

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        """It has no state of its own: the scheduler looks again at what depends on it."""

    def deadline(self) -> Nanos | None:
        """None: its motion is that of its axis."""
        return None

    # ------------------------------------------------------------------ the carriage of switches

    def version(self) -> object:
        return self.shaft.version(), self._held, self._share

    def lift(self, now: Nanos) -> Fraction:
        return self._cam.lift(self.shaft.grid_position(now)) * self._share if self._held is None else self._held

    def grid_position(self, now: Nanos) -> int:
        if self._held is None and self._share == 1:
            return self._cam.nearest(self.shaft.grid_position(now), GRID_PER_UNIT)
        return floor(self.lift(now) * GRID_PER_UNIT + Fraction(1, 2))

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        if self._held is not None or self._share == 0:
            return None
        level = Fraction(2 * position - direction, 2 * GRID_PER_UNIT) / self._share
        here, found = self.shaft.grid_position(after), []
        for heading in (1, -1):
            place = self._cam.next(level, here, direction, heading)
            if place is not None and (due := self.shaft.reaches(place, after, heading)) is not None:
                found.append(due)
        return min(found, default=None)

    def motion(self, nm_per_unit: Fraction) -> Motion:
        """In nm, at any place between the pulses of its axis."""

        def pieces(now: Nanos) -> Iterator[Piece]:
            if self._held is not None:
                yield StillPiece(now, None, float(self._held * nm_per_unit))
                return
            yield from geared(pieces_of_cam(self._cam, self.shaft.pieces(now)), gear_of(self._share * nm_per_unit))

        return Motion(self.version, pieces)

    # ------------------------------------------------------------------ signals and faults

    def position(self, now: Nanos) -> float:
        return float(self.lift(now))

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after ``now`` between which it moves one way."""
        if self._held is not None:
            return
        for leg in (*turning_points_of_axis(self.shaft.axis, now), None):
            yield from self._corners(now, leg)
            if leg is not None:
                yield leg
                now = leg

    def _corners(self, begin: Nanos, end: Nanos | None) -> Iterator[Nanos]:
        """When its axis, which goes one way from ``begin`` to ``end``, passes points of the cam, in one revolution."""
        here = self.shaft.grid_position(begin)
        for heading in (1, -1):
            now = begin
            for corner in self._cam.corners(here, heading):
                due = self.shaft.reaches(corner, now, heading)
                if due is None or (end is not None and due >= end):
                    break
                if due > now + 1:
                    yield due - 1
                yield due
                now = due

    def is_elsewhere(self, now: Nanos) -> bool:
        """Whether it is not where an unworn cam has it, or will be so by the motion of its axis."""
        return moves(self.shaft.axis, now) or self.lift(now) != self._cam.lift(self.shaft.grid_position(now))

    def hold(self, holds: bool, now: Nanos) -> None:
        self._held = self.lift(now) if holds else None
        self._report(STUCK, float(holds))

    def wear(self, share: float) -> None:
        self._share = exact_fraction(share)
        self._report(LIFT_SHARE, share)

    def _report(self, what: str, level: float) -> None:
        axis = self.shaft.axis
        axis.scheduler.record(axis.mechanism.controller, "edge", f"{self.spec.name}.{what}", level)

    @property
    def moved(self) -> tuple[str, MovedChannel]:
        axis, channel = self.shaft.moved
        points = tuple(sorted(self.spec.points))
        return axis, channel._replace(name=self.spec.name, signal="position", unit=self.spec.unit, points=points)

    @property
    def drawing(self) -> Drawing:
        return Drawing(ROD, self.spec.highest, ("position",), sensors=tuple(one.zone for one in self.spec.switches))


IS_STUCK = Message("simulation.follower-is-stuck", "{name} is stuck")
FOLLOWS_AGAIN = Message("simulation.follows-its-cam-again", "{name} follows its cam again")


def _stick(active: ActiveFault, follower: Follower, begins: bool, now: Nanos) -> str:
    follower.hold(begins, now)
    return (IS_STUCK if begins else FOLLOWS_AGAIN)(name=follower.spec.name)


def _is_elsewhere(active: ActiveFault, follower: Follower, now: Nanos) -> bool:
    return follower.is_elsewhere(now)


CAM_HAS_SHARE = Message("simulation.cam-has-share", "the cam of {name} has {share:g} of its lift")


def _wear(active: ActiveFault, follower: Follower, begins: bool, now: Nanos) -> str:
    share = active.fault.number("share") if begins else 1.0
    follower.wear(share)
    return CAM_HAS_SHARE(name=follower.spec.name, share=share)


# ---------------------------------------------------------------------- the element


def _controller(spec: FollowerSpec, described: ElementSpecs) -> str:
    """The controller that drives the axis of its shaft; otherwise the name that does not exist."""
    axes = {shaft.name: shaft.axis for shaft in described.of(SHAFT)}
    drives = {axis.name: axis.drive[0] for axis in described.of(AXIS)}
    axis = axes.get(spec.shaft)
    return spec.shaft if axis is None else drives.get(axis, axis)


def _refers(spec: FollowerSpec, described: ElementSpecs) -> Iterator[Reference]:
    controller = _controller(spec, described)
    yield Reference(controller, controller, (*spec.path, "shaft"))
    for switch in spec.switches:
        yield Reference(controller, switch.target[0], (*switch.path, "to"))


def _build(spec: FollowerSpec, context: ElementContext) -> Follower:
    shaft = context.objects.built(SHAFT).get(spec.shaft)
    if shaft is None:
        raise Unknown(spec.shaft, f"no shaft is called {spec.shaft!r}")
    follower = Follower(spec, shaft, context.memo.once(spec.path, lambda: _cam(spec, shaft)))
    scheduler = shaft.axis.scheduler
    scheduler.add_part(follower, (shaft.axis.spec.name, spec.shaft, spec.name), spec.name)
    for n, switch in enumerate(spec.switches, start=1):
        context.text.unless_wrong(switch.path, partial(_put_switch, follower, switch, channel_of(spec.name, n), context))
    return follower


def _cam(spec: FollowerSpec, shaft: GearedShaft) -> Cam:
    turn = abs(shaft.pulses_per_turn)
    if turn < 2 * len(spec.points):
        raise Misuse(f"points: a turn of {spec.shaft!r} has {float(turn):g} imp, too few for so many")
    found = ((shaft.grid_position_at(angle), exact_fraction(lift)) for angle, lift in spec.points)
    return Cam(((place - floor(place / turn) * turn, lift) for place, lift in found), turn)


def _put_switch(follower: Follower, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    if spec.period is not None:
        raise Misuse(f"period = {spec.period:g}: a follower moves between two ends, its switches have one zone")

    def to_grid(units: float) -> int:
        return floor(exact_fraction(units) * GRID_PER_UNIT + Fraction(1, 2))

    zone = context.memo.once(spec.path, lambda: zone_of(spec, to_grid))
    axis = follower.shaft.axis
    put_switch(axis.scheduler, follower, (axis.spec.name, follower.spec.shaft, follower.spec.name), zone, spec, channel, context)


def _signals(follower: Follower) -> Mapping[str, SignalOf]:
    source, spec = (follower.shaft.axis.scheduler.source(follower.spec.name),), follower.spec
    bounds = 0.0, spec.highest
    return {"position": SignalOf(source, follower.position, follower.turning_points, follower.version, spec.unit, bounds)}


def _moves(spec: FollowerSpec, follower: Follower) -> Sequence[Movement]:
    metres = LENGTHS.get(spec.unit)
    if metres is None:
        raise Misuse(f"{spec.name!r} is lifted by {spec.unit}: in space a lift is in {', '.join(LENGTHS)}")
    mm, axis = metres * 1000, follower.shaft.axis
    sources = (axis.spec.name, spec.shaft, spec.name)
    motion, blocks = follower.motion(mm * NM_PER_MM), (axis.mechanism.block,)
    return (Movement("position", motion, spec.towards(), float(mm), blocks, sources, travel=(0.0, spec.highest)),)


FOLLOWER: Element[FollowerSpec, Follower] = Element(
    spec=FollowerSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
    drawing=lambda follower: follower.drawing,
    moved=lambda follower: (follower.moved,),
    moves=_moves,
    faults=(
        FaultKind(
            "stuck-follower",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A follower stays where it is; afterwards it is on its cam again at once.",
            effect=ElementEffect(_stick, _is_elsewhere),
        ),
        FaultKind(
            "worn-cam",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A cam lifts its follower by a share only.",
            own=(number("share", "Of its lift.", 0.0, 1.0, default=0.9),),
            effect=ElementEffect(_wear, _is_elsewhere),
        ),
    ),
)
