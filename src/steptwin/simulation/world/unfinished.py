"""Search for what stands still in a world: what its programs and scripts wait for, what holds a program, and which inputs never
changed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cached_property
from itertools import zip_longest
from typing import NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.controllerstate import StatusLevel
from steptwin.diagnostics import visible
from steptwin.messages import Message, MessageText, text_of
from steptwin.simulation.faults.active import HeldLevel
from steptwin.simulation.kinds.programs import ProgramStand, ProgramState, Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.wiring import connections

WAITS = "waits"
LEVEL_IS = Message("simulation.level-is", "{name} is {level:g}")
IS_DRIVEN = Message("simulation.is-driven", "{name} is {level:g}, driven by {sources}")
IS_HELD = Message("simulation.is-held", "{name} is {held}")
SOURCE_IS_HELD = Message("simulation.source-is-held", "{source} ({held})")
NOTHING_DRIVES_IT = Message("simulation.nothing-drives-it", "nothing")
AXIS_MOVES = Message("simulation.axis-moves", "{axis} moves at {position:g} {unit}")
AXIS_STANDS = Message("simulation.axis-stands", "{axis} stands at {position:g} {unit}, {status}")
ENCODER_IS = Message("simulation.encoder-is", "the encoder of {axis} is at {counts}")


class StandingProgram(NamedTuple):
    """A program that does not go on. The place of its statement is empty where that is not known."""

    controller: str
    stand: ProgramStand
    use: StatementUse
    """That of the statement."""
    file: str
    line: int
    statement: str
    levels: tuple[MessageText, ...]
    """The present values of the pins and variables that it waits for, and what drives them."""
    motions: tuple[MessageText, ...]
    """Where the axes and encoders are that it waits for."""

    @property
    def present(self) -> tuple[MessageText, ...]:
        return (*self.levels, *self.motions)

    @property
    def where(self) -> str:
        return f"{self.file}:{self.line} {self.statement}" if self.stand.location is not None else ""


class StandingPrograms:
    """The programs of a world that do not go on, and where the others are."""

    def __init__(self, world: Simulation) -> None:
        self._world = world

    def __iter__(self) -> Iterator[StandingProgram]:
        """Those of now."""
        for name, programs in self._world.programs.items():
            self._world.sync(name)
            stand = programs.stand(self._world.now)
            if stand is not None:
                yield self._standing(name, stand)

    def going_on(self) -> Iterator[StandingProgram]:
        """Those that execute statements, at that of now."""
        for name, programs in self._world.programs.items():
            self._world.sync(name)
            now = self._world.now
            at = programs.stack(now) if programs.state is ProgramState.RUNS and programs.stand(now) is None else ()
            if at:
                yield self._standing(name, ProgramStand(ProgramState.RUNS, at[0].location))

    def _standing(self, name: str, stand: ProgramStand) -> StandingProgram:
        if stand.location is None:
            return StandingProgram(name, stand, StatementUse(), "", 0, "", (), ())
        programs, (place, number) = self._world.programs[name], stand.location
        found, source, use = programs.statements(place)[number], programs.texts[place], programs.use(stand.location)
        words = visible(source.text[found.start : found.end].strip())
        reads = dict.fromkeys(use.reads) if stand.state is ProgramState.RUNS else ()
        levels = tuple([text for one in reads for text in self._levels(name, one)])
        motions = tuple([text for one in reads for text in self._motions(name, one)])
        return StandingProgram(name, stand, use, source.name, found.line, words, levels, motions)

    def _levels(self, controller: str, resource: Resource) -> Iterator[MessageText]:
        if resource.kind is ResourceKind.PIN and resource.name:
            yield self._level(controller, resource.name)
        elif resource.kind is ResourceKind.VALUE and resource.name:
            value = self._world.programs[controller].read(resource.name, self._world.now)
            if value is not None:
                yield LEVEL_IS(name=resource.name, level=value)

    def _motions(self, controller: str, resource: Resource) -> Iterator[MessageText]:
        """Motions of an axis, or of all that move, or the count of an encoder."""
        if resource.kind not in (ResourceKind.AXIS, ResourceKind.ENCODER):
            return
        number = resource.name
        for axis in self._world.state_of(controller).axes:
            full = f"{controller}.{axis.name}"
            if number not in ("", str(axis.number)) or axis.position is None:
                continue
            if resource.kind is ResourceKind.ENCODER:
                yield ENCODER_IS(axis=full, counts=axis.encoder)
            elif axis.moving:
                yield AXIS_MOVES(axis=full, position=axis.position, unit=axis.unit)
            elif number:
                yield AXIS_STANDS(axis=full, position=axis.position, unit=axis.unit, status=text_of(axis.status.text))

    def _level(self, controller: str, name: str) -> MessageText:
        pin = f"{controller}.{name}"
        held, terminals = self._held(controller).get(pin), self._world.kind(controller).terminals
        if held is not None:
            return IS_HELD(name=pin, held=held.description())
        level = self._world.read(pin)
        if name not in (*terminals.digital_inputs, *terminals.analog_inputs):
            return LEVEL_IS(name=pin, level=level)
        sources = [self._source(one) for one in self._drivers.get(pin, ())]
        return IS_DRIVEN(name=pin, level=level, sources=sources or NOTHING_DRIVES_IT())

    def _source(self, name: str) -> str:
        held = self._held(name.partition(".")[0]).get(name)
        return name if held is None else SOURCE_IS_HELD(source=name, held=held.description())

    def _held(self, owner: str) -> dict[str, HeldLevel]:
        return self._world.objects.faults.held(owner)

    @cached_property
    def _drivers(self) -> dict[str, list[str]]:
        """Sources that drive each pin."""
        found: dict[str, list[str]] = {}
        for one in connections(self._world.objects):
            found.setdefault(str(one.target), []).append(one.source)
        return found


class Unfinished(NamedTuple):
    """``who``: a controller with its program, or a script of the description. ``state``: `WAITS`, or that of its program;
    ``what`` it waits for, or where it is."""

    who: str
    state: str
    what: str

    def __str__(self) -> str:
        if self.state == WAITS:
            return f"{self.who} waits for {self.what}"
        if self.state == ProgramState.RUNS.value:
            return f"{self.who} goes on at {self.what}"
        return f"{self.who} is {self.state} at {self.what}" if self.what else f"{self.who} is {self.state}"


class WithoutProgram(NamedTuple):
    """A controller that has a program and runs none. ``error``: what has stopped it; ``alarm``: the status of the controller,
    where that is not in order."""

    who: str
    error: str = ""
    alarm: str = ""

    def __str__(self) -> str:
        if self.error:
            return f"{self.who} was stopped by an error: {self.error}"
        return f"{self.who} runs no program{self.alarm and f'; its status is: {self.alarm}'}"


def unfinished(simulation: Simulation) -> Iterator[Unfinished]:
    """The programs that are held or wait for something other than time, those that go on, then the scripts that wait, but for
    events, which wait for the next time."""
    programs = StandingPrograms(simulation)
    for one in programs:
        if one.stand.state is ProgramState.RUNS:
            if one.use.reads:
                yield Unfinished(one.controller, WAITS, _at(one))
        elif one.stand.state is not ProgramState.STOPPED:
            yield Unfinished(one.controller, one.stand.state.value, one.where)
    for one in programs.going_on():
        yield Unfinished(one.controller, one.stand.state.value, _at(one))
    events = {script.name for script in simulation.spec.scripts if script.when is not None or script.every is not None}
    for script in simulation.scripts:
        if script.waiting is not None and script.name not in events:
            asked = ", ".join(f"the answer on {pending.line}" for pending in script.waiting.asked)
            if what := script.waiting.condition or asked:
                yield Unfinished(script.name, WAITS, what)


def _at(program: StandingProgram) -> str:
    return f"{program.where}: {'; '.join(program.present)}" if program.present else program.where


def without_program(simulation: Simulation) -> Iterator[WithoutProgram]:
    """The controllers whose program was not started, has ended, or was stopped."""
    for one in StandingPrograms(simulation):
        if one.stand.error is not None:
            yield WithoutProgram(one.controller, f"{one.where}: {one.stand.error}" if one.where else one.stand.error)
        elif one.stand.state is ProgramState.STOPPED:
            status = simulation.kind(one.controller).state.status(simulation.controller(one.controller), simulation.now)
            yield WithoutProgram(one.controller, alarm="" if status.level is StatusLevel.OK else status.text)


def changes_of_pins(simulation: Simulation) -> Counter[str]:
    """How often each pin has changed so far, as far as the trace is kept."""
    return Counter({pin: len(times) for pin, times in _changes(simulation).items()})


def _changes(simulation: Simulation) -> dict[str, list[Nanos]]:
    """The moments at which each pin has changed."""
    found: dict[str, list[Nanos]] = {}
    for record in simulation.trace.edges():
        found.setdefault(f"{record.controller}.{record.subject}", []).append(record.time)
    return found


def unchanged_inputs(simulation: Simulation, before: Counter[str]) -> list[str]:
    """The inputs of controllers that something drives and that have had one level since a moment, ``before`` which there were
    so many changes; and those that a program reads and whose every change was shorter than their filter."""
    changes, read = _changes(simulation), set(_read(simulation))
    found: list[str] = []
    for pin in dict.fromkeys(one.target for one in connections(simulation.objects)):
        if pin.controller not in simulation.controllers:
            continue
        times = changes.get(str(pin), [])[before[str(pin)] :]
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
