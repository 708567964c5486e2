"""``[[tool]]``: what two axes move together in a plane, by sums and differences of their positions, as in a CoreXY drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS, BuiltAxis, find_axis, mm_per_unit, moves, summed_travel
from steptwin.simulation.components.coordinate import GRID_PER_UNIT, Coordinate, Pulled, pulled_to
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.mount import FORWARD, MountSpec, Movement, direction
from steptwin.simulation.components.switch import SwitchSpec, put_switch, zone_of
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import Parameter, ParameterForm
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import SLIPS, MovedChannel
from steptwin.simulation.mechanics.drawing import PLANE, Drawing, rail
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.space.frames import Direction, Y
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import NameOf, name_value, number, pair, permitting
from steptwin.state import Plain, Stateful

COORDINATES = ("x", "y")
BELTS = ("axis", "other")


@permitting("[share of axis, share of other], not both 0")
def _shares(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [share of axis, share of other]")
    one, other = (number()(share) for share in value)
    if one == other == 0.0:
        raise Misuse(f"{value!r}: one of the shares is not 0")
    return one, other


@permitting("two directions, such as ['+x', '+y']", direction.words)
def _directions(value: Any) -> tuple[Direction, Direction]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected two directions, such as ['+x', '+y']")
    one, other = map(direction, value)
    if one.axis == other.axis:
        raise Misuse(f"{value!r}: a plane has two directions that are across each other")
    return one, other


@table("[[tool]]")
class ToolSpec(NamedSpec, MountSpec):
    """``x`` and ``y``: the shares of ``axis`` and ``other`` in each coordinate."""

    name: str = key(name_value, "how conditions and faults name it")
    axis: str = key(NameOf("axis"), "an axis that moves it")
    other: str = key(NameOf("axis"), "the other axis that moves it, in the same unit")
    x: tuple[float, float] = key(
        _shares, "units of its x per unit of axis, and of other; default that of CoreXY", default=(0.5, 0.5)
    )
    y: tuple[float, float] = key(
        _shares, "units of its y per unit of axis, and of other; default that of CoreXY", default=(0.5, -0.5)
    )
    x_travel: tuple[float, float] | None = key(pair, "where its x may be, in the unit of the axes: it is drawn so", default=None)
    y_travel: tuple[float, float] | None = key(pair, "where its y may be, in the unit of the axes: it is drawn so", default=None)
    along: tuple[Direction, Direction] = key(
        _directions, "directions in space of its x and its y", default=(FORWARD, Direction(Y, 1)), order=2
    )
    x_switches: tuple[SwitchSpec, ...] = tables_in("x_switch", SwitchSpec, "[[tool.x_switch]]")
    y_switches: tuple[SwitchSpec, ...] = tables_in("y_switch", SwitchSpec, "[[tool.y_switch]]")

    @property
    def moves_others(self) -> bool:
        return True

    @property
    def switches(self) -> Iterator[tuple[str, int, SwitchSpec]]:
        """The coordinate of each, its number there, from 1, and itself."""
        for name, those in zip(COORDINATES, (self.x_switches, self.y_switches), strict=True):
            yield from ((name, n, one) for n, one in enumerate(those, start=1))

    def check(self, text: TomlText) -> None:
        if self.axis == self.other:
            text.wrong((*self.path, "other"), "D007", f"other = {self.other!r} is its axis already: a tool has two")
        if self.x[0] * self.y[1] == self.x[1] * self.y[0]:
            message = f"y = {list(self.y)} is a multiple of x = {list(self.x)}: it moves along one line"
            text.wrong((*self.path, "y"), "D007", message)


class Tool(Stateful):
    """Is where its axes have it, also between their pulses. The belt of one that slips stands while its axis turns."""

    FIXED: ClassVar[tuple[str, ...]] = ("axes", "coordinates", "spec")
    __slots__ = (*FIXED, "_pulled")

    def __init__(self, spec: ToolSpec, axes: tuple[BuiltAxis, BuiltAxis]) -> None:
        self.spec = spec
        self.axes = axes
        self._pulled = [Pulled(), Pulled()]
        self.coordinates = {
            name: Coordinate(axes, shares, self._pulled) for name, shares in zip(COORDINATES, (spec.x, spec.y), strict=True)
        }

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        """Its motion is that of its axes: the scheduler looks again at what depends on it."""

    def deadline(self) -> Nanos | None:
        """None: its motion is that of its axes."""
        return None

    def slip(self, belt: str, slips: bool, now: Nanos) -> float:
        """Let the belt of an axis slip, or grip again where it is then; gives by how much it is behind."""
        n = BELTS.index(belt)
        axis, its = self.axes[n], self._pulled[n]
        if slips:
            self._pulled[n] = Pulled(pulled_to(axis, its, now))
        elif its.held is not None:
            self._pulled[n] = Pulled(None, pulled_to(axis, Pulled(), now) - its.held)
        scheduler = axis.scheduler
        scheduler.record(self.axes[0].mechanism.controller, "edge", f"{self.spec.name}.{belt}.{SLIPS}", float(slips))
        scheduler.notify(self.spec.name)
        return self._pulled[n].behind

    def is_left_behind(self, belt: str, now: Nanos) -> bool:
        """Whether a belt slips, and its axis moves or is elsewhere by now."""
        n = BELTS.index(belt)
        axis, its = self.axes[n], self._pulled[n]
        return its.held is not None and (moves(axis, now) or pulled_to(axis, Pulled(behind=its.behind), now) != its.held)

    def copy_state(self) -> Plain:
        return tuple(self._pulled)

    def set_state(self, plain: Plain) -> None:
        """As `Stateful.set_state`. Its coordinates keep the same list."""
        self._pulled[:] = [Pulled(*its) for its in plain]

    # ------------------------------------------------------------------ how it is shown

    @property
    def unit(self) -> str:
        return self.axes[0].scale.unit

    @property
    def drawing(self) -> Drawing:
        spec = self.spec
        x = rail(spec.x_travel, tuple(one.zone for one in spec.x_switches))
        y = rail(spec.y_travel, tuple(one.zone for one in spec.y_switches))
        return Drawing(PLANE, x.length, COORDINATES, sensors=x.sensors, low=x.low, across=y.length, across_low=y.low)

    @property
    def moved(self) -> Iterator[tuple[str, MovedChannel]]:
        other = self.axes[1].mechanism
        for name, shares in zip(COORDINATES, (self.spec.x, self.spec.y), strict=True):
            factors = [
                share * axis.mechanism.build.sign / float(axis.scale.pulses_per_unit)
                for share, axis in zip(shares, self.axes, strict=True)
            ]
            yield (
                self.axes[0].spec.name,
                MovedChannel(
                    self.spec.name,
                    name,
                    self.unit,
                    factors[0],
                    coupling=f"{self.spec.name}.{BELTS[0]}",
                    other=(other.controller, str(other.number)),
                    other_per_pulse=factors[1],
                    other_coupling=f"{self.spec.name}.{BELTS[1]}",
                ),
            )


# ---------------------------------------------------------------------- the element


def _refers(spec: ToolSpec, described: ElementSpecs) -> Iterator[Reference]:
    drives = {axis.name: axis.drive[0] for axis in described.of(AXIS)}
    controller, other = (drives.get(name, name) for name in (spec.axis, spec.other))
    yield Reference(controller, controller, (*spec.path, "axis"))
    yield Reference(controller, other, (*spec.path, "other"))
    for _, _, switch in spec.switches:
        yield Reference(controller, switch.target[0], (*switch.path, "to"))


def _build(spec: ToolSpec, context: ElementContext) -> Tool:
    one, other = find_axis(spec.axis, context), find_axis(spec.other, context)
    if one.scale.unit != other.scale.unit:
        raise Misuse(f"{spec.axis!r} is in {one.scale.unit} and {spec.other!r} in {other.scale.unit}: a tool has one unit")
    tool = Tool(spec, (one, other))
    one.scheduler.add_part(tool, (spec.axis, spec.other, spec.name), spec.name)
    for name, n, switch in spec.switches:
        channel = f"{spec.name}.{name}_switch{n}"
        context.text.unless_wrong(switch.path, partial(_put_switch, tool, name, switch, channel, context))
    return tool


def _put_switch(tool: Tool, name: str, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    def to_grid(units: float) -> int:
        return round(exact_fraction(units) * GRID_PER_UNIT)

    zone = zone_of(spec, to_grid, None if spec.period is None else to_grid(spec.period))
    moved_by = tool.spec.axis, tool.spec.other, tool.spec.name
    put_switch(tool.axes[0].scheduler, tool.coordinates[name], moved_by, zone, spec, channel, context)


def _signals(tool: Tool) -> Mapping[str, SignalOf]:
    source = (tool.axes[0].scheduler.source(tool.spec.name),)
    return {
        name: SignalOf(source, its.value, its.turning_points, its.version, tool.unit) for name, its in tool.coordinates.items()
    }


TOOL_BELT_SLIPS = Message("simulation.tool-belt-slips", "the belt of {belt} of {name} slips")
TOOL_BELT_GRIPS = Message("simulation.tool-belt-grips", "the belt of {belt} of {name} grips, {behind:g} {unit} behind")


def _slip(active: ActiveFault, tool: Tool, begins: bool, now: Nanos) -> str:
    belt, name = str(active.fault.get("belt")), tool.spec.name
    behind = tool.slip(belt, begins, now)
    if begins:
        return TOOL_BELT_SLIPS(belt=belt, name=name)
    return TOOL_BELT_GRIPS(belt=belt, name=name, behind=behind, unit=tool.unit)


def _is_left_behind(active: ActiveFault, tool: Tool, now: Nanos) -> bool:
    return tool.is_left_behind(str(active.fault.get("belt")), now)


def _moves(spec: ToolSpec, tool: Tool) -> Sequence[Movement]:
    mm = float(mm_per_unit(tool.axes[0]))
    blocks = tuple(axis.mechanism.block for axis in tool.axes)
    sources = (spec.axis, spec.other, spec.name)
    return tuple(
        Movement(name, its.motion, along, mm, blocks, sources, travel=summed_travel(tool.axes, shares))
        for (name, its), along, shares in zip(tool.coordinates.items(), spec.along, (spec.x, spec.y), strict=True)
    )


TOOL: Element[ToolSpec, Tool] = Element(
    spec=ToolSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
    drawing=lambda tool: tool.drawing,
    moved=lambda tool: tool.moved,
    moves=_moves,
    faults=(
        FaultKind(
            "slipping-belt",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A belt of a tool stands while its axis turns; afterwards it goes on from where it stands.",
            own=(Parameter("belt", ParameterForm.WORD, "Whose belt.", words=BELTS, default=BELTS[0]),),
            effect=ElementEffect(_slip, _is_left_behind),
        ),
    ),
)
