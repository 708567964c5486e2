"""The model of a world at the present moment: its parts by name, its signals and conditions, and what is reported of it.

Steps, checks and texts of programs need no more of a world. `steptwin.simulation.world.simulation.Simulation` runs it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any

from steptwin.controller import Nanos
from steptwin.controllerstate import ControllerState, ProgramActivity, StateProgram
from steptwin.diagnostics import SourceText
from steptwin.jsonvalues import to_json
from steptwin.messages import NONE, Message, text_of
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss
from steptwin.simulation.components.axis import AXIS, BuiltAxis
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.components.faultsetup import FaultSetup
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.build import Keep, build
from steptwin.simulation.faults import Fault
from steptwin.simulation.kinds.givenfiles import GivenFiles
from steptwin.simulation.kinds.kind import AnyKind, EncoderInputs, NamedRegisters, Vision
from steptwin.simulation.kinds.lines import Line
from steptwin.simulation.kinds.programs import Programs
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.contacts import Button
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import Trace, TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml.names import Unknown
from steptwin.simulation.world.boundedlog import BoundedLog

WORLD = "world"
"""The controller name in records that belong to no controller."""
MOST_REMEMBERED = 10_000
"""Size limit of each cache of requests, signals and conditions, which scripts use repeatedly."""


UNKNOWN = Message("simulation.unknown", "no {what} is called {name!r}{hint}; there are {names}")
A_CONTROLLER_OR_LINE = Message("simulation.controller-or-line", "controller or line")
A_CONTROLLER = Message("simulation.controller", "controller")
A_BUTTON = Message("simulation.button", "button")
A_LINE = Message("simulation.line", "line")


class Model:
    """The schedulers, controllers, lines and elements of a description. A scheduler is advanced to the present before it is read
    or changed."""

    def __init__(self, blueprint: Blueprint, *, keep_trace: bool, keep_memory: Keep | None, is_blank: bool) -> None:
        """``is_blank``: a snapshot is restored next."""
        self.blueprint, spec = blueprint, blueprint.spec
        names = [*(controller.name for controller in spec.controllers), *(line.name for line in spec.lines), WORLD]
        self.spec = spec
        self.files = blueprint.files
        self.trace = Trace(names, keep=keep_trace)
        self.objects: BuiltObjects = build(blueprint, self.trace.add, keep_memory, is_blank=is_blank)
        self.trace.read_together(blueprint.connected or ())
        self.now: Nanos = 0
        self.stopped: str | None = None
        """The reason a script gave for ending the run; None if none did."""
        self.failures = BoundedLog()
        """Expectations that did not hold."""
        self.overdue = BoundedLog()
        """Things for which scripts waited in vain: conditions and answers until their time-out, writes that were
        refused."""
        self.until_subscribers: list[Callable[[str, str], None]] = []
        """Called when a condition has become true for which a script waited, with the name of the script and the condition."""
        self.synced_first: Sequence[Scheduler] = ()
        """Schedulers that are advanced before the others where the order is free, so that what observes them can read the
        others."""
        self._encoded: dict[object, tuple[bytes, ...]] = {}
        self._signals: dict[str, SignalOf | Idle] = {}
        self._conditions: dict[str, SignalCondition] = {}
        self.downloaded: dict[tuple[str, str], SourceText] = {}
        """Texts that have been put into controllers since the beginning, by controller and place, as it was written."""
        self.given = GivenFiles(spec.lines, self.files, self.downloaded)
        self.fault_setup = FaultSetup(self.objects)

    # ------------------------------------------------------------------ what is in it

    @property
    def controllers(self) -> Mapping[str, MotionController]:
        return self.objects.controllers

    @property
    def lines(self) -> Mapping[str, Line]:
        return self.objects.lines

    @property
    def axes(self) -> Mapping[str, BuiltAxis]:
        return self.objects.built(AXIS)

    @property
    def schedulers(self) -> list[Scheduler]:
        return self.objects.schedulers

    def sync(self, name: str) -> Scheduler:
        """The scheduler of a controller or line, advanced to the present. Raises `Misuse` with the existing names."""
        scheduler = self.objects.scheduler_of.get(name)
        if scheduler is None:
            raise self.unknown(A_CONTROLLER_OR_LINE(), name, self.objects.scheduler_of)
        scheduler.advance(self.now)
        return scheduler

    @staticmethod
    def unknown(what: str, name: str, known: Iterable[str]) -> Unknown:
        near = NearMiss()
        text = UNKNOWN(what=text_of(what), name=name, hint=near.hint(name, known), names=list(known) or NONE())
        return Unknown(name, text, near.of(name, known))

    def condition(self, text: str) -> SignalCondition:
        """The condition with this text. Raises `Misuse` for invalid text and for unknown signals."""
        found = self._conditions.get(text)
        if found is None:
            if len(self._conditions) >= MOST_REMEMBERED:
                self._conditions.clear()
            found = self._conditions[text] = SignalCondition(text, self.watched)
        return found

    def watched(self, name: str) -> SignalOf | Idle:
        """A signal for a condition. Raises `Misuse` with the existing names, and for one that conditions cannot use."""
        found = self.signal(name)
        found.watch(name)
        return found

    def signal(self, name: str) -> SignalOf | Idle:
        """The signal called ``name``. Raises `Misuse` with the existing names."""
        found = self._signals.get(name)
        if found is None:
            if len(self._signals) >= MOST_REMEMBERED:
                self._signals.clear()
            found = self._signals[name] = find_signal(self.objects, name)
        return found

    def read(self, name: str) -> float:
        """The present value of a signal. Raises `Misuse` for a write-only one."""
        found = self.signal(name)
        found.sync(self.now)
        return float(found.value(self.now))

    @cached_property
    def programs(self) -> Mapping[str, Programs]:
        """The programs of controllers that have any, by name of the controller."""
        found = {one.name: one.kind.programs(one, self.controllers[one.name], self.given) for one in self.spec.controllers}
        return {name: programs for name, programs in found.items() if programs is not None}

    def state_of(self, name: str) -> ControllerState:
        """The present state of a controller. Raises `Misuse` with the existing ones."""
        controller = self.controller(name)
        self.sync(name)
        state = self.kind(name).state(controller, self.now)
        return replace(state, program=self._located(name, state.program))

    def parts_of(self, name: str, wanted: Collection[str]) -> dict[str, object]:
        """As `state_of`, of some parts, as `steptwin.controllerstate.StateReader.parts`. Raises `Misuse`."""
        controller = self.controller(name)
        self.sync(name)
        reader = self.kind(name).state
        found = reader.parts(controller, self.now, wanted)
        if "program" in found:
            found["program"] = to_json(self._located(name, reader.program(controller, self.now)))
        return found

    def _located(self, name: str, program: StateProgram) -> StateProgram:
        """With its place in the text, which a controller that stores no text does not know."""
        programs = self.programs.get(name)
        is_there = programs is not None and program.file is None and program.state is not ProgramActivity.STOPPED
        stack = programs.stack(self.now) if programs is not None and is_there else ()
        if programs is None or not stack:
            return program
        text, number = stack[0].location
        return replace(program, file=programs.texts[text].name, line=programs.statements(text)[number].line)

    def sync_all(self) -> None:
        """Advance every scheduler to the present."""
        for scheduler in (*self.synced_first, *self.schedulers):
            scheduler.advance(self.now)

    # ------------------------------------------------------------------ by name

    def controller(self, name: str) -> MotionController:
        """The controller called ``name``. Raises `Misuse` with the existing ones."""
        controller = self.objects.controllers.get(name)
        if controller is None:
            raise self.unknown(A_CONTROLLER(), name, self.controllers)
        return controller

    def kind(self, name: str) -> AnyKind:
        """The kind of a controller. Raises `Misuse` with the existing controllers."""
        kind = self.objects.kind_of.get(name)
        if kind is None:
            raise self.unknown(A_CONTROLLER(), name, self.controllers)
        return kind

    def input_pin(self, name: str, pin: str, level: float) -> str:
        """The name of the input that ``pin`` means. Raises `Misuse` with the existing inputs, and for a level out of range."""
        kind = self.kind(name)
        found = kind.input_pin(pin, level)
        kind.refuse_taken(self.controller(name), found)
        return found

    def registers(self, name: str) -> NamedRegisters[Any]:
        """The registers of a controller. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.registers is None:
            raise kind.lacks(name, "registers")
        return kind.registers

    def encoders(self, name: str) -> EncoderInputs[Any]:
        """The encoder inputs of a controller. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.encoders is None:
            raise kind.lacks(name, "encoder")
        return kind.encoders

    def vision(self, name: str) -> Vision[Any, Any]:
        """The vision registers of a controller. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.vision is None:
            raise kind.lacks(name, "vision registers")
        return kind.vision

    def requests(self, step: do.Write, *, is_command: bool = False) -> list[tuple[str, Sequence[bytes]]]:
        """The PDUs of a write for one controller after the other. Raises `Misuse` for values that a register does not accept, of
        a command also for those that its controller would ignore now."""
        found: list[tuple[str, Sequence[bytes]]] = []
        for name, group in groupby(step.values, key=itemgetter(0)):
            registers, controller = self.registers(name), self.objects.controllers[name]
            self.sync(name)  # a request that is due now may change the dialect
            values = tuple(map(itemgetter(1, 2), group))
            key = (name, registers.dialect(controller), values)
            if is_command or key not in self._encoded:
                if len(self._encoded) >= MOST_REMEMBERED:
                    self._encoded.clear()
                self._encoded[key] = registers.requests(controller, values, is_command=is_command)
            found.append((name, self._encoded[key]))
        return found

    def programs_of(self, name: str) -> Programs:
        """The programs of a controller. Raises `Misuse` for a controller without."""
        kind = self.kind(name)
        if name not in self.programs:
            raise kind.lacks(name, "program whose text is known")
        return self.programs[name]

    def button(self, name: str) -> tuple[Button, Scheduler]:
        """The button called ``name`` and its scheduler. Raises `Misuse` with the existing buttons."""
        found = self.objects.built(BUTTON).get(name)
        if found is None:
            raise self.unknown(A_BUTTON(), name, self.objects.built(BUTTON))
        return found

    def line_called(self, name: str) -> Line:
        """The line called ``name``. Raises `Misuse` with the existing lines."""
        line = self.lines.get(name)
        if line is None:
            raise self.unknown(A_LINE(), name, self.lines)
        return line

    def put_fault(self, fault: Fault) -> None:
        """Set a fault now. Raises `Misuse` for one that cannot occur in this world."""
        self.sync_all()
        self.fault_setup.put(fault, self.now)

    # ------------------------------------------------------------------ reports

    def expect(self, text: str) -> None:
        """Report a condition that does not hold, with the values that it has instead."""
        if not self.holds(self.condition(text)):
            self._report(self.failures, "expectation", self.told(text))

    def holds(self, condition: SignalCondition) -> bool:
        """Whether a condition is true now."""
        condition.sync(self.now)
        return condition.holds(self.now)

    def told(self, text: str) -> str:
        """A condition with what its signals are now: ``lift.count == 3; lift.count is 0``."""
        condition = self.condition(text)
        condition.sync(self.now)
        return condition.told(self.now)

    def report_refused(self, text: str) -> None:
        """Report a command of a script that cannot be done."""
        self._report(self.failures, "expectation", text)

    def report_overdue(self, text: str) -> None:
        """Report that a script of the description waited in vain."""
        self._report(self.overdue, "overdue", text)

    def _report(self, log: BoundedLog, code: str, text: str) -> None:
        record = TraceRecord(self.now, WORLD, "event", code, text)
        log.add(record)
        self.trace.add(record)
