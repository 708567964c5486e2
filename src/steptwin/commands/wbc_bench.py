"""A MIC488 in virtual time with a program, a hand on its inputs, and somebody who writes down what the program does."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.files.timedinputs import TimedInput
from steptwin.machine import SECOND, Edge, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.config import ControllerConfig, ProgramConfig
from steptwin.mic488.device import Event, Mic488
from steptwin.mic488.homing import Homing
from steptwin.mic488.inputs import index_input
from steptwin.mic488.program import LoadedProgram, ProgramState
from steptwin.mic488.program_registers import ACCESS
from steptwin.mic488.registers import AXES, AXIS_STATUS_TEXTS
from steptwin.mic488.status import Status
from steptwin.state import Plain
from steptwin.wbc import steps as s
from steptwin.wbc.compile import Cells, StepCode
from steptwin.wbc.machine import Machine
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.real import real_text
from steptwin.wbc.usage import homing_sides
from steptwin.world.contacts import PositionSwitch, place
from steptwin.world.kernel import Kernel, PinName
from steptwin.world.trace import Record, Trace

NAME = "mic488"
"""Of the machine in traces."""
PROGRAM = "program"
"""The subject of its statements."""

SLICE_NS: Nanos = 10 * SECOND
"""The longest stretch of time between two looks at whether anything is still going on."""

ASSUMED_TRAVEL_S = 0.1
"""How far from the place at power-on a switch is assumed, for homing: what VMAX covers in this time."""
ASSUMED_FAR_S = 10.0
"""The same for KR where a program homes to both sides: it has to leave a way between the switches."""


class Happening(NamedTuple):
    """Something to tell. ``step`` is the step of the program that caused it, where one did."""

    time: Nanos
    code: str
    text: str
    step: int | None = None


class Travel(NamedTuple):
    """Where the switches of ``axis`` (from 1) are, in configured units seen from the place at power-on; None: no switch."""

    axis: int
    low_u: float | None
    high_u: float | None


class Ending(NamedTuple):
    """When a run ended, and why: the program has ``ended``, it is ``waiting`` for ever, or the ``limit`` came."""

    at: Nanos
    why: str


class Bench:
    """The program starts at power-on. ``happened`` grows until somebody takes from it, in order of time.

    Switches are placed where ``travels`` say. For an axis they do not name, the switches its HOMEs look for are assumed near the
    place at power-on, unless an input of the run moves their pin. ``assumed`` lists them as text.
    """

    def __init__(
        self,
        program: LoadedProgram,
        positions: PositionTable | None,
        config: ControllerConfig,
        *,
        firmware: str,
        statement_time: Nanos,
        trace: Trace | None = None,
    ) -> None:
        self.program = program
        self.happened: list[Happening] = []
        self.assumed: list[str] = []
        self.now: Nanos = 0
        self._trace = trace
        self._records: list[Record] = []
        self._statement: tuple[Nanos, int | None] = (-1, None)
        self._told_wait: int | None = None
        self._switched: set[str] = set()
        steps = [self._watched(number, step) for number, step in enumerate(program.code.steps)]
        watched = replace(program, code=replace(program.code, steps=tuple(steps)))
        self.device = Mic488(
            replace(config, program=ProgramConfig(activate=1)),
            firmware,
            programs={0: watched},
            positions={} if positions is None else {0: positions},
            statement_time=statement_time,
        )
        self.device.on_event = self._event
        for event in self.device.events:  # what power-on has to say
            self._event(event)
        self._axes = [(axis.status, axis.revision, axis.velocity_p) for axis in self.device.axes]
        self._kernel = Kernel(record=None if trace is None else self._records.append)
        self._kernel.add(NAME, self.device)
        self._kernel.add_part(self)
        self._kernel.observers.append(self._edge)

    # ------------------------------------------------------------------ switches

    def place_switches(self, travels: Sequence[Travel], driven: set[str]) -> None:
        """Put switches where ``travels`` say, or where they have to be for homing; not on the pins in ``driven``."""
        known = {travel.axis: travel for travel in travels}
        homed = homing_sides(self.program.steps)
        self._switched |= driven
        for axis in self.device.axes:
            config, travel = axis.config, known.get(axis.number)
            if travel is not None:
                low_u, high_u = travel.low_u, travel.high_u
            else:
                low_u, high_u = self._assume(axis, homed.get(axis.number, frozenset()), driven)
            self._place(axis, "KL", config.in_kl, None, low_u)
            self._place(axis, "KR", config.in_kr, high_u, None)

    def _assume(self, axis: Axis, sides: frozenset[int], driven: set[str]) -> tuple[float | None, float | None]:
        """Where KL and KR of an axis have to be that is homed to ``sides`` (`homing_sides`); None for no switch."""
        config = axis.config
        has_kl, has_kr = (
            number < len(self.device.inputs.pins) and f"IN{number + 1}" not in driven for number in (config.in_kl, config.in_kr)
        )
        if 0 in sides:
            sides |= {-1 if has_kl else 1}
        low_u = -config.vel * ASSUMED_TRAVEL_S if has_kl and -1 in sides else None
        high_u = None
        if has_kr and 1 in sides:
            high_u = config.vel * (ASSUMED_FAR_S if -1 in sides else ASSUMED_TRAVEL_S)
        for name, number, edge_u in (("KL", config.in_kl, low_u), ("KR", config.in_kr, high_u)):
            if edge_u is not None:
                where = f"{real_text(edge_u)} {config.unit_name}"
                example = f"--travel M{axis.number}={'LOW..' if name == 'KL' else '..HIGH'} says otherwise"
                self.assumed.append(f"M{axis.number}: {name} on IN{number + 1} assumed at {where} ({example})")
        return low_u, high_u

    def missing_switches(self) -> list[str]:
        """Of every axis that homes: what it waits for, where nothing in the run can bring that about."""
        homing = [(axis.number, self._missing(axis)) for axis in self.device.axes if axis.status is Status.HOMING]
        return [f"M{number} homes {reason}" for number, reason in homing if reason is not None]

    def _missing(self, axis: Axis) -> str | None:
        homing = axis.homing
        if homing.leg == Homing.TO_STOP:
            return "to a mechanical stop: a run without a world has none"
        if homing.leg == Homing.TO_INDEX:
            pin = f"IN{index_input(axis.number - 1) + 1}"
            missing = f"to channel C of its encoder on {pin}, which nothing switches: --input {pin}=1@TIME"
            return None if pin in self._switched else missing
        side = "KL" if homing.velocity_p < 0 else "KR"
        if homing.sensor >= len(self.device.inputs.pins):
            return f"to {side}, for which the configuration has no input (In{side} of [Axis{axis.number - 1}])"
        pin = f"IN{homing.sensor + 1}"
        if pin in self._switched:
            return None
        ends = "LOW.." if side == "KL" else "..HIGH"
        return f"to {side} on {pin}, which nothing switches: --travel M{axis.number}={ends}"

    def _place(self, axis: Axis, name: str, number: int, low_u: float | None, high_u: float | None) -> None:
        if low_u is None and high_u is None:
            return
        if number >= len(self.device.inputs.pins):
            raise Misuse(f"--travel M{axis.number}: the configuration has no {name} for this axis")
        self._switched.add(f"IN{number + 1}")
        low, high = (None if edge_u is None else round(edge_u * axis.gear) for edge_u in (low_u, high_u))
        closed = self.device.config.inputs[number].level == 1
        place(self._kernel, PositionSwitch(NAME, axis.number, low, high, PinName(NAME, f"IN{number + 1}"), closed))

    # ------------------------------------------------------------------ what the program does

    def _watched(self, number: int, code: StepCode) -> StepCode:
        """The code of a step that tells what it does."""
        steps = self.program.steps
        if number == len(steps):
            return self._telling(number, code, "end", "the program ends")
        step = steps[number]
        if isinstance(step, s.Wait | s.WaitPos):
            return self._waiting(number, code)
        if isinstance(step, s.Delay):
            return self._delaying(number, code)
        if isinstance(step, s.End):
            return self._telling(number, code, "end", "the program ends")
        if isinstance(step, s.ProgReset):
            return self._telling(number, code, "reset", "drives off, the program begins again")
        if isinstance(step, s.Entry):
            return self._telling(number, code, "interrupt", f"interrupt of {step.event.name}")
        if isinstance(step, s.Set) and isinstance(step.target, s.Register) and step.target.row.words:
            return self._setting(number, code, step.target)
        return self._noting(number, code)

    def _noting(self, number: int, code: StepCode) -> StepCode:
        def step(machine: Machine, cells: Cells) -> int:
            self._note(machine.now, number)
            return code(machine, cells)

        return step

    def _telling(self, number: int, code: StepCode, kind: str, text: str) -> StepCode:
        def step(machine: Machine, cells: Cells) -> int:
            self._note(machine.now, number)
            self._tell(machine.now, kind, text, number)
            return code(machine, cells)

        return step

    def _waiting(self, number: int, code: StepCode) -> StepCode:
        def step(machine: Machine, cells: Cells) -> int:
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
        def step(machine: Machine, cells: Cells) -> int:
            self._note(machine.now, number)
            following = code(machine, cells)
            self._tell(machine.now, "delay", f"waits {real_text((machine.not_before - machine.now) / SECOND)} s", number)
            return following

        return step

    def _setting(self, number: int, code: StepCode, register: s.Register) -> StepCode:
        read = ACCESS[register.row.key].read(register.number)

        def step(machine: Machine, cells: Cells) -> int:
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
        if self._trace is not None:
            self._records.append(Record(now, NAME, "statement", PROGRAM, self.line(number)))

    def line(self, step: int) -> int:
        """Line of the program's text, from 1."""
        steps, source = self.program.steps, self.program.source
        return source.position(steps[step].start if step < len(steps) else len(source.text))[0]

    # ------------------------------------------------------------------ what the controller does

    def _tell(self, now: Nanos, code: str, text: str, step: int | None = None) -> None:
        self.happened.append(Happening(now, code, text, step))

    def _caused(self, now: Nanos) -> int | None:
        """The step that did what happens at ``now``, if one was executed then."""
        moment, step = self._statement
        return step if moment == now else None

    def _event(self, event: Event) -> None:
        self._tell(event.time, event.code, event.text, self._caused(event.time))
        if self._trace is not None:
            self._records.append(Record(event.time, NAME, "event", event.code, event.text))

    def _edge(self, _name: str, edge: Edge) -> None:
        if edge.pin.startswith("OUT") or edge.pin == "ERR":
            self._tell(edge.time, "output", f"{edge.pin} {'on' if edge.value else 'off'}", self._caused(edge.time))

    def deadline(self) -> Nanos | None:
        """Of the part of the kernel that watches the axes: it only looks."""
        return None

    def look(self, now: Nanos) -> None:
        """Tell what axes have begun or ended."""
        for index, axis in enumerate(self.device.axes):
            known = self._axes[index]
            if axis.revision != known[1] or axis.status is not known[0]:
                self._axes[index] = axis.status, axis.revision, axis.velocity_p
                self._tell_of(axis, known[0], known[2], now)

    def _tell_of(self, axis: Axis, before: Status, velocity_p: float, now: Nanos) -> None:
        """An axis has another status than ``before``, or another motion."""
        step = self._caused(now)
        kind = None if step is None or step >= len(self.program.steps) else self.program.steps[step]
        moves = isinstance(kind, s.Motion | s.Halt | s.RowMotion)
        if axis.status is not before or moves or (axis.status is Status.VELOCITY and axis.velocity_p != velocity_p):
            caused = moves or isinstance(kind, s.Set | s.End | s.ProgReset)
            self._tell(now, "axis", _words(axis, before, now), step if caused else None)

    def copy_state(self) -> Plain:
        return ()

    def set_state(self, plain: Plain) -> None:
        """It has none."""

    # ------------------------------------------------------------------ a run

    def run(self, inputs: Sequence[TimedInput], limit: Nanos, *, until_idle: bool) -> Ending:
        """Until the program has ended and the drives stand, at most to ``limit``; with ``until_idle`` also where nothing will
        happen any more. ``inputs`` in order."""
        waiting = deque(inputs)
        while True:
            while waiting and waiting[0].time <= self.now:
                self._set_pin(waiting.popleft())
            due = self._kernel.deadline()
            if due is None and self.device.program.state is ProgramState.STOPPED and not waiting:
                return Ending(self._settled(), "ended")
            if self.now >= limit:
                return Ending(limit, "limit")
            if due is None and not waiting and until_idle:
                return Ending(self._settled(), "waiting")
            moment = limit if due is None else max(due, self.now + SLICE_NS)
            self._advance(min(moment, limit, waiting[0].time if waiting else limit))

    def _settled(self) -> Nanos:
        """From when on nothing has happened, and every axis stands or keeps its velocity."""
        last = max((happening.time for happening in self.happened), default=0)
        for axis in self.device.axes:
            profile = axis.profile
            last = max(last, profile.start, *(profile.start + int(end) for end in profile.ends if end != inf))
        return min(last, self.now)

    def _advance(self, now: Nanos) -> None:
        self._kernel.advance(now)
        self.device.advance(now)
        self.now = now
        self._flush()

    def _flush(self) -> None:
        if self._trace is not None:
            self._records.sort(key=lambda record: record.time)
            for record in self._records:
                self._trace.add(record)
            self._records.clear()

    def _set_pin(self, change: TimedInput) -> None:
        level = f"{real_text(change.value)} V" if change.pin.startswith("AIN") else "on" if change.value else "off"
        self._tell(self.now, "input", f"{change.pin} {level}")
        if self._trace is not None and (change.pin.startswith("AIN") or self.device.pins()[change.pin] != change.value):
            self._records.append(Record(self.now, NAME, "edge", change.pin, change.value))
        self.device.set_pin(change.pin, change.value, self.now)


def _words(axis: Axis, before: Status, now: Nanos) -> str:
    """What an axis does from now on."""
    name, unit, gear = f"M{axis.number}", axis.config.unit_name, axis.gear
    place = f"{real_text(axis.coordinate_p(now) / gear)} {unit}"
    match axis.status:
        case Status.OFF:
            return f"{name} off"
        case Status.ON if before is Status.OFF:
            return f"{name} on"
        case Status.ON:
            return f"{name} stands at {place}"
        case Status.VELOCITY if axis.velocity_p == 0.0:
            return f"{name} slows down from {real_text(axis.profile.velocity(now) / gear)} {unit}/s"
        case Status.VELOCITY:
            return f"{name} runs at {real_text(axis.velocity_p / gear)} {unit}/s"
        case Status.POSITION:
            return f"{name} goes to {real_text((axis.target_p + axis.offset_p) / gear)} {unit}"
        case Status.HOMING:
            return f"{name} homes"
        case status:
            return f"{name} at {place}, {AXIS_STATUS_TEXTS[status]}"


def parse_travel(text: str) -> list[Travel]:
    """``M1=-10..250,M2=-5..`` → switches of axes. Raises `Misuse`."""
    travels: list[Travel] = []
    for part in filter(None, map(str.strip, text.split(","))):
        name, _, ends = part.partition("=")
        low, dots, high = ends.partition("..")
        number = name.strip().upper().removeprefix("M")
        try:
            low_u, high_u = (float(end) if end.strip() else None for end in (low, high))
        except ValueError:
            dots = ""
            low_u = high_u = None
        if not dots or not number.isdecimal() or not 1 <= int(number) <= AXES:
            raise Misuse(f"--travel {part}: expected Mn=LOW..HIGH, such as M1=-10..250 or M1=-10..")
        if low_u is not None and high_u is not None and low_u >= high_u:
            raise Misuse(f"--travel {part}: {real_text(low_u)} must be below {real_text(high_u)}")
        travels.append(Travel(int(number), low_u, high_u))
    return travels
