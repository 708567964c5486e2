"""``[[conveyor]]``: a belt that carries workpieces, with sensors that see them.

A workpiece enters with its front at 0, when FEED is switched on or at a fixed period, unless another one is there; it leaves when
its front comes to the end of the belt. Stops hold workpieces back while the belt slides below them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import partial
from math import ceil, floor, nan
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import find_axis, turning_points_of_axis
from steptwin.simulation.components.beltsensor import Sensor, SensorSpec
from steptwin.simulation.components.conveyortable import FEED, RUN, ConveyorSpec, stop_terminal
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import Reference
from steptwin.simulation.components.logic import STUCK_INPUT, TerminalComponent, with_terminals
from steptwin.simulation.faults import ActiveFault, Fault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.belt import BeltDrive, ConstantDrive, Load, Workpiece, next_change
from steptwin.simulation.mechanics.drawing import BELT, Drawing, SensorZone
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.names import Unknown

FEEDER_STANDS = "feeder_stands"
"""Edges ``CONVEYOR.feeder_stands`` that a fault records."""
MOST_PLACES = 24
"""Limit of the workpieces of a conveyor whose places are signals."""
PICOMETRES = 10**9
"""In a millimetre: steps of the grid of a belt that no axis moves."""
_PULSE = 1
"""The most that an axis moves a belt within a nanosecond, in its pulses."""


# ---------------------------------------------------------------------- what is built


IS_ON = Message("simulation.is-on-a-belt", "{workpiece} is on {belt}")
GOES_BACK = Message("simulation.goes-back-on-a-belt", "{workpiece} goes back on {belt}")
GOES_ON = Message("simulation.goes-on-on-a-belt", "{workpiece} goes on on {belt}")
LEAVES = Message("simulation.leaves-a-belt", "{workpiece} leaves {belt}")
FALLS_OFF = Message("simulation.falls-off-a-belt", "{workpiece} falls off the beginning of {belt}")
STANDS_AT = Message("simulation.stands-on-a-belt", "{workpiece} stands at {place:g} mm of {belt}")


class Conveyor(TerminalComponent):
    """A belt with its workpieces. ``drive`` moves it, on a grid of which ``per_mm`` steps are a millimetre.

    What leaves it is put at the beginning of the following one, or is gone. Workpieces stand before a stop that is on, behind
    one that stands, and at the end while the beginning of the following conveyor is occupied. A belt that an axis moves
    backwards takes back what stands, and loses workpieces at its beginning.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_length",
        "_moved_by",
        "_seen",
        "_stops",
        "_turning_points",
        "drive",
        "following",
        "per_mm",
        "spec",
    )
    __slots__ = (
        *FIXED,
        "_due",
        "_is_fed",
        "_next_feed",
        "_own",
        "_then",
        "delivered",
        "fed",
        "feeder_stands",
        "is_stopped",
        "load",
        "missed",
    )

    def __init__(
        self,
        block: TerminalBlock,
        spec: ConveyorSpec,
        drive: BeltDrive,
        per_mm: Fraction,
        own: ConstantDrive | RampedDrive | None,
        moved_by: tuple[str, ...] = (),
        turning_points: Callable[[Nanos], Iterator[Nanos]] = lambda now: iter(()),
    ) -> None:
        """``own``: the drive, where it is the conveyor's own; ``moved_by``: otherwise the controller that moves it, between
        ``turning_points`` one way."""
        super().__init__(block)
        self.spec = spec
        self.drive = drive
        self.per_mm = per_mm
        self._length = self.to_grid(spec.length)
        self._stops = tuple((stop_terminal(n), self.to_grid(stop.at)) for n, stop in enumerate(spec.stops, start=1))
        self._own = own
        self._moved_by = moved_by
        self._turning_points = turning_points
        self._then = drive.grid_position(block.scheduler.now)
        """The position of the belt at the last update: since then it has moved one way while anything stands."""
        self.following: Conveyor | None = None
        self.load = Load()
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
        self._is_fed = False
        self._next_feed = spec.feed_every
        self._due: Nanos | None = None
        """When a workpiece comes to an end of the belt, to what holds it, or is taken back."""
        self._seen: object = None

    @property
    def has_own_drive(self) -> bool:
        return self._own is not None

    def to_grid(self, mm: float) -> int:
        """The length on the grid of the belt."""
        return floor(exact_fraction(mm) * self.per_mm + Fraction(1, 2))

    def version(self) -> object:
        """Another value whenever predictions no longer hold."""
        return self.drive.version(), self.load.version()

    @property
    def depends_on(self) -> tuple[str, ...]:
        return (self.block.name, *self._moved_by, *(() if self.spec.next is None else (self.spec.next,)))

    def _state(self) -> object:
        """Another value whenever workpieces may move or stand otherwise."""
        return self.version(), self._raised(), None if self.following is None else self.following.version()

    def _raised(self) -> tuple[int, ...]:
        """The places of the stops that are on."""
        return tuple(place for terminal, place in self._stops if self.block.is_on(terminal))

    def update(self, now: Nanos) -> None:
        if self._own is not None:
            self._own.run(self.block.is_on(RUN) and not self.is_stopped, now)
        is_fed = self.block.is_on(FEED)
        if is_fed and not self._is_fed:
            self._feed(now)
        self._is_fed = is_fed
        if self._next_feed is not None and self._next_feed <= now:
            self._feed(now)
            self._next_feed += self.spec.feed_every or 0
        if self._state() != self._seen or (self._due is not None and self._due <= now):
            self._hold(now)
            self._deliver(now)
            self._seen = self._state()
            self.block.scheduler.notify(self.block.name)
            self._due = self._next(now)

    def _feed(self, now: Nanos) -> None:
        """Put a workpiece at the beginning, where there is room for it."""
        if self.feeder_stands or self.load.covering(0, self.drive.grid_position(now)) is not None:
            self.missed += 1
            self.block.scheduler.notify(self.block.name)
            return
        self.fed += 1
        spec = self.spec
        marks = tuple((self.to_grid(mark), self.to_grid(mark + spec.mark_width)) for mark in spec.marks)
        self.put(Workpiece(f"{spec.name}.{self.fed}", 0, self.to_grid(spec.workpiece), spec.mass, marks), 0.0, now)

    def put(self, workpiece: Workpiece, front: float, now: Nanos) -> None:
        """Put a workpiece, whose lengths are on the grid of this belt, with its front ``front`` mm from the beginning."""
        self._then = self.drive.grid_position(now)
        self.load.put(workpiece._replace(origin=self.drive.grid_position(now) - self.to_grid(front), held=None))
        self.report(IS_ON(workpiece=workpiece.name, belt=self.spec.name), workpiece.name, "on")
        self.block.scheduler.notify(self.block.name)

    def take_over(self, workpiece: Workpiece, other: Conveyor, front: float, now: Nanos) -> None:
        """Put a workpiece that was on another belt on this one."""
        ratio = self.per_mm / other.per_mm

        def to_grid(length: int) -> int:
            return floor(length * ratio + Fraction(1, 2))

        marks = tuple((to_grid(begin), to_grid(end)) for begin, end in workpiece.marks)
        self.put(workpiece._replace(length=to_grid(workpiece.length), marks=marks), front, now)

    def take(self, workpiece: Workpiece) -> None:
        """Take a workpiece off the belt."""
        self.load.take(workpiece)
        self.block.scheduler.notify(self.block.name)

    def front(self, number: int, now: Nanos) -> float:
        """How far the front of a workpiece is from the beginning, mm. 0 is the workpiece that was put there first; NaN if
        there are fewer."""
        workpieces = self.load.workpieces
        return float(workpieces[number].front(self.drive.grid_position(now)) / self.per_mm) if number < len(workpieces) else nan

    def mass(self, now: Nanos) -> float:
        """kg of the workpieces on it."""
        return sum(workpiece.mass for workpiece in self.load.workpieces)

    def report(self, text: str, name: str, what: str) -> None:
        """Something has happened to a workpiece."""
        scheduler = self.block.scheduler
        facts = ("workpiece", name), ("element", self.spec.name), ("what", what)
        scheduler.record(scheduler.owner(self.block.name), "event", "workpiece", text, *facts)

    def _hold(self, now: Nanos) -> None:
        """Let workpieces stand where they cannot go on, and let those go on that can."""
        belt, stride = self.drive.grid_position(now), _PULSE if self._own is None else self._own.stride
        back, self._then = self._then - belt, belt
        if back > 0:
            for workpiece in self.load.workpieces:
                if workpiece.held is not None:
                    self.load.release(workpiece, belt + back)
                    self.report(GOES_BACK(workpiece=workpiece.name, belt=self.spec.name), workpiece.name, "goes back")
        ahead: int | None = None
        for workpiece in sorted(self.load.workpieces, key=lambda one: one.front(belt), reverse=True):
            front = workpiece.front(belt)
            limit = self._limit(front, stride, ahead, now)
            if limit is not None and front >= limit:
                at = limit if front - limit <= stride else front
                if workpiece.held != at:
                    self.load.hold(workpiece, at)
                    self.report(
                        STANDS_AT(workpiece=workpiece.name, place=float(at / self.per_mm), belt=self.spec.name),
                        workpiece.name,
                        "stands",
                    )
                ahead = at - workpiece.length - 1
                continue
            ahead = None
            if workpiece.held is not None:
                self.load.release(workpiece, belt)
                self.report(GOES_ON(workpiece=workpiece.name, belt=self.spec.name), workpiece.name, "goes on")

    def _limit(self, front: int, stride: int, ahead: int | None, now: Nanos) -> int | None:
        """The place up to which a workpiece can go, with its front at ``front``. ``ahead``: behind one that stands before it."""
        limits = [position for position in self._raised() if position >= front - stride]
        if ahead is not None:
            limits.append(ahead)
        if self._is_blocked(now):
            limits.append(self._length)
        return min(limits, default=None)

    def _is_blocked(self, now: Nanos) -> bool:
        """Whether there is no room for a workpiece at the beginning of the following conveyor."""
        following = self.following
        return following is not None and following.covers_beginning(now)

    def covers_beginning(self, now: Nanos) -> bool:
        return self.load.covering(0, self.drive.grid_position(now)) is not None

    def _deliver(self, now: Nanos) -> None:
        """Let go what has come to an end of the belt."""
        belt, length = self.drive.grid_position(now), self._length
        for workpiece in self.load.workpieces:
            front = workpiece.front(belt)
            if front >= length and workpiece.held is None:
                self.delivered += 1
                self.take(workpiece)
                self.report(LEAVES(workpiece=workpiece.name, belt=self.spec.name), workpiece.name, "leaves")
                if self.following is not None:
                    self.following.take_over(workpiece, self, 0.0, now)
            elif front < 0:
                self.take(workpiece)
                self.report(FALLS_OFF(workpiece=workpiece.name, belt=self.spec.name), workpiece.name, "falls")

    def _next(self, now: Nanos) -> Nanos | None:
        """When the next workpiece is lost at the beginning, is delivered or cannot go on; or can again, at the end."""
        belt = self.drive.grid_position(now)
        moving = [workpiece for workpiece in self.load.workpieces if workpiece.held is None]
        below = max((workpiece.origin for workpiece in moving), default=None)
        above = min((workpiece.origin + self._way(workpiece, belt, now) for workpiece in moving), default=None)
        due = next_change(self.drive, None if below is None else below - 1, above, now)
        if len(moving) < len(self.load.workpieces):
            due = min(
                filter(None, (due, next(self._turning_points(now), None), self.drive.reaches(belt - 1, now, -1))), default=None
            )
        following = self.following
        if following is None or not self.load.workpieces or not self._is_blocked(now):
            return due
        free = next_change(following.drive, *following.load.edges(0, following.drive.grid_position(now)), now)
        return free if due is None else due if free is None else min(due, free)

    def _way(self, workpiece: Workpiece, belt: int, now: Nanos) -> int:
        """Up to where a moving workpiece can go."""
        front = workpiece.front(belt)
        before = [one for one in self.load.workpieces if one.held is not None and one.held > front]
        ahead = min((one.front(belt) - one.length - 1 for one in before), default=None)
        found = self._limit(front, 0, ahead, now)
        return self._length if found is None else min(found, self._length)

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


FEEDER_FAILS = Message("simulation.feeder-stands", "the feeder of {name} stands")
FEEDER_WORKS_AGAIN = Message("simulation.feeder-works-again", "the feeder of {name} works again")


def _stop_feeder(active: ActiveFault, conveyor: Conveyor, begins: bool, now: Nanos) -> str:
    conveyor.feeder_stands = begins
    scheduler, name = conveyor.block.scheduler, conveyor.spec.name
    scheduler.record(scheduler.owner(name), "edge", f"{name}.{FEEDER_STANDS}", float(begins))
    return (FEEDER_FAILS if begins else FEEDER_WORKS_AGAIN)(name=name)


def _own_drive(spec: ConveyorSpec, speed: Fraction, now: Nanos) -> ConstantDrive | RampedDrive:
    if spec.ramp_up or spec.ramp_down:
        return RampedDrive(speed, spec.ramp_up, spec.ramp_down, now)
    return ConstantDrive(speed, now)


def _make(spec: ConveyorSpec, context: ElementContext) -> Conveyor:
    block = context.terminal_block(spec.name)
    if spec.axis is None:
        own = _own_drive(spec, exact_fraction(spec.speed), block.scheduler.now)
        conveyor = Conveyor(block, spec, own, Fraction(PICOMETRES), own)
    else:
        axis = find_axis(spec.axis, context)
        per_mm = axis.scale.pulses_per_unit / exact_fraction(spec.mm_per_unit)
        turning_points = partial(turning_points_of_axis, axis)
        conveyor = Conveyor(block, spec, axis.mechanism, per_mm, None, (axis.mechanism.controller,), turning_points)
    if conveyor.to_grid(spec.length) < 1:
        raise Misuse(
            f"length = {spec.length:g} mm: the belt is shorter than one step of its drive, {float(1 / conveyor.per_mm):g} mm"
        )
    return conveyor


def _connect(spec: ConveyorSpec, conveyor: Conveyor, context: ElementContext) -> None:
    if spec.next is not None:
        conveyor.following = find_conveyor(spec.next, context)


def find_conveyor(name: str, context: ElementContext) -> Conveyor:
    """The conveyor ``name`` as it is built."""
    found = context.objects.built(CONVEYOR).get(name)
    if found is None:
        raise Unknown(name, f"no conveyor is called {name!r}")
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
    sensor = Sensor(circuit, conveyor, spec, context.bounce_of(circuit), channel)
    scheduler.add_part(sensor, (conveyor.block.name,), drives=circuit.target.controller)


def _place_names(spec: ConveyorSpec) -> tuple[str, ...]:
    """Signals with the places of as many workpieces as there is room for."""
    return tuple(f"place{n + 1}" for n in range(ceil(min(MOST_PLACES - 1, spec.length / spec.workpiece)) + 1))


def _drawing(conveyor: Conveyor) -> Drawing:
    spec = conveyor.spec
    sensors = tuple(SensorZone(sensor.target, sensor.at, sensor.at) for sensor in spec.sensors)
    stops = tuple(SensorZone((spec.name, stop_terminal(n)), stop.at, stop.at) for n, stop in enumerate(spec.stops, start=1))
    return Drawing(BELT, spec.length, _place_names(spec), spec.workpiece, sensors + stops)


def _refuse_place() -> None:
    raise Misuse("the place of a workpiece can be watched, but conditions need a sensor: [[conveyor.sensor]]")


def _signals(conveyor: Conveyor) -> Mapping[str, SignalOf]:
    source = (conveyor.block.source,)
    places = {
        name: SignalOf(source, partial(conveyor.front, n), unit="mm", bounds=(0.0, conveyor.spec.length), check=_refuse_place)
        for n, name in enumerate(_place_names(conveyor.spec))
    }
    return {
        **places,
        "count": SignalOf(source, lambda now: float(len(conveyor.load.workpieces))),
        "fed": SignalOf(source, lambda now: float(conveyor.fed)),
        "delivered": SignalOf(source, lambda now: float(conveyor.delivered)),
        "missed": SignalOf(source, lambda now: float(conveyor.missed)),
        "mass": SignalOf(source, conveyor.mass, unit="kg"),
    }


CONVEYOR = with_terminals(
    ConveyorSpec,
    make=_make,
    signals=_signals,
    drawing=_drawing,
    moves=lambda spec, conveyor: (),
    connect=_connect,
    faults=(
        STUCK_INPUT,
        FaultKind(
            "belt-stop",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A conveyor with a speed stands, although it is switched on.",
            effect=ElementEffect(_stop),
            check=_check_stop,
        ),
        FaultKind(
            "empty-feeder",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The feeder of a conveyor is empty or blocked: no workpieces come onto it.",
            effect=ElementEffect(_stop_feeder),
        ),
    ),
    refers=_refers_of_sensors,
    fit=_put_sensors,
)
