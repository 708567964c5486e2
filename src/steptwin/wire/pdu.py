"""Modbus protocol data units: function code and data, without address and checksum.

The six functions of the MIC488 in both directions (Modbus application protocol V1.1b3, section 6). Requests and responses
are plain values; each side encodes what it sends (`Misuse` when a value is not permitted) and decodes what it receives.
Addresses are those on the wire, from 0; ``count`` is a number of bits or of 16-bit registers.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.messages import Message, text_of

READ_COILS = 0x01
READ_DISCRETE_INPUTS = 0x02
READ_HOLDING_REGISTERS = 0x03
WRITE_SINGLE_COIL = 0x05
WRITE_SINGLE_REGISTER = 0x06
WRITE_MULTIPLE_REGISTERS = 0x10

BIT_READS = frozenset({READ_COILS, READ_DISCRETE_INPUTS})
READS = BIT_READS | {READ_HOLDING_REGISTERS}
WRITES = frozenset({WRITE_SINGLE_COIL, WRITE_SINGLE_REGISTER, WRITE_MULTIPLE_REGISTERS})
REFUSED = 0x80
"""Added to the function code in an exception response."""

ILLEGAL_FUNCTION = 0x01
ILLEGAL_DATA_ADDRESS = 0x02
ILLEGAL_DATA_VALUE = 0x03
DEVICE_FAILURE = 0x04
DEVICE_BUSY = 0x06
GATEWAY_TARGET_FAILED = 0x0B
EXCEPTION_NAMES = {
    ILLEGAL_FUNCTION: Message("wire.illegal-function", "illegal function")(),
    ILLEGAL_DATA_ADDRESS: Message("wire.illegal-data-address", "illegal data address")(),
    ILLEGAL_DATA_VALUE: Message("wire.illegal-data-value", "illegal data value")(),
    DEVICE_FAILURE: Message("wire.device-failure", "device failure")(),
    0x05: Message("wire.acknowledge", "acknowledge")(),
    DEVICE_BUSY: Message("wire.device-busy", "device busy")(),
    0x08: Message("wire.memory-parity-error", "memory parity error")(),
    0x0A: Message("wire.gateway-path-unavailable", "gateway path unavailable")(),
    GATEWAY_TARGET_FAILED: Message("wire.gateway-target-failed-to-respond", "gateway target failed to respond")(),
}

# MIC-24: the limits of the protocol are those of the device.
MAX_BITS = 2000
MAX_REGISTERS = 125
MAX_WRITTEN_REGISTERS = 123
MAX_PDU = 253

COIL_ON = 0xFF00
COIL_OFF = 0x0000

_THREE_FIELDS = struct.Struct(">BHH")
_WRITE_HEAD = struct.Struct(">BHHB")


def function_number(code: int) -> str:
    """A function code as text, decimal with its hexadecimal form: ``22 (16h)``."""
    return f"{code} ({code:02X}h)"


REFUSED_WITH = Message("wire.refused", "function {function} refused with exception {code} ({name})")
DETAILED = Message("wire.refused-in-detail", "{refused}: {detail}")
UNKNOWN_CODE = Message("wire.unknown-code", "unknown code")


class ModbusException(Refusal):
    """The peer answered with an exception. Inside a slave: the request must be answered with one (`pdu`)."""

    def __init__(self, function: int, code: int, detail: str = "") -> None:
        self.function = function
        self.code = code
        self.detail = detail
        refused = REFUSED_WITH(
            function=function_number(function), code=f"{code:02X}", name=EXCEPTION_NAMES.get(code, UNKNOWN_CODE())
        )
        super().__init__(DETAILED(refused=refused, detail=text_of(detail)) if detail else refused)

    @property
    def pdu(self) -> bytes:
        return exception_pdu(self.function, self.code)


class BadResponse(LineFailure):
    """The response does not belong to the request."""


@dataclass(frozen=True, slots=True)
class ReadRequest:
    """Request 01, 02 or 03."""

    function: int
    address: int
    count: int


@dataclass(frozen=True, slots=True)
class WriteCoilRequest:
    """Request 05, and its response, which repeats it."""

    function: ClassVar[int] = WRITE_SINGLE_COIL
    address: int
    on: bool


@dataclass(frozen=True, slots=True)
class WriteRegisterRequest:
    """Request 06, and its response, which repeats it."""

    function: ClassVar[int] = WRITE_SINGLE_REGISTER
    address: int
    value: int


@dataclass(frozen=True, slots=True)
class WriteRegistersRequest:
    """Request 16."""

    function: ClassVar[int] = WRITE_MULTIPLE_REGISTERS
    address: int
    values: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BitsResponse:
    """Response 01 or 02. A frame has whole bytes: ``packed`` has up to seven bits more than were requested."""

    function: int
    packed: bytes


@dataclass(frozen=True, slots=True)
class RegistersResponse:
    """Response 03."""

    function: ClassVar[int] = READ_HOLDING_REGISTERS
    values: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class WriteResponse:
    """Response 16."""

    function: ClassVar[int] = WRITE_MULTIPLE_REGISTERS
    address: int
    count: int


@dataclass(frozen=True, slots=True)
class ExceptionResponse:
    """Exception response to ``function``."""

    function: int
    code: int


ModbusRequest: TypeAlias = ReadRequest | WriteCoilRequest | WriteRegisterRequest | WriteRegistersRequest
ModbusResponse: TypeAlias = (
    BitsResponse | RegistersResponse | WriteCoilRequest | WriteRegisterRequest | WriteResponse | ExceptionResponse
)


def exception_pdu(function: int, code: int) -> bytes:
    return bytes((function | REFUSED, code))


def pack_bits(values: Iterable[bool]) -> bytes:
    """First value in the lowest bit of the first byte, as functions 01 and 02 answer."""
    packed = count = 0
    for on in values:
        if on:
            packed |= 1 << count
        count += 1
    return packed.to_bytes((count + 7) // 8, "little")


def unpack_bits(packed: bytes, count: int) -> list[bool]:
    """The first ``count`` bits of ``packed``."""
    if not 0 <= count <= 8 * len(packed):
        raise Misuse(f"cannot take {count} bits from {len(packed)} bytes: permitted are 0 to {8 * len(packed)}")
    whole = int.from_bytes(packed, "little")
    return [bool(whole >> i & 1) for i in range(count)]


def _within(what: str, value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise Misuse(f"{what} {value} is outside {least} to {most}")
    return value


def _check_span(address: int, count: int, most: int, what: str) -> None:
    if not (0 <= address <= 0xFFFF and 1 <= count <= most):
        _within("address", address, 0, 0xFFFF)
        _within(f"number of {what}", count, 1, most)
    if address + count > 0x10000:
        raise Misuse(f"{count} {what} from address {address} end above 65535")


def _register_bytes(values: Sequence[int]) -> bytes:
    try:
        return struct.pack(f">{len(values)}H", *values)
    except struct.error:
        for value in values:
            _within("register value", value, 0, 0xFFFF)
        raise


def encode_request(request: ModbusRequest) -> bytes:
    """The PDU of a request; `Misuse` when a field is outside the protocol's range."""
    match request:
        case ReadRequest(function, address, count):
            if function not in READS:
                raise Misuse(f"function {function_number(function)} does not read: permitted are 1, 2 and 3")
            bits = function in BIT_READS
            _check_span(address, count, MAX_BITS if bits else MAX_REGISTERS, "bits" if bits else "registers")
            return _THREE_FIELDS.pack(function, address, count)
        case WriteRegistersRequest(address, values):
            _check_span(address, len(values), MAX_WRITTEN_REGISTERS, "registers")
            payload = _register_bytes(values)
            return _WRITE_HEAD.pack(WRITE_MULTIPLE_REGISTERS, address, len(values), len(payload)) + payload
    return encode_response(request)


WRONG_QUANTITY = Message("wire.wrong-quantity", "quantity {count} is outside 1 to {most}")
WRONG_COIL_VALUE = Message("wire.wrong-coil-value", "coil value {value:04X} is neither FF00 nor 0000")


def decode_request(pdu: bytes) -> ModbusRequest:
    """The request in a PDU, or `ModbusException` with the code a slave answers: 01 for a function outside the six,
    03 for a quantity, coil value, byte count or length that is not permitted (MIC-1, MIC-7, MIC-24).

    The device itself checks whether the addresses exist (02).
    """
    function = pdu[0] if pdu else 0
    if function in READS:
        if len(pdu) != 5:
            raise _bad_length(function, len(pdu), 5)
        _, address, count = _THREE_FIELDS.unpack(pdu)
        most = MAX_REGISTERS if function == READ_HOLDING_REGISTERS else MAX_BITS
        if not 1 <= count <= most:
            raise ModbusException(function, ILLEGAL_DATA_VALUE, WRONG_QUANTITY(count=count, most=most))
        return ReadRequest(function, address, count)
    if function not in WRITES:
        raise ModbusException(function, ILLEGAL_FUNCTION)
    if function == WRITE_MULTIPLE_REGISTERS:
        return _decode_write_registers(pdu)
    if len(pdu) != 5:
        raise _bad_length(function, len(pdu), 5)
    _, address, value = _THREE_FIELDS.unpack(pdu)
    if function == WRITE_SINGLE_REGISTER:
        return WriteRegisterRequest(address, value)
    if value not in (COIL_ON, COIL_OFF):
        raise ModbusException(function, ILLEGAL_DATA_VALUE, WRONG_COIL_VALUE(value=value))
    return WriteCoilRequest(address, value == COIL_ON)


WRONG_BYTE_COUNT = Message("wire.wrong-byte-count", "byte count {bytes} does not match {count} registers")


def _decode_write_registers(pdu: bytes) -> WriteRegistersRequest:
    function = WRITE_MULTIPLE_REGISTERS
    if len(pdu) < 6:
        raise _bad_length(function, len(pdu), 8)
    _, address, count, byte_count = _WRITE_HEAD.unpack_from(pdu)
    if not 1 <= count <= MAX_WRITTEN_REGISTERS:
        raise ModbusException(function, ILLEGAL_DATA_VALUE, WRONG_QUANTITY(count=count, most=MAX_WRITTEN_REGISTERS))
    if byte_count != 2 * count:
        raise ModbusException(function, ILLEGAL_DATA_VALUE, WRONG_BYTE_COUNT(bytes=byte_count, count=count))
    if len(pdu) != 6 + byte_count:
        raise _bad_length(function, len(pdu), 6 + byte_count)
    return WriteRegistersRequest(address, struct.unpack_from(f">{count}H", pdu, 6))


WRONG_LENGTH = Message("wire.wrong-length", "the PDU has {length} bytes instead of {wanted}")


def _bad_length(function: int, length: int, wanted: int) -> ModbusException:
    return ModbusException(function, ILLEGAL_DATA_VALUE, WRONG_LENGTH(length=length, wanted=wanted))


def encode_response(response: ModbusResponse) -> bytes:
    """The PDU of a response; `Misuse` when a field is outside the protocol's range."""
    match response:
        case BitsResponse(function, packed):
            if function not in BIT_READS:
                raise Misuse(f"function {function_number(function)} does not answer with bits: permitted are 1 and 2")
            return bytes((function, _within("number of bytes", len(packed), 1, MAX_BITS // 8))) + packed
        case RegistersResponse(values):
            count = _within("number of registers", len(values), 1, MAX_REGISTERS)
            return bytes((READ_HOLDING_REGISTERS, 2 * count)) + _register_bytes(values)
        case WriteCoilRequest(address, on):
            _within("address", address, 0, 0xFFFF)
            return _THREE_FIELDS.pack(WRITE_SINGLE_COIL, address, COIL_ON if on else COIL_OFF)
        case WriteRegisterRequest(address, value):
            _within("address", address, 0, 0xFFFF)
            return _THREE_FIELDS.pack(WRITE_SINGLE_REGISTER, address, _within("register value", value, 0, 0xFFFF))
        case WriteResponse(address, count):
            _check_span(address, count, MAX_WRITTEN_REGISTERS, "registers")
            return _THREE_FIELDS.pack(WRITE_MULTIPLE_REGISTERS, address, count)
        case ExceptionResponse(function, code):
            return exception_pdu(_within("function", function, 1, 0x7F), _within("exception code", code, 1, 0xFF))


def decode_response(pdu: bytes) -> ModbusResponse:
    """The response in a PDU by its own form alone; `BadResponse` for other functions and forms.

    Use `answer` to check that it answers a given request.
    """
    if len(pdu) < 2:
        raise BadResponse(f"a response of {len(pdu)} bytes is too short")
    function = pdu[0]
    if function & REFUSED:
        if len(pdu) != 2:
            raise _bad_response(pdu, 2)
        return ExceptionResponse(function & ~REFUSED, pdu[1])
    if function in READS:
        if len(pdu) != 2 + pdu[1]:
            raise _bad_response(pdu, 2 + pdu[1])
        if function in BIT_READS:
            return BitsResponse(function, pdu[2:])
        if pdu[1] % 2:
            raise BadResponse(f"response to function 3 (03h) has an odd byte count: {pdu[1]}")
        return RegistersResponse(struct.unpack_from(f">{pdu[1] // 2}H", pdu, 2))
    if function not in WRITES:
        raise BadResponse(f"response to function {function_number(function)}, which is none of 1, 2, 3, 5, 6 and 16 (10h)")
    if len(pdu) != 5:
        raise _bad_response(pdu, 5)
    _, address, value = _THREE_FIELDS.unpack(pdu)
    if function == WRITE_MULTIPLE_REGISTERS:
        return WriteResponse(address, value)
    if function == WRITE_SINGLE_REGISTER:
        return WriteRegisterRequest(address, value)
    if value not in (COIL_ON, COIL_OFF):
        raise BadResponse(f"response to function 5 (05h) repeats the coil value {value:04X}, neither FF00 nor 0000")
    return WriteCoilRequest(address, value == COIL_ON)


def _bad_response(pdu: bytes, wanted: int) -> BadResponse:
    return BadResponse(f"response to function {function_number(pdu[0] & ~REFUSED)} has {len(pdu)} bytes instead of {wanted}")


def answer(request: ModbusRequest, pdu: bytes) -> ModbusResponse:
    """The response in ``pdu`` if it answers ``request``.

    Raises `ModbusException` when the peer refused, `BadResponse` when it answers another request.
    """
    response = decode_response(pdu)
    match request, response:
        case _, ExceptionResponse(function, code) if function == request.function:
            raise ModbusException(function, code)
        case ReadRequest(function, _, count), BitsResponse(answered, packed) if (
            function == answered and len(packed) == (count + 7) // 8
        ):
            return response
        case ReadRequest(function, _, count), RegistersResponse(values) if (
            function == READ_HOLDING_REGISTERS and len(values) == count
        ):
            return response
        case WriteRegistersRequest(address, values), WriteResponse(written, count) if address == written and len(values) == count:
            return response
        case ((WriteCoilRequest() | WriteRegisterRequest()), _) if response == request:
            return response
    raise BadResponse(f"{response} does not answer {request}")
