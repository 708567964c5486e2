"""Answers to read requests: a request is compiled once into a short plan that computes only what it asks for.

Values of a block are packed little-endian and then every 16-bit word is byte-swapped, which gives big-endian registers with
the low word first (manual 3.2).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

from steptwin.mic488.behaviour import BEHAVIOUR, Getter
from steptwin.mic488.core import ControllerCore
from steptwin.mic488.encoding import saturated_dint, saturated_real, swap_bytes
from steptwin.mic488.registermap import FUNCTION_SPACES, LAST_ADDRESS, DataType, Register, RegisterMap, RegisterSlice, Space, Type
from steptwin.mic488.registers import AXES
from steptwin.wire.pdu import ILLEGAL_DATA_ADDRESS, ModbusException, ReadRequest, pack_bits


class RegisterSource(NamedTuple):
    """The source of a value: ``place`` 0–3 is an axis, `DEVICE` the controller."""

    place: int
    get: Getter


DEVICE = AXES


def compile_read(
    registers: RegisterMap, request: ReadRequest, data_type: DataType, *, lenient: bool
) -> Callable[[ControllerCore], bytes]:
    """The plan for functions 01, 02, 03, or exception 02 (MIC-3). Registers may begin and end inside a value (MIC-5)."""
    space = FUNCTION_SPACES[request.function]
    slices = list(registers.slices(space, request.address, request.count))
    for one in slices:
        register = one.register
        if register is not None and request.function in register.reads:
            continue
        if not lenient or request.address + request.count > LAST_ADDRESS + 1:
            raise ModbusException(request.function, ILLEGAL_DATA_ADDRESS)
    if space is Space.HOLDING:
        return _registers_plan(request, slices, data_type)
    return _bits_plan(request, slices)


# ---------------------------------------------------------------------- bits


def _bits_plan(request: ReadRequest, slices: list[RegisterSlice]) -> Callable[[ControllerCore], bytes]:
    head = bytes((request.function, (request.count + 7) // 8))
    getters: list[Callable[[ControllerCore], bool]] = []
    for register, _, size in slices:
        getters += [_off] * size if register is None else [_bit(register)]
    return lambda device: head + pack_bits([get(device) for get in getters])


def _off(device: ControllerCore) -> bool:
    return False


def _bit(register: Register) -> Callable[[ControllerCore], bool]:
    key, number = (register.key, register.index), (register.index or 1) - 1
    if register.reads:
        return BEHAVIOUR[register.key].read(number)
    return lambda device: bool(device.written.get(key))


# ---------------------------------------------------------------------- registers


def _registers_plan(request: ReadRequest, slices: list[RegisterSlice], data_type: DataType) -> Callable[[ControllerCore], bytes]:
    head = bytes((request.function, 2 * request.count))
    if len(slices) == 1 and slices[0].register is not None and slices[0].register.type is Type.MEMORY:
        return _memory_plan(head, request.address, request.count)
    layout = "<"
    sources: list[RegisterSource] = []
    for register, address, size in slices:
        if register is None:
            sources += [RegisterSource(DEVICE, lambda device, now: 0)] * size
            layout += "H" * size
        elif register.type is Type.MEMORY:
            sources += [RegisterSource(DEVICE, _user_word(a)) for a in range(address, address + size)]
            layout += "H" * size
        else:
            sources.append(_source(register, data_type))
            layout += register.type.layout(data_type)
    register = slices[0].register
    inside = 0 if register is None or register.type is Type.MEMORY else slices[0].address - register.address
    return _packing_plan(head, struct.Struct(layout), sources, slice(2 * inside, 2 * (inside + request.count)))


def _packing_plan(
    head: bytes, layout: struct.Struct, sources: list[RegisterSource], asked: slice
) -> Callable[[ControllerCore], bytes]:
    """``asked`` are the bytes of the values that the request covers: it may begin and end inside one (MIC-5)."""
    pack = layout.pack
    formats = layout.format[1:]

    of_axes_only = all(place < DEVICE for place, _ in sources)
    all_asked = asked == slice(0, layout.size)

    def plan(device: ControllerCore) -> bytes:
        now = device.now
        places = device.axes if of_axes_only else (*device.axes, device)
        values = [get(places[place], now) for place, get in sources]
        try:
            packed = pack(*values)
        except (struct.error, OverflowError):
            packed = pack(*map(_saturated, formats, values))
        return head + (swap_bytes(packed) if all_asked else swap_bytes(packed)[asked])

    return plan


def _saturated(layout: str, value: float) -> float:
    """A quantity that has outgrown its register shows the limit; counters have wrapped already."""
    return saturated_real(value) if layout == "f" else saturated_dint(value) if layout == "i" else value


def _memory_plan(head: bytes, address: int, count: int) -> Callable[[ControllerCore], bytes]:
    pack = struct.Struct(f">{count}H").pack
    end = address + count
    return lambda device: head + pack(*device.user[address:end])


def _user_word(address: int) -> Getter:
    return lambda device, now: device.user[address]


def _source(register: Register, data_type: DataType) -> RegisterSource:
    if 3 not in register.reads:
        return RegisterSource(DEVICE, _last_written(register, data_type))
    behaviour = BEHAVIOUR[register.key]
    if register.axis is None:
        return RegisterSource(DEVICE, behaviour.read)
    in_pulses = register.type is Type.VALUE and data_type is DataType.DINT
    return RegisterSource(register.axis - 1, behaviour.read_p if in_pulses else behaviour.read)


def _last_written(register: Register, data_type: DataType) -> Getter:
    """MIC-3, lenient: what was written last into a write-only register, converted as stored values are (MIC-17)."""
    key, number = (register.key, register.index), (register.axis or 1) - 1
    if register.type is not Type.VALUE:
        return lambda device, now: device.written.get(key, 0)
    if data_type is DataType.DINT:
        return lambda device, now: round(device.written.get(key, 0))
    return lambda device, now: device.written.get(key, 0) / device.axes[number].gear
