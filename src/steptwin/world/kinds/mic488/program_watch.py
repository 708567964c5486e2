"""Reports what a program of the MIC488 does: waits, writes to registers, motions, outputs, each with the statement that caused
it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from steptwin.diagnostics import visible
from steptwin.machine import SECOND, Nanos, PinEdge
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program import LoadedProgram
from steptwin.mic488.program_registers import ACCESS
from steptwin.mic488.registers import AXIS_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus
from steptwin.state import Plain
from steptwin.wbc import steps as s
from steptwin.wbc.code import Cells, Execution, StepCode
from steptwin.wbc.real import real_text
from steptwin.world.kernel import Kernel


class ProgramEvent(NamedTuple):
    """An action or event to report. ``step`` is the step of ``program`` that caused it, if one did."""

    time: Nanos
    code: str
    text: str
    step: int | None = None
    program: LoadedProgram | None = None

    @property
    def place(self) -> str:
        """Line number and text of the statement; empty if no statement caused it."""
        if self.program is None or self.step is None or self.step >= len(self.program.steps):
            return ""
        found, source = self.program.steps[self.step], self.program.source
        return f"{source.position(found.start)[0]:>4}  {visible(source.text[found.start : found.end].strip())}"


def watch_program(device: Mic488Device, kernel: Kernel, name: str) -> ProgramWatch | None:
    """See `steptwin.world.kind.ControllerKind.watch_program`."""
    return ProgramWatch(device, kernel, name) if device.program.programs else None


class ProgramWatch:
    """Observes the programs in the banks of a controller, as a part of its kernel. ``happened`` is in order of time.

    It does not change the run: the code of each step is wrapped by one that compares the state before and after.
    """

    def __init__(self, device: Mic488Device, kernel: Kernel, name: str) -> None:
        """``name``: the name of the controller in the kernel."""
        self.device = device
        self._name = name
        self.happened: list[ProgramEvent] = []
        self._statement: tuple[Nanos, int | None] = (-1, None)
        self._told_wait: int | None = None
        programs: Mapping[int, LoadedProgram] = dict(device.program.programs)
        for bank, program in programs.items():
            self.program = program
            steps = [self._watched(number, step) for number, step in enumerate(program.code.steps)]
            if len(programs) > 1:
                steps = [self._of(program, step) for step in steps]
            device.program.programs[bank] = replace(program, code=replace(program.code, steps=tuple(steps)))
        self._axes = [(axis.status, axis.revision, axis.velocity_p) for axis in device.axes]
        kernel.add_part(self)
        kernel.observers.append(self._edge)

    def _of(self, program: LoadedProgram, code: StepCode) -> StepCode:
        """The code of a step if there are several programs; it also marks its program as the one that acts."""

        def step(machine: Execution, cells: Cells) -> int:
            self.program = program
            return code(machine, cells)

        return step

    def _executed(self, now: Nanos, number: int) -> None:
        """Step ``number`` is executed."""

    # ------------------------------------------------------------------ what the program does

    def _watched(self, number: int, code: StepCode) -> StepCode:
        """The code of a step, wrapped so that its effects are reported."""
        steps = self.program.steps
        if number == len(steps):
            return self._telling(number, code, "end", "the program ends")
        step = steps[number]
        if isinstance(step, s.WaitStep | s.WaitPosStep):
            return self._waiting(number, code)
        if isinstance(step, s.DelayStep):
            return self._delaying(number, code)
        if isinstance(step, s.EndStep):
            return self._telling(number, code, "end", "the program ends")
        if isinstance(step, s.ProgResetStep):
            return self._telling(number, code, "reset", "drives off, the program begins again")
        if isinstance(step, s.InterruptStep):
            return self._telling(number, code, "interrupt", f"interrupt of {step.event.name}")
        if isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand) and step.target.row.words:
            return self._setting(number, code, step.target)
        return self._noting(number, code)

    def _noting(self, number: int, code: StepCode) -> StepCode:
        def step(machine: Execution, cells: Cells) -> int:
            self._note(machine.now, number)
            return code(machine, cells)

        return step

    def _telling(self, number: int, code: StepCode, kind: str, text: str) -> StepCode:
        def step(machine: Execution, cells: Cells) -> int:
            self._note(machine.now, number)
            self._tell(machine.now, kind, text, number)
            return code(machine, cells)

        return step

    def _waiting(self, number: int, code: StepCode) -> StepCode:
        def step(machine: Execution, cells: Cells) -> int:
            told = self._told_wait
            self._note(machine.now, number)
            following = code(machine, cells)
            if machine.waiting:
                self._told_wait = number
                if told != number:
                    self._tell(machine.now, "wait", "waits", number)
            return following

        return step

    def _delaying(self, number: int, code: StepCode) -> StepCode:
        def step(machine: Execution, cells: Cells) -> int:
            self._note(machine.now, number)
            following = code(machine, cells)
            self._tell(machine.now, "delay", f"waits {real_text((machine.not_before - machine.now) / SECOND)} s", number)
            return following

        return step

    def _setting(self, number: int, code: StepCode, register: s.RegisterOperand) -> StepCode:
        read = ACCESS[register.row.key].read(register.number)

        def step(machine: Execution, cells: Cells) -> int:
            self._note(machine.now, number)
            before = read(machine.controller, machine.now)
            following = code(machine, cells)
            after = read(machine.controller, machine.now)
            if after != before:
                self._tell(machine.now, "register", f"{register.name} = {real_text(after)}", number)
            return following

        return step

    def _note(self, now: Nanos, number: int) -> None:
        """Step ``number`` is executed."""
        if now == self._statement[0]:
            # What the statement before it did to axes comes first, and keeps its line.
            self.look(now)
        self._statement = now, number
        self._told_wait = None
        self._executed(now, number)

    def line(self, step: int) -> int:
        """Line of the program's text, from 1."""
        steps, source = self.program.steps, self.program.source
        return source.position(steps[step].start if step < len(steps) else len(source.text))[0]

    # ------------------------------------------------------------------ what the controller does

    def _tell(self, now: Nanos, code: str, text: str, step: int | None = None) -> None:
        self.happened.append(ProgramEvent(now, code, text, step, self.program))

    def _caused(self, now: Nanos) -> int | None:
        """The step that was executed at ``now``, if any."""
        moment, step = self._statement
        return step if moment == now else None

    def _edge(self, name: str, edge: PinEdge) -> None:
        if name == self._name and (edge.pin.startswith("OUT") or edge.pin == "ERR"):
            self._tell(edge.time, "output", f"{edge.pin} {'on' if edge.value else 'off'}", self._caused(edge.time))

    def deadline(self) -> Nanos | None:
        """Of the part of the kernel that watches the axes: it only looks."""
        return None

    def look(self, now: Nanos) -> None:
        """Report the motions that axes have begun or ended."""
        for index, axis in enumerate(self.device.axes):
            known = self._axes[index]
            if axis.revision != known[1] or axis.status is not known[0]:
                self._axes[index] = axis.status, axis.revision, axis.velocity_p
                self._tell_of(axis, known[0], known[2], now)

    def _tell_of(self, axis: Axis, before: AxisStatus, velocity_p: float, now: Nanos) -> None:
        """Report a changed status or motion of an axis; ``before``: its status at the last report."""
        step = self._caused(now)
        kind = None if step is None or step >= len(self.program.steps) else self.program.steps[step]
        moves = isinstance(kind, s.MotionStep | s.HaltStep | s.RowMotionStep)
        if axis.status is not before or moves or (axis.status is AxisStatus.VELOCITY and axis.velocity_p != velocity_p):
            caused = moves or isinstance(kind, s.SetStep | s.EndStep | s.ProgResetStep)
            self._tell(now, "axis", _words(axis, before, now), step if caused else None)

    def copy_state(self) -> Plain:
        return ()

    def set_state(self, plain: Plain) -> None:
        """It has none."""


def _words(axis: Axis, before: AxisStatus, now: Nanos) -> str:
    """The present motion of an axis as text."""
    name, unit, gear = f"M{axis.number}", axis.config.unit_name, axis.gear
    place = f"{real_text(axis.coordinate_p(now) / gear)} {unit}"
    match axis.status:
        case AxisStatus.OFF:
            return f"{name} off"
        case AxisStatus.ON if before is AxisStatus.OFF:
            return f"{name} on"
        case AxisStatus.ON:
            return f"{name} at rest at {place}"
        case AxisStatus.VELOCITY if axis.velocity_p == 0.0:
            return f"{name} slows down from {real_text(axis.profile.velocity(now) / gear)} {unit}/s"
        case AxisStatus.VELOCITY:
            return f"{name} runs at {real_text(axis.velocity_p / gear)} {unit}/s"
        case AxisStatus.POSITION:
            return f"{name} moves to {real_text((axis.target_p + axis.offset_p) / gear)} {unit}"
        case AxisStatus.HOMING:
            return f"{name} homes"
        case status:
            return f"{name} at {place}, {AXIS_STATUS_TEXTS[status]}"
