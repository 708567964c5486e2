"""Effects of writes. A request is checked whole before any of it takes effect (MIC-4, MIC-7)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import nextafter
from typing import Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.mic488.behaviour import BEHAVIOUR, AxisAction
from steptwin.mic488.core import ControllerCore, RegisterAction
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, swap_bytes
from steptwin.mic488.ranges import ValueRange
from steptwin.mic488.registermap import DataType, QuantityKind, Register, RegisterMap, Space, Type
from steptwin.motion.planner import LEAST, MOST
from steptwin.wire.pdu import (
    ILLEGAL_DATA_ADDRESS,
    ILLEGAL_DATA_VALUE,
    WRITE_MULTIPLE_REGISTERS,
    WRITE_SINGLE_COIL,
    WRITE_SINGLE_REGISTER,
    ModbusException,
    WriteCoilRequest,
    WriteRegisterRequest,
    WriteRegistersRequest,
)

WriteCheck: TypeAlias = Callable[[ControllerCore, float], float | None]
"""The value of the request → the stored value (pulses for REAL/DINT registers), None if it may not be written."""


# ---------------------------------------------------------------------- function 05


def compile_coil(
    registers: RegisterMap, request: WriteCoilRequest, pdu: bytes, *, lenient: bool
) -> Callable[[ControllerCore], bytes]:
    """The plan for a write of a coil, or exception 02."""
    register = registers.find(Space.COIL, request.address)
    if register is None or WRITE_SINGLE_COIL not in register.accepts:
        raise ModbusException(WRITE_SINGLE_COIL, ILLEGAL_DATA_ADDRESS)
    action, number, on = BEHAVIOUR[register.key].write, (register.index or 1) - 1, request.on
    key = (register.key, register.index)
    is_output = register.key == "OUT"

    def plan(device: ControllerCore) -> bytes:
        if is_output and device.outputs[number] is on:
            return pdu  # masters write outputs again and again; nothing happens
        try:
            device.write_coil(action, number, on)
        except ModbusException as refusal:
            return refusal.pdu
        if lenient:
            device.written[key] = on
        return pdu

    return plan


# ---------------------------------------------------------------------- functions 06 and 16


class WritePlan(Protocol):
    """Serves all requests of one beginning: function, address, quantity."""

    head: int
    """Bytes of the PDU before the values."""
    length: int

    def __call__(self, device: ControllerCore, pdu: bytes) -> bytes:
        """Serve ``pdu``, which has this plan's beginning and length. Raises `ModbusException` 03 when a value is bad."""
        ...


def compile_registers(
    registers: RegisterMap, request: WriteRegisterRequest | WriteRegistersRequest, data_type: DataType, *, lenient: bool
) -> WritePlan:
    """The plan for requests like ``request``, or exception 02 (MIC-3, MIC-5, MIC-24)."""
    function = request.function
    count = len(request.values) if isinstance(request, WriteRegistersRequest) else 1
    chosen: list[Register] = []
    for one in registers.slices(Space.HOLDING, request.address, count):
        register = one.register
        if register is None or function not in register.accepts:
            raise ModbusException(function, ILLEGAL_DATA_ADDRESS)
        # MIC-6: JOG_SPEED alone takes function 06.
        one_word = function == WRITE_SINGLE_REGISTER and register.word_write
        if one.address != register.address if one_word else not one.whole:
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

    def __call__(self, device: ControllerCore, pdu: bytes) -> bytes:
        self._pack(device.user, self._place, *self._unpack(pdu, self.head))
        if device.program.state:
            device.user_registers_written()
        return pdu[:5]


class _ControlPlan:
    """Control registers: all values are checked, then they take effect in the order of their addresses (MIC-4, MIC-7)."""

    __slots__ = ("_actions", "_checks", "_function", "_keys", "_layout", "_lenient", "_quiet", "head", "length")

    def __init__(self, function: int, chosen: list[Register], data_type: DataType, *, lenient: bool) -> None:
        self._function = function
        # MIC-6: function 06 writes JOG_SPEED, the one 32-bit register it reaches, as a signed word.
        one_word = function == WRITE_SINGLE_REGISTER and chosen[0].word_write
        layout = "h" if one_word else "".join(register.type.layout(data_type) for register in chosen)
        self._layout = struct.Struct("<" + layout)
        self._checks = [_check(register, data_type) for register in chosen]
        self._actions = [_action(register) for register in chosen]
        self._keys = [(register.key, register.index) for register in chosen]
        self._lenient = lenient
        self._quiet = all(BEHAVIOUR[register.key].quiet for register in chosen)
        self.head = _head(function)
        self.length = self.head + self._layout.size

    def __call__(self, device: ControllerCore, pdu: bytes) -> bytes:
        checked: list[float] = []
        for check, value in zip(self._checks, self._layout.unpack(swap_bytes(pdu[self.head :])), strict=True):
            stored = check(device, value)
            if stored is None:
                raise ModbusException(self._function, ILLEGAL_DATA_VALUE)
            checked.append(stored)
        device.write_registers(self._actions, checked, quiet=self._quiet)
        if self._lenient:
            device.written.update(zip(self._keys, checked, strict=True))
        return pdu[:5]


def _check(register: Register, data_type: DataType) -> WriteCheck:
    """The check of a written value (MIC-7), which returns the stored value."""
    permitted = register.permitted
    if register.type is not Type.VALUE:
        return lambda device, value: value if value in permitted else None
    number = (register.axis or 1) - 1
    held = _position_p if register.kind is QuantityKind.POSITION else _rate_p if register.permitted.above else _velocity_p
    if data_type is DataType.DINT:
        return lambda device, value: held(value) if value in permitted else None
    if register.key in _LIMITS:
        held = _limit_of_real_p
    return lambda device, value: held(value * device.axes[number].gear) if value in permitted else None


def permitted(register: Register, data_type: DataType, gear: float) -> ValueRange:
    """The values that a register of an axis with ``gear`` pulses in a unit takes. A position is one whose pulses fit a DINT."""
    if register.kind is not QuantityKind.POSITION or register.type is not Type.VALUE or data_type is DataType.DINT:
        return register.permitted
    if register.key in _LIMITS:
        end = nextafter(2.0**31 * (1.0 + _REAL_STEP), 0.0)
        return ValueRange(-end / gear, end / gear)
    return ValueRange(DINT_MIN / gear, DINT_MAX / gear)


def _position_p(pulses: float) -> int | None:
    """MIC-14: to the nearest pulse."""
    return round(pulses) if DINT_MIN - 0.5 < pulses < DINT_MAX + 0.5 else None


_LIMITS = ("POSLIM_L", "POSLIM_R")
_REAL_STEP = 2.0**-23
"""Distance of neighbouring REALs, as part of their size: nearer to the end of the range, a REAL means the end."""


def _limit_of_real_p(pulses: float) -> int | None:
    """As `_position_p`; a soft limit that does not limit (MIC-12) can be written back as it was read."""
    if abs(abs(pulses) / 2.0**31 - 1.0) < _REAL_STEP:
        return DINT_MAX if pulses > 0.0 else DINT_MIN
    return _position_p(pulses)


def _velocity_p(pulses: float) -> float | None:
    """Any finite velocity; a velocity that is too high is limited when it is used."""
    return float(pulses) if -MOST <= pulses <= MOST else None


def _rate_p(pulses: float) -> float | None:
    """ACC, DEC, VMAX as far as motion can be planned with them."""
    return float(pulses) if LEAST <= pulses <= MOST else None


def _action(register: Register) -> RegisterAction:
    behaviour = BEHAVIOUR[register.key]
    act = behaviour.write
    if register.axis is None:
        return act
    number = register.axis - 1
    if behaviour.waits:
        return _motion(act, register.key, number)
    return lambda device, value, now: act(device.axes[number], value, now)


def _motion(move: AxisAction, key: str, number: int) -> RegisterAction:
    def command(device: ControllerCore, value: float, now: Nanos) -> None:
        """DIRECT: at once. TRIGGER: kept for the trigger register (MIC-16)."""
        axis = device.axes[number]
        if device.trigger_mode:
            axis.pending[key] = value
        else:
            move(axis, value, now)

    return command
