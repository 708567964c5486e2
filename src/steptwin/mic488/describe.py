"""Modbus PDUs of a MIC488 in words: ``read M1_POS_ACT … M4_POS_ACT = 12.5, 0, 0, 0 mm``. For logs and live views.

Never raises on what comes from the line: a PDU that makes no sense is described as such.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import NamedTuple

from steptwin.messages import NONE, Message, MessageText, text_of
from steptwin.mic488.encoding import word_to_int, words_to_dint, words_to_real
from steptwin.mic488.registermap import DataType, QuantityKind, Register, RegisterMap, RegisterSlice, Space, Type, show_address
from steptwin.mic488.registers import axes_of_mask
from steptwin.wire import pdu as modbus

EMPTY_REQUEST = Message("mic488.empty-request", "empty request")
NOT_IMPLEMENTED = Message("mic488.not-implemented", "not implemented by the device")
A_FUNCTION = Message("mic488.a-function", "function {function}")
FUNCTION = Message("mic488.function", "function {function}: {detail}")
READ = Message("mic488.read", "read {what}")
WRITE = Message("mic488.write", "write {what}")
WROTE = Message("mic488.wrote", "wrote {what}")
READ_BITS = Message("mic488.read-bits", "read bits {data}")
READ_REGISTERS = Message("mic488.read-registers", "read registers {values}")
MALFORMED = Message("mic488.malformed", "malformed: {what}")
EXCEPTION = Message("mic488.exception", "exception {code:02d} {name} ({where})")
PART = Message("mic488.part", "{name} = {value}")
PARTS = Message("mic488.parts", "{parts:; }")
UNMAPPED = Message("mic488.unmapped", "{where} (unmapped)")
HALF = Message("mic488.half", "half of {name} at {address}")
ALL_OFF = Message("mic488.all-off", "all off")
ALL_ON = Message("mic488.all-on", "all on")
ON = Message("mic488.on", "{names} on")
MEANING = Message("mic488.meaning", "{text} ({word})")
MOST_VALUES = 8
"""Longer lists of plain numbers are cut."""


class AxisScale(NamedTuple):
    """The configured unit of an axis (``mm``), and its pulses per unit (GEAR)."""

    unit: str
    gear: float


class Wording:
    """The knowledge for describing the frames of one controller.

    ``scales`` are those of axes 1–4; without them units are shown as ``u``. ``data_type`` is DATA_TYPE at the time.
    """

    __slots__ = ("data_type", "register_map", "scales")

    def __init__(self, register_map: RegisterMap, scales: Sequence[AxisScale] = (), data_type: DataType = DataType.REAL) -> None:
        self.register_map = register_map
        self.scales = tuple(scales)
        self.data_type = data_type

    # ------------------------------------------------------------------ PDUs

    def request(self, pdu: bytes) -> MessageText:
        """The text of a request: registers read, or registers written with their values."""
        try:
            request = modbus.decode_request(pdu)
        except modbus.ModbusException as refusal:
            if not pdu:
                return EMPTY_REQUEST()
            detail = text_of(refusal.detail) if refusal.detail else NOT_IMPLEMENTED()
            return FUNCTION(function=modbus.function_number(pdu[0]), detail=detail)
        match request:
            case modbus.ReadRequest(function, address, count):
                return READ(what=self._names(_SPACES[function], address, count))
            case modbus.WriteCoilRequest(address, on):
                return WRITE(what=self._bits(Space.COIL, address, [on]))
            case modbus.WriteRegisterRequest(address, value):
                return WRITE(what=self._word(address, value))
            case modbus.WriteRegistersRequest(address, values):
                return WRITE(what=self._registers(address, values))

    def response(self, pdu: bytes, request: bytes | None = None) -> MessageText:
        """The text of a response. Values and registers can only be named if the request is known."""
        try:
            response = modbus.decode_response(pdu)
        except modbus.BadResponse as failure:
            return MALFORMED(what=text_of(failure))
        asked = _decoded(request)
        match response:
            case modbus.ExceptionResponse(function, code):
                name = modbus.EXCEPTION_NAMES.get(code, "unknown exception")
                where = A_FUNCTION(function=modbus.function_number(function)) if asked is None else str(asked.address)
                return EXCEPTION(code=code, name=text_of(name), where=where)
            case modbus.BitsResponse(function, packed):
                if isinstance(asked, modbus.ReadRequest) and asked.function == function and len(packed) == (asked.count + 7) // 8:
                    states = modbus.unpack_bits(packed, asked.count)
                    return READ(what=self._bits(_SPACES[function], asked.address, states))
                return READ_BITS(data=packed.hex(" "))
            case modbus.RegistersResponse(values):
                if isinstance(asked, modbus.ReadRequest) and asked.function == pdu[0] and asked.count == len(values):
                    return READ(what=self._registers(asked.address, values))
                return READ_REGISTERS(values=_numbers(values))
            case modbus.WriteCoilRequest(address, on):
                return WROTE(what=self._bits(Space.COIL, address, [on]))
            case modbus.WriteRegisterRequest(address, value):
                return WROTE(what=self._word(address, value))
            case modbus.WriteResponse(address, count):
                return WROTE(what=self._names(Space.HOLDING, address, count))

    # ------------------------------------------------------------------ parts of a request

    def _groups(self, space: Space, address: int, count: int) -> Iterable[list[RegisterSlice]]:
        """Slices of a request, those of one row (all axes of a quantity) together; half a value is a slice of its own."""
        slices = self.register_map.slices(space, address, count)
        return (list(group) for _, group in groupby(slices, _group_key))

    def _names(self, space: Space, address: int, count: int) -> list[str]:
        return [_name(group) for group in self._groups(space, address, count)]

    def _bits(self, space: Space, address: int, states: Sequence[bool]) -> list[MessageText]:
        parts: list[MessageText] = []
        for group in self._groups(space, address, len(states)):
            start = group[0].address - address
            shown = states[start : start + sum(p.size for p in group)]
            parts.append(PART(name=_name(group), value=_switches(group, shown)))
        return parts

    def _word(self, address: int, value: int) -> str:
        """Function 06. On JOG_SPEED it carries a signed number in units (MIC-6)."""
        register = self.register_map.find(Space.HOLDING, address)
        if register is not None and register.word_write and address == register.address:
            return f"{register.name} = {word_to_int(value)} {self._unit(register)}"
        return self._registers(address, (value,))

    def _registers(self, address: int, words: Sequence[int]) -> MessageText:
        parts: list[MessageText] = []
        for group in self._groups(Space.HOLDING, address, len(words)):
            start = group[0].address - address
            shown = words[start : start + sum(p.size for p in group)]
            parts.append(PART(name=_name(group), value=self._values(group, shown)))
        return PARTS(parts=parts)

    # ------------------------------------------------------------------ values

    def _unit(self, register: Register) -> str:
        scale = self._scale(register)
        return register.unit(self.data_type, scale.unit if scale else "u")

    def _scale(self, register: Register) -> AxisScale | None:
        axis = register.axis
        return self.scales[axis - 1] if axis is not None and axis <= len(self.scales) else None

    def _values(self, group: list[RegisterSlice], words: Sequence[int]) -> str | list[MessageText]:
        registers = [p.register for p in group if p.register is not None]
        if not registers or not group[0].whole:
            return " ".join(f"{word:04X}" for word in words)
        first = registers[0]
        if first.type.size == 1:
            return [_meaning(first, word) for word in words] if first.type is Type.WORD else _numbers(words)
        pairs = zip(words[::2], words[1::2], strict=True)
        if first.type is Type.DINT or (first.type is Type.VALUE and self.data_type is DataType.DINT):
            return self._pulses(registers, [words_to_dint(low, high) for low, high in pairs])
        shown = [f"{words_to_real(low, high):.7g}" for low, high in pairs]
        return _with_units(shown, [self._unit(r) for r in registers])

    def _pulses(self, registers: Sequence[Register], counts: Sequence[int]) -> str:
        """DINT values, and their values in units where these are known."""
        text = _with_units([str(count) for count in counts], [self._unit(r) for r in registers])
        scales = [self._scale(r) for r in registers]
        if registers[0].kind is QuantityKind.ENCODER or any(s is None or s.unit == "imp" or s.gear == 0 for s in scales):
            return text
        known = [s for s in scales if s is not None]
        units = [r.unit(DataType.REAL, s.unit) for r, s in zip(registers, known, strict=True)]
        return f"{text} ({_with_units([f'{count / s.gear:.7g}' for count, s in zip(counts, known, strict=True)], units)})"


_SPACES = {
    modbus.READ_COILS: Space.COIL,
    modbus.READ_DISCRETE_INPUTS: Space.INPUT,
    modbus.READ_HOLDING_REGISTERS: Space.HOLDING,
}


def _decoded(request: bytes | None) -> modbus.ModbusRequest | None:
    try:
        return None if request is None else modbus.decode_request(request)
    except modbus.ModbusException:
        return None


def _group_key(one: RegisterSlice) -> tuple[str | None, int | None]:
    if one.register is None:
        return None, None
    return one.register.key, None if one.whole else one.address


def _name(group: list[RegisterSlice]) -> str:
    first, last = group[0], group[-1]
    end = last.address + last.size - 1
    if first.register is None or last.register is None:
        where = str(first.address) if first.address == end else f"{first.address}…{end}"
        return UNMAPPED(where=where)
    if not first.whole:
        return HALF(name=first.register.name, address=show_address(first.address))
    if first.register.cells > 1:
        offset = first.register.address
        cells = f"{first.address - offset}" if first.address == end else f"{first.address - offset} … {end - offset}"
        return f"{first.register.name} {cells}"
    return first.register.name if first is last else f"{first.register.name} … {last.register.name}"


def _switches(group: list[RegisterSlice], states: Sequence[bool]) -> str:
    if len(states) == 1:
        return "ON" if states[0] else "OFF"
    if not any(states):
        return ALL_OFF()
    if all(states):
        return ALL_ON()
    if group[0].register is None:
        return "".join("1" if on else "0" for on in states)
    return ON(names=[p.register.name for p, on in zip(group, states, strict=True) if on and p.register is not None])


def _meaning(register: Register, word: int) -> MessageText:
    if register.kind is QuantityKind.MASK:
        return MEANING(text=" ".join(f"M{axis}" for axis in axes_of_mask(word)) or NONE(), word=word)
    text = register.values.get(word)
    return MessageText(str(word)) if text is None else MEANING(text=text_of(text), word=word)


def _numbers(words: Sequence[int]) -> str:
    shown = ", ".join(str(word) for word in words[:MOST_VALUES])
    return shown if len(words) <= MOST_VALUES else f"{shown}, … ({len(words)} words)"


def _with_units(values: Sequence[str], units: Sequence[str]) -> str:
    if len(set(units)) == 1:
        return f"{', '.join(values)} {units[0]}"
    return ", ".join(f"{value} {unit}" for value, unit in zip(values, units, strict=True))
