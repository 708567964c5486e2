"""What a write does. A request is checked whole before any of it takes effect (MIC-4, MIC-7)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, TypeAlias

from steptwin.machine import Nanos
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, swap_bytes
from steptwin.mic488.registermap import DataType, Kind, Register, RegisterMap, Space, Type
from steptwin.mic488.registers import axes_of_mask
from steptwin.motion.planner import LEAST, MOST
from steptwin.wire.pdu import (
    DEVICE_FAILURE,
    ILLEGAL_DATA_ADDRESS,
    ILLEGAL_DATA_VALUE,
    WRITE_MULTIPLE_REGISTERS,
    WRITE_SINGLE_COIL,
    WRITE_SINGLE_REGISTER,
    ModbusException,
    WriteCoil,
    WriteRegister,
    WriteRegisters,
)

if TYPE_CHECKING:
    from steptwin.mic488.axis import Axis
    from steptwin.mic488.device import Mic488

Check: TypeAlias = "Callable[[Mic488, float], float | None]"
"""The value as it travelled → what is stored (pulses for REAL/DINT registers), None when it may not be written."""
Action: TypeAlias = "Callable[[Mic488, float, Nanos], None]"
AxisAction: TypeAlias = "Callable[[Axis, float, Nanos], None]"
CoilAction: TypeAlias = "Callable[[Mic488, int, bool, Nanos], None]"
"""Takes the number of the axis or output, from 0."""


# ---------------------------------------------------------------------- function 05


def compile_coil(registers: RegisterMap, request: WriteCoil, pdu: bytes, *, lenient: bool) -> Callable[[Mic488], bytes]:
    """The plan for a write of a coil, or exception 02."""
    register = registers.find(Space.COIL, request.address)
    if register is None or WRITE_SINGLE_COIL not in register.accepts:
        raise ModbusException(WRITE_SINGLE_COIL, ILLEGAL_DATA_ADDRESS)
    action, number, on = _COILS[register.key], (register.index or 1) - 1, request.on
    key = (register.key, register.index)
    is_output = register.key == "OUT"

    def plan(device: Mic488) -> bytes:
        if is_output and device.outputs[number] is on:
            return pdu  # masters write outputs again and again; nothing happens
        try:
            action(device, number, on, device.now)
        except ModbusException as refusal:
            return refusal.pdu
        if lenient:
            device.written[key] = on
        device.touch()
        return pdu

    return plan


# ---------------------------------------------------------------------- functions 06 and 16


class WritePlan(Protocol):
    """Serves all requests of one beginning: function, address, quantity."""

    head: int
    """Bytes of the PDU before the values."""
    length: int

    def __call__(self, device: Mic488, pdu: bytes) -> bytes:
        """Serve ``pdu``, which has this plan's beginning and length. Raises `ModbusException` 03 when a value is bad."""
        ...


def compile_registers(
    registers: RegisterMap, request: WriteRegister | WriteRegisters, data_type: DataType, *, lenient: bool
) -> WritePlan:
    """The plan for requests like ``request``, or exception 02 (MIC-3, MIC-5, MIC-24)."""
    function = request.function
    count = len(request.values) if isinstance(request, WriteRegisters) else 1
    chosen: list[Register] = []
    for piece in registers.pieces(Space.HOLDING, request.address, count):
        register = piece.register
        if register is None or function not in register.accepts:
            raise ModbusException(function, ILLEGAL_DATA_ADDRESS)
        # MIC-6: JOG_SPEED alone takes function 06.
        one_word = function == WRITE_SINGLE_REGISTER and register.word_write
        if piece.address != register.address if one_word else not piece.whole:
            raise ModbusException(function, ILLEGAL_DATA_ADDRESS)
        chosen.append(register)
    if chosen[0].type is Type.MEMORY:
        return _MemoryPlan(function, request.address, count)
    return _ControlPlan(function, chosen, data_type, lenient=lenient)


def _head(function: int) -> int:
    return 6 if function == WRITE_MULTIPLE_REGISTERS else 3


class _MemoryPlan:
    """User registers, which have no neighbours of another kind."""

    __slots__ = ("_pack", "_place", "_unpack", "head", "length")

    def __init__(self, function: int, address: int, count: int) -> None:
        self.head = _head(function)
        self.length = self.head + 2 * count
        self._place = 2 * address
        self._unpack = struct.Struct(f">{count}H").unpack_from
        self._pack = struct.Struct(f"={count}H").pack_into

    def __call__(self, device: Mic488, pdu: bytes) -> bytes:
        self._pack(device.user, self._place, *self._unpack(pdu, self.head))
        if device.program.state:
            device.touch()
            device.program.registers_written(device.now)
            device.touch()
        return pdu[:5]


class _ControlPlan:
    """Control registers: all values are checked, then they take effect in the order of their addresses (MIC-4, MIC-7)."""

    __slots__ = ("_function", "_layout", "_lenient", "_quiet", "_steps", "head", "length")

    def __init__(self, function: int, chosen: list[Register], data_type: DataType, *, lenient: bool) -> None:
        self._function = function
        # MIC-6: function 06 writes JOG_SPEED, the one 32-bit register it reaches, as a signed word.
        one_word = function == WRITE_SINGLE_REGISTER and chosen[0].word_write
        layout = "h" if one_word else "".join(register.type.layout(data_type) for register in chosen)
        self._layout = struct.Struct("<" + layout)
        self._steps = [(register, _check(register, data_type), _action(register)) for register in chosen]
        self._lenient = lenient
        self._quiet = all(register.key in _QUIET for register in chosen)
        self.head = _head(function)
        self.length = self.head + self._layout.size

    def __call__(self, device: Mic488, pdu: bytes) -> bytes:
        checked: list[float] = []
        for (_, check, _), value in zip(self._steps, self._layout.unpack(swap_bytes(pdu[self.head :])), strict=True):
            stored = check(device, value)
            if stored is None:
                raise ModbusException(self._function, ILLEGAL_DATA_VALUE)
            checked.append(stored)
        now = device.now
        for (register, _, action), stored in zip(self._steps, checked, strict=True):
            action(device, stored, now)
            if self._lenient:
                device.written[register.key, register.index] = stored
        if not self._quiet or device.program.state:
            device.touch()
        return pdu[:5]


def _check(register: Register, data_type: DataType) -> Check:
    """What a value must be (MIC-7), and what is stored of it."""
    permits = register.permits
    if register.type is not Type.VALUE:
        return lambda device, value: value if permits(value) else None
    number = (register.axis or 1) - 1
    held = _position_p if register.kind is Kind.POSITION else _rate_p if register.permitted.above else _velocity_p
    if data_type is DataType.DINT:
        return lambda device, value: held(value) if permits(value) else None
    if register.key in ("POSLIM_L", "POSLIM_R"):
        held = _limit_of_real_p
    return lambda device, value: held(value * device.axes[number].gear) if permits(value) else None


def _position_p(pulses: float) -> int | None:
    """MIC-14: to the nearest pulse."""
    if DINT_MIN <= pulses <= DINT_MAX:
        return round(pulses)
    if not DINT_MIN - 0.5 <= pulses <= DINT_MAX + 0.5:
        return None
    return DINT_MIN if pulses < 0.0 else DINT_MAX


_REAL_STEP = 2.0**-23
"""Distance of neighbouring REALs, as part of their size: nearer to the end of the range, a REAL means the end."""


def _limit_of_real_p(pulses: float) -> int | None:
    """As `_position_p`; a soft limit that does not limit (MIC-12) can be written back as it was read."""
    if abs(abs(pulses) / 2.0**31 - 1.0) < _REAL_STEP:
        return DINT_MAX if pulses > 0.0 else DINT_MIN
    return _position_p(pulses)


def _velocity_p(pulses: float) -> float | None:
    """Any finite velocity; what is too fast is clamped when it is used."""
    return float(pulses) if -MOST <= pulses <= MOST else None


def _rate_p(pulses: float) -> float | None:
    """ACC, DEC, VMAX as far as motion can be planned with them."""
    return float(pulses) if LEAST <= pulses <= MOST else None


def axes_chosen(device: Mic488, mask: float) -> list[Axis]:
    """The axes of a mask register (MIC-25)."""
    return [device.axes[number - 1] for number in axes_of_mask(int(mask))]


# ---------------------------------------------------------------------- what coils do


def _enable(device: Mic488, number: int, on: bool, now: Nanos) -> None:
    axis = device.axes[number]
    if on:
        axis.enable(now)
    else:
        axis.disable(now)


def _stop(device: Mic488, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.axes[number].stop(now)


def _jog(direction: int) -> CoilAction:
    def jog(device: Mic488, number: int, on: bool, now: Nanos) -> None:
        axis = device.axes[number]
        axis.jog(direction, on, device.jog_speed_u * axis.gear, now)

    return jog


def _load(device: Mic488, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.load_memory()


def _save(device: Mic488, number: int, on: bool, now: Nanos) -> None:
    if on:
        try:
            device.save_memory()
        except OSError as error:
            device.event("memory-failure", str(error))
            raise ModbusException(WRITE_SINGLE_COIL, DEVICE_FAILURE) from error


def _zero(device: Mic488, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.zero_memory()


_COILS: dict[str, CoilAction] = {
    "EN": _enable,
    "STOP": _stop,
    "JOG_PLUS": _jog(+1),
    "JOG_MINUS": _jog(-1),
    "USER_REG_READ": _load,
    "USER_REG_SAVE": _save,
    "USER_REG_ZERO": _zero,
    "OUT": lambda device, number, on, now: device.set_output(number, on),
}


# ---------------------------------------------------------------------- what registers of the controller do

_QUIET = frozenset({"DATA_TYPE", "PROG_BANK_SEL", "POS_BANK_SEL", "AXIS_CTR_MODE", "JOG_SPEED", "ACC", "DEC", "VMAX"})
"""Registers that only keep a value: nothing happens earlier or later for it."""


def _data_type(device: Mic488, value: float, now: Nanos) -> None:
    """MIC-17: only the representation changes."""
    device.data_type = int(value)


def _program_bank(device: Mic488, value: float, now: Nanos) -> None:
    device.program.program_bank = int(value)


def _position_bank(device: Mic488, value: float, now: Nanos) -> None:
    device.program.position_bank = int(value)


def _mode(device: Mic488, value: float, now: Nanos) -> None:
    device.trigger_mode = int(value)


def _jog_speed(device: Mic488, value: float, now: Nanos) -> None:
    device.jog_speed_u = float(value)


def _trigger(kind: str) -> Action:
    def trigger(device: Mic488, value: float, now: Nanos) -> None:
        """MIC-16: starts the chosen axes that have a stored value, and uses it up, unless values are kept."""
        device.triggered[kind] = int(value)
        if not device.trigger_mode:
            return
        for axis in axes_chosen(device, value):
            stored = axis.pending.get(kind) if device.config.trigger_keeps else axis.pending.pop(kind, None)
            if stored is None:
                device.axis_event(axis.number, "trigger-empty", f"trigger of M{axis.number} without a new value of {kind}")
            else:
                _MOTIONS[kind](axis, stored, now)

    return trigger


def _drives(action: Callable[[Axis, Nanos], None]) -> Action:
    def act(device: Mic488, value: float, now: Nanos) -> None:
        for axis in axes_chosen(device, value):
            action(axis, now)

    return act


_DEVICE_ACTIONS: dict[str, Action] = {
    "DATA_TYPE": _data_type,
    "PROG_BANK_SEL": _program_bank,
    "POS_BANK_SEL": _position_bank,
    "PROGRAM_CTRL": lambda device, value, now: device.program.command(int(value), now),
    "AXIS_CTR_MODE": _mode,
    "AXIS_VEL_ABS_TRIG": _trigger("VEL_ABS"),
    "AXIS_VEL_REL_TRIG": _trigger("VEL_REL"),
    "AXIS_POS_ABS_TRIG": _trigger("POS_ABS"),
    "AXIS_POS_REL_TRIG": _trigger("POS_REL"),
    "M_ENABLE": _drives(lambda axis, now: axis.enable(now)),
    "M_DISABLE": _drives(lambda axis, now: axis.disable(now)),
    "M_STOP": _drives(lambda axis, now: axis.stop(now)),
    "JOG_SPEED": _jog_speed,
}


# ---------------------------------------------------------------------- what registers of an axis do, in pulses

_MOTIONS: dict[str, AxisAction] = {
    "VEL_ABS": lambda axis, value, now: axis.move_velocity(value, now),
    "VEL_REL": lambda axis, value, now: axis.change_velocity(value, now),
    "POS_ABS": lambda axis, value, now: axis.move_to(int(value), now),
    "POS_REL": lambda axis, value, now: axis.move_by(int(value), now),
}


def _acc(axis: Axis, value: float, now: Nanos) -> None:
    axis.acc_p = value


def _dec(axis: Axis, value: float, now: Nanos) -> None:
    axis.dec_p = value


def _vmax(axis: Axis, value: float, now: Nanos) -> None:
    axis.vmax_p = value


def _encoder(axis: Axis, value: float, now: Nanos) -> None:
    axis.encoder.set_counter(int(value), axis.shaft(now))


def _encoder_position(axis: Axis, value: float, now: Nanos) -> None:
    _encoder(axis, round(axis.encoder.counts(value)), now)


_AXIS_ACTIONS: dict[str, AxisAction] = {
    "POS_ACT": lambda axis, value, now: axis.set_coordinate(int(value), now),
    "ACC": _acc,
    "DEC": _dec,
    "VMAX": _vmax,
    "HOME": lambda axis, value, now: axis.home(value, now),
    "ENC_IMP": _encoder,
    "ENC_XPOS": _encoder_position,
    "POSLIM_L": lambda axis, value, now: axis.set_limits(now, left_p=int(value)),
    "POSLIM_R": lambda axis, value, now: axis.set_limits(now, right_p=int(value)),
}


def _action(register: Register) -> Action:
    if register.axis is None:
        return _DEVICE_ACTIONS[register.key]
    number = register.axis - 1
    if register.key in _MOTIONS:
        return _motion(register.key, number)
    act = _AXIS_ACTIONS[register.key]
    return lambda device, value, now: act(device.axes[number], value, now)


def _motion(kind: str, number: int) -> Action:
    move = _MOTIONS[kind]

    def command(device: Mic488, value: float, now: Nanos) -> None:
        """DIRECT: at once. TRIGGER: kept for the trigger register (MIC-16)."""
        axis = device.axes[number]
        if device.trigger_mode:
            axis.pending[kind] = value
        else:
            move(axis, value, now)

    return command
