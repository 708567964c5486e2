"""Modbus TCP: headers, transactions, units, and connections that come to an end."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.wire import mbap
from steptwin.wire.pdu import (
    ModbusException,
    ModbusRequest,
    ModbusResponse,
    ReadRequest,
    WriteRegisterRequest,
    answer,
    encode_request,
)
from steptwin.wire.slave import FrameDirection, TcpSlavePort

NewBank = Callable[[], Any]


def over_tcp(port: TcpSlavePort, unit: int, request: ModbusRequest, transaction: int = 7) -> ModbusResponse:
    (frame,) = mbap.TcpFramer().feed(port.exchange(mbap.encode_frame(transaction, unit, encode_request(request)), 0))
    assert (frame.transaction, frame.unit) == (transaction, unit)
    return answer(request, frame.pdu)


@pytest.mark.parametrize("is_observed", [False, True])
def test_mic_1_a_refusal_of_function_0_is_counted_on_tcp(*, is_observed: bool) -> None:
    """Its exception has the smallest function there is, 80h."""

    class Refusing:
        def execute(self, pdu: bytes, now: int) -> bytes:
            return bytes((pdu[0] | 0x80, 1))

    port = TcpSlavePort({1: Refusing()}, on_frame=(lambda now, way, raw: None) if is_observed else None)
    assert port.exchange(mbap.encode_frame(1, 1, b"\0\0"), 0) == mbap.encode_frame(1, 1, b"\x80\x01")
    assert (port.requests, port.exceptions, port.lost, port.unframed) == (1, 1, 0, 0)


def test_an_observer_sees_tcp_frames_with_their_header(bank: Any) -> None:
    seen: list[tuple[int, FrameDirection, bytes]] = []
    port = TcpSlavePort({1: bank}, on_frame=lambda now, way, raw: seen.append((now, way, raw)))
    ask = mbap.encode_frame(3, 1, bytes.fromhex("03 00 05 00 01"))
    told = port.exchange(ask, 4)
    assert seen == [(4, FrameDirection.IN, ask), (4, FrameDirection.OUT, told)]


def test_tcp_requests_are_answered_in_order_with_their_transactions(bank: Any) -> None:
    port = TcpSlavePort({1: bank})
    ask = b"".join(mbap.encode_frame(0xFF00 + n, 1, encode_request(ReadRequest(3, n, 1))) for n in range(30))
    told = b"".join(mbap.encode_frame(0xFF00 + n, 1, bytes((3, 2, 0, n))) for n in range(30))
    for size in (1, 7, 12, 13, 1000):
        assert b"".join(port.exchange(ask[at : at + size], 0) for at in range(0, len(ask), size)) == told


@pytest.mark.parametrize("unit", [0, 255, 17])
def test_mic_23_a_single_device_is_addressed_by_0_and_255_too(bank: Any, unit: int) -> None:
    assert over_tcp(TcpSlavePort({17: bank}), unit, WriteRegisterRequest(0, 9)) == WriteRegisterRequest(0, 9)
    assert bank.registers[0] == 9


@pytest.mark.parametrize(("units", "asked"), [([1], 2), ([1, 2], 255), ([1, 2], 3)])
def test_mic_23_any_other_unit_is_refused_as_a_gateway_does(new_bank: NewBank, units: list[int], asked: int) -> None:
    banks = {unit: new_bank() for unit in units}
    with pytest.raises(ModbusException) as refusal:
        over_tcp(TcpSlavePort(banks), asked, WriteRegisterRequest(0, 9))
    assert refusal.value.code == 0x0B
    assert not any(bank.executed for bank in banks.values())


def test_mic_2_unit_0_on_tcp_is_a_broadcast_where_there_are_several_units(new_bank: NewBank) -> None:
    banks = {unit: new_bank() for unit in (1, 2)}
    seen: list[FrameDirection] = []
    port = TcpSlavePort(banks, on_frame=lambda now, way, raw: seen.append(way))
    write = bytes.fromhex("06 00 05 00 63")
    assert port.exchange(mbap.encode_frame(1, 0, write), 4) == b""
    assert [bank.executed for bank in banks.values()] == [[(4, write)], [(4, write)]]
    assert port.exchange(mbap.encode_frame(2, 0, bytes.fromhex("03 00 05 00 01")), 5) == b""
    assert [len(bank.executed) for bank in banks.values()] == [1, 1]
    assert seen == [FrameDirection.IN, FrameDirection.IN]


@pytest.mark.parametrize("wrong", ["00 01 00 01 00 06 01 03 00 00 00 01", "00 01 00 00 00 01 01 03", "00 01 00 00 01 07 01 03"])
def test_a_wrong_header_breaks_the_connection_and_good_requests_before_it_are_answered(bank: Any, wrong: str) -> None:
    good = mbap.encode_frame(1, 1, bytes.fromhex("03 00 05 00 01"))
    port = TcpSlavePort({1: bank})
    assert port.exchange(good + bytes.fromhex(wrong), 0) == mbap.encode_frame(1, 1, bytes.fromhex("03 02 00 05"))
    assert port.broken is not None
    assert port.exchange(good, 0) == b""
    assert len(bank.executed) == 1
    port = TcpSlavePort({1: bank})
    assert port.exchange(bytes.fromhex(wrong), 0) == b""
    assert port.broken is not None


def test_the_largest_tcp_frame_and_no_larger(bank: Any) -> None:
    port = TcpSlavePort({1: bank})
    assert len(port.exchange(mbap.encode_frame(1, 1, bytes(253)), 0)) == 9
    assert bank.executed == [(0, bytes(253))]
    port.exchange(bytes.fromhex("00 01 00 00 01 07 01") + bytes(262), 0)
    assert port.broken == "MBAP length 263 is outside 2 to 262 bytes"


tcp_frames = st.builds(mbap.encode_frame, st.integers(0, 0xFFFF), st.integers(0, 2), st.binary(min_size=1, max_size=20))


@given(st.lists(tcp_frames), st.lists(st.integers(0, 200), max_size=10))
def test_tcp_answers_do_not_depend_on_pieces(new_bank: NewBank, sent: list[bytes], places: list[int]) -> None:
    stream = b"".join(sent)
    one_by_one = TcpSlavePort({1: new_bank()})
    expected = b"".join(one_by_one.exchange(frame, 0) for frame in sent)
    port = TcpSlavePort({1: new_bank()})
    assert b"".join(port.exchange(stream[a:b], 0) for a, b in pairwise([0, *sorted(places), len(stream)])) == expected
    assert len(mbap.TcpFramer().feed(expected)) == len(sent)


@given(st.lists(st.binary(max_size=300), max_size=6))
def test_tcp_takes_anything(new_bank: NewBank, stream: list[bytes]) -> None:
    port = TcpSlavePort({1: new_bank()})
    answered = b"".join(port.exchange(data, 0) for data in stream)
    framer = mbap.TcpFramer()
    framer.feed(answered)
    assert (framer.broken, framer.held) == (None, b"")


@pytest.mark.parametrize(
    ("unit", "pdu", "exceptions"),
    [
        (1, "03 03 FC 00 02", 0),
        (1, "03 03 FC 00 00", 1),  # no register
        (1, "00", 1),  # function 80h answers it
        (9, "03 03 FC 00 02", 1),  # nobody there
    ],
)
def test_requests_and_exceptions_are_counted(new_bank: NewBank, unit: int, pdu: str, exceptions: int) -> None:
    port = TcpSlavePort({1: new_bank()})
    response = port.exchange(mbap.encode_frame(5, unit, bytes.fromhex(pdu)), 0)
    assert (response[7] >= 0x80) is bool(exceptions)
    assert (port.requests, port.exceptions) == (1, exceptions)
