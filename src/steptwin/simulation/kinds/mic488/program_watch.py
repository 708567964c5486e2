"""Reports what a program of the MIC488 does: waits, writes to registers, motions, outputs, each with the statement that caused
it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos, PinEdge
from steptwin.diagnostics import visible
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import LoadedProgram
from steptwin.mic488.program_motion import finished
from steptwin.mic488.program_registers import ACCESS
from steptwin.mic488.registers import AXIS_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.kinds.mic488.statement_use import use_of
from steptwin.simulation.kinds.programs import ResourceKind
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.state import Plain
from steptwin.wbc import steps as s
from steptwin.wbc.controller import RegisterReader
from steptwin.wbc.real import real_text
from steptwin.wbc.resting import RestingLoop

_FOLLOWS = (AxisStatus.POSITION, AxisStatus.REACHED)
"""Statuses of an axis that follows its encoder."""


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

    @property
    def is_done(self) -> bool:
        """See `steptwin.simulation.kinds.kind.ProgramAct.is_done`: an interrupt comes of others itself."""
        return self.step is not None and self.code != "interrupt"


class ProgramWatch:
    """Observes the programs in the banks of a controller, as a part of its scheduler. ``happened`` is in order of time.

    It does not change the run: a hook before each statement notes what the statement may change, and that is compared before the
    next one, or when signals settle at the same moment.
    """

    def __init__(self, device: Mic488Device, scheduler: Scheduler, name: str) -> None:
        """``name``: the name of the controller in the scheduler."""
        self.device = device
        self._name = name
        self.happened: list[ProgramEvent] = []
        self._statement: tuple[Nanos, int | None] = (-1, None)
        self._pending: Callable[[], None] | None = None
        """Reports what the present statement has done."""
        self.program = next(iter(device.program.banks.programs.values()))
        """The one that was executed last."""
        self._axes = [(axis.status, axis.revision, axis.velocity_p) for axis in device.axes]
        self._resting: RestingLoop | None = None
        """The loop of which that was reported."""
        self._following: set[int] = set()
        """Axes that were reported to follow their encoders."""
        device.program.interpreter.add_hook(self._begins)
        scheduler.add_part(self, (name,))
        scheduler.hears_programs = True
        scheduler.edge_subscribers.append(self._edge)

    # ------------------------------------------------------------------ what the program does

    def _begins(self, now: Nanos, number: int) -> None:
        """Step ``number`` is executed now."""
        self._finish()
        if now == self._statement[0]:
            # What the statement before it did to axes comes first, and keeps its line.
            self.update(now)
        running = self.device.program.running
        if running is not None:
            self.program = running
        self._statement = now, number
        steps = self.program.steps
        step = steps[number] if number < len(steps) else None
        match step:
            case None | s.EndStep():
                self._emit(now, "end", "the program ends", number)
            case s.ProgResetStep():
                self._emit(now, "reset", "drives off, the program begins again", number)
            case s.InterruptStep():
                self._emit(now, "interrupt", f"interrupt of {step.event.name}", number)
            case s.ProgramStep(waits=s.StepWait.CONDITION | s.StepWait.MOTION):
                self._pending = partial(self._waits, now, number)
            case s.ProgramStep(waits=s.StepWait.TIME):
                self._pending = partial(self._delays, now, number)
            case s.SetStep(target=s.RegisterOperand() as register) if register.row.words:
                read = ACCESS[register.row.key].read(register.number)
                self._pending = partial(self._sets, now, number, register.name, read, read(self.device.program, now))

    def _finish(self) -> None:
        """Report what the statement that was executed last has done."""
        if self._pending is not None:
            pending, self._pending = self._pending, None
            pending()

    def _waits(self, now: Nanos, number: int) -> None:
        if self.device.program.interpreter.waiting:
            what = ", ".join(self._awaited(now, number))
            self._emit(now, "wait", f"waits for {what}" if what else "waits", number)

    def _awaited(self, now: Nanos, number: int) -> Iterable[str]:
        """The inputs, axes and values that decide how long a statement waits."""
        for resource in dict.fromkeys(use_of(self.program.steps, number).reads):
            if resource.kind is ResourceKind.ORIGIN:
                continue  # that of an axis that is there, too
            if resource.kind is ResourceKind.ENCODER:
                yield f"ENC{resource.name}"
            elif resource.kind is not ResourceKind.AXIS:
                yield resource.name or "inputs"
            elif resource.name:
                yield f"M{resource.name}"
            else:
                yield from (f"M{axis.number}" for axis in self.device.axes if not finished(axis, now))

    def _delays(self, now: Nanos, number: int) -> None:
        duration = self.device.program.interpreter.not_before - now
        self._emit(now, "delay", f"waits {real_text(duration / SECOND)} s", number)

    def _sets(self, now: Nanos, number: int, name: str, read: RegisterReader, before: float) -> None:
        after = read(self.device.program, now)
        if after != before:
            self._emit(now, "register", f"{name} = {real_text(after)}", number)

    def line(self, step: int) -> int:
        """Line of the program's text, from 1."""
        steps, source = self.program.steps, self.program.source
        return source.position(steps[step].start if step < len(steps) else len(source.text))[0]

    # ------------------------------------------------------------------ what the controller does

    def _emit(self, now: Nanos, code: str, text: str, step: int | None = None) -> None:
        self.happened.append(ProgramEvent(now, code, text, step, self.program))

    def _caused(self, now: Nanos) -> int | None:
        """The step that was executed at ``now``, if any."""
        moment, step = self._statement
        return step if moment == now else None

    def _edge(self, name: str, edge: PinEdge) -> None:
        if name == self._name and (edge.pin.startswith("OUT") or edge.pin == "ERR"):
            self._emit(edge.time, "output", f"{edge.pin} {'on' if edge.value else 'off'}", self._caused(edge.time))

    def deadline(self) -> Nanos | None:
        """None: the part of the scheduler only watches the axes."""
        return None

    def update(self, now: Nanos) -> None:
        """Report what the present statement has done, and the motions that axes have begun or ended."""
        self._finish()
        loop = self.device.program.interpreter.resting_loop
        if loop is not None and loop is not self._resting and self.happened:
            last = self.happened[-1]
            if last.code in ("delay", "wait") and last.time > now - 2 * loop.period:
                self._emit(now, "rest", "the loop goes on like this", self._statement[1])
        self._resting = loop
        for index, axis in enumerate(self.device.axes):
            known = self._axes[index]
            if index in self._following and axis.control.is_following and axis.status in _FOLLOWS:
                continue  # told once: it comes to where its shaft was, and goes on, up to a hundred times a second
            if axis.revision != known[1] or axis.status is not known[0]:
                self._axes[index] = axis.status, axis.revision, axis.velocity_p
                follows = axis.control.is_following and axis.status is AxisStatus.POSITION
                (self._following.add if follows else self._following.discard)(index)
                self._emit_axis(axis, known[0], known[2], now)

    def _emit_axis(self, axis: Axis, before: AxisStatus, velocity_p: float, now: Nanos) -> None:
        """Report a changed status or motion of an axis; ``before``: its status at the last report."""
        step = self._caused(now)
        kind = None if step is None or step >= len(self.program.steps) else self.program.steps[step]
        effect = s.NO_EFFECT if kind is None else kind.effect()
        moves = effect.on_drives and not effect.everything
        if axis.status is not before or moves or (axis.status is AxisStatus.VELOCITY and axis.velocity_p != velocity_p):
            caused = effect.on_drives or isinstance(kind, s.SetStep)
            self._emit(now, "axis", _describe(axis, before, now), step if caused else None)

    def copy_state(self) -> Plain:
        return ()

    def set_state(self, plain: Plain) -> None:
        """It has none."""


def _describe(axis: Axis, before: AxisStatus, now: Nanos) -> str:
    """The present motion of an axis as text."""
    name, unit, gear = f"M{axis.number}", axis.config.unit_name, axis.gear
    position = f"{real_text(axis.coordinate_p(now) / gear)} {unit}"
    match axis.status:
        case AxisStatus.OFF:
            return f"{name} off"
        case AxisStatus.ON if before is AxisStatus.OFF:
            return f"{name} on"
        case AxisStatus.ON:
            return f"{name} at rest at {position}"
        case AxisStatus.VELOCITY if axis.velocity_p == 0.0:
            return f"{name} slows down from {real_text(axis.profile.velocity(now) / gear)} {unit}/s"
        case AxisStatus.VELOCITY:
            return f"{name} runs at {real_text(axis.velocity_p / gear)} {unit}/s"
        case AxisStatus.POSITION if axis.control.is_following:
            return f"{name} follows its encoder"
        case AxisStatus.POSITION:
            return f"{name} moves to {real_text((axis.target_p + axis.offset_p) / gear)} {unit}"
        case AxisStatus.HOMING:
            return f"{name} homes"
        case status:
            return f"{name} at {position}, {AXIS_STATUS_TEXTS[status]}"
