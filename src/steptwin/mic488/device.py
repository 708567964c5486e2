"""The MIC488 as a pure machine: four axes, inputs and outputs, memory, program control."""

from __future__ import annotations

import traceback
from array import array
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import MILLISECOND, Edge, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.behaviour import MOTIONS
from steptwin.mic488.config import ANALOG_INPUTS, ControllerConfig
from steptwin.mic488.encoder import Coupling, Motion
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN
from steptwin.mic488.inputs import Inputs
from steptwin.mic488.position_control import PositionControl
from steptwin.mic488.program import LoadedProgram, ProgramControl
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, INPUTS, OUTPUTS, register_map
from steptwin.mic488.slave import slave
from steptwin.mic488.status import ControllerStatus, Status
from steptwin.mic488.vision import Record
from steptwin.state import Plain, Stateful
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wbc.positions import PositionTable
from steptwin.wire.pdu import DEVICE_FAILURE, exception_pdu

MAX_EVENTS_PER_INSTANT = 10_000
"""More than this at one moment is a runaway, not a motion."""

EVENTS_KEPT = 1000

_ERROR = Status.ERROR
"""Asked for at every instant: a member found through its class costs more than all the rest of the question."""


class Event(NamedTuple):
    """Something that happened and that no register shows."""

    time: Nanos
    axis: int | None
    code: str
    text: str


INPUT_PINS = {f"IN{n + 1}": n for n in range(INPUTS)}
ANALOG_PINS = {f"AIN{n + 1}": n for n in range(ANALOG_INPUTS)}
OUTPUT_PINS = tuple(f"OUT{n + 1}" for n in range(OUTPUTS))
ENABLE_PINS = tuple(f"M{n + 1}_EN" for n in range(AXES))
PINS = (*INPUT_PINS, *ANALOG_PINS, *OUTPUT_PINS, *ENABLE_PINS, "ERR")


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All state of a controller at a moment, and what it belongs to. It can be pickled; profiles are shared."""

    config: ControllerConfig
    firmware: str
    state: Plain
    banks: tuple[tuple[int, str], ...] = ()
    """Texts of programs and position tables."""


def check_pin(pin: str, value: float) -> None:
    """`Misuse` unless ``pin`` is an input that can take ``value``."""
    name = pin.upper()
    if name in INPUT_PINS:
        if value not in (0.0, 1.0):
            raise Misuse(f"{name} = {value:g}: a digital input is 0 or 1")
    elif name in ANALOG_PINS:
        if not 0.0 <= value <= 10.0:
            raise Misuse(f"{name} = {value:g} V: an analog input takes 0 to 10 V")
    else:
        raise Misuse(f"no input pin {pin!r}: inputs are IN1 to IN{INPUTS} and AIN1 to AIN{ANALOG_INPUTS}")


def check_turn(axis: int, counts: int) -> None:
    """`Misuse` unless there is such an axis, whose encoder can be turned by ``counts`` at once."""
    if not 1 <= axis <= AXES:
        raise Misuse(f"no axis M{axis}: axes are M1 to M{AXES}")
    if not DINT_MIN <= counts <= DINT_MAX:
        raise Misuse(f"M{axis}: {counts} encoder counts at once: permitted {DINT_MIN}…{DINT_MAX}")


def pause_observer(devices: Mapping[int, Mic488]) -> Callable[[int, Nanos], None]:
    """For ports that serve ``devices``: an event for a request with a pause inside (unit, 0 for all; pause in ns), see MIC-15."""

    def observe(unit: int, pause: Nanos) -> None:
        text = f"a request had a pause of {pause / MILLISECOND:.1f} ms inside: the controller drops a frame at 0.75 ms (MIC-15)"
        for device in devices.values() if unit == 0 else (devices[unit],):
            device.event("frame-pause", text)

    return observe


_NO_BANKS: Mapping[int, Any] = MappingProxyType({})


def _nothing() -> None:
    pass


class Serving(Protocol):
    """What serves the requests of a controller: its `Slave`, or something in front of that."""

    def answer(self, device: Mic488, pdu: bytes) -> bytes: ...


class Mic488(Stateful):
    """One controller. Commands and inputs are applied after everything that is due at their moment.

    ``memory`` are the stored user registers (two bytes each, high byte first; none stored: all 0); `Misuse` when their number
    is wrong. ``lenient`` lets masters read holes and write-only registers (MIC-3). ``programs`` and ``positions`` are what is in
    the banks at power-on (`steptwin.mic488.program.load` makes programs), ``statement_time`` what one statement takes (WBC-6).

    Hooks: ``store`` is called with the stored user registers when they are saved and returns when they are safe; an `OSError`
    says that they are not, bytes say what was stored instead. ``slave`` serves the requests. ``changed`` is called whenever the
    next deadline or an output may have changed, ``on_event`` for every event.
    """

    __slots__ = (
        "_due",
        "_edges",
        "_others",
        "analog_v",
        "axes",
        "changed",
        "config",
        "data_type",
        "error_led",
        "events",
        "firmware",
        "inputs",
        "jog_speed_u",
        "lenient",
        "master_error",
        "memory",
        "now",
        "on_event",
        "outputs",
        "program",
        "registers",
        "slave",
        "store",
        "trigger_mode",
        "triggered",
        "user",
        "written",
    )
    FIXED = frozenset({"changed", "config", "firmware", "lenient", "on_event", "registers", "slave", "store"})

    def __init__(
        self,
        config: ControllerConfig,
        firmware: str = DEFAULT_FIRMWARE,
        *,
        lenient: bool = False,
        memory: bytes | None = None,
        programs: Mapping[int, LoadedProgram] = _NO_BANKS,
        positions: Mapping[int, PositionTable] = _NO_BANKS,
        statement_time: Nanos = STATEMENT_TIME,
    ) -> None:
        self.config = config
        self.registers = register_map(firmware)
        self.firmware = self.registers.firmware
        self.lenient = lenient
        self.slave: Serving = slave(firmware, lenient=lenient)
        self.store: Callable[[bytes], bytes | None] | None = None
        self.changed: Callable[[], None] = _nothing
        self.on_event: Callable[[Event], None] | None = None

        self.now: Nanos = 0
        self.memory = self._checked_memory(memory)
        self.events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._edges: list[Edge] = []
        self._due: Nanos | None = None
        self._others: Nanos | None = None
        """When something is due next, and of that when anything but the program is."""
        self.inputs = Inputs(config.inputs)
        self.analog_v = [0.0] * ANALOG_INPUTS
        self.outputs = [False] * OUTPUTS
        self.axes = tuple(Axis(n, config.axes[n - 1], self) for n in range(1, AXES + 1))
        self.program = ProgramControl(self, programs, positions, statement_time)
        self.error_led = False
        self.master_error = False
        """Whether a slave of the controller's own Modbus master does not answer, which only a fault brings about (WBC-13)."""
        self._power_on()

    def _power_on(self) -> None:
        """MIC-27; axes, inputs and outputs are in that state already."""
        self.data_type = 0
        self.trigger_mode = 0
        self.triggered = dict.fromkeys(MOTIONS, 0)
        self.jog_speed_u = self.config.axes[0].vel
        self.user = array("H", bytes(2 * self.firmware.user_registers))
        self.written: dict[tuple[str, int | None], float] = {}
        """Last values of write-only registers by key and number, in pulses where they have a unit; kept when lenient."""
        self.program.power_on(self.now)
        self.touch()

    def power_cycle(self, now: Nanos) -> None:
        """Off and on again: registers as after power-on; terminals, shafts and the non-volatile memory stay as they are."""
        self.advance(now)
        for number in range(OUTPUTS):
            self.set_output(number, False)
        for axis in self.axes:
            axis.disable(now)
            axis.power_on(now)
        self.inputs.power_on()
        self.event("power-on", "power-on")
        self._power_on()

    def power_off(self, now: Nanos) -> None:
        """Program, drives and outputs off. Until a `power_cycle` nothing more is to be asked of the controller."""
        self.advance(now)
        self.program.command(0, now)
        for number in range(OUTPUTS):
            self.set_output(number, False)
        for axis in self.axes:
            axis.disable(now)
        self.touch()

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        due = self._due
        while due is not None and due <= now:
            self._run_instant(due, now)
            due = self._due
        self.now = now

    def _run_instant(self, at: Nanos, until: Nanos) -> None:
        """Run everything due at ``at``; a program that concerns nothing else may go on up to ``until``."""
        self.now = at
        for _ in range(MAX_EVENTS_PER_INSTANT):
            others = self._others
            happened = others is not None and others <= at
            if happened:
                self._run_others(at)
                others = self._due_without_program()
            due = self.program.deadline()
            acted = False
            if due is not None and due <= at:
                acted = self.program.advance(at, until if others is None else min(until, others - 1))
            if acted:
                others = self._due_without_program()
            self._plan_ahead(others, lamp=acted or happened)
            if self._due is None or self._due > at:
                return
        raise Runaway(f"more than {MAX_EVENTS_PER_INSTANT} events of one MIC488 at {at} ns")

    def _run_others(self, at: Nanos) -> None:
        """Inputs, then axes; then the program is notified, before its statement of this moment."""
        changed: list[int] = []
        due = self.inputs.deadline()
        if due is not None and due <= at:
            changed = self.inputs.settle(at)
        for axis in self.axes:
            due = axis.deadline()
            if due is not None and due <= at:
                axis.advance(at)
        self.program.disturbed(at, inside=True)
        if changed:
            self.program.inputs_changed(changed, at)

    def deadline(self) -> Nanos | None:
        return self._due

    def touch(self) -> None:
        """State was changed from outside: notify the program, find the next deadline and the ERR lamp anew."""
        self.program.disturbed(self.now, inside=False)
        self._plan_ahead(self._due_without_program(), lamp=True)

    def _due_without_program(self) -> Nanos | None:
        due = self.inputs.deadline()
        for axis in self.axes:
            at = axis.deadline()
            if at is not None and (due is None or at < due):
                due = at
        return due

    def _plan_ahead(self, others: Nanos | None, *, lamp: bool) -> None:
        """Find the next deadline, which for all but the program is ``others``, and the ERR ``lamp`` anew."""
        self._others = others
        due = self.program.deadline()
        self._due = others if due is None or (others is not None and others < due) else due
        if lamp:
            lit = self.program.error
            for axis in self.axes:
                if axis.status is _ERROR:
                    lit = True
            if lit is not self.error_led:
                self.error_led = lit
                self._edges.append(Edge(self.now, "ERR", float(lit)))
        self.changed()

    # ------------------------------------------------------------------ banks of programs and positions

    def load_program(self, bank: int, program: LoadedProgram) -> None:
        """Fill a program bank. `Misuse` for a bank that does not exist or whose program is running or paused."""
        self.program.load_program(bank, program)

    def load_positions(self, bank: int, table: PositionTable) -> None:
        """Fill a position bank. `Misuse` for a bank that does not exist or is in use."""
        self.program.load_positions(bank, table)

    # ------------------------------------------------------------------ the Modbus face

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        """Apply a request at ``now`` and answer it; a request that cannot be served is answered with its exception.

        One that fails unexpectedly is answered with exception 04, device failure, and an event.
        """
        self.advance(now)
        try:
            return self.slave.answer(self, pdu)
        except Exception as error:  # noqa: BLE001 - a master waits for an answer
            at = traceback.extract_tb(error.__traceback__)[-1]
            what = f"{type(error).__name__}: {error} ({at.filename}:{at.lineno})"
            self.event("internal-error", f"request {pdu.hex(' ')} failed, please report it: {what}")
            self.touch()
            return exception_pdu(pdu[0] if pdu else 0, DEVICE_FAILURE)

    # ------------------------------------------------------------------ pins

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Set IN1–IN20 (0 or 1) or AIN1–AIN2 (0 to 10 V)."""
        check_pin(pin, value)
        name = pin.upper()
        self.advance(now)
        if name in INPUT_PINS:
            self._set_input(INPUT_PINS[name], value == 1.0, now)
        else:
            self.analog_v[ANALOG_PINS[name]] = value
        self.touch()

    def _set_input(self, number: int, high: bool, now: Nanos) -> None:
        if self.inputs.set_pin(number, high, now):
            active = self.inputs.raw[number]
            for axis in self.axes:
                axis.input_changed(number, active, now)

    def pins(self) -> Mapping[str, float]:
        enables = [axis.enabled for axis in self.axes]
        levels = (*self.inputs.pins, *self.analog_v, *self.outputs, *enables, self.error_led)
        return dict(zip(PINS, map(float, levels), strict=True))

    def take_edges(self) -> list[Edge]:
        edges, self._edges = self._edges, []
        return edges

    def set_output(self, number: int, on: bool) -> None:
        """Set OUT ``number`` (from 0)."""
        if self.outputs[number] is not on:
            self.outputs[number] = on
            self._edges.append(Edge(self.now, OUTPUT_PINS[number], float(on)))

    def analog(self, number: int) -> float:
        """Analog input ``number`` (from 0) scaled by LoVal…HiVal."""
        scale = self.config.analog[number]
        return scale.lo_val + (scale.hi_val - scale.lo_val) * self.analog_v[number] / 10.0

    # ------------------------------------------------------------------ the vision system on COM1

    def see(self, record: Record, now: Nanos) -> None:
        """A record of the vision system has come: it is in the registers Vision… of programs."""
        self.advance(now)
        self.program.registers.take_record(record)
        self.touch()

    # ------------------------------------------------------------------ a hand on the shaft

    def turn_encoder(self, axis: int, counts: int, now: Nanos) -> None:
        """Turn the shaft of ``axis`` (from 1) by ``counts`` without the drive: a handwheel, or a slip."""
        check_turn(axis, counts)
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.turn(counts)
        chosen.control.encoder_moved(chosen, now)
        self.touch()

    def couple_encoder(self, axis: int, coupling: Coupling, now: Nanos) -> None:
        """Say what turns the shaft of ``axis`` (from 1): the drive, nothing, or a blocked drive."""
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.couple(coupling, chosen.profile.count(now), now)
        chosen.control.encoder_moved(chosen, now)
        self.touch()

    def follow_shaft(self, axis: int, motion: Motion | None, now: Nanos) -> None:
        """Mechanics turn the encoder's shaft of ``axis`` (from 1) by ``motion``; None: exactly as the drive."""
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.follow(motion)
        chosen.control.encoder_moved(chosen, now)
        self.touch()

    def gear_encoder(self, axis: int, counts: int, pulses: int, now: Nanos) -> None:
        """The encoder of ``axis`` (from 1) gives ``counts`` per ``pulses`` of the drive, whatever is configured."""
        if counts == 0 or pulses < 1:
            raise Misuse(f"M{axis}: {counts} encoder counts per {pulses} pulses: counts must not be 0, pulses 1 or more")
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.gear(counts, pulses, chosen.profile.count(now), now)
        self.touch()

    def _axis(self, number: int) -> Axis:
        if not 1 <= number <= AXES:
            raise Misuse(f"no axis M{number}: axes are M1 to M{AXES}")
        return self.axes[number - 1]

    # ------------------------------------------------------------------ what axes ask of their controller

    def input_active(self, number: int) -> bool:
        return self.inputs.raw[number]

    def axis_event(self, axis: int, code: str, detail: str) -> None:
        self._tell(Event(self.now, axis, code, detail))

    def event(self, code: str, detail: str) -> None:
        self._tell(Event(self.now, None, code, detail))

    def _tell(self, event: Event) -> None:
        self.events.append(event)
        if self.on_event is not None:
            self.on_event(event)

    def drive_output(self, axis: int, on: bool) -> None:
        self._edges.append(Edge(self.now, ENABLE_PINS[axis - 1], float(on)))

    def position_error(self, axis: int) -> None:
        self.axis_event(axis, "position-error", f"M{axis} did not reach its position")
        reaction = self.config.axes[axis - 1].err_ctrl_mode
        if reaction in (PositionControl.REACTION_PROGRAM, PositionControl.REACTION_OUT8):
            self.program.interrupt_by_position_error(self.now)
        if reaction == PositionControl.REACTION_OUT8:
            self.set_output(OUTPUTS - 1, True)

    # ------------------------------------------------------------------ state that registers show

    def status(self) -> ControllerStatus:
        """M_STATUS. A position error is shown before a program error, and that before an error of the Modbus master."""
        if any(axis.status is Status.ERROR for axis in self.axes):
            return ControllerStatus.POSITION_ERROR
        if self.program.error:
            return ControllerStatus.PROGRAM_ERROR
        return ControllerStatus.MASTER_ERROR if self.master_error else ControllerStatus.OK

    # ------------------------------------------------------------------ non-volatile user registers

    def _checked_memory(self, memory: bytes | None) -> bytes:
        stored = self.firmware.stored_user_registers or range(0)
        if memory is None:
            return bytes(2 * len(stored))
        if len(memory) != 2 * len(stored):
            raise Misuse(
                f"the stored user registers of firmware {self.firmware.name} take {2 * len(stored)} bytes, not {len(memory)}"
            )
        return bytes(memory)

    def _stored(self) -> slice:
        stored = self.firmware.stored_user_registers or range(0)
        return slice(stored.start, stored.stop)

    def load_memory(self) -> None:
        """USER_REG_READ."""
        memory = self.memory
        self.user[self._stored()] = array("H", (memory[i] << 8 | memory[i + 1] for i in range(0, len(memory), 2)))

    def save_memory(self) -> None:
        """USER_REG_SAVE. An `OSError` of the hook leaves the stored copy as it was."""
        memory = b"".join(word.to_bytes(2, "big") for word in self.user[self._stored()])
        stored = self.store(memory) if self.store is not None else None
        self.memory = memory if stored is None else stored

    def zero_memory(self) -> None:
        """USER_REG_ZERO: the registers, not their stored copy."""
        stored = self._stored()
        self.user[stored] = array("H", bytes(2 * (stored.stop - stored.start)))

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> Snapshot:
        """All state at the present moment; hooks are no part of it."""
        return Snapshot(self.config, self.firmware.name, self.copy_state(), self.program.contents())

    def restore(self, snapshot: Snapshot) -> None:
        """Take the state of a snapshot, its moment too. `Misuse` when it is of another configuration, firmware or program."""
        if snapshot.firmware != self.firmware.name:
            raise Misuse(f"the snapshot is of firmware {snapshot.firmware}, this controller has {self.firmware.name}")
        if snapshot.config != self.config:
            raise Misuse("the snapshot is of a controller with another configuration")
        if snapshot.banks != self.program.contents():
            raise Misuse("the snapshot is of a controller with other programs or positions in its banks")
        self.set_state(snapshot.state)
        self.changed()
