"""Every fault that a world can have: each kind at each of its places, and how often it would have come to it in a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from steptwin.errors import Misuse
from steptwin.simulation.faults import Fault, parse
from steptwin.simulation.faults.kinds import KINDS
from steptwin.simulation.faults.table import FaultCategory, FaultKind, FaultValue, Layer, Occasion
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.script.steps import Repeat, Set, Step
from steptwin.simulation.world.simulation import Simulation

STUCK_INPUT, STUCK_OUTPUT = "stuck-input", "stuck-output"
_LOGIC = frozenset({"gate", "latch", "timer", "relay", "counter"})
"""Elements whose outputs are neither sensors nor actuators."""


@dataclass(frozen=True, slots=True)
class PossibleFault:
    """A fault, without its moment: set, it begins at once. ``place`` names what is faulty, ``mode`` how."""

    part: FaultCategory
    place: str
    mode: str
    fault: Fault

    @property
    def text(self) -> str:
        return str(self.fault)

    @property
    def is_counted(self) -> bool:
        """Whether it waits for occasions (bytes, requests, edges), so that it may be that of a number (``nth``)."""
        return self.fault.kind.parameter("nth") is not None

    def once(self, nth: int = 1) -> Fault:
        """At the occasion of this number alone, counted from the moment at which it is set."""
        return replace(self.fault, given={**self.fault.given, "nth": nth})


def possible_faults(world: Simulation) -> list[PossibleFault]:
    """Every kind of fault at every place of a world, in the order of kinds, then places.

    ``world`` is prepared for faults by this; it is not for other use.
    """
    return [found for kind in KINDS.values() for found in _of_kind(world, kind)]


def _of_kind(world: Simulation, kind: FaultKind) -> Iterator[PossibleFault]:
    for where, place in _places(world, kind):
        for more in _tried(world, kind, where):
            given: dict[str, object] = {**where, **more}
            try:
                fault = parse({"kind": kind.name, **given})
                world.fault_setup.check(fault)
            except Misuse:
                continue  # impossible at this place
            yield PossibleFault(_part(world, kind, where), place, _mode(kind, more, where), fault)


def _tried(world: Simulation, kind: FaultKind, where: Mapping[str, FaultValue]) -> Iterable[Mapping[str, FaultValue]]:
    if not callable(kind.tried):
        return kind.tried
    return kind.tried(world.fault_setup.prepare_for_faults(str(where["machine"])), int(str(where["axis"])))


def _mode(kind: FaultKind, more: Mapping[str, FaultValue], where: dict[str, FaultValue]) -> str:
    shown = {**({"direction": where["direction"]} if "direction" in where else {}), **more}
    return " ".join(
        (kind.name, *(f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}" for key, value in shown.items()))
    )


def _part(world: Simulation, kind: FaultKind, where: dict[str, FaultValue]) -> FaultCategory:
    if kind.name == STUCK_OUTPUT:
        name = where["element"]
        of = next((of for of, built in world.objects.elements.items() if name in built), "")
        return FaultCategory.LOGIC if of in _LOGIC else FaultCategory.SENSOR
    if "pin" in where and where["pin"] in _outputs(world, str(where["machine"])):
        return FaultCategory.LOGIC
    return kind.part


def _places(world: Simulation, kind: FaultKind) -> Iterator[tuple[dict[str, FaultValue], str]]:
    """Parameters that choose each place at which a kind of fault may be, and its name."""
    if kind.layer is Layer.ELEMENT:
        yield from _elements(world, kind)
    elif kind.layer is Layer.PHYSICS:
        yield from _controllers(world, kind)
    else:
        yield from _lines(world, kind)


def _elements(world: Simulation, kind: FaultKind) -> Iterator[tuple[dict[str, FaultValue], str]]:
    key, used = {STUCK_OUTPUT: ("output", _sources(world)), STUCK_INPUT: ("input", _contacted(world))}.get(kind.name, ("", []))
    for name in world.objects.faults.elements:
        if not key:
            yield {"element": name}, name
            continue
        for terminal in (pin for owner, pin in used if owner == name):
            yield {"element": name, key: terminal.lower()}, f"{name}.{terminal.lower()}"


def _sources(world: Simulation) -> list[tuple[str, str]]:
    """The outputs that a wire leads away from, in the order of terminals: what is stuck elsewhere has no effect."""
    led = {tuple(wire.source) for scheduler in world.schedulers for wire in scheduler.wires}
    outputs = ((name, pin) for name, its in world.objects.terminals.items() for pin in its.outputs)
    return [one for one in outputs if one in led]


def _contacted(world: Simulation) -> list[tuple[str, str]]:
    """The inputs of elements with contacts: one that a wire drives is stuck where the output is."""
    return [tuple(pin) for pin in world.objects.circuits if pin.controller in world.objects.terminals]


def _controllers(world: Simulation, kind: FaultKind) -> Iterator[tuple[dict[str, FaultValue], str]]:
    for name, controller in world.controllers.items():
        where: dict[str, FaultValue] = {"machine": name}
        if kind.parameter("pin") is not None:
            outputs = _outputs(world, name) if kind.occasion is Occasion.ALWAYS else ()
            for pin in (*_inputs(world, name), *outputs):
                yield {**where, "pin": pin}, f"{name}.{pin}"
        elif kind.parameter("axis") is not None:
            for number in _axes(world, name, len(controller.axes)):
                yield {**where, "axis": number}, f"{name}.M{number}"
        else:
            yield where, name


def _axes(world: Simulation, controller: str, count: int) -> list[int]:
    """The axes that move something; all where the world has no elements."""
    moving = {axis.mechanism.number for axis in world.axes.values() if axis.spec.drive[0] == controller}
    return sorted(moving) if any(world.objects.elements.values()) else list(range(1, count + 1))


def _inputs(world: Simulation, controller: str) -> list[str]:
    """The inputs that a wire, a switch or a script changes, in the order of the pins."""
    led = {pin.pin for pin in (*world.objects.driven, *world.objects.circuits) if pin.controller == controller}
    led |= {pin.upper() for script in world.spec.scripts for name, pin in _set_by(script.steps) if name == controller}
    return [pin for pin in world.controllers[controller].pins() if pin in led]


def _outputs(world: Simulation, controller: str) -> list[str]:
    """The pins that a wire leads away from, but for lines that are inputs as well, in the order of the pins."""
    led = {wire.source.pin for scheduler in world.schedulers for wire in scheduler.wires if wire.source.controller == controller}
    inputs = _inputs(world, controller)
    return [pin for pin in world.controllers[controller].pins() if pin in led and pin not in inputs]


def _set_by(steps: Iterable[Step]) -> Iterator[tuple[str, str]]:
    for step in steps:
        if isinstance(step, Set):
            yield from ((name, pin) for name, pin, _ in step.levels)
        elif isinstance(step, Repeat):
            yield from _set_by(step.steps)


def _lines(world: Simulation, kind: FaultKind) -> Iterator[tuple[dict[str, FaultValue], str]]:
    directions = ("in", "out") if kind.parameter("direction") is not None else ("",)
    for spec in world.spec.lines:
        where: dict[str, FaultValue] = {"line": spec.name}
        if spec.is_open:
            where["link"] = SCRIPTS
        for direction in directions:
            yield where | ({"direction": direction} if direction else {}), spec.name
    for name, controller_kind in world.objects.kind_of.items():
        if controller_kind.registers is not None and name not in world.objects.line_of and kind.layer is not Layer.BYTES:
            yield {}, name
            return  # requests to controllers without a line do not say to which


# ---------------------------------------------------------------------- occasions and moments


def occasions(world: Simulation, possible: Iterable[PossibleFault], end_ns: int, until: str | None = None) -> dict[str, int]:
    """How often it comes to each counted fault (by its text) in a run of ``world`` from now to ``end_ns``: every byte, request,
    edge, save. The run is that without faults."""
    counted: list[tuple[str, str]] = []
    for one in possible:
        if one.is_counted:
            never = replace(one.fault, given={**one.fault.given, "probability": 0.0})
            world.put_fault(never)
            counted.append((one.text, world.objects.faults.active[-1].name))
    world.run_to(end_ns, until)
    return {text: world.objects.faults.called(name).seen for text, name in counted}
