"""``[[cylinder]]``: a pneumatic cylinder with its valve and the sensors at its ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import floor
from typing import ClassVar

from steptwin.controller import MILLISECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import Reference
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import Movement, MoverSpec, to_nm
from steptwin.simulation.components.switch import SwitchSpec, channel_of, put_switch, warn_of_useless, zone_of
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.drawing import ROD, Drawing
from steptwin.simulation.mechanics.integral import Straight
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.mechanics.travel import Travel
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.pieces import Gear, Motion, geared, pieces_of_travel
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, positive_time, time_value, word

EXTEND, RETRACT, EXTENDED, RETRACTED = "EXTEND", "RETRACT", "EXTENDED", "RETRACTED"
SINGLE, DOUBLE = "single", "double"


@table("[[cylinder]]")
class CylinderSpec(TerminalComponentSpec, MoverSpec):
    valve: str = key(word(SINGLE, DOUBLE), "single: one coil and a spring; double: two coils", default=SINGLE)
    extend: Terminal | None = key(OUTPUT_PIN, "output connected to the coil EXTEND; without it a wire may be", default=None)
    retract: Terminal | None = key(OUTPUT_PIN, "valve double: output connected to the coil RETRACT", default=None)
    stroke: float = key(number(0.0, above=True), "mm", default=100.0)
    extend_time: Nanos = key(positive_time, "from end to end", default=300 * MILLISECOND)
    retract_time: Nanos = key(positive_time, "from end to end", default=300 * MILLISECOND)
    switching: Nanos = key(time_value, "from a coil to the spool of the valve", default=0)
    start: str = key(word("retracted", "extended"), "where it stands when the world begins", default="retracted")
    switches: tuple[SwitchSpec, ...] = tables_in("switch", SwitchSpec)

    @property
    def terminals(self) -> Terminals:
        inputs = (EXTEND,) if self.valve == SINGLE else (EXTEND, RETRACT)
        return Terminals(digital_inputs=inputs, outputs=(EXTENDED, RETRACTED))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.extend is not None:
            yield Joint("extend", EXTEND, self.extend)
        if self.retract is not None and self.valve == DOUBLE:
            yield Joint("retract", RETRACT, self.retract)

    def check(self, text: TomlText) -> None:
        if self.valve == SINGLE and self.retract is not None:
            text.wrong((*self.path, "retract"), "D007", "a valve with a single coil has no input RETRACT", "valve = 'double' has")
        if self.valve == SINGLE and self.start == "extended":
            text.wrong(
                (*self.path, "start"), "D007", "a valve with a single coil keeps its cylinder retracted until it is switched"
            )
        warn_of_useless(text, self.switches, self.name, (0.0, self.stroke))


class Cylinder(TerminalComponent):
    """Moves between its ends at the constant speeds of its throttles.

    A valve with one coil and a spring extends it while the coil is on. One with two coils stays where it was switched last; while
    both coils are on or off it keeps its place. The spool moves ``switching`` after its coil.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_spec",)
    __slots__ = (*FIXED, "_blockers", "_due", "_spool", "_wanted", "has_air", "is_jammed", "travel")

    def __init__(self, block: TerminalBlock, spec: CylinderSpec) -> None:
        super().__init__(block)
        self._spec = spec
        starts_out = spec.start == "extended"
        self._spool = self._wanted = 1 if starts_out and spec.valve == DOUBLE else -1
        self._due: Nanos | None = None
        """When the spool of the valve moves."""
        self.has_air = True
        self.is_jammed = False
        self._blockers: tuple[str, ...] = ()
        """Names of what it has run against and stands at."""
        self.travel = Travel(spec.extend_time, spec.retract_time, is_forth=starts_out, now=block.scheduler.now)

    def update(self, now: Nanos) -> None:
        self._switch(now)  # before the coils change: an input at a moment comes after what is due then
        wanted = self._coils()
        if wanted != self._wanted:
            self._wanted = wanted
            self._due = None if wanted == self._spool else now + self._spec.switching
            self._switch(now)
        force = self._force()
        if force != self.travel.direction:
            self.travel.send(force, now)
            self.block.scheduler.notify(self.block.name)
        position = self.travel.grid_position(now)
        self.block.put(EXTENDED, float(position == self.travel.full))
        self.block.put(RETRACTED, float(position == 0))

    def _switch(self, now: Nanos) -> None:
        """Move the spool if that is due."""
        if self._due is not None and self._due <= now:
            self._due = None
            self._spool = self._wanted

    def _coils(self) -> int:
        """Where the coils move the spool."""
        extend = self.block.is_on(EXTEND)
        if self._spec.valve == SINGLE:
            return 1 if extend else -1
        retract = self.block.is_on(RETRACT)
        return self._wanted if extend is retract else 1 if extend else -1

    def _force(self) -> int:
        """Where the piston is driven: without air a spring returns it, where there is one."""
        return 0 if self.is_jammed or self._blockers else self._driven(self.has_air)

    def _driven(self, has_air: bool) -> int:
        """As `_force`, of a piston that nothing holds."""
        if not has_air:
            return -1 if self._spec.valve == SINGLE else 0
        return self._spool

    def is_held_back(self, now: Nanos) -> bool:
        """Whether it is jammed where it would move otherwise."""
        return self.is_jammed and not self._blockers and self._can_move(self._driven(self.has_air), now)

    def lacks_air(self, now: Nanos) -> bool:
        """Whether it has no air where it would move otherwise, or stand."""
        wanted, driven = self._driven(has_air=True), self._driven(self.has_air)
        is_free = not self.is_jammed and not self._blockers
        return wanted != driven and is_free and (self._can_move(wanted, now) or self._can_move(driven, now))

    def _can_move(self, direction: int, now: Nanos) -> bool:
        """Whether it is not at the end in a direction."""
        return direction != 0 and self.travel.grid_position(now) != (self.travel.full if direction > 0 else 0)

    def obstruct(self, blocked: bool, now: Nanos, by: str) -> None:
        """Let it stand until nothing blocks it any more."""
        others = tuple(name for name in self._blockers if name != by)
        self._blockers = (*others, by) if blocked else others
        if blocked:
            self.travel.send(0, now)
        self.block.scheduler.notify(self.block.name)

    def deadline(self) -> Nanos | None:
        moments = (*self.travel.turning_points(self.block.scheduler.now), *(() if self._due is None else (self._due,)))
        return min(moments, default=None)

    def heading(self, now: Nanos) -> int:
        """The way in which its valve moves it, whether it can or not."""
        return self._spool

    @property
    def wanted(self) -> int:
        """Where its valve sends the piston: +1 to extend, -1 to retract."""
        return self._spool

    @property
    def blockers(self) -> tuple[str, ...]:
        """Names of what it has run against and stands at."""
        return self._blockers

    @property
    def stroke(self) -> float:
        return self._spec.stroke

    @property
    def drawing(self) -> Drawing:
        return Drawing(ROD, self.stroke, ("position",), sensors=tuple(one.zone for one in self._spec.switches))

    def position(self, now: Nanos) -> float:
        """In units of the stroke, 0 retracted."""
        return self._spec.stroke * (self.travel.grid_position(now) / self.travel.full)

    def line(self, now: Nanos) -> Straight:
        """As `position`, up to where its motion changes."""
        travel, per_step = self.travel, exact_fraction(self._spec.stroke) / self.travel.full
        arrival = max(travel.turning_points(now), default=None)
        slope = 0 if arrival is None else travel.direction * travel.speed(travel.direction)
        return Straight(travel.grid_position(now) * per_step, slope * per_step, arrival)

    def to_grid(self, units: float) -> int:
        """The position on the grid of its travel nearest to a position in units."""
        exact = exact_fraction(units) / exact_fraction(self._spec.stroke) * self.travel.full
        return floor(exact + Fraction(1, 2))


# ---------------------------------------------------------------------- faults


HAS_NO_AIR = Message("simulation.has-no-air", "{name} has no air")
HAS_AIR_AGAIN = Message("simulation.has-air-again", "{name} has air again")


def _take_air(active: ActiveFault, cylinder: Cylinder, begins: bool, now: Nanos) -> str:
    cylinder.has_air = not begins
    return (HAS_NO_AIR if begins else HAS_AIR_AGAIN)(name=cylinder.block.name)


def _lacks_air(active: ActiveFault, cylinder: Cylinder, now: Nanos) -> bool:
    return cylinder.lacks_air(now)


IS_JAMMED = Message("simulation.is-jammed", "{name} is jammed")
IS_FREE_AGAIN = Message("simulation.cylinder-is-free-again", "{name} is free again")


def _jam(active: ActiveFault, cylinder: Cylinder, begins: bool, now: Nanos) -> str:
    cylinder.is_jammed = begins
    return (IS_JAMMED if begins else IS_FREE_AGAIN)(name=cylinder.block.name)


def _is_held_back(active: ActiveFault, cylinder: Cylinder, now: Nanos) -> bool:
    return cylinder.is_held_back(now)


# ---------------------------------------------------------------------- the element


def _refers_of_switches(spec: CylinderSpec) -> Iterator[Reference]:
    for switch in spec.switches:
        yield Reference(spec.name, switch.target[0], (*switch.path, "to"))


def _put_switches(spec: CylinderSpec, cylinder: Cylinder, context: ElementContext) -> None:
    for n, switch in enumerate(spec.switches, start=1):
        context.text.unless_wrong(switch.path, partial(_put_switch, cylinder, switch, channel_of(spec.name, n), context))


def _put_switch(cylinder: Cylinder, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    zone = zone_of(spec, cylinder.to_grid, None if spec.period is None else cylinder.to_grid(spec.period))
    put_switch(cylinder.block.scheduler, cylinder.travel, cylinder.block.name, zone, spec, channel, context)


DOES_NOT_EXTEND = Message("simulation.cylinder-does-not-extend", "is switched to extend, and stands at {place:g} mm")
DOES_NOT_RETRACT = Message("simulation.cylinder-does-not-retract", "is switched to retract, and stands at {place:g} mm")
STANDS_AGAINST = Message("simulation.cylinder-stands-against", "{text}, against {names}")


def _stands(cylinder: Cylinder, now: Nanos) -> Stands | None:
    wanted, travel = cylinder.wanted, cylinder.travel
    end = travel.full if wanted > 0 else 0
    if travel.grid_position(now) == end or travel.direction == wanted:
        return None
    text = (DOES_NOT_EXTEND if wanted > 0 else DOES_NOT_RETRACT)(place=round(cylinder.position(now), 3))
    text = STANDS_AGAINST(text=text, names=cylinder.blockers) if cylinder.blockers else text
    return Stands(text, travel.since, signal="position")


def _signals(cylinder: Cylinder) -> Mapping[str, SignalOf]:
    source, travel = cylinder.block.source, cylinder.travel
    turning, bounds = travel.turning_points, (0.0, cylinder.stroke)
    position = SignalOf((source,), cylinder.position, turning, travel.version, "mm", bounds, straight=cylinder.line)
    return {"position": position}


def _moves(spec: CylinderSpec, cylinder: Cylinder) -> Sequence[Movement]:
    travel = cylinder.travel
    gear = Gear(float(to_nm(spec.stroke)), float(travel.full))
    motion = Motion(travel.version, lambda now: geared(pieces_of_travel(travel, now), gear))
    ends = (0.0, spec.stroke)
    return (
        Movement(
            "position", motion, spec.towards(), 1.0, (cylinder.obstruct,), (spec.name,), travel=ends, heading=cylinder.heading
        ),
    )


CYLINDER = with_terminals(
    CylinderSpec,
    make=lambda spec, context: Cylinder(context.terminal_block(spec.name), spec),
    signals=_signals,
    drawing=lambda cylinder: cylinder.drawing,
    moves=_moves,
    stands=_stands,
    faults=(
        *STUCK,
        FaultKind(
            "no-air",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A cylinder has no compressed air: a spring retracts it, without one it stands.",
            effect=ElementEffect(_take_air, _lacks_air),
        ),
        FaultKind(
            "jam",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A cylinder stands where it is.",
            effect=ElementEffect(_jam, _is_held_back),
        ),
    ),
    refers=_refers_of_switches,
    fit=_put_switches,
)
