"""A MIC488 without its Modbus interface: four axes, inputs and outputs, memory, program control, and their time."""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Fact, Nanos, PinEdge
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.messages import Message
from steptwin.mic488.axis import Axis
from steptwin.mic488.config import ANALOG_INPUTS, ControllerConfig
from steptwin.mic488.encoder import Coupling, ShaftMotion
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN
from steptwin.mic488.inputs import Inputs
from steptwin.mic488.path import keep_within_limits
from steptwin.mic488.position_control import PositionControl
from steptwin.mic488.program import ProgramControl
from steptwin.mic488.program_banks import LoadedProgram
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, INPUTS, MOTION_REGISTERS, OUTPUTS, register_map
from steptwin.mic488.status import AxisStatus, ControllerStatus
from steptwin.mic488.vision import VisionRecord
from steptwin.state import Stateful
from steptwin.wbc.interpreter import STATEMENT_TIME
from steptwin.wbc.positions import PositionTable

MAX_EVENTS_PER_INSTANT = 10_000
"""Limit of deadlines at one moment; more is an endless loop."""

EVENTS_KEPT = 1000

RegisterAction: TypeAlias = "Callable[[ControllerCore, float, Nanos], None]"
"""The effect of a write of a holding register."""
CoilAction: TypeAlias = "Callable[[ControllerCore, int, bool, Nanos], None]"
"""The effect of a write of a coil, called with the number of the axis or output, from 0."""

_ERROR = AxisStatus.ERROR
"""A global name: it is compared at every instant, and access through the class costs more than the comparison."""


class Mic488Event(NamedTuple):
    """An event that no register shows."""

    time: Nanos
    axis: int | None
    code: str
    text: str

    @property
    def facts(self) -> tuple[Fact, ...]:
        return () if self.axis is None else (("axis", self.axis),)


INPUT_PINS = {f"IN{n + 1}": n for n in range(INPUTS)}
ANALOG_PINS = {f"AIN{n + 1}": n for n in range(ANALOG_INPUTS)}
OUTPUT_PINS = tuple(f"OUT{n + 1}" for n in range(OUTPUTS))
ENABLE_PINS = tuple(f"M{n + 1}_EN" for n in range(AXES))


DIGITAL_INPUT_VALUE = Message("mic488.digital-input-value", "{name} = {value:g}: a digital input is 0 or 1")
ANALOG_INPUT_VALUE = Message("mic488.analog-input-value", "{name} = {value:g} V: an analog input takes 0 to 10 V")
UNKNOWN_INPUT_PIN = Message(
    "mic488.unknown-input-pin", "no input pin {pin!r}: inputs are IN1 to IN{inputs} and AIN1 to AIN{analog}"
)


def check_pin(pin: str, value: float) -> None:
    """`Misuse` unless ``pin`` is an input that can take ``value``."""
    name = pin.upper()
    if name in INPUT_PINS:
        if value not in (0.0, 1.0):
            raise Misuse(DIGITAL_INPUT_VALUE(name=name, value=value))
    elif name in ANALOG_PINS:
        if not 0.0 <= value <= 10.0:
            raise Misuse(ANALOG_INPUT_VALUE(name=name, value=value))
    else:
        raise Misuse(UNKNOWN_INPUT_PIN(pin=pin, inputs=INPUTS, analog=ANALOG_INPUTS))


UNKNOWN_AXIS = Message("mic488.unknown-axis", "no axis M{axis}: axes are M1 to M{most}")
TOO_MANY_COUNTS = Message("mic488.too-many-counts", "M{axis}: {counts} encoder counts at once: permitted {least}…{most}")


def check_turn(axis: int, counts: int) -> None:
    """`Misuse` unless there is such an axis, whose encoder can be turned by ``counts`` at once."""
    if not 1 <= axis <= AXES:
        raise Misuse(UNKNOWN_AXIS(axis=axis, most=AXES))
    if not DINT_MIN <= counts <= DINT_MAX:
        raise Misuse(TOO_MANY_COUNTS(axis=axis, counts=counts, least=DINT_MIN, most=DINT_MAX))


NO_BANKS: Mapping[int, Any] = MappingProxyType({})


POWER_ON = Message("mic488.power-on", "power-on")
TOO_MANY_EVENTS = Message("mic488.too-many-events", "more than {most} events of one MIC488 at {at} ns")
WRONG_COUNT_RATIO = Message(
    "mic488.wrong-count-ratio", "M{axis}: {counts} encoder counts per {pulses} pulses: counts must not be 0, pulses 1 or more"
)
POSITION_NOT_REACHED = Message("mic488.position-not-reached", "M{axis} did not reach its position")
STORED_REGISTERS_OF_OTHER_SIZE = Message(
    "mic488.stored-registers-of-other-size", "the stored user registers of firmware {firmware} take {size} bytes, not {found}"
)


class ControllerCore(Stateful):
    """The controller behind its Modbus registers. Inputs are applied after everything that is due at their moment.

    ``memory`` are the stored user registers (two bytes each, high byte first; none stored: all 0); `Misuse` when their number
    is wrong. ``programs`` and ``positions`` are the contents of the banks at power-on (`steptwin.mic488.program_banks.load` makes
    programs), ``statement_time`` is the time of one statement (WBC-6).

    Hooks: ``store`` is called with the stored user registers when they are saved and returns when they are safe: None, or
    what was stored instead; an `OSError` if they could not be stored. ``changed`` is called whenever the
    next deadline or an output may have changed, ``on_event`` for every event.
    """

    FIXED = ("changed", "config", "firmware", "on_event", "registers", "store")
    __slots__ = (
        *FIXED,
        "_due",
        "_edges",
        "_others",
        "analog_v",
        "axes",
        "data_type",
        "error_led",
        "events",
        "inputs",
        "jog_speed_u",
        "master_error",
        "memory",
        "now",
        "outputs",
        "program",
        "trigger_mode",
        "triggered",
        "user",
        "written",
    )

    def __init__(
        self,
        config: ControllerConfig,
        firmware: str = DEFAULT_FIRMWARE,
        *,
        memory: bytes | None = None,
        programs: Mapping[int, LoadedProgram] = NO_BANKS,
        positions: Mapping[int, PositionTable] = NO_BANKS,
        statement_time: Nanos = STATEMENT_TIME,
    ) -> None:
        self.config = config
        self.registers = register_map(firmware)
        self.firmware = self.registers.firmware
        self.store: Callable[[bytes], bytes | None] | None = None
        self.changed: Callable[[], None] = lambda: None
        self.on_event: Callable[[Mic488Event], None] | None = None

        self.now: Nanos = 0
        self.memory = self._checked_memory(memory)
        self.events: deque[Mic488Event] = deque(maxlen=EVENTS_KEPT)
        self._edges: list[PinEdge] = []
        self._due: Nanos | None = None
        self.inputs = Inputs(config.inputs)
        self.analog_v = [0.0] * ANALOG_INPUTS
        self.outputs = [False] * OUTPUTS
        self.axes = tuple(Axis(n, config.axes[n - 1], self) for n in range(1, AXES + 1))
        self.program = ProgramControl(self, programs, positions, statement_time)
        self.error_led = False
        self.master_error = False
        """Whether a slave of the controller's own Modbus master does not respond; only a fault sets it (WBC-13)."""
        self.written: dict[tuple[str, int | None], float]
        """Last values of write-only registers by key and number, in pulses where they have a unit; kept when lenient."""
        self._power_on()

    def _power_on(self) -> None:
        """MIC-27; axes, inputs and outputs are in that state already."""
        self.data_type = 0
        self.trigger_mode = 0
        self.triggered = dict.fromkeys(MOTION_REGISTERS, 0)
        self.jog_speed_u = self.config.axes[0].vel
        self.user = array("H", bytes(2 * self.firmware.user_registers))
        self.written = {}
        self.program.power_on(self.now)
        self._propagate()

    def power_cycle(self, now: Nanos) -> None:
        """Off and on again: registers as after power-on; terminals, shafts and the non-volatile memory stay as they are."""
        self.advance(now)
        for number in range(OUTPUTS):
            self.set_output(number, False, now)
        for axis in self.axes:
            axis.disable(now)
            axis.power_on(now)
        self.inputs.power_on()
        self.event("power-on", POWER_ON(), now)
        self._power_on()

    def power_off(self, now: Nanos) -> None:
        """Switch program, drives and outputs off. The controller must not be used again until a `power_cycle`."""
        self.advance(now)
        self.program.command(0, now)
        for number in range(OUTPUTS):
            self.set_output(number, False, now)
        for axis in self.axes:
            axis.disable(now)
        self._propagate()

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        due = self._due
        while due is not None and due <= now:
            self._run_instant(due, now)
            due = self._due
        self.now = now

    def advance_to_change(self, until: Nanos) -> Nanos:
        """See `steptwin.motioncontroller.MotionController.advance_to_change`."""
        due = self._due
        if due is None or due > until:
            self.advance(until)
        else:
            self._run_instant(due, until)
            if self._due is not None and self._due <= self.now:
                self.advance(self.now)
        return self.now

    def _run_instant(self, at: Nanos, until: Nanos) -> None:
        """Execute all deadlines at ``at``; a program without effects on other parts may run on up to ``until``, unless something
        else has happened."""
        self.now = at
        for _ in range(MAX_EVENTS_PER_INSTANT):
            others = self._others
            happened = others is not None and others <= at
            if happened:
                self._run_others(at)
                others = self._due_without_program()
                until = at
            due = self.program.deadline()
            acted_at = None
            if due is not None and due <= at:
                acted_at = self.program.advance(at, until if others is None else min(until, others - 1))
            if acted_at is not None:
                self.now = acted_at
                others = self._due_without_program()
            self._plan_ahead(others, has_changed=acted_at is not None or happened)
            if self._due is None or self._due > at:
                return
        raise Runaway(TOO_MANY_EVENTS(most=MAX_EVENTS_PER_INSTANT, at=at))

    def _run_others(self, at: Nanos) -> None:
        """Inputs, then axes; then the program is notified, before its statement of this moment."""
        changed: list[int] = []
        due = self.inputs.deadline()
        if due is not None and due <= at:
            changed = self.inputs.settle(at)
        for axis in self.axes:
            axis.advance(at)
        self.program.disturbed(at, inside=True)
        if changed:
            self.program.inputs_changed(changed, at)

    def deadline(self) -> Nanos | None:
        return self._due

    def command(self, action: Callable[[Nanos], object], now: Nanos) -> None:
        """Apply ``action``, which commands axes or the program, at ``now``, after all deadlines of that moment."""
        self.advance(now)
        action(now)
        self._propagate()

    def _propagate(self) -> None:
        """After a change from outside: notify the program, compute the next deadline and the ERR output."""
        self.program.disturbed(self.now, inside=False)
        self._plan_ahead(self._due_without_program(), has_changed=True)

    def _due_without_program(self) -> Nanos | None:
        due = self.inputs.deadline()
        for axis in self.axes:
            at = axis.deadline()
            if at is not None and (due is None or at < due):
                due = at
        return due

    def _plan_ahead(self, others: Nanos | None, *, has_changed: bool) -> None:
        """Find the next deadline, which for all but the program is ``others``; and the ERR lamp anew, where anything but the
        program ``has_changed``."""
        self._others = others
        """The next deadline of everything except the program, ns."""
        due = self.program.deadline()
        self._due = others if due is None or (others is not None and others < due) else due
        if not has_changed:
            return
        lit = self.program.error
        for axis in self.axes:
            if axis.status is _ERROR:
                lit = True
        if lit is not self.error_led:
            self.error_led = lit
            self._edges.append(PinEdge(self.now, "ERR", float(lit)))
        self.changed()

    # ------------------------------------------------------------------ banks of programs and positions

    def load_program(self, bank: int, program: LoadedProgram) -> None:
        """Fill a program bank. `Misuse` for a bank that does not exist or whose program is running or paused."""
        self.program.load_program(bank, program)

    def load_positions(self, bank: int, table: PositionTable) -> None:
        """Fill a position bank. `Misuse` for a bank that does not exist or is in use."""
        self.program.load_positions(bank, table)

    # ------------------------------------------------------------------ writes of registers

    def write_coil(self, action: CoilAction, number: int, on: bool) -> None:
        """Write a coil of axis or output ``number`` (from 0) at the present moment."""
        action(self, number, on, self.now)
        self._propagate()

    def write_registers(self, actions: Sequence[RegisterAction], values: Sequence[float], *, quiet: bool) -> None:
        """Write registers, in the order of their addresses, at the present moment.

        ``quiet``: the registers only keep their values, which affects a running program at most.
        """
        now = self.now
        for action, value in zip(actions, values, strict=True):
            action(self, value, now)
        if not quiet or self.program.state:
            self._propagate()

    def user_registers_written(self) -> None:
        """Notify a running program of user registers written over Modbus."""
        if self.program.state:
            self._propagate()
            self.program.registers_written(self.now)
            self._propagate()

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
        self._propagate()

    def _set_input(self, number: int, high: bool, now: Nanos) -> None:
        if self.inputs.set_pin(number, high, now):
            active = self.inputs.raw[number]
            for axis in self.axes:
                axis.input_changed(number, active, now)

    def pins(self) -> Mapping[str, float]:
        enabled = (axis.enabled for axis in self.axes)
        levels = (*self.inputs.pins, *self.analog_v, *self.outputs, *enabled, self.error_led)
        return dict(zip(_PIN_READERS, map(float, levels), strict=True))

    def pin(self, name: str) -> float:
        read, number = _PIN_READERS[name]
        return float(read(self, number))

    def take_edges(self) -> list[PinEdge]:
        edges, self._edges = self._edges, []
        return edges

    def set_output(self, number: int, on: bool, now: Nanos) -> None:
        """Set OUT ``number`` (from 0)."""
        if self.outputs[number] is not on:
            self.outputs[number] = on
            self._edges.append(PinEdge(now, OUTPUT_PINS[number], float(on)))

    def analog(self, number: int) -> float:
        """Analog input ``number`` (from 0) scaled by LoVal…HiVal."""
        scale = self.config.analog[number]
        return scale.lo_val + (scale.hi_val - scale.lo_val) * self.analog_v[number] / 10.0

    # ------------------------------------------------------------------ the vision system on COM1

    def see(self, record: VisionRecord, now: Nanos) -> None:
        """Take a record of the vision system into the registers Vision… of programs."""
        self.advance(now)
        self.program.registers.take_record(record)
        self._propagate()

    # ------------------------------------------------------------------ a hand on the shaft

    def turn_encoder(self, axis: int, counts: int, now: Nanos) -> None:
        """Turn the shaft of ``axis`` (from 1) by ``counts`` without the drive: a handwheel, or a slip."""
        check_turn(axis, counts)
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.turn(counts)
        chosen.control.encoder_moved(chosen, now)
        self._propagate()

    def couple_encoder(self, axis: int, coupling: Coupling, now: Nanos) -> None:
        """Select what turns the shaft of ``axis`` (from 1): the drive, nothing, or a blocked drive."""
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.couple(coupling, chosen.profile.count(now), now)
        chosen.control.encoder_moved(chosen, now)
        self._propagate()

    def follow_shaft(self, axis: int, motion: ShaftMotion | None, now: Nanos) -> None:
        """Mechanics turn the encoder's shaft of ``axis`` (from 1) by ``motion``; None: exactly as the drive."""
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.follow(motion)
        chosen.control.encoder_moved(chosen, now)
        self._propagate()

    def gear_encoder(self, axis: int, counts: int, pulses: int, now: Nanos) -> None:
        """Set ``counts`` of the encoder of ``axis`` (from 1) per ``pulses`` of the drive, instead of the configured ones."""
        if counts == 0 or pulses < 1:
            raise Misuse(WRONG_COUNT_RATIO(axis=axis, counts=counts, pulses=pulses))
        chosen = self._axis(axis)
        self.advance(now)
        chosen.encoder.gear(counts, pulses, chosen.profile.count(now), now)
        self._propagate()

    def _axis(self, number: int) -> Axis:
        if not 1 <= number <= AXES:
            raise Misuse(UNKNOWN_AXIS(axis=number, most=AXES))
        return self.axes[number - 1]

    # ------------------------------------------------------------------ what axes ask of their controller

    def input_active(self, number: int) -> bool:
        return self.inputs.raw[number]

    def axis_event(self, axis: int, code: str, detail: str, now: Nanos) -> None:
        self._record(Mic488Event(now, axis, code, detail))

    def event(self, code: str, detail: str, now: Nanos) -> None:
        self._record(Mic488Event(now, None, code, detail))

    def _record(self, event: Mic488Event) -> None:
        self.events.append(event)
        if self.on_event is not None:
            self.on_event(event)

    def drive_output(self, axis: int, on: bool, now: Nanos) -> None:
        self._edges.append(PinEdge(now, ENABLE_PINS[axis - 1], float(on)))

    def path_limited(self, now: Nanos) -> None:
        keep_within_limits(self.axes[:2], now)

    def position_error(self, axis: int, now: Nanos) -> None:
        self.axis_event(axis, "position-error", POSITION_NOT_REACHED(axis=axis), now)
        reaction = self.config.axes[axis - 1].err_ctrl_mode
        if reaction in (PositionControl.REACTION_PROGRAM, PositionControl.REACTION_OUT8):
            self.program.interrupt_by_position_error(now)
        if reaction == PositionControl.REACTION_OUT8:
            self.set_output(OUTPUTS - 1, True, now)

    # ------------------------------------------------------------------ state that registers show

    def set_master_error(self, shown: bool, now: Nanos) -> None:
        """Set or clear the Modbus master error in M_STATUS."""
        self.advance(now)
        self.master_error = shown
        self._propagate()

    def status(self) -> ControllerStatus:
        """M_STATUS. A position error is shown before a program error, and that before an error of the Modbus master."""
        if any(axis.status is AxisStatus.ERROR for axis in self.axes):
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
            raise Misuse(STORED_REGISTERS_OF_OTHER_SIZE(firmware=self.firmware.name, size=2 * len(stored), found=len(memory)))
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


_PIN_READERS: Mapping[str, tuple[Callable[[ControllerCore, int], float], int]] = {
    **{name: (lambda core, n: core.inputs.pins[n], n) for name, n in INPUT_PINS.items()},
    **{name: (lambda core, n: core.analog_v[n], n) for name, n in ANALOG_PINS.items()},
    **{name: (lambda core, n: core.outputs[n], n) for n, name in enumerate(OUTPUT_PINS)},
    **{name: (lambda core, n: core.axes[n].enabled, n) for n, name in enumerate(ENABLE_PINS)},
    "ERR": (lambda core, n: core.error_led, 0),
}
"""How the level of each pin is read, and its number (from 0)."""
