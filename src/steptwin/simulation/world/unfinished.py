"""Search for what stands still in a world: what its programs and scripts wait for, and which inputs never changed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from typing import NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.diagnostics import visible
from steptwin.simulation.faults.active import HeldLevel
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementLocation
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.wiring import Connection, connections


class Waiting(NamedTuple):
    """``who``: a controller with its program, or a script of the description; ``what`` it waits for."""

    who: str
    what: str


def waiting(simulation: Simulation) -> Iterator[Waiting]:
    """The programs that wait for something other than time, then the scripts, but for events, which wait for the next time."""
    drivers, held = _drivers(simulation), _held(simulation)
    for name, programs in simulation.programs.items():
        stack = programs.stack(simulation.now)
        if not stack:
            continue
        use = programs.use(stack[0].location)
        if use.waits and use.reads:
            states = ", ".join(state for resource in use.reads for state in _states(simulation, name, resource, drivers, held))
            where = _statement(simulation, name, stack[0].location)
            yield Waiting(name, f"{where}: {states}" if states else where)
    events = {script.name for script in simulation.spec.scripts if script.when is not None or script.every is not None}
    for script in simulation.scripts:
        if script.waiting is not None and script.name not in events:
            asked = ", ".join(f"the answer on {pending.line}" for pending in script.waiting.asked)
            if what := script.waiting.condition or asked:
                yield Waiting(script.name, what)


def _statement(simulation: Simulation, controller: str, location: StatementLocation) -> str:
    programs = simulation.programs[controller]
    found, source = programs.statements(location.text)[location.number], programs.texts[location.text]
    return f"{source.name}:{found.line} {visible(source.text[found.start : found.end].strip())}"


def _states(
    simulation: Simulation, controller: str, resource: Resource, drivers: dict[str, list[Connection]], held: dict[str, HeldLevel]
) -> Iterator[str]:
    """The present level of a pin that a statement reads, and what drives it; where the axes are that it waits for."""
    if resource.kind is ResourceKind.AXIS:
        for axis in simulation.kind(controller).state(simulation.controller(controller), simulation.now).axes:
            if axis.moving and resource.name in ("", str(axis.number)):
                position = "" if axis.position is None else f" at {axis.position:g} {axis.unit}"
                yield f"{controller}.{axis.name} moves{position}"
    elif resource.kind is ResourceKind.PIN and resource.name:
        yield from _level(simulation, controller, resource.name, drivers, held)


def _level(
    simulation: Simulation, controller: str, name: str, drivers: dict[str, list[Connection]], held: dict[str, HeldLevel]
) -> Iterator[str]:
    pin = f"{controller}.{name}"
    level = simulation.read(pin)
    terminals = simulation.kind(controller).terminals
    if pin in held:
        yield f"{pin} is {held[pin].description()}"
    elif name not in (*terminals.digital_inputs, *terminals.analog_inputs):
        yield f"{pin} is {level:g}"
    else:
        sources = (one.source for one in drivers.get(pin, ()))
        by = " and ".join(f"{one} ({held[one].description()})" if one in held else one for one in sources) or "nothing"
        yield f"{pin} is {level:g}, driven by {by}"


def _held(simulation: Simulation) -> dict[str, HeldLevel]:
    faults = simulation.objects.faults
    return {signal: held for owner in (*faults.controllers, *faults.elements) for signal, held in faults.held(owner).items()}


def _drivers(simulation: Simulation) -> dict[str, list[Connection]]:
    found: dict[str, list[Connection]] = {}
    for one in connections(simulation.objects):
        found.setdefault(str(one.target), []).append(one)
    return found


def unchanged_inputs(simulation: Simulation, since: Nanos) -> list[str]:
    """The inputs of controllers that something drives and that have had one level since a moment, as far as the trace is kept;
    and those that a program reads and whose every change was shorter than their filter."""
    changes: dict[PinName, list[Nanos]] = {}
    for record in simulation.trace.edges():
        if record.time > since:
            changes.setdefault(PinName(record.controller, record.subject), []).append(record.time)
    read = set(_read(simulation))
    found: list[str] = []
    for pin in dict.fromkeys(one.target for one in connections(simulation.objects)):
        if pin.controller not in simulation.controllers:
            continue
        times = changes.get(pin, [])
        lasts = simulation.kind(pin.controller).filter_of(simulation.controller(pin.controller), pin.pin)
        if not times:
            found.append(str(pin))
        elif pin in read and all(end - begin < lasts for begin, end in zip_longest(*2 * [iter(times)], fillvalue=simulation.now)):
            found.append(f"{pin} (for less than its filter of {lasts / MILLISECOND:g} ms)")
    return found


def _read(simulation: Simulation) -> Iterator[PinName]:
    """The pins that statements of programs read."""
    for name, programs in simulation.programs.items():
        for text in programs.texts:
            for number in range(len(programs.statements(text))):
                reads = programs.use(StatementLocation(text, number)).reads
                yield from (PinName(name, one.name) for one in reads if one.kind is ResourceKind.PIN)
