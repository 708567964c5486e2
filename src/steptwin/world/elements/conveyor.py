"""``[[conveyor]]``: a belt that carries workpieces, with sensors that see them.

A workpiece enters with its front at 0, when FEED is switched on or at a fixed period, unless another one is there; it leaves when
its front comes to the end of the belt.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import ceil, floor, nan
from typing import ClassVar

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.world.belt import BeltDrive, ConstantDrive, Load, Workpiece, next_change
from steptwin.world.board import Board
from steptwin.world.chance import Chance
from steptwin.world.contacts import Circuit, Contact
from steptwin.world.drawing import BELT, Drawing, SensorZone
from steptwin.world.element import Reference
from steptwin.world.elements.axis import find_axis
from steptwin.world.elements.contact import CONTACT_KEYS
from steptwin.world.elements.logic import BoardPart, BoardSpec, Inner, Joint, with_terminals
from steptwin.world.faults import ActiveFault, Fault, FaultKind, Layer, Occasion
from steptwin.world.faults.table import ElementEffect
from steptwin.world.kind import Terminals
from steptwin.world.names import Unknown
from steptwin.world.reader import Key, Table, TomlText, optional, read_table
from steptwin.world.scale import exact_fraction
from steptwin.world.sense import TableRows, check_sense
from steptwin.world.signals import SignalOf
from steptwin.world.site import Site, Terminal
from steptwin.world.spec import WorldSpec
from steptwin.world.tomlplaces import Path
from steptwin.world.values import INPUT_PIN, OUTPUT_PIN, NameOf, number, positive_time

RUN, FEED = "RUN", "FEED"
FEEDER_STANDS = "feeder_stands"
"""Edges ``CONVEYOR.feeder_stands`` that a fault records."""
MOST_PLACES = 24
"""Limit of the workpieces of a conveyor whose places are signals."""
PICOMETRES = 10**9
"""In a millimetre: places of a belt that no axis moves."""


# ---------------------------------------------------------------------- tables


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSpec:
    """A light barrier or proximity switch over the belt."""

    at: float
    target: Terminal
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()


SENSOR = TableRows(
    written="[[conveyor.sensor]]",
    keys=(
        Key("at", number(0.0), "mm from the beginning of the belt"),
        Key("to", INPUT_PIN, "the input, on while a workpiece covers it: MACHINE.PIN", attribute="target"),
        *CONTACT_KEYS,
    ),
    need={"bounces": "bounce"},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConveyorSpec(BoardSpec):
    length: float
    speed: float | None
    run: Terminal | None
    axis: str | None
    mm_per_unit: float
    feed: Terminal | None
    feed_every: Nanos | None
    workpiece: float
    next: str | None
    sensors: tuple[SensorSpec, ...]

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(FEED,) if self.speed is None else (RUN, FEED))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.run is not None and self.speed is not None:
            yield Joint("run", RUN, self.run)
        if self.feed is not None:
            yield Joint("feed", FEED, self.feed)

    def others(self, world: WorldSpec) -> Iterable[tuple[str, str]]:
        if self.axis is not None:
            yield "axis", self.axis
        if self.next is not None:
            yield "next", self.next

    def check(self, text: TomlText) -> None:
        if (self.speed is None) is (self.axis is None):
            text.wrong(self.path, "D007", "a conveyor needs one of speed and axis")
        if self.next == self.name:
            text.wrong((*self.path, "next"), "D007", f"{self.name} is followed by itself")
        for sensor in self.sensors:
            if sensor.at > self.length:
                text.wrong((*sensor.path, "at"), "D007", f"at = {sensor.at:g} is beyond length = {self.length:g}")


# ---------------------------------------------------------------------- what is built


class Conveyor(BoardPart):
    """A belt with its workpieces. ``drive`` moves it, in places of which ``per_mm`` are a millimetre.

    What leaves it is put at the beginning of the following one, or is gone. A belt that an axis moves backwards loses workpieces
    at its beginning.
    """

    __slots__ = (
        "_due",
        "_is_fed",
        "_length",
        "_moved_by",
        "_next_feed",
        "_own",
        "_version",
        "delivered",
        "drive",
        "fed",
        "feeder_stands",
        "following",
        "is_stopped",
        "load",
        "missed",
        "per_mm",
        "spec",
    )
    FIXED: ClassVar[frozenset[str]] = (
        frozenset({"_length", "_moved_by", "_version", "drive", "following", "per_mm", "spec"}) | BoardPart.FIXED
    )

    def __init__(
        self,
        board: Board,
        spec: ConveyorSpec,
        drive: BeltDrive,
        per_mm: Fraction,
        own: ConstantDrive | None,
        moved_by: tuple[str, ...] = (),
    ) -> None:
        """``own``: the drive, where it is the conveyor's own; ``moved_by``: otherwise the machine that moves it."""
        super().__init__(board)
        self.spec = spec
        self.drive = drive
        self.per_mm = per_mm
        self._length = self.places(spec.length)
        self._own = own
        self._moved_by = moved_by
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
        """When a workpiece comes to an end of the belt."""
        self._version: object = None

    @property
    def has_own_drive(self) -> bool:
        return self._own is not None

    def places(self, mm: float) -> int:
        """The length in places of the belt."""
        return floor(exact_fraction(mm) * self.per_mm + Fraction(1, 2))

    def version(self) -> object:
        """Another value whenever predictions no longer hold."""
        return self.drive.version(), self.load.version()

    @property
    def watches(self) -> tuple[str, ...]:
        return (self.board.name, *self._moved_by)

    def update(self, now: Nanos) -> None:
        if self._own is not None:
            self._own.run(self.board.is_on(RUN) and not self.is_stopped, now)
        is_fed = self.board.is_on(FEED)
        if is_fed and not self._is_fed:
            self._feed(now)
        self._is_fed = is_fed
        if self._next_feed is not None and self._next_feed <= now:
            self._feed(now)
            self._next_feed += self.spec.feed_every or 0
        version = self.version()
        if version != self._version or (self._due is not None and self._due <= now):
            self._deliver(now)
            self._version = self.version()
            self.board.kernel.mark(self.board.name)
            self._due = next_change(self.drive, *self._ends(now), now)

    def _feed(self, now: Nanos) -> None:
        """Put a workpiece at the beginning, where there is room for it."""
        if self.feeder_stands or self.load.covering(0, self.drive.place(now)) is not None:
            self.missed += 1
            self.board.kernel.mark(self.board.name)
            return
        self.fed += 1
        self.put(f"{self.spec.name}.{self.fed}", 0.0, self.places(self.spec.workpiece), now)

    def put(self, name: str, front: float, length: int, now: Nanos) -> None:
        """Put a workpiece with its front ``front`` mm from the beginning. ``length`` in places of this belt."""
        self.load.put(Workpiece(name, self.drive.place(now) - self.places(front), length))
        self.report(f"{name} is on {self.spec.name}", name, "on")
        self.board.kernel.mark(self.board.name)

    def take(self, piece: Workpiece) -> None:
        """Take a workpiece off the belt."""
        self.load.take(piece)
        self.board.kernel.mark(self.board.name)

    def front(self, number: int, now: Nanos) -> float:
        """How far the front of a workpiece is from the beginning, mm. 0 is the workpiece that was put there first; NaN if
        there are fewer."""
        pieces = self.load.pieces
        return float((self.drive.place(now) - pieces[number].origin) / self.per_mm) if number < len(pieces) else nan

    def report(self, text: str, name: str, what: str) -> None:
        """Something has happened to a workpiece."""
        kernel = self.board.kernel
        facts = ("workpiece", name), ("conveyor", self.spec.name), ("what", what)
        kernel.report(kernel.owner(self.board.name), "event", "workpiece", text, *facts)

    def _deliver(self, now: Nanos) -> None:
        """Let go what has come to an end of the belt."""
        belt, length = self.drive.place(now), self._length
        for piece in self.load.pieces:
            front = belt - piece.origin
            if front >= length:
                self.delivered += 1
                self.take(piece)
                self.report(f"{piece.name} leaves {self.spec.name}", piece.name, "leaves")
                if self.following is not None:
                    self.following.put(piece.name, 0.0, self.following.places_of(self, piece.length), now)
            elif front < 0:
                self.take(piece)
                self.report(f"{piece.name} falls off the beginning of {self.spec.name}", piece.name, "falls")

    def places_of(self, other: Conveyor, places: int) -> int:
        """A length on another belt in places of this one."""
        return floor(places * self.per_mm / other.per_mm + Fraction(1, 2))

    def _ends(self, now: Nanos) -> tuple[int | None, int | None]:
        """Places of the belt at which the next workpiece is lost at its beginning, and delivered at its end."""
        origins = [piece.origin for piece in self.load.pieces]
        return (max(origins) - 1, min(origins) + self._length) if origins else (None, None)

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self._due, self._next_feed) if moment is not None)
        return min(moments, default=None)


class Sensor(Contact):
    """On while a workpiece covers its place."""

    __slots__ = ("_at", "_conveyor", "_seen")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_at", "_conveyor", "_seen"}) | Contact.FIXED

    def __init__(self, circuit: Circuit, conveyor: Conveyor, spec: SensorSpec, chance: Chance, lane: str) -> None:
        super().__init__(
            circuit,
            normally_closed=spec.contact == "NC",
            bounce_ns=spec.bounce,
            bounces=spec.bounces,
            chance=chance,
            lane=lane,
        )
        self._conveyor = conveyor
        self._at = conveyor.places(spec.at)
        self._seen: object = None
        self.rest_at(self.normally_closed)

    def update(self, now: Nanos) -> None:
        self.bounce(now)
        version = self._conveyor.version()
        if version == self._seen and (self._due is None or self._due > now):
            return
        self._seen = version
        drive, load = self._conveyor.drive, self._conveyor.load
        belt = drive.place(now)
        self.change((load.covering(self._at, belt) is not None) is not self.normally_closed, now)
        self._due = next_change(drive, *load.edges(self._at, belt), now)

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self.bounce_due(), self._due) if moment is not None)
        return min(moments, default=None)


# ---------------------------------------------------------------------- the element


def _check_stop(conveyor: Conveyor, fault: Fault) -> None:
    if not conveyor.has_own_drive:
        raise Misuse(f"fault {fault.kind.name}: {conveyor.spec.name!r} is moved by axis {conveyor.spec.axis!r}: let that stall")


def _stop(active: ActiveFault, conveyor: Conveyor, begins: bool, now: Nanos) -> str:
    conveyor.is_stopped = begins
    return f"the drive of {conveyor.spec.name} {'fails' if begins else 'is repaired'}"


def _stop_feeder(active: ActiveFault, conveyor: Conveyor, begins: bool, now: Nanos) -> str:
    conveyor.feeder_stands = begins
    kernel, name = conveyor.board.kernel, conveyor.spec.name
    kernel.report(kernel.owner(name), "edge", f"{name}.{FEEDER_STANDS}", float(begins))
    kernel.mark(name)
    return f"the feeder of {name} {'stands' if begins else 'works again'}"


def _make(spec: ConveyorSpec, site: Site) -> Conveyor:
    board = site.board(spec.name)
    if spec.axis is None:
        own = ConstantDrive(exact_fraction(spec.speed), board.kernel.now)
        conveyor = Conveyor(board, spec, own, Fraction(PICOMETRES), own)
    else:
        axis = find_axis(spec.axis, site)
        per_mm = axis.scale.pulses_per_unit / exact_fraction(spec.mm_per_unit)
        conveyor = Conveyor(board, spec, axis.mechanism, per_mm, None, (axis.mechanism.machine,))
    if conveyor.places(spec.length) < 1:
        raise Misuse(
            f"length = {spec.length:g} mm: the belt is shorter than one step of its drive, {float(1 / conveyor.per_mm):g} mm"
        )
    return conveyor


def _connect(spec: ConveyorSpec, conveyor: Conveyor, site: Site) -> None:
    if spec.next is not None:
        conveyor.following = find_conveyor(spec.next, site)


def find_conveyor(name: str, site: Site) -> Conveyor:
    """What is built of the conveyor ``name``."""
    found = site.parts.built(CONVEYOR).get(name)
    if found is None:
        raise Unknown(name, f"no conveyor is called {name!r}")
    return found


def _read_sensors(text: TomlText, path: Path, table: Table) -> tuple[SensorSpec, ...]:
    given = table.get("sensor", [])
    found: list[SensorSpec] = []
    for n, sensor in enumerate(given if isinstance(given, list) else [given]):
        of_sensor = (*path, "sensor", n)
        values = read_table(text, of_sensor, sensor, SENSOR.keys)
        if "target" in values and "at" in values:
            check_sense(text, of_sensor, SENSOR, sensor)
            found.append(SensorSpec(**values, path=of_sensor))
    return tuple(found)


def _refers_of_sensors(spec: ConveyorSpec) -> Iterator[Reference]:
    for sensor in spec.sensors:
        yield Reference(spec.name, sensor.target[0], (*sensor.path, "to"))


def _lane(spec: ConveyorSpec, number: int) -> str:
    return f"{spec.name}.sensor{number}"


def _put_sensors(spec: ConveyorSpec, conveyor: Conveyor, site: Site) -> None:
    for n, sensor in enumerate(spec.sensors, start=1):
        site.spec.text.unless_wrong(sensor.path, partial(_put_sensor, conveyor, sensor, _lane(spec, n), site))


def _put_sensor(conveyor: Conveyor, spec: SensorSpec, lane: str, site: Site) -> None:
    kernel = conveyor.board.kernel
    circuit = site.circuit(kernel, spec.target, (*spec.path, "to"), spec.join)
    sensor = Sensor(circuit, conveyor, spec, site.bounce_of(circuit), lane)
    kernel.add_part(sensor, (conveyor.board.name,), drives=circuit.target.machine)


def _place_names(spec: ConveyorSpec) -> tuple[str, ...]:
    """Signals with the places of as many workpieces as there is room for."""
    return tuple(f"place{n + 1}" for n in range(ceil(min(MOST_PLACES - 1, spec.length / spec.workpiece)) + 1))


def _drawing(conveyor: Conveyor) -> Drawing:
    spec = conveyor.spec
    sensors = tuple(SensorZone(sensor.target, sensor.at, sensor.at) for sensor in spec.sensors)
    return Drawing(BELT, spec.length, _place_names(spec), spec.workpiece, sensors)


def _refuse_place() -> None:
    raise Misuse("the place of a workpiece can be watched, but conditions need a sensor: [[conveyor.sensor]]")


def _signals(conveyor: Conveyor) -> Mapping[str, SignalOf]:
    source = (conveyor.board.source,)
    places = {
        name: SignalOf(source, partial(conveyor.front, n), unit="mm", bounds=(0.0, conveyor.spec.length), check=_refuse_place)
        for n, name in enumerate(_place_names(conveyor.spec))
    }
    return {
        **places,
        "count": SignalOf(source, lambda now: float(len(conveyor.load.pieces))),
        "fed": SignalOf(source, lambda now: float(conveyor.fed)),
        "delivered": SignalOf(source, lambda now: float(conveyor.delivered)),
        "missed": SignalOf(source, lambda now: float(conveyor.missed)),
    }


CONVEYOR = with_terminals(
    "conveyor",
    ConveyorSpec,
    (
        Key("length", number(0.0, above=True), "mm"),
        optional(number(0.0, above=True), "speed", "mm/s while RUN is on"),
        optional(OUTPUT_PIN, "run", "with speed: output joined to RUN; without it a wire may be"),
        optional(NameOf("axis"), "axis", "the axis that moves the belt, instead of speed"),
        optional(number(0.0, above=True), "mm_per_unit", "with axis: mm of the belt per unit of the axis", 1.0),
        optional(OUTPUT_PIN, "feed", "output joined to FEED, which puts a workpiece on when it is switched on"),
        optional(positive_time, "feed_every", "a workpiece comes after each such time"),
        optional(number(0.0, above=True), "workpiece", "length of a workpiece, mm", 50.0),
        optional(NameOf("conveyor"), "next", "the conveyor on which workpieces go on"),
    ),
    make=_make,
    signals=_signals,
    drawing=_drawing,
    connect=_connect,
    faults=(
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
    inner=Inner(
        key="sensor",
        attribute="sensors",
        rows=SENSOR,
        read=_read_sensors,
        refers=_refers_of_sensors,
        build=_put_sensors,
    ),
)
