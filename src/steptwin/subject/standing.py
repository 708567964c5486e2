"""Things that stand in a world, and since when: programs that wait, alarms, elements, faults."""

from __future__ import annotations

import enum
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import ProgramActivity, StatusLevel
from steptwin.diagnostics import visible
from steptwin.jsonvalues import Moment, Sentence
from steptwin.messages import Message, MessageText, text_of
from steptwin.simulation.components.axis import LOST, BuiltAxis, is_beside
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.faults import ActiveFault, Layer
from steptwin.simulation.kinds.programs import ProgramState
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.unfinished import StandingProgram, StandingPrograms
from steptwin.simulation.world.wiring import connections
from steptwin.subject.lastacts import LastActs

LEAST_NS: Nanos = SECOND
"""Least time that something has stood when it is reported: less, and it may be on its way."""


class StandingKind(enum.Enum):
    PROGRAM = "program"
    """It waits or is paused."""
    ALARM = "alarm"
    """The status of a controller."""
    AXIS = "axis"
    ELEMENT = "element"
    FAULT = "fault"
    GATEWAY = "gateway"


@dataclass(frozen=True, slots=True)
class StandingState:
    """Something that stands."""

    kind: StandingKind
    name: Annotated[str, "The controller, its axis (table.M1), the element, the line, the gateway."]
    text: Sentence
    since_ns: Annotated[Moment | None, "Null: longer than anything is known of it."]
    question: Annotated[str | None, "What to ask `why`; null where that knows nothing of it."]
    line: Annotated[int | None, "Of the program of a controller, from 1."] = None
    place: Annotated[str | None, "Of the text of that program."] = None


WAITS_AT = Message("subject.waits-at", "waits at line {line}: {statement}")
ALARM_WITH_PROGRAM = Message("subject.alarm-with-program", "{status}; the program is {program}")
FAULT_IS_SET = Message("subject.fault-is-set", "fault {fault}")
WITH_LEVELS = Message("subject.waits-with-levels", "{text} ({levels:; })")
IDLE = Message("subject.idle", "executes statements, and has switched and moved nothing")
IDLE_SINCE = Message(
    "subject.idle-since", "executes statements, and has switched and moved nothing since line {line}: {statement}"
)
PAUSED_AT = Message("subject.paused-at", "is paused at line {line}: {statement}")
ALARM_AT = Message("subject.alarm-at", "{status}, at line {line}: {statement}")


_TOLD = {ProgramState.RUNS: WAITS_AT, ProgramState.PAUSED: PAUSED_AT}
"""Otherwise its controller has a status that says what holds it, or the program is over."""


def _waiting(programs: Iterable[StandingProgram]) -> Iterator[StandingState]:
    """Programs that wait or are paused, where it is known since when."""
    for one in programs:
        stand, name = one.stand, one.controller
        if stand.state in _TOLD and stand.location is not None and stand.since is not None:
            text: MessageText = _TOLD[stand.state](line=one.line, statement=one.statement)
            text = WITH_LEVELS(text=text, levels=list(one.levels)) if one.levels else text
            yield StandingState(StandingKind.PROGRAM, name, text, stand.since, name, one.line, stand.location.text)


class Standing:
    """Finds what stands in ``world``, and follows when things changed that do not know it themselves: from now on."""

    def __init__(self, world: Simulation) -> None:
        self._world = world
        self._programs = StandingPrograms(world)
        self._acts = LastActs(world)
        self._changed: dict[str, Nanos] = {}
        """By a pin or terminal (``table.OUT1``), a controller or its axis (``table.M1``): its last edge or event; by an
        ``[[axis]]`` when it began or ended to lose pulses."""
        self._homed: dict[str, tuple[Nanos, int | None]] = {}
        """By an axis of a controller: when it was homed last, and the pulses that it had lost by then, once these are known."""
        self._around = defaultdict[str, set[str]](set)
        """Drivers of the inputs of an element, and its own outputs, by its name."""
        for one in connections(world.objects):
            self._around[one.target[0]].add(one.source)
        for name, terminals in world.objects.terminals.items():
            self._around[name] |= {f"{name}.{output.lower()}" for output in terminals.outputs}
        world.trace.subscribers.append(self._recorded)

    def _recorded(self, record: TraceRecord) -> None:
        if record.kind == "edge":
            self._changed[record.subject if "." in record.subject else f"{record.controller}.{record.subject}"] = record.time
        elif record.kind == "event":
            facts = dict(record.facts)
            axis = facts.get("axis")
            self._changed[record.controller if axis is None else f"{record.controller}.M{axis}"] = record.time
            if record.subject == "homed":
                self._homed[f"{record.controller}.M{axis}"] = record.time, None
            if "lost" in facts:
                self._changed[str(facts["element"])] = record.time

    def went_back(self) -> None:
        """Time has gone back to now: what came then and later has not happened."""
        self._changed = {name: moment for name, moment in self._changed.items() if moment < self._world.now}
        self._homed = {name: homed for name, homed in self._homed.items() if homed[0] < self._world.now}
        self._acts.went_back(self._world.now)

    def states(self) -> Iterator[StandingState]:
        """Those of now: first what is wrong, then what waits."""
        now = self._world.now
        programs = {one.controller: one for one in self._programs}
        found = [*self._faults(), *self._controllers(now, programs), *self._elements(now), *_waiting(programs.values())]
        found += self._idle(now, programs)
        return (one for one in found if one.since_ns is None or now - one.since_ns >= LEAST_NS or one.kind is StandingKind.FAULT)

    def _idle(self, now: Nanos, standing: Mapping[str, StandingProgram]) -> Iterator[StandingState]:
        """Programs that execute statements, and have switched and moved nothing since some time: most go round in a loop that
        asks for something, perhaps with a DELAY. Which statement that is now would be another one each time."""
        for name, programs in self._world.programs.items():
            one = standing.get(name)
            waits = one is not None and (one.use.reads or one.stand.since is None or now - one.stand.since >= LEAST_NS)
            if programs.state is not ProgramState.RUNS or waits or not programs.stack(now):
                continue
            acted = self._acts.last(name)
            if acted is not None:
                since, (place, number) = acted
                statement, text = programs.statements(place)[number], programs.texts[place].text
                words = visible(text[statement.start : statement.end].strip())
                yield StandingState(StandingKind.PROGRAM, name, IDLE_SINCE(line=statement.line, statement=words), since, name)
            elif now - self._acts.begin >= LEAST_NS:
                yield StandingState(StandingKind.PROGRAM, name, IDLE(), None, name)

    # ------------------------------------------------------------------ controllers

    def _controllers(self, now: Nanos, programs: Mapping[str, StandingProgram]) -> Iterator[StandingState]:
        for name, controller in self._world.controllers.items():
            self._world.sync(name)
            reader = self._world.kind(name).state
            status = reader.status(controller, now)
            if status.level is not StatusLevel.OK:
                program = reader.program(controller, now)
                has_ended = program.state is ProgramActivity.STOPPED and program.text != status.text
                text = (
                    ALARM_WITH_PROGRAM(status=text_of(status.text), program=text_of(program.text)) if has_ended else status.text
                )
                has_point = any(one.path == "status" for one in reader.datasheet(controller).points)
                question = f"{name}.status" if has_point else name
                held, line, place = programs.get(name), None, None
                if held is not None and held.stand.location is not None and held.stand.state not in _TOLD:
                    line, place = held.line, held.stand.location.text
                    text = ALARM_AT(status=text_of(text), line=line, statement=held.statement)
                yield StandingState(StandingKind.ALARM, name, text, self._since(now, name), question, line, place)
            for axis in reader.datasheet(controller).axes:
                found = reader.axis(controller, axis, now).status
                if found.level is not StatusLevel.OK:
                    full = f"{name}.{axis.name}"
                    since = self._since(now, f"{name}.M{axis.number}")
                    yield StandingState(StandingKind.AXIS, full, found.text, since, f"{full}.status")

    # ------------------------------------------------------------------ elements and faults

    def _elements(self, now: Nanos) -> Iterator[StandingState]:
        for kind, built in self._world.objects.elements.items():
            stands = ELEMENTS[kind].stands
            if stands is None:
                continue
            for name, one in built.items():
                found = stands(one, now)
                if found is not None and found.signal == LOST:
                    found = self._beside(name, one, now, found)
                if found is not None:
                    since, question = self._since_all(name, found, now), f"{name}.{found.signal or self._shown_by(name)}"
                    yield StandingState(StandingKind.ELEMENT, name, found.text, since, question)

    def _beside(self, name: str, axis: BuiltAxis, now: Nanos, found: Stands) -> Stands | None:
        """Without what it had lost before its controller homed it."""
        drive, lost = ".".join(axis.spec.drive), axis.mechanism.lost(now)
        homed = self._homed.get(drive)
        if homed is None:
            return found
        at, before = homed
        if before is None:
            since = self._since_all(name, found, now)
            before = 0 if since is not None and since > at else lost
            self._homed[drive] = at, before
        return is_beside(axis, lost - before)

    def _since_all(self, name: str, found: Stands, now: Nanos) -> Nanos | None:
        """The last change of anything that it may depend on."""
        faults = [*self._faults_since(name)]
        around = [moment for one in (name, *self._around[name]) if (moment := self._since(now, one)) is not None]
        return max([*faults, *around, *(() if found.since is None else (found.since,))], default=None)

    def _faults_since(self, name: str) -> Iterator[Nanos]:
        """When faults of an element began; and when those of the drive of an axis acted last: some come again and again."""
        faults, axis = self._world.objects.faults, self._world.axes.get(name)
        for fault in faults.active:
            place = place_of(self._world, fault)
            if place == name:
                yield fault.begin
            elif axis is not None and place == ".".join(axis.spec.drive) and fault.name in faults.acts:
                yield faults.acts[fault.name].last

    def _shown_by(self, name: str) -> str:
        """The signal that shows how an element is: its first output, else its first number; empty where it has neither."""
        objects = self._world.objects
        terminals = objects.terminals.get(name)
        named = () if terminals is None else terminals.outputs
        return next((one.lower() for one in (*named, *(objects.element_signals(name) or ()))), "")

    def _faults(self) -> Iterator[StandingState]:
        for fault in self._world.objects.faults.active:
            if fault.begin > self._world.now or (fault.end is not None and fault.end <= self._world.now):
                continue
            name = place_of(self._world, fault)
            question: str | None = None
            if name.partition(".")[0] in self._world.controllers:
                question = f"{name}.status" if fault.fault.get("axis") is not None else name
            if name in self._world.objects.element_names:
                shown = self._shown_by(name)
                question = f"{name}.{shown}" if shown else None
            yield StandingState(StandingKind.FAULT, name, FAULT_IS_SET(fault=str(fault.fault)), fault.begin, question)

    def _since(self, now: Nanos, name: str) -> Nanos | None:
        moment = self._changed.get(name)
        return None if moment is None or moment > now else moment  # the world has gone back before it


def place_of(world: Simulation, fault: ActiveFault) -> str:
    """The place of a fault: an element, a controller, a pin or axis of it (``table.IN3``), a line. Empty: all lines."""
    get = fault.fault.get
    if (element := get("element")) is not None:
        return str(element)
    controllers = list(world.controllers)
    machine = get("machine") or (controllers[0] if fault.fault.kind.layer is Layer.PHYSICS and len(controllers) == 1 else None)
    if machine is None:
        return str(get("line") or "")
    axis = get("axis")
    part = get("pin") or (None if axis is None else f"M{axis}")
    return str(machine) if part is None else f"{machine}.{part}"
