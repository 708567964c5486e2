"""The registers a program sees, and those that exist for programs only: timers, interrupt switches, row 0, vision records."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Iterable, Mapping
from math import inf, isnan
from types import MappingProxyType
from typing import Protocol, TypeAlias

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.messages import Message
from steptwin.mic488.axis import MAX_SPEED_P, Axis
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN
from steptwin.mic488.program_device import ProgramDevice
from steptwin.mic488.status import AxisStatus
from steptwin.motion.paths import ArcProfile
from steptwin.motion.planner import LEAST, MOST
from steptwin.state import Stateful
from steptwin.wbc.controller import FOREVER, RegisterFamily, RegisterReader, RegisterWriter, Tendency, complete_access
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.events import BY_REGISTER, EVENTS, INPUTS
from steptwin.wbc.positions import PARAMETERS
from steptwin.wbc.real import ProgramFault, real, real_text
from steptwin.wbc.registers import ROWS, TIMER
from steptwin.wbc.resting import HORIZON

TIMERS = 16
TIMER_PERIODS: Mapping[str, Nanos] = MappingProxyType({"TIMA": 10 * MILLISECOND, "TIMB": SECOND})
_TIMER_MOST = int(TIMER.high)

_OF_INPUTS = tuple((number, event.input - 1) for number, event in enumerate(EVENTS) if 0 < event.input <= INPUTS)
"""Events of inputs: their numbers in `EVENTS`, and their inputs from 0."""

STATUS_SINCE = "1.70"

VISION = ("NEW", "NO", "X", "Y", "A")


class ProgramRegisters(Stateful):
    """Registers that belong to the program. Every start of a program resets them (WBC-25)."""

    __slots__ = ("lin_acc_u", "row_0", "switches", "ticks", "timers", "vision")

    def __init__(self) -> None:
        self.row_0: tuple[float | None, ...] | None = None
        """Row 0 of the position table, which programs can write; None: there is none yet."""
        self.ticks: dict[int, Nanos]
        """Next moment of the ticks that are switched on."""
        self.timers: dict[str, tuple[tuple[int, Nanos], ...]]
        """Timers of each family: the number at a moment, from which it counts on."""
        self.lin_acc_u: float | None

    def forget_record(self) -> None:
        self.vision = array("f", bytes(4 * len(VISION)))
        """By number in `VISION`; records are kept over starts of programs."""

    def begin(self, config: ControllerConfig, now: Nanos) -> None:
        self.switches = array("b", bytes(len(EVENTS)))
        """CFGINT_… by number of the event in `EVENTS`."""
        for number, of_input in _OF_INPUTS:
            self.switches[number] = config.inputs[of_input].interrupt
        self.ticks = {}
        self.timers = dict.fromkeys(TIMER_PERIODS, ((0, now),) * TIMERS)
        self.lin_acc_u = None

    def timer(self, name: str, number: int, at: Nanos) -> int:
        """Timer ``number`` from 0."""
        value, since = self.timers[name][number]
        return min(value + (at - since) // TIMER_PERIODS[name], _TIMER_MOST)

    def set_timer(self, name: str, number: int, value: int, now: Nanos) -> None:
        timers = list(self.timers[name])
        timers[number] = (value, now)
        self.timers[name] = tuple(timers)

    def switch(self, event: int, mode: int, now: Nanos) -> bool:
        """CFGINT_… written; whether that changed anything."""
        if self.switches[event] == mode:
            return False
        self.switches[event] = mode
        period = EVENTS[event].period
        if period and mode:
            self.ticks[event] = now + period
        else:
            self.ticks.pop(event, None)
        return True

    def take_record(self, values: Iterable[float]) -> None:
        """N, X, Y, A of a record of the vision system."""
        self.vision = array("f", (1.0, *map(real, values)))


class RegisterHost(Protocol):
    """The owner of the registers that a program reads and writes: those of the controller, and its own."""

    @property
    def device(self) -> ProgramDevice: ...
    @property
    def registers(self) -> ProgramRegisters: ...
    @property
    def dialect(self) -> Dialect: ...
    def set_output(self, number: int, on: bool, now: Nanos) -> bool:
        """Output ``number`` from 0; whether that changed anything."""
        ...

    def set_switch(self, event: int, mode: int, now: Nanos) -> bool:
        """CFGINT_… of an event by its number; whether that changed anything."""
        ...


# ---------------------------------------------------------------------- axes

_OfAxis: TypeAlias = Callable[[Axis, Nanos], float]


def _axis_reader(get: _OfAxis) -> Callable[[int], RegisterReader]:
    def of(number: int) -> RegisterReader:
        index = number - 1
        return lambda control, at: real(get(control.device.axes[index], at))

    return of


def _axis_writer(put: Callable[[Axis, float, Nanos], bool]) -> Callable[[int], RegisterWriter]:
    def of(number: int) -> RegisterWriter:
        index = number - 1
        return lambda control, value, now: put(control.device.axes[index], value, now)

    return of


def _axis_tendency(intervals: Callable[[Axis, Nanos], Iterable[Nanos] | None]) -> Callable[[int], Tendency]:
    def of(number: int) -> Tendency:
        index = number - 1
        return lambda control, at: intervals(control.device.axes[index], at)

    return of


def _segments(axis: Axis, at: Nanos) -> list[Nanos]:
    """Last moments of the segments of the motion from ``at`` on."""
    start = axis.profile.start
    ends = [FOREVER if end == inf else start + int(end) - 1 for end in axis.profile.ends]
    return [end for end in ends if end >= at]


def _position_intervals(axis: Axis, at: Nanos) -> list[Nanos]:
    ends = _segments(axis, at)
    if ends:
        for edge_p in (DINT_MAX + 1, DINT_MIN - 1):
            wraps = axis.profile.pulse_time(edge_p - axis.offset_p, at)
            if wraps is not None:
                ends.append(wraps - 1)
        ends.sort()
    return ends


def _velocity_intervals(axis: Axis, at: Nanos) -> list[Nanos] | None:
    # Along an arc the velocity of an axis also turns within segments.
    return None if axis.path is not None and isinstance(axis.profile, ArcProfile) else _segments(axis, at)


def _encoder_intervals(axis: Axis, at: Nanos) -> list[Nanos] | None:
    if axis.encoder.turned_by is not Coupling.DRIVE:
        return None if axis.encoder.turned_by is None else []
    farthest = abs(axis.encoder_counts(at)) + abs(axis.encoder.counts(MAX_SPEED_P * HORIZON / SECOND))
    return _segments(axis, at) if axis.encoder.agrees and farthest < DINT_MAX else None


def _motion_intervals(axis: Axis, at: Nanos) -> list[Nanos]:
    end = axis.profile.end
    return [] if end is None else [end - 1]


def _set_drive(axis: Axis, on: float, now: Nanos) -> bool:
    if axis.enabled is bool(on) and (on or axis.status is AxisStatus.OFF):
        return False
    if on:
        axis.enable(now)
    else:
        axis.disable(now)
    return True


VALUE_OUT_OF_RANGE = Message("mic488.value-out-of-range", "{what} = {value} {unit}: permitted are {limits}")


def position_p(axis: Axis, value_u: float, what: str) -> int:
    """Pulses of a position or distance (MIC-14). `ProgramFault` beyond what a position register holds."""
    pulses = value_u * axis.gear
    if not DINT_MIN - 0.5 < pulses < DINT_MAX + 0.5:
        limits = f"{DINT_MIN / axis.gear:.12g}…{DINT_MAX / axis.gear:.12g} {axis.config.unit_name}"
        raise ProgramFault(VALUE_OUT_OF_RANGE(what=what, value=real_text(value_u), unit=axis.config.unit_name, limits=limits))
    return round(pulses)


def _set_position(axis: Axis, value_u: float, now: Nanos) -> bool:
    coordinate_p = position_p(axis, value_u, f"PosM{axis.number}")
    if coordinate_p == axis.coordinate_p(now):
        return False
    axis.set_coordinate(coordinate_p, now)
    return True


def _limit_p(axis: Axis, value_u: float) -> int:
    """A limit beyond every position limits nothing."""
    return round(min(max(value_u * axis.gear, DINT_MIN), DINT_MAX))


def _set_limit_l(axis: Axis, value_u: float, now: Nanos) -> bool:
    limit_p = _limit_p(axis, value_u)
    if limit_p == axis.limit_l_p:
        return False
    axis.set_limits(now, left_p=limit_p)
    return True


def _set_limit_r(axis: Axis, value_u: float, now: Nanos) -> bool:
    limit_p = _limit_p(axis, value_u)
    if limit_p == axis.limit_r_p:
        return False
    axis.set_limits(now, right_p=limit_p)
    return True


def _rate_p(axis: Axis, value_u: float) -> float:
    return min(max(value_u * axis.gear, LEAST), MOST)


def _set_acc(axis: Axis, value_u: float, now: Nanos) -> bool:
    before, axis.acc_p = axis.acc_p, _rate_p(axis, value_u)
    return before != axis.acc_p


def _set_dec(axis: Axis, value_u: float, now: Nanos) -> bool:
    before, axis.dec_p = axis.dec_p, _rate_p(axis, value_u)
    return before != axis.dec_p


def _set_vmax(axis: Axis, value_u: float, now: Nanos) -> bool:
    before, axis.vmax_p = axis.vmax_p, _rate_p(axis, value_u)
    return before != axis.vmax_p


def _set_encoder(axis: Axis, value: float, now: Nanos) -> bool:
    if axis.encoder_counts(now) == value:
        return False
    axis.encoder.set_counter(int(value), axis.shaft(now))
    return True


def _xenc(axis: Axis, at: Nanos) -> float:
    return axis.encoder.pulses(axis.encoder_counts(at)) / axis.gear


# ---------------------------------------------------------------------- inputs, outputs, user registers


def _out(number: int) -> RegisterReader:
    index = number - 1
    return lambda control, at: 1.0 if control.device.outputs[index] else 0.0


def _set_out(number: int) -> RegisterWriter:
    index = number - 1

    def put(control: RegisterHost, value: float, now: Nanos) -> bool:
        return control.set_output(index, value > 0.0, now)

    return put


def _set_outs(control: RegisterHost, value: float, now: Nanos) -> bool:
    bits = int(value)
    changed = [control.set_output(index, bool(bits >> index & 1), now) for index in range(len(control.device.outputs))]
    return any(changed)


def _bits(levels: Iterable[bool]) -> float:
    return float(sum(1 << bit for bit, level in enumerate(levels) if level))


def _in(number: int) -> RegisterReader:
    index = number - 1
    return lambda control, at: 1.0 if control.device.inputs.filtered[index] else 0.0


def _ain(number: int) -> RegisterReader:
    index = number - 1
    return lambda control, at: real(control.device.analog(index))


_WORD, _DINT, _REAL = (struct.Struct(layout) for layout in ("<h", "<i", "<f"))


def _user(layout: struct.Struct) -> RegisterFamily:
    """One memory: a register of two words has the low word first."""
    words = layout.size // 2

    def read(number: int) -> RegisterReader:
        place = slice(number, number + words)

        def get(control: RegisterHost, at: Nanos) -> float:
            value = layout.unpack(control.device.user[place])[0]
            return value if layout is _WORD else 0.0 if isnan(value) else real(value)

        return get

    def write(number: int) -> RegisterWriter:
        place = slice(number, number + words)

        def put(control: RegisterHost, value: float, now: Nanos) -> bool:
            held = array("H", layout.pack(value if layout is _REAL else int(value)))
            if control.device.user[place] == held:
                return False
            control.device.user[place] = held
            return True

        return put

    return RegisterFamily(read, write)


# ---------------------------------------------------------------------- the program's own


def _timer(name: str) -> RegisterFamily:
    def read(number: int) -> RegisterReader:
        return lambda control, at: float(control.registers.timer(name, number - 1, at))

    def write(number: int) -> RegisterWriter:
        def put(control: RegisterHost, value: float, now: Nanos) -> bool:
            control.registers.set_timer(name, number - 1, int(value), now)
            return True

        return put

    def tendency(number: int) -> Tendency:
        def intervals(control: RegisterHost, at: Nanos) -> list[Nanos]:
            missing = _TIMER_MOST - control.registers.timer(name, number - 1, at)
            return [at + missing * TIMER_PERIODS[name]] if missing else []

        return intervals

    return RegisterFamily(read, write, tendency)


def _switch(name: str) -> RegisterFamily:
    """CFGINT_…: a family, or a single register (number 0)."""

    def event(number: int) -> int:
        return EVENTS.index(BY_REGISTER[f"{name}{number}" if number else name])

    def read(number: int) -> RegisterReader:
        index = event(number)
        return lambda control, at: float(control.registers.switches[index])

    def write(number: int) -> RegisterWriter:
        index = event(number)
        return lambda control, value, now: control.set_switch(index, int(value), now)

    return RegisterFamily(read, write, quiet=False)


def _row_0(parameter: int | None = None) -> RegisterFamily:
    """A parameter (from 0) of row 0; None: that of the register's number."""

    def index_of(number: int) -> int:
        return number - 1 if parameter is None else parameter

    def read(number: int) -> RegisterReader:
        index = index_of(number)

        def get(control: RegisterHost, at: Nanos) -> float:
            row = control.registers.row_0
            return 0.0 if row is None else real(row[index] or 0.0)

        return get

    def write(number: int) -> RegisterWriter:
        index = index_of(number)

        def put(control: RegisterHost, value: float, now: Nanos) -> bool:
            """WBC-16: a parameter that was left alone becomes valid."""
            row = list(control.registers.row_0 or (None,) * PARAMETERS)
            before, row[index] = row[index], value
            control.registers.row_0 = tuple(row)
            return before != value

        return put

    return RegisterFamily(read, write)


def _lin_acc(control: RegisterHost, at: Nanos) -> float:
    acc_u = control.registers.lin_acc_u
    return real(acc_u if acc_u is not None else control.device.axes[0].acc_p / control.device.axes[0].gear)


def _set_lin_acc(control: RegisterHost, value: float, now: Nanos) -> bool:
    before, control.registers.lin_acc_u = control.registers.lin_acc_u, value
    return before != value


def _vision(index: int) -> RegisterFamily:
    def put(control: RegisterHost, value: float, now: Nanos) -> bool:
        before, control.registers.vision[index] = control.registers.vision[index], value
        return before != value

    return _single(lambda control, at: control.registers.vision[index], put)


def _single(
    read: Callable[[RegisterHost, Nanos], float], write: RegisterWriter | None = None, *, quiet: bool = True
) -> RegisterFamily:
    return RegisterFamily(lambda number: read, None if write is None else lambda number: write, quiet=quiet)


def _status(control: RegisterHost, at: Nanos) -> float:
    return float(control.device.status()) if control.dialect.has(STATUS_SINCE) else 0.0


_LIMIT_L = _axis_reader(lambda axis, at: axis.limit_l_p / axis.gear)
_LIMIT_R = _axis_reader(lambda axis, at: axis.limit_r_p / axis.gear)

ACCESS: Mapping[str, RegisterFamily] = complete_access(
    ROWS,
    {
        "OUT": RegisterFamily(_out, _set_out, quiet=False),
        "OUTPUTS": _single(lambda control, at: _bits(control.device.outputs), _set_outs, quiet=False),
        "IN": RegisterFamily(_in),
        "INPUTS": _single(lambda control, at: _bits(control.device.inputs.filtered[:16])),
        "AIN": RegisterFamily(_ain),
        "M": RegisterFamily(
            _axis_reader(lambda axis, at: axis.profile.moving(at)),
            _axis_writer(_set_drive),
            _axis_tendency(_motion_intervals),
            quiet=False,
        ),
        "STATM": RegisterFamily(_axis_reader(lambda axis, at: axis.status)),
        "VACTM": RegisterFamily(
            _axis_reader(lambda axis, at: axis.profile.velocity(at) / axis.gear),
            tendency=_axis_tendency(_velocity_intervals),
        ),
        "POSM": RegisterFamily(
            _axis_reader(lambda axis, at: axis.coordinate_p(at) / axis.gear),
            _axis_writer(_set_position),
            _axis_tendency(_position_intervals),
            quiet=False,
        ),
        "ACCM": RegisterFamily(_axis_reader(lambda axis, at: axis.acc_p / axis.gear), _axis_writer(_set_acc)),
        "DECM": RegisterFamily(_axis_reader(lambda axis, at: axis.dec_p / axis.gear), _axis_writer(_set_dec)),
        "VMAXM": RegisterFamily(_axis_reader(lambda axis, at: axis.vmax_p / axis.gear), _axis_writer(_set_vmax)),
        "LIMLM": RegisterFamily(_LIMIT_L, _axis_writer(_set_limit_l), quiet=False),
        "LIMRM": RegisterFamily(_LIMIT_R, _axis_writer(_set_limit_r), quiet=False),
        "ENC": RegisterFamily(
            _axis_reader(lambda axis, at: axis.encoder_counts(at)),
            _axis_writer(_set_encoder),
            _axis_tendency(_encoder_intervals),
            quiet=False,
        ),
        "XENC": RegisterFamily(_axis_reader(_xenc), tendency=_axis_tendency(_encoder_intervals)),
        **{name: _timer(name) for name in TIMER_PERIODS},
        **{name: _switch(name) for name in ("CFGINT_IN", "CFGINT_MODBUS", "CFGINT_M")},
        **{name: _switch(name) for name in ("CFGINT_TICK", "CFGINT_TICK100", "CFGINT_TICK1000")},
        "PTPM": _row_0(),
        "CIRCX": _row_0(0),
        "CIRCY": _row_0(1),
        "CIRCR": _row_0(2),
        "CIRCA": _row_0(3),
        "LINX": _row_0(0),
        "LINY": _row_0(1),
        "LINVEL": _row_0(2),
        "LINACC": _single(_lin_acc, _set_lin_acc),
        **{f"VISION{name}": _vision(index) for index, name in enumerate(VISION)},
        "STATUS": _single(_status),
        "$I": _user(_WORD),
        "$D": _user(_DINT),
        "$R": _user(_REAL),
    },
)
"""By family in upper case."""
