"""``[[conveyor]]``: a belt that carries workpieces, with sensors that see them.

A workpiece enters with its front at 0, when FEED is switched on or at a fixed period, unless another one is there. The following
conveyor moves it from when its centre is there; at the end of the last one it leaves with its front. Stops hold workpieces back
while the belt slides below them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import partial
from math import ceil, nan
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import find_axis, turning_points_of_axis
from steptwin.simulation.components.beltsensor import Sensor, SensorSpec
from steptwin.simulation.components.conveyortable import (
    BELT_STOP,
    FEED,
    RUN,
    ConveyorSpec,
    NearSpec,
    near_ones,
    stop_terminal,
)
from steptwin.simulation.components.driveencoder import Turned, fit_encoders
from steptwin.simulation.components.element import ON_AND_STANDS, Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import Reference
from steptwin.simulation.components.logic import STUCK_INPUT, TerminalComponent, with_terminals
from steptwin.simulation.components.workpieces import workpiece_of
from steptwin.simulation.faults import ActiveFault, Fault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.belt import Belt, ConstantDrive, Near, Placed, nanometres, next_change
from steptwin.simulation.mechanics.beltline import limit, next_look, pushed_against
from steptwin.simulation.mechanics.drawing import BELT, Drawing, SensorZone
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.names import Unknown

FEEDER_STANDS = "feeder_stands"
"""Edges ``CONVEYOR.feeder_stands`` that a fault records."""
MOST_PLACES = 24
"""Limit of the workpieces of a conveyor whose places are signals."""
PICOMETRES = 10**9
"""In a millimetre: steps of the grid of a belt that no axis moves."""


NO_CONVEYOR = Message("simulation.no-conveyor-is-called", "no conveyor is called {name!r}: {instead}")
USE_A_NEST = Message(
    "simulation.place-is-a-nest", "a place that is no belt is a [[nest]]; cups and jaws with an at take from it and put into it"
)


# ---------------------------------------------------------------------- what is built


IS_ON = Message("simulation.is-on-a-belt", "{workpiece} is on {belt}")
GOES_BACK = Message("simulation.goes-back-on-a-belt", "{workpiece} goes back on {belt}")
GOES_ON = Message("simulation.goes-on-on-a-belt", "{workpiece} goes on along {belt}")
LEAVES = Message("simulation.leaves-a-belt", "{workpiece} leaves {belt}")
FALLS_OFF = Message("simulation.falls-off-a-belt", "{workpiece} falls off the beginning of {belt}")
COLLIDES = Message("simulation.workpieces-collide", "{workpiece} collides with {other} on {belt}")
STANDS_AT = Message("simulation.stands-on-a-belt", "{workpiece} stands at {place:g} mm of {belt}")


def _nothing(workpiece: str, now: Nanos) -> None:
    """Nothing lies on workpieces."""


class Conveyor(TerminalComponent):
    """A belt with its workpieces.

    The following one takes over what leaves it; after the last one it is gone. Workpieces stand before a stop that is on, behind
    one that stands, and before one that another belt moves and that they would touch. A belt that an axis moves backwards takes
    back what stands, and loses workpieces at its beginning.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_moved_by",
        "_near",
        "_seen",
        "_stops",
        "drop",
        "following",
        "mass_on",
        "preceding",
        "spec",
        "takes_along",
        "turning_points",
    )
    __slots__ = (
        *FIXED,
        "_due",
        "_is_fed",
        "_next_feed",
        "_own",
        "_then",
        "_waits",
        "belt",
        "delivered",
        "fed",
        "fed_in_vain",
        "feeder_stands",
        "is_stopped",
        "missed",
    )

    def __init__(
        self,
        block: TerminalBlock,
        spec: ConveyorSpec,
        belt: Belt,
        near: tuple[NearSpec, ...],
        moved_by: tuple[str, ...] = (),
        turning_points: Callable[[Nanos], Iterator[Nanos]] = lambda now: iter(()),
    ) -> None:
        """``moved_by``: the axis that moves the belt, between ``turning_points`` one way, unless it has a drive of its
        own."""
        super().__init__(block)
        self.spec = spec
        self.belt = belt
        self._near = near
        self._stops = tuple((stop_terminal(n), belt.to_grid(stop.at)) for n, stop in enumerate(spec.stops, start=1))
        self._own = belt.own
        self._moved_by = moved_by
        self.turning_points = turning_points
        self._then = belt.position(block.scheduler.now)
        """The position of the belt at the last update: since then it has moved one way while anything stands."""
        self.drop: Callable[[Placed, Nanos], bool] = lambda placed, now: False
        """Lets a workpiece fall at its end where the following one does not begin there now. Whether it does."""
        self.following: Conveyor | None = None
        self.preceding: dict[str, Conveyor] = {}
        """Those of which it is the following one, by name."""
        self.takes_along: Callable[[str, Nanos], None] = _nothing
        """Lets what lies on a workpiece leave with it at the end of the last belt."""
        self.mass_on: Callable[[str], float] = lambda name: 0.0
        """kg of all that lies on a workpiece."""
        self.fed = 0
        """How many workpieces it was fed with."""
        self.delivered = 0
        """How many have left at its end."""
        self.missed = 0
        """How many did not come when they should: the beginning was occupied, or the feeder stood."""
        self.is_stopped = False
        """Fault: its own drive does not move it."""
        self.feeder_stands = False
        """Fault: no workpieces come onto it, but those of a conveyor before it."""
        self.fed_in_vain = 0
        """How many did not come because of that."""
        self._is_fed = False
        self._next_feed = spec.feed_every
        self._waits = False
        """Whether a workpiece waits for room at the beginning."""
        self._due: Nanos | None = None
        """When a workpiece comes to an end of the belt, to what holds it, or is taken back."""
        self._seen: object = None

    @property
    def has_own_drive(self) -> bool:
        return self._own is not None

    @property
    def line(self) -> tuple[str, ...]:
        """Its name and those of the conveyors whose workpieces may lie over it."""
        return (self.spec.name, *(near.name for near in self._near))

    def connect(self, following: Conveyor | None, conveyors: Mapping[str, Conveyor]) -> None:
        """Join it to the following one, and to the others of its line that are built."""
        self.following = following
        self.belt.following = None if following is None else following.belt
        self.preceding = {name: one for name, one in conveyors.items() if one.spec.next == self.spec.name}
        there = ((conveyors[near.name], near) for near in self._near if near.name in conveyors)
        self.belt.near = tuple(Near(one.belt, *near[1:]) for one, near in there)

    @property
    def depends_on(self) -> tuple[str, ...]:
        # What waits for room waits for workpieces of conveyors before this one, too.
        near = (one.name for one in self._near if one.joins is not None or self.spec.feed_waits)
        return (self.block.name, *self._moved_by, *near)

    def _state(self) -> object:
        """Another value whenever workpieces may move or stand otherwise."""
        return self._waits, [(belt.version(), belt.raised, belt.bars, belt.passings) for belt in self._belts_ahead()]

    def _belts_ahead(self) -> Iterator[Belt]:
        """This one and those on which workpieces may be in the way."""
        yield self.belt
        for near in self.belt.near:
            if near.joins is not None:
                yield near.belt

    def update(self, now: Nanos) -> None:
        if self._own is not None:
            self._own.run(self.block.is_on(RUN) and not self.is_stopped, now)
        self.belt.raised = tuple(place for terminal, place in self._stops if self.block.is_on(terminal))
        is_fed = self.block.is_on(FEED)
        if is_fed and not self._is_fed:
            self._feed(now)
        self._is_fed = is_fed
        if self._next_feed is not None and self._next_feed <= now:
            self._feed(now)
            self._next_feed = None if self._waits else self._next_feed + (self.spec.feed_every or 0)
        elif self._waits and (self.feeder_stands or self.room_at(0, now)):
            self._waits = False
            self._feed(now)
            self._next_feed = None if self.spec.feed_every is None else now + self.spec.feed_every
        if self._state() != self._seen or (self._due is not None and self._due <= now):
            self._hold(now)
            while self._deliver(now):
                self._hold(now)
            self._seen = self._state()
            self.block.scheduler.notify(self.block.name)
            self._due = self._next(now)

    def _feed(self, now: Nanos) -> None:
        """Let a workpiece come to the beginning, if there is room for it."""
        has_room = self.room_at(0, now)
        if has_room and not self.feeder_stands:
            self.put_new(0, now)
        elif self.spec.feed_waits and not self.feeder_stands:
            self._waits = True
        else:
            self.missed += 1
            self.fed_in_vain += self.feeder_stands
            self.block.scheduler.notify(self.block.name)

    def room_at(self, front: int, now: Nanos) -> bool:
        """Whether there is room for one of its workpieces with its front ``front`` steps from the beginning."""
        placed = self.next_at(front, now)
        found = self.belt.occupant(front - placed.length, front, now, beside=placed)
        return found is None and not self.belt.is_in_the_way(placed, now)

    def next_at(self, front: int, now: Nanos) -> Placed:
        """How the next one of its workpieces would lie with its front ``front`` steps from the beginning."""
        return self.belt.place(self._workpiece(), front, now)._replace(held=front)

    def put_new(self, front: int, now: Nanos) -> str:
        """Put one of its workpieces where there is room for it; gives its name."""
        workpiece = self._workpiece()
        self.fed += 1
        self._lay(self.belt.place(workpiece, front, now), now)
        return workpiece.name

    def _workpiece(self) -> Workpiece:
        """The next one that it is fed with."""
        spec = self.spec
        marks = tuple((nanometres(mark), nanometres(mark + spec.mark_width)) for mark in spec.marks)
        return workpiece_of(f"{spec.name}.{self.fed + 1}", spec.workpiece, spec.mass, marks)

    def lay(self, workpiece: Workpiece, front: int, now: Nanos, across: int = 0, yaw_q: float = 0.0) -> bool:
        """Put a workpiece with its front ``front`` steps from the beginning, ``across`` and ``yaw_q`` as in `Placed`. Whether it
        lies there: it does not where it collides with another one."""
        place = front
        placed = self.belt.place(workpiece, place, now, "", across, yaw_q)
        found = self.belt.occupant(place - placed.length + 1, place - 1, now, beside=placed)
        if found is not None:
            self._collides(placed, found[1])
            return False
        self._lay(placed, now)
        return True

    def _lay(self, placed: Placed, now: Nanos) -> None:
        """A workpiece is on the belt from now on."""
        self._then = self.belt.position(now)
        self.belt.put(placed)
        name = placed.workpiece.name
        self.report(IS_ON(workpiece=name, belt=self.spec.name), name, "on")
        self.block.scheduler.notify(self.block.name)

    def _collides(self, placed: Placed, other: Placed) -> None:
        name, against = placed.workpiece.name, other.workpiece.name
        self.report(COLLIDES(workpiece=name, other=against, belt=self.spec.name), name, "collides")

    def remove(self, belt: Belt, placed: Placed) -> None:
        """Take a workpiece that lies over the belt off the one that moves it."""
        belt.take(placed)
        self.block.scheduler.notify(belt.name)

    def front(self, number: int, now: Nanos) -> float:
        """How far the front of a workpiece is from the beginning, mm. 0 is the workpiece that was put there first; NaN if
        there are fewer."""
        belt = self.belt
        if number >= len(belt.workpieces):
            return nan
        return float(belt.workpieces[number].front(belt.position(now)) / belt.per_mm)

    def travel(self, now: Nanos) -> float:
        """mm that its belt has moved."""
        return float(self.belt.position(now) / self.belt.per_mm)

    def mass(self, now: Nanos) -> float:
        """kg of the workpieces on it, and of those on them."""
        there = (placed.workpiece for placed in self.belt.workpieces)
        return sum(workpiece.mass + self.mass_on(workpiece.name) for workpiece in there)

    def _report(self, message: Message, placed: Placed, what: str) -> None:
        name = placed.workpiece.name
        self.report(message(workpiece=name, belt=self.spec.name), name, what)

    def report(self, text: str, name: str, what: str) -> None:
        """Something has happened to a workpiece."""
        scheduler = self.block.scheduler
        facts = ("workpiece", name), ("element", self.spec.name), ("what", what)
        scheduler.record(scheduler.owner(self.block.name), "event", "workpiece", text, *facts)

    def _hold(self, now: Nanos) -> None:
        """Let workpieces stand where they cannot go on, and let those go on that can."""
        belt, position, stride = self.belt, self.belt.position(now), self.belt.stride
        back, self._then = self._then - position, position
        if back > 0:
            for placed in belt.workpieces:
                if placed.held is not None:
                    belt.release(placed, position + back)
                    self._report(GOES_BACK, placed, "goes back")
        firsts = belt.firsts(now) if belt.near else []
        for first in firsts:
            while (other := pushed_against(belt, first, now)) is not None:
                self._collides(other.placed, first)
                self.remove(other.near.belt, other.placed)
        standing: list[tuple[Placed, int]] = []
        """With where one behind it stands."""
        for placed in sorted(belt.workpieces, key=lambda one: one.front(position), reverse=True):
            front = placed.front(position)
            before = (place for one, place in reversed(standing) if not belt.are_beside(placed, belt, one, now))
            most = self._limit(placed, front - stride, next(before, None), now, is_first=placed in firsts)
            if most is not None and front >= most:
                at = most if front - most <= stride else front
                if placed.held != at:
                    belt.hold(placed, at)
                    place = float(at / belt.per_mm)
                    name = placed.workpiece.name
                    self.report(STANDS_AT(workpiece=name, place=place, belt=self.spec.name), name, "stands")
                standing.append((placed, at - placed.length - 1))
            elif placed.held is not None:
                belt.release(placed, position)
                self._report(GOES_ON, placed, "goes on")

    def _limit(self, placed: Placed, least: int, ahead: int | None, now: Nanos, *, is_first: bool) -> int | None:
        """The place up to which a workpiece can go; stops before ``least`` do not concern it. ``ahead``: behind one that stands
        before it. ``is_first``: nothing is before it on this belt."""
        belt = self.belt
        limits = [place for place in belt.raised if place >= least]
        limits += [bar.place for bar in belt.bars if bar.workpiece == placed.workpiece.name]
        if ahead is not None:
            limits.append(ahead)
        if is_first:
            for near in belt.near:
                if near.after is not None:
                    places = (belt.from_nm(near.belt.to_nm(place) + near.begin) for place in near.belt.raised)
                    limits += [place for place in places if place >= least]
            before = limit(belt, placed, now)
            if before is not None:
                limits.append(before)
        return min(limits, default=None)

    def _deliver(self, now: Nanos) -> bool:
        """Let go what has come to an end of the belt. Whether another conveyor moves any of that."""
        belt, position, goes_on = self.belt, self.belt.position(now), False
        for placed in belt.workpieces:
            front = placed.front(position)
            if front >= belt.exit(placed) and placed.held is None:
                self.delivered += 1
                self.remove(belt, placed)
                self._report(LEAVES, placed, "leaves")
                if self.following is None:
                    self.takes_along(placed.workpiece.name, now)
                elif not self.drop(placed, now):
                    goes_on = True
                    self.following.take_over(self._left_alone(placed, now), belt, front - belt.length, now)
            elif front < 0:
                self.remove(belt, placed)
                before = self.preceding.get(placed.came_from)
                if before is None:
                    self._report(FALLS_OFF, placed, "falls")
                    continue
                goes_on = True
                self._report(LEAVES, placed, "leaves")
                before.take_back(self._left_alone(placed, now), belt, front, now)
        return goes_on

    def _left_alone(self, placed: Placed, now: Nanos) -> Placed:
        """A workpiece that nothing pushes any more."""
        return placed._replace(across=self.belt.across_at(placed, now), pusher="")

    def take_over(self, placed: Placed, other: Belt, beyond: int, now: Nanos) -> None:
        """Move a workpiece that the belt before it has moved. ``beyond``: how far it is beyond its end, on its grid."""
        found = self.belt.place(
            placed.workpiece, self.belt.from_nm(other.to_nm(beyond)), now, other.name, placed.across, placed.yaw_q
        )
        short = found.length // 2 - found.front(self.belt.position(now))
        self._lay(found._replace(origin=found.origin - max(short, 0)), now)

    def take_back(self, placed: Placed, other: Belt, front: int, now: Nanos) -> None:
        """Move a workpiece again that the following belt has moved back to its beginning. ``front`` is on its grid."""
        place = self.belt.length + self.belt.from_nm(other.to_nm(front))
        self._lay(self.belt.place(placed.workpiece, place, now, "", placed.across, placed.yaw_q), now)

    def _next(self, now: Nanos) -> Nanos | None:
        """When the next workpiece is lost at the beginning, is delivered or cannot go on; or can again."""
        belt, position = self.belt, self.belt.position(now)
        moving = [placed for placed in belt.workpieces if placed.held is None]
        firsts = belt.firsts(now) if belt.near else []
        looks = [next_look(belt, first, now) for first in firsts]
        below = max((placed.origin - 1 for placed in moving), default=None)
        ends = [placed.origin + self._way(placed, position, now, is_first=placed in firsts) for placed in moving]
        ends += [
            first.origin + place
            for first, (place, _) in zip(firsts, looks, strict=True)
            if first.held is None and place is not None
        ]
        due = next_change(belt.drive, below, min(ends, default=None), now)
        moments = [due, *(look for _, look in looks)]
        if self._waits:
            moments += [belt.next_change(place, now) for place in (0, -belt.from_nm(nanometres(self.spec.workpiece[0])))]
        if len(moving) < len(belt.workpieces):
            moments += [next(self.turning_points(now), None), belt.drive.reaches(position - 1, now, -1)]
        return min((moment for moment in moments if moment is not None), default=None)

    def _way(self, placed: Placed, position: int, now: Nanos, *, is_first: bool) -> int:
        """Up to where a moving workpiece can go."""
        front, end = placed.front(position), self.belt.exit(placed)
        belt = self.belt
        before = [one for one in belt.workpieces if one.held is not None and one.held > front]
        before = [one for one in before if not belt.are_beside(placed, belt, one, now)]
        ahead = min((one.front(position) - one.length - 1 for one in before), default=None)
        found = self._limit(placed, front, ahead, now, is_first=is_first)
        return end if found is None else min(found, end)

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self._due, self._next_feed) if moment is not None)
        return min(moments, default=None)


# ---------------------------------------------------------------------- the element


def _check_stop(conveyor: Conveyor, fault: Fault) -> None:
    if not conveyor.has_own_drive:
        raise Misuse(f"fault {fault.kind.name}: {conveyor.spec.name!r} is moved by axis {conveyor.spec.axis!r}: let that stall")


DRIVE_FAILS = Message("simulation.drive-fails", "the drive of {name} fails")
DRIVE_IS_REPAIRED = Message("simulation.drive-is-repaired", "the drive of {name} is repaired")


def _stop(active: ActiveFault, conveyor: Conveyor, begins: bool, now: Nanos) -> str:
    conveyor.is_stopped = begins
    return (DRIVE_FAILS if begins else DRIVE_IS_REPAIRED)(name=conveyor.spec.name)


def _should_run(active: ActiveFault, belt: Conveyor, now: Nanos) -> bool:
    return belt.is_stopped and belt.block.is_on(RUN)


FEEDER_FAILS = Message("simulation.feeder-stands", "the feeder of {name} stands")
FEEDER_WORKS_AGAIN = Message("simulation.feeder-works-again", "the feeder of {name} works again")


def _stop_feeder(active: ActiveFault, conveyor: Conveyor, begins: bool, now: Nanos) -> str:
    conveyor.feeder_stands = begins
    scheduler, name = conveyor.block.scheduler, conveyor.spec.name
    scheduler.record(scheduler.owner(name), "edge", f"{name}.{FEEDER_STANDS}", float(begins))
    return (FEEDER_FAILS if begins else FEEDER_WORKS_AGAIN)(name=name)


def _fed_in_vain(active: ActiveFault, conveyor: Conveyor, now: Nanos) -> int:
    return conveyor.fed_in_vain


def _own_drive(spec: ConveyorSpec, speed: Fraction, now: Nanos) -> ConstantDrive | RampedDrive:
    if spec.ramp_up or spec.ramp_down:
        return RampedDrive(speed, spec.ramp_up, spec.ramp_down, now)
    return ConstantDrive(speed, now)


def _make(spec: ConveyorSpec, context: ElementContext) -> Conveyor:
    block = context.terminal_block(spec.name)
    conveyors = {one.name: one for one in context.objects.described.of(CONVEYOR)}
    near = context.memo.once((*spec.path, "near"), lambda: near_ones(spec.name, conveyors))
    if spec.axis is None:
        own = _own_drive(spec, exact_fraction(spec.speed), block.scheduler.now)
        belt = Belt(spec.name, spec.length, own, Fraction(PICOMETRES))
        conveyor = Conveyor(block, spec, belt, near)
    else:
        axis = find_axis(spec.axis, context)
        per_mm = axis.scale.pulses_per_unit / exact_fraction(spec.mm_per_unit)
        belt = Belt(spec.name, spec.length, axis.mechanism, per_mm)
        turning_points = partial(turning_points_of_axis, axis)
        conveyor = Conveyor(block, spec, belt, near, (axis.spec.name,), turning_points)
    if belt.length < 1:
        raise Misuse(
            f"length = {spec.length:g} mm: the belt is shorter than one step of its drive, {float(1 / belt.per_mm):g} mm"
        )
    return conveyor


def _connect(spec: ConveyorSpec, conveyor: Conveyor, context: ElementContext) -> None:
    following = None if spec.next is None else find_conveyor(spec.next, context)
    conveyor.connect(following, context.objects.built(CONVEYOR))
    drive = conveyor.belt.own or find_axis(str(spec.axis), context).mechanism
    fit_encoders(Turned(spec.name, drive, "counts_per_unit", "mm", conveyor.belt.per_mm), context)


def find_conveyor(name: str, context: ElementContext) -> Conveyor:
    """The conveyor ``name`` as it is built."""
    found = context.objects.built(CONVEYOR).get(name)
    if found is None:
        raise Unknown(name, NO_CONVEYOR(name=name, instead=USE_A_NEST()))
    return found


def _refers_of_sensors(spec: ConveyorSpec) -> Iterator[Reference]:
    for sensor in spec.sensors:
        yield Reference(spec.name, sensor.target[0], (*sensor.path, "to"))


def _channel(spec: ConveyorSpec, number: int) -> str:
    return f"{spec.name}.sensor{number}"


def _put_sensors(spec: ConveyorSpec, conveyor: Conveyor, context: ElementContext) -> None:
    for n, sensor in enumerate(spec.sensors, start=1):
        context.text.unless_wrong(sensor.path, partial(_put_sensor, conveyor, sensor, _channel(spec, n), context))


def _put_sensor(conveyor: Conveyor, spec: SensorSpec, channel: str, context: ElementContext) -> None:
    scheduler = conveyor.block.scheduler
    circuit = context.circuit(scheduler, spec.target, (*spec.path, "to"), spec.join)
    sensor = Sensor(circuit, conveyor.belt, spec, context.bounce_of(circuit), channel)
    scheduler.add_part(sensor, conveyor.line, drives=circuit.target.controller)


def _stands(conveyor: Conveyor, now: Nanos) -> Stands | None:
    return Stands(ON_AND_STANDS(), signal="travel") if conveyor.is_stopped and conveyor.block.is_on(RUN) else None


def _place_names(spec: ConveyorSpec) -> tuple[str, ...]:
    """Signals with the places of as many workpieces as there is room for."""
    return tuple(f"place{n + 1}" for n in range(ceil(min(MOST_PLACES - 1, spec.length / spec.workpiece[0])) + 1))


def _drawing(conveyor: Conveyor) -> Drawing:
    spec = conveyor.spec
    sensors = tuple(SensorZone(sensor.target, sensor.at, sensor.at) for sensor in spec.sensors)
    stops = tuple(SensorZone((spec.name, stop_terminal(n)), stop.at, stop.at) for n, stop in enumerate(spec.stops, start=1))
    feeds = spec.feed_every is not None or spec.feed is not None
    return Drawing(BELT, spec.length, _place_names(spec), spec.workpiece[0], sensors + stops, across=spec.width, feeds=feeds)


def _refuse_place() -> None:
    raise Misuse("the place of a workpiece can be watched, but conditions need a sensor: [[conveyor.sensor]]")


def _signals(conveyor: Conveyor) -> Mapping[str, SignalOf]:
    source = (conveyor.block.source,)
    places = {
        name: SignalOf(source, partial(conveyor.front, n), unit="mm", bounds=(0.0, conveyor.spec.length), check=_refuse_place)
        for n, name in enumerate(_place_names(conveyor.spec))
    }
    return {
        "count": SignalOf(source, lambda now: float(len(conveyor.belt.workpieces))),
        "fed": SignalOf(source, lambda now: float(conveyor.fed)),
        "delivered": SignalOf(source, lambda now: float(conveyor.delivered)),
        "missed": SignalOf(source, lambda now: float(conveyor.missed)),
        "mass": SignalOf(source, conveyor.mass, unit="kg"),
        "travel": SignalOf(source, conveyor.travel, conveyor.turning_points, conveyor.belt.version, "mm"),
        **places,
    }


CONVEYOR = with_terminals(
    ConveyorSpec,
    make=_make,
    signals=_signals,
    stands=_stands,
    drawing=_drawing,
    moves=lambda spec, conveyor: (),
    connect=_connect,
    faults=(
        STUCK_INPUT,
        FaultKind(
            BELT_STOP,
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A conveyor with a speed stands, although it is switched on.",
            effect=ElementEffect(_stop, _should_run),
            check=_check_stop,
        ),
        FaultKind(
            "empty-feeder",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The feeder of a conveyor is empty or blocked: no workpieces come onto it.",
            effect=ElementEffect(_stop_feeder, _fed_in_vain),
        ),
    ),
    refers=_refers_of_sensors,
    fit=_put_sensors,
)
