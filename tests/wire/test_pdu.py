from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.pdu import DecodePDU
from pymodbus.pdu import bit_message as peer_bits
from pymodbus.pdu import register_message as peer_registers

from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.wire.pdu import (
    BadResponse,
    BitsResponse,
    ExceptionResponse,
    ModbusException,
    ModbusRequest,
    ModbusResponse,
    ReadRequest,
    RegistersResponse,
    WriteCoilRequest,
    WriteRegisterRequest,
    WriteRegistersRequest,
    WriteResponse,
    answer,
    decode_request,
    decode_response,
    encode_request,
    encode_response,
    pack_bits,
    unpack_bits,
)

addresses = st.integers(0, 0xFFFF)
words = st.integers(0, 0xFFFF)


def spans(most: int) -> st.SearchStrategy[tuple[int, int]]:
    """Address and count of a permitted span."""
    return st.integers(1, most).flatmap(lambda count: st.tuples(st.integers(0, 0x10000 - count), st.just(count)))


requests: st.SearchStrategy[ModbusRequest] = st.one_of(
    st.builds(lambda f, span: ReadRequest(f, *span), st.sampled_from([1, 2]), spans(2000)),
    st.builds(lambda span: ReadRequest(3, *span), spans(125)),
    st.builds(WriteCoilRequest, addresses, st.booleans()),
    st.builds(WriteRegisterRequest, addresses, words),
    spans(123).flatmap(
        lambda span: st.builds(WriteRegistersRequest, st.just(span[0]), st.tuples(*[st.just(7)] * (span[1] - 1), words))
    ),
)


def test_examples_of_the_specification_in_both_directions(example: Any) -> None:
    asked, answered = bytes.fromhex(example.request_pdu), bytes.fromhex(example.response_pdu)
    assert encode_request(example.request) == asked
    assert decode_request(asked) == example.request
    assert encode_response(example.response) == answered
    assert decode_response(answered) == example.response
    assert answer(example.request, answered) == example.response


def test_golden_requests_of_the_manual(golden: tuple[bytes, ModbusRequest]) -> None:
    frame, request = golden
    assert decode_request(frame[1:-2]) == request
    assert encode_request(request) == frame[1:-2]


def test_example_of_an_exception_response() -> None:
    # Section 7 of the specification: a read of coil 1185 that does not exist.
    assert decode_response(bytes.fromhex("81 02")) == ExceptionResponse(1, 2)
    assert encode_response(ExceptionResponse(1, 2)) == bytes.fromhex("81 02")
    assert ModbusException(1, 2).pdu == bytes.fromhex("81 02")


def test_bits_of_the_specification() -> None:
    # Section 6.1: coils 27–20 are CD, 35–28 are 6B, 38–36 are 05; the first coil is the lowest bit of the first byte.
    coils = unpack_bits(bytes.fromhex("CD 6B 05"), 19)
    assert "".join(str(int(on)) for on in coils) == "1011001111010110101"
    assert pack_bits(coils) == bytes.fromhex("CD 6B 05")


@given(st.lists(st.booleans(), max_size=2000))
def test_bits_survive_packing(values: list[bool]) -> None:
    packed = pack_bits(values)
    assert len(packed) == (len(values) + 7) // 8
    assert unpack_bits(packed, len(values)) == values


def test_more_bits_than_there_are() -> None:
    with pytest.raises(Misuse, match=r"cannot take 9 bits from 1 bytes: permitted are 0 to 8"):
        unpack_bits(b"\xff", 9)


@given(requests)
def test_requests_survive_the_wire(request: ModbusRequest) -> None:
    pdu = encode_request(request)
    assert decode_request(pdu) == request
    assert pdu[0] == request.function


@given(requests)
def test_requests_are_those_of_pymodbus(request: ModbusRequest) -> None:
    match request:
        case ReadRequest(1, address, count):
            peer: Any = peer_bits.ReadCoilsRequest(address=address, count=count)
        case ReadRequest(2, address, count):
            peer = peer_bits.ReadDiscreteInputsRequest(address=address, count=count)
        case ReadRequest(_, address, count):
            peer = peer_registers.ReadHoldingRegistersRequest(address=address, count=count)
        case WriteCoilRequest(address, on):
            peer = peer_bits.WriteSingleCoilRequest(address=address, bits=[on])
        case WriteRegisterRequest(address, value):
            peer = peer_registers.WriteSingleRegisterRequest(address=address, registers=[value])
        case WriteRegistersRequest(address, values):
            peer = peer_registers.WriteMultipleRegistersRequest(address=address, count=len(values), registers=list(values))
    assert bytes((peer.function_code,)) + peer.encode() == encode_request(request)


@given(st.lists(words, min_size=1, max_size=125))
def test_register_responses_are_read_by_pymodbus(values: list[int]) -> None:
    peer = DecodePDU(False).decode(encode_response(RegistersResponse(tuple(values))))
    assert peer is not None
    assert peer.registers == values


@given(st.lists(st.booleans(), min_size=1, max_size=2000))
def test_bit_responses_are_read_by_pymodbus(values: list[bool]) -> None:
    peer = DecodePDU(False).decode(encode_response(BitsResponse(2, pack_bits(values))))
    assert peer is not None
    assert peer.bits[: len(values)] == values


@pytest.mark.parametrize(
    ("text", "code", "why"),
    [
        ("01 00 00 00 00", 3, "quantity 0 is outside 1 to 2000"),
        ("01 00 00 07 D1", 3, "quantity 2001 is outside 1 to 2000"),
        ("02 00 00 FF FF", 3, "quantity 65535 is outside 1 to 2000"),
        ("03 00 00 00 00", 3, "quantity 0 is outside 1 to 125"),
        ("03 00 00 00 7E", 3, "quantity 126 is outside 1 to 125"),
        ("10 00 00 00 00 00", 3, "quantity 0 is outside 1 to 123"),
        ("10 00 00 00 7C F8" + 248 * "00", 3, "quantity 124 is outside 1 to 123"),
        ("10 00 00 00 02 03 00 00 00", 3, "byte count 3 does not match 2 registers"),
        ("10 00 00 00 02 04 00 00 00", 3, "the PDU has 9 bytes instead of 10"),
        ("10 00 00 00 02 04 00 00 00 00 00", 3, "the PDU has 11 bytes instead of 10"),
        ("10 00 00", 3, "the PDU has 3 bytes instead of 8"),
        ("03 00 00 00 01 00", 3, "the PDU has 6 bytes instead of 5"),
        ("06 00 00", 3, "the PDU has 3 bytes instead of 5"),
    ],
)
def test_mic_24_quantities_and_lengths_are_refused_with_03(text: str, code: int, why: str) -> None:
    with pytest.raises(ModbusException) as refusal:
        decode_request(bytes.fromhex(text))
    assert (refusal.value.code, refusal.value.detail) == (code, why)


@pytest.mark.parametrize("text", ["01 00 00 07 D0", "02 00 00 07 D0", "03 00 00 00 7D", "10 00 00 00 7B F6" + 246 * "00"])
def test_mic_24_the_largest_quantities_are_accepted(text: str) -> None:
    assert encode_request(decode_request(bytes.fromhex(text))) == bytes.fromhex(text)


@pytest.mark.parametrize("value", ["00 01", "FF FF", "01 00", "00 FF"])
def test_mic_7_other_coil_values_are_refused_with_03(value: str) -> None:
    with pytest.raises(ModbusException) as refusal:
        decode_request(bytes.fromhex("05 17 71" + value))
    assert refusal.value.pdu == bytes.fromhex("85 03")
    assert f"coil value {value.replace(' ', '')} is neither FF00 nor 0000" in str(refusal.value)


@pytest.mark.parametrize("function", [0, 4, 7, 8, 15, 17, 22, 23, 43, 100, 127])
def test_mic_1_other_functions_are_refused_with_01(function: int) -> None:
    with pytest.raises(ModbusException) as refusal:
        decode_request(bytes((function, 0, 0, 0, 1)))
    assert refusal.value.pdu == bytes((function | 0x80, 1))


def refusal_code(pdu: bytes) -> int | None:
    try:
        decode_request(pdu)
    except ModbusException as refusal:
        return refusal.code
    return None


@given(st.binary(max_size=260))
def test_any_pdu_is_a_request_or_refused(pdu: bytes) -> None:
    code = refusal_code(pdu)
    if code is None:
        assert pdu[0] in (1, 2, 3, 5, 6, 16)
        assert len(pdu) == (5 if pdu[0] != 16 else 6 + pdu[5])
    elif pdu and pdu[0] in (1, 2, 3, 5, 6, 16):
        assert code == 3
    else:
        assert code == 1


@given(st.binary(max_size=260))
def test_any_pdu_is_a_response_or_a_bad_one(pdu: bytes) -> None:
    try:
        response = decode_response(pdu)
    except BadResponse:
        return
    try:
        assert encode_response(response) == pdu
    except Misuse:
        # Right in form, outside the protocol's range: no answer to any request that can be sent.
        assert isinstance(response, BitsResponse | RegistersResponse | WriteResponse | ExceptionResponse)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (ReadRequest(4, 0, 1), "function 4 (04h) does not read: permitted are 1, 2 and 3"),
        (ReadRequest(3, 0, 0), "number of registers 0 is outside 1 to 125"),
        (ReadRequest(3, 0, 126), "number of registers 126 is outside 1 to 125"),
        (ReadRequest(1, 0, 2001), "number of bits 2001 is outside 1 to 2000"),
        (ReadRequest(3, 65536, 1), "address 65536 is outside 0 to 65535"),
        (ReadRequest(3, 65530, 7), "7 registers from address 65530 end above 65535"),
        (WriteCoilRequest(-1, True), "address -1 is outside 0 to 65535"),
        (WriteRegisterRequest(70000, 1), "address 70000 is outside 0 to 65535"),
        (WriteRegisterRequest(0, 65536), "register value 65536 is outside 0 to 65535"),
        (WriteRegistersRequest(0, ()), "number of registers 0 is outside 1 to 123"),
        (WriteRegistersRequest(0, (0,) * 124), "number of registers 124 is outside 1 to 123"),
        (WriteRegistersRequest(0, (1, -1)), "register value -1 is outside 0 to 65535"),
    ],
)
def test_what_cannot_be_asked(request_: ModbusRequest, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        encode_request(request_)
    assert str(misuse.value) == message


@pytest.mark.parametrize(
    ("response", "message"),
    [
        (BitsResponse(3, b"\0"), "function 3 (03h) does not answer with bits: permitted are 1 and 2"),
        (BitsResponse(1, bytes(251)), "number of bytes 251 is outside 1 to 250"),
        (RegistersResponse(()), "number of registers 0 is outside 1 to 125"),
        (ExceptionResponse(0x83, 2), "function 131 is outside 1 to 127"),
        (ExceptionResponse(3, 0), "exception code 0 is outside 1 to 255"),
    ],
)
def test_what_cannot_be_answered(response: ModbusResponse, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        encode_response(response)
    assert str(misuse.value) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a response of 0 bytes is too short"),
        ("03", "a response of 1 bytes is too short"),
        ("83 02 00", "response to function 3 (03h) has 3 bytes instead of 2"),
        ("03 04 00 00", "response to function 3 (03h) has 4 bytes instead of 6"),
        ("03 03 00 00 00", "response to function 3 (03h) has an odd byte count: 3"),
        ("05 00 00 00 01", "response to function 5 (05h) repeats the coil value 0001, neither FF00 nor 0000"),
        ("06 00 00", "response to function 6 (06h) has 3 bytes instead of 5"),
        ("04 02 00 00", "response to function 4 (04h), which is none of 1, 2, 3, 5, 6 and 16 (10h)"),
    ],
)
def test_responses_without_form(text: str, message: str) -> None:
    with pytest.raises(BadResponse) as bad:
        decode_response(bytes.fromhex(text))
    assert str(bad.value) == message
    assert isinstance(bad.value, LineFailure)


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        (ReadRequest(3, 0, 2), "03 02 00 00"),
        (ReadRequest(3, 0, 2), "02 04 00 00 00 00"),
        (ReadRequest(1, 0, 9), "01 01 00"),
        (ReadRequest(1, 0, 8), "02 01 00"),
        (ReadRequest(1, 0, 8), "82 02"),
        (WriteCoilRequest(5, True), "05 00 05 00 00"),
        (WriteRegisterRequest(5, 1), "06 00 06 00 01"),
        (WriteRegisterRequest(5, 0xFF00), "05 00 05 FF 00"),
        (WriteRegistersRequest(5, (1, 2)), "10 00 05 00 01"),
        (WriteRegistersRequest(5, (1, 2)), "10 00 04 00 02"),
    ],
)
def test_answers_to_something_else(request_: ModbusRequest, text: str) -> None:
    with pytest.raises(BadResponse, match="does not answer"):
        answer(request_, bytes.fromhex(text))


@pytest.mark.parametrize(
    "request_",
    [
        ReadRequest(1, 0, 1),
        ReadRequest(3, 0, 1),
        WriteCoilRequest(0, True),
        WriteRegisterRequest(0, 0),
        WriteRegistersRequest(0, (1,)),
    ],
)
def test_a_refusal_is_raised_as_one(request_: ModbusRequest) -> None:
    with pytest.raises(ModbusException) as refusal:
        answer(request_, bytes((request_.function | 0x80, 2)))
    assert isinstance(refusal.value, Refusal)
    assert (refusal.value.function, refusal.value.code) == (request_.function, 2)
    assert (
        str(refusal.value)
        == f"function {request_.function} ({request_.function:02X}h) refused with exception 02 (illegal data address)"
    )


def test_an_exception_code_nobody_knows_is_shown() -> None:
    assert str(ModbusException(3, 0x55)) == "function 3 (03h) refused with exception 55 (unknown code)"


def test_values_of_different_kinds_differ() -> None:
    alike: Sequence[object] = (WriteCoilRequest(1, True), WriteRegisterRequest(1, 1), WriteResponse(1, 1))
    assert len({repr(value) for value in alike}) == 3
    assert all(a != b for i, a in enumerate(alike) for b in alike[i + 1 :])
