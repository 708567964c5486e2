"""The programs of a MIC488 while they are executed."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

from steptwin.controlflow import ControlFlow
from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText
from steptwin.messages import text_of
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program import ProgramError
from steptwin.mic488.program_banks import LoadedProgram
from steptwin.mic488.program_registers import ACCESS
from steptwin.mic488.status import ProgramState as Control
from steptwin.simulation.kinds.mic488.statement_use import use_of
from steptwin.simulation.kinds.programs import (
    Frame,
    GivenCommand,
    ProgramStand,
    ProgramState,
    Resource,
    Statement,
    StatementLocation,
    StatementUse,
)
from steptwin.simulation.kinds.programtexts import bank_text
from steptwin.statements import StatementHook
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.flow import flow_of
from steptwin.wbc.registers import parts
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.steps import BLOCK_MARKS, Literal, RegisterOperand, ValueSource, Variable
from steptwin.wbc.syntax import parse
from steptwin.wbc.tree import Identifier, ProgramTree

BEGIN = "program"
"""The name of what is executed before the first label."""


class WbcPrograms:
    """See `steptwin.simulation.kinds.programs.Programs`. Numbers of statements are those of steps, the last one the end of the
    program."""

    def __init__(self, device: Mic488Device) -> None:
        self._device = device
        self._banks: dict[str, _Bank] = {}
        """Their content at the last request."""
        self._locations: dict[tuple[int, int], StatementLocation] = {}
        """By bank and number."""

    @property
    def statement_time(self) -> Nanos:
        return self._device.program.interpreter.statement_time

    @property
    def texts(self) -> Mapping[str, SourceText]:
        return {bank_text(bank): program.source for bank, program in self._device.program.banks.programs.items()}

    def _bank(self, text: str) -> _Bank:
        program = self._device.program.banks.programs[int(text.rpartition(" ")[2])]
        found = self._banks.get(text)
        if found is None or found.program is not program:
            found = self._banks[text] = _Bank(program)
        return found

    def statements(self, text: str) -> Sequence[Statement]:
        return self._bank(text).statements

    def after(self, text: str) -> Mapping[int, Sequence[int]]:
        return self._bank(text).after

    def reached(self, text: str, starts: Collection[int]) -> Collection[int]:
        return self._bank(text).reached(starts)

    def labels(self, text: str) -> Mapping[str, int]:
        return self._bank(text).labels

    def add_hook(self, hook: StatementHook, locations: Collection[StatementLocation] | None = None) -> None:
        numbers = None if locations is None else frozenset(location.number for location in locations)
        self._device.program.interpreter.add_hook(hook, numbers)

    def remove_hook(self, hook: StatementHook) -> None:
        self._device.program.interpreter.remove_hook(hook)

    def begun(self, now: Nanos) -> Sequence[int]:
        return ()  # the first statement is executed one statement time after power-on

    def location(self, number: int) -> StatementLocation | None:
        control = self._device.program
        if control.running is None:
            return None
        bank = control.running_bank
        found = self._locations.get((bank, number))
        if found is None:
            found = self._locations[bank, number] = StatementLocation(bank_text(bank), number)
        return found

    @property
    def state(self) -> ProgramState:
        return _STATES[self._device.program.state]

    @property
    def holding(self) -> Mapping[ProgramState, Sequence[Resource]]:
        return {}

    def given(self, number: int) -> GivenCommand | None:
        return None  # statements come from texts only

    def queued(self) -> Sequence[GivenCommand]:
        return ()

    def commands(self, data: bytes) -> Sequence[GivenCommand]:
        return ()

    def depth(self) -> int:
        return len(self._device.program.interpreter.stack)

    def deferred(self) -> Sequence[StatementLocation]:
        control = self._device.program
        if control.running is None or self.state is not ProgramState.RUNS:
            return ()
        found = (self.location(step) for step in control.interpreter.deferred(control.running.code.entries))
        return [one for one in found if one is not None]

    def comes_back(self, location: StatementLocation) -> bool:
        return self._bank(location.text).comes_back(location.number)

    def use(self, location: StatementLocation) -> StatementUse:
        return use_of(self._bank(location.text).program.steps, location.number)

    def stack(self, now: Nanos) -> Sequence[Frame]:
        control = self._device.program
        if control.running is None:
            return ()
        text, interpreter = bank_text(control.running_bank), control.interpreter
        bank = self._bank(text)
        back = [step for step, _ in reversed(interpreter.stack)]
        interrupted, calls = (back[:1], back[1:]) if interpreter.handling else ([], back)
        # A JUMP that never comes back, such as the last one of a main loop, is no call (WBC-1 keeps its step nevertheless).
        numbers = [interpreter.place(now), *interrupted, *(step for step in calls if step == 0 or bank.comes_back(step - 1))]
        return [Frame(bank.name(number), StatementLocation(text, number)) for number in numbers]

    def stand(self, now: Nanos) -> ProgramStand | None:
        control, state, text = self._device.program, self.state, bank_text(self._device.program.running_bank)
        interpreter, fault = control.interpreter, control.fault
        if fault is not None:
            return ProgramStand(state, self._failed(text, fault), error=text_of(fault.text))
        if state is ProgramState.STOPPED:
            return ProgramStand(state) if self.texts else None
        if state is ProgramState.PAUSED:
            return ProgramStand(state, StatementLocation(text, interpreter.place(now)), interpreter.paused_at)
        if not interpreter.waits(now):
            return None
        return ProgramStand(state, StatementLocation(text, interpreter.place(now)), interpreter.waits_since(now))

    def _failed(self, text: str, fault: ProgramError) -> StatementLocation | None:
        """The statement that failed, while its text is there."""
        found = StatementLocation(text, self._device.program.interpreter.pc)
        statements = self.statements(text) if text in self.texts else ()
        is_there = found.number < len(statements) and statements[found.number].start == fault.span.start
        return found if is_there else None

    def variables(self, now: Nanos) -> Mapping[str, float]:
        return self._device.program.variables(now)

    def read(self, name: str, now: Nanos) -> float | None:
        control = self._device.program
        if control.running is None:
            return None
        source = self._bank(bank_text(control.running_bank)).meaning(name, control.dialect)
        match source:
            case Literal(value):
                return float(value)
            case Variable(index):
                return control.interpreter.cells_at(now)[index]
            case RegisterOperand(row, number):
                return float(ACCESS[row.key].read(number)(control, now))
        return None

    def has_name(self, name: str) -> bool:
        dialect = self._device.program.dialect
        return any(self._bank(text).meaning(name, dialect) is not None for text in self.texts)

    def point(self, name: str) -> str | None:
        found = parts(name.upper())
        if found is None:
            return None
        row, number = found
        return _POINTS[row.key].format(number) if row.key in _POINTS else None

    def set_variable(self, name: str, value: float, now: Nanos) -> None:
        self._device.command(lambda now: self._device.program.set_variable(name, value, now), now)

    def execute_all(self, on: bool, now: Nanos) -> None:
        self._device.command(lambda now: self._device.program.rest_in_loops(not on, now), now)


_STATES = {Control.STOPPED: ProgramState.STOPPED, Control.RUNNING: ProgramState.RUNS, Control.PAUSED: ProgramState.PAUSED}
_POINTS = {
    "$I": "USER_REGISTER[{}]:int",
    "$D": "USER_REGISTER[{}]:dint",
    "$R": "USER_REGISTER[{}]:real",
    "ACCM": "M{}_ACC",
    "DECM": "M{}_DEC",
    "VMAXM": "M{}_VMAX",
    "LIMLM": "M{}_POSLIM_L",
    "LIMRM": "M{}_POSLIM_R",
    "STATM": "M{}_STATUS",
    "ENC": "ENC{}_IMP",
    "XENC": "ENC{}_XPOS",
}
"""Registers of the controller, by the registers of the language."""


class _Bank:
    """A program with what is known of its text."""

    def __init__(self, program: LoadedProgram) -> None:
        self.program = program
        source, end = program.source, len(program.source.text)
        spans = [*((step.start, step.end) for step in program.steps), (end, end)]
        self.statements = tuple(Statement(start, end, source.position(start)[0]) for start, end in spans)
        self.labels = program.labels
        self._scope: ProgramScope | None = None
        self._named = sorted((number, name) for name, number in self.labels.items())

    @cached_property
    def after(self) -> Mapping[int, Sequence[int]]:
        following = self._flow.after
        return {number: following[number] for number, step in enumerate(self.program.steps) if not isinstance(step, BLOCK_MARKS)}

    def reached(self, starts: Collection[int]) -> Collection[int]:
        return self._flow.later((*starts, *self._flow.interrupts))

    @cached_property
    def _flow(self) -> ControlFlow:
        return flow_of(self.program.steps)

    @cached_property
    def _tree(self) -> ProgramTree:
        return parse(self.program.source.text)[0]

    def meaning(self, name: str, dialect: Dialect) -> ValueSource | None:
        """Meaning of a name in the text; its place in the text does not matter."""
        key = name.upper()
        for index, variable in enumerate(self.program.variables):
            if variable.upper() == key:
                return Variable(index, variable)
        if self._scope is None:
            self._scope = ProgramScope(self._tree, None, dialect, [])
        return self._scope.value(Identifier(0, 0, name, key))

    def comes_back(self, number: int) -> bool:
        return self._flow.comes_back(number)

    def name(self, number: int) -> str:
        """Name of the label at or before a statement."""
        found = bisect_right(self._named, number, key=lambda row: row[0])
        return self._named[found - 1][1] if found else BEGIN
