from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from steptwin.wire import mbap
from steptwin.wire.crc import with_crc
from steptwin.wire.gateway import QUEUE_REQUESTS, GatewayPort, ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.rtu import BURSTY_GAP_NS
from steptwin.wire.slave import FrameDirection
from steptwin.wire.timed import FRAME_INTERVAL_NS, LineTiming, TimedRtuSlavePort, TimedUnits

NewBank = Callable[[], Any]
LINE = SerialLine(38400)
TIMING = LineTiming(LINE)
TURN = 750_000
REQUEST_NS = 2_083_334  # 8 characters at 38400 bit/s
RESPONSE_NS = 1_822_917  # 7 characters
READ = bytes.fromhex("03 00 05 00 01")
TOLD = bytes.fromhex("03 02 00 05")
SENT = REQUEST_NS + TURN + RESPONSE_NS


def ask(transaction: int, unit: int = 1, pdu: bytes = READ) -> bytes:
    return mbap.encode_frame(transaction, unit, pdu)


def answered(transaction: int, pdu: bytes = TOLD, unit: int = 1) -> bytes:
    return mbap.encode_frame(transaction, unit, pdu)


def run(until: int, *ports: GatewayPort | TimedRtuSlavePort) -> list[list[tuple[int, bytes]]]:
    """As a shell does: call each port at its deadlines. What each has sent."""
    out: list[list[tuple[int, bytes]]] = [[] for _ in ports]
    while True:
        deadlines = [due for port in ports if (due := port.deadline()) is not None and due <= until]
        if not deadlines:
            return out
        for port, sent in zip(ports, out, strict=True):
            if port.deadline() == min(deadlines):
                sent.extend(port.to_send(min(deadlines)))


def test_mic_32_a_request_takes_the_time_of_the_line_behind_the_gateway(bank: Any) -> None:
    port = TcpGatewayPort(ModbusGateway(TimedUnits({1: bank}, TIMING)))
    assert port.exchange(ask(7), 1000) == b""
    assert port.deadline() == 1000 + REQUEST_NS
    assert run(10**9, port) == [[(1000 + SENT, answered(7))]]
    assert bank.executed == [(1000 + REQUEST_NS, READ)]
    assert port.deadline() is None


def test_mic_32_requests_wait_for_their_turn_in_the_order_in_which_they_came(bank: Any) -> None:
    gateway = ModbusGateway(TimedUnits({1: bank}, TIMING))
    first, second = TcpGatewayPort(gateway), TcpGatewayPort(gateway)
    first.exchange(ask(1) + ask(2), 0)
    second.exchange(ask(3), 0)
    first.exchange(ask(4), 0)
    mine, others = run(10**9, first, second)
    moments = [SENT + n * FRAME_INTERVAL_NS for n in range(4)]
    assert mine == [(moments[0], answered(1)), (moments[1], answered(2)), (moments[3], answered(4))]
    assert others == [(moments[2], answered(3))]


def test_mic_32_what_finds_the_queue_full_is_refused_as_busy(bank: Any) -> None:
    gateway = ModbusGateway(TimedUnits({1: bank}, TIMING))
    first, second = TcpGatewayPort(gateway), TcpGatewayPort(gateway)
    refused = first.exchange(b"".join(ask(n) for n in range(QUEUE_REQUESTS + 1)), 0)
    assert refused == answered(QUEUE_REQUESTS, bytes.fromhex("83 06"))
    assert second.exchange(ask(99), 0) == answered(99, bytes.fromhex("83 06"))
    ((*_, (_, last)), none) = run(10**9, first, second)
    assert (last, none) == (answered(QUEUE_REQUESTS - 1), [])
    assert len(bank.executed) == QUEUE_REQUESTS


def test_mic_32_a_gateway_waits_while_the_controller_serves_another_port(bank: Any) -> None:
    units = TimedUnits({1: bank}, TIMING)
    port, serial = TcpGatewayPort(ModbusGateway(units)), TimedRtuSlavePort(units)
    serial.exchange(b"\x01" + READ + bytes.fromhex("94 0b"), 0)
    run(REQUEST_NS, serial)
    port.exchange(ask(1), REQUEST_NS)
    (mine, others) = run(10**9, port, serial)
    assert len(others) == 1
    assert mine == [(SENT + FRAME_INTERVAL_NS, answered(1))]
    assert serial.dropped == 0


def test_requests_of_a_connection_that_is_gone_are_not_executed(bank: Any) -> None:
    gateway = ModbusGateway(TimedUnits({1: bank}, TIMING))
    gone, port = TcpGatewayPort(gateway), TcpGatewayPort(gateway)
    gone.exchange(ask(1), 0)
    gone.close()
    port.exchange(ask(2), 10**9)
    assert run(2 * 10**9, port) == [[(10**9 + SENT, answered(2))]]
    assert len(bank.executed) == 1


def test_mic_2_a_broadcast_is_executed_by_all_units_in_its_turn_and_not_answered(new_bank: NewBank) -> None:
    banks = {unit: new_bank() for unit in (1, 2)}
    port = TcpGatewayPort(ModbusGateway(TimedUnits(banks, TIMING)))
    write = bytes.fromhex("06 00 05 00 63")
    port.exchange(ask(1, 0, write) + ask(2, 0) + ask(3), 0)
    ((_, told),) = run(10**9, port)[0]
    assert told == answered(3, bytes.fromhex("03 02 00 63"))
    assert [pdu for _, pdu in banks[2].executed] == [write]
    assert banks[1].executed == [(REQUEST_NS, write), (REQUEST_NS + FRAME_INTERVAL_NS, READ)]


@pytest.mark.parametrize(("units", "asked", "code"), [([1], 2, 0x0B), ([1, 2], 255, 0x0B), ([1], 0, 0), ([1], 255, 0)])
def test_mic_23_units_behind_a_gateway(new_bank: NewBank, units: list[int], asked: int, code: int) -> None:
    port = TcpGatewayPort(ModbusGateway(TimedUnits({unit: new_bank() for unit in units}, TIMING)))
    now = port.exchange(ask(5, asked), 0)
    later = b"".join(told for _, told in run(10**9, port)[0])
    expected = answered(5, bytes((0x83, code)) if code else TOLD, asked)
    assert (now, later) == ((expected, b"") if code else (b"", expected))


def test_requests_of_scripts_and_of_clients_share_the_line(bank: Any) -> None:
    gateway = ModbusGateway(TimedUnits({1: bank}, TIMING))
    script, client = ScriptPort(gateway), TcpGatewayPort(gateway)
    frame = b"\x01" + READ + bytes.fromhex("94 0b")
    assert script.exchange(frame * 12 + frame[:4], 0) == b""
    client.exchange(ask(1), 0)
    script.exchange(frame[4:] + bytes.fromhex("ff 02 03"), 0)
    mine, others = run(10**9, script, client)
    assert [moment for moment, _ in mine] == [SENT + n * FRAME_INTERVAL_NS for n in range(14) if n != 12]
    assert others == [(SENT + 12 * FRAME_INTERVAL_NS, answered(1))]


def test_scripts_address_as_on_a_line(new_bank: NewBank) -> None:
    banks = {unit: new_bank() for unit in (1, 2)}
    script = ScriptPort(ModbusGateway(TimedUnits(banks, TIMING)))
    for text in ("00 06 00 05 00 63", "03 06 00 05 00 63", "00 03 00 05 00 01"):
        script.exchange(with_crc(bytes.fromhex(text)), 0)
    assert run(10**9, script) == [[]]
    assert [[pdu for _, pdu in bank.executed] for bank in banks.values()] == [[bytes.fromhex("06 00 05 00 63")]] * 2


def test_a_wrong_header_breaks_the_connection(bank: Any) -> None:
    port = TcpGatewayPort(ModbusGateway(TimedUnits({1: bank}, TIMING)))
    port.exchange(ask(1) + bytes.fromhex("00 01 00 01 00 06"), 0)
    assert port.broken == "MBAP protocol 1 is not 0"
    assert run(10**9, port) == [[(SENT, answered(1))]]


def test_an_observer_sees_requests_when_they_come_and_responses_when_they_leave(bank: Any) -> None:
    seen: list[tuple[int, FrameDirection, bytes]] = []
    gateway = ModbusGateway(TimedUnits({1: bank}, TIMING))
    port = TcpGatewayPort(gateway, on_frame=lambda now, way, raw: seen.append((now, way, raw)))
    port.exchange(ask(1), 5)
    run(10**9, port)
    assert seen == [(5, FrameDirection.IN, ask(1)), (5 + SENT, FrameDirection.OUT, answered(1))]


def test_mic_15_a_frame_of_unknown_length_from_a_script_comes_after_the_gap(bank: Any) -> None:
    script = ScriptPort(ModbusGateway(TimedUnits({1: bank}, TIMING)))
    script.exchange(with_crc(bytes.fromhex("01 41 01 02 03")), 1000)
    sent = 1000 + BURSTY_GAP_NS + LINE.duration(7) + TURN + LINE.duration(5)
    assert run(10**9, script) == [[(sent, with_crc(bytes.fromhex("01 C1 01")))]]


def test_refusals_of_one_moment_leave_in_the_order_of_their_requests(bank: Any) -> None:
    port = TcpGatewayPort(ModbusGateway(TimedUnits({1: bank}, TIMING)))
    refused = bytes.fromhex("83 0B")
    assert port.exchange(ask(9, 2) + ask(3, 2), 0) == answered(9, refused, 2) + answered(3, refused, 2)


@pytest.mark.parametrize("kind", [TcpGatewayPort, ScriptPort])
def test_a_snapshot_continues_as_the_original(new_bank: NewBank, kind: type[TcpGatewayPort | ScriptPort]) -> None:
    """A request that waits, a response on its way, half a request."""
    request = ask(1) if kind is TcpGatewayPort else with_crc(b"\x01" + READ)
    ports, gateways, units, banks = [], [], [], []
    for _ in range(2):
        banks.append(new_bank())
        units.append(TimedUnits({1: banks[-1]}, TIMING))
        gateways.append(ModbusGateway(units[-1]))
        ports.append(kind(gateways[-1]))
    ports[1].exchange(request, 0)  # replaced by the snapshot
    ports[0].exchange(request * 2 + request[:5], 0)
    ports[0].to_send(REQUEST_NS)
    for part, other in ((units[0], units[1]), (gateways[0], gateways[1]), (ports[0], ports[1])):
        other.set_state(part.copy_state())
    for port in ports:
        port.exchange(request[5:], REQUEST_NS + 1)
    banks[0].executed.clear()
    (mine,), (others,) = (run(10**9, port) for port in ports)
    assert len(mine) == 3
    assert mine == others
    assert banks[0].executed == banks[1].executed
    ports[1].set_state(kind(gateways[0]).copy_state())
    assert ports[1].deadline() is None


def test_an_observer_of_scripts_sees_requests_when_they_are_executed(bank: Any) -> None:
    seen: list[tuple[int, FrameDirection, bytes]] = []
    script = ScriptPort(ModbusGateway(TimedUnits({1: bank}, TIMING)), on_frame=lambda now, way, raw: seen.append((now, way, raw)))
    request, response = with_crc(b"\x01" + READ), with_crc(b"\x01" + TOLD)
    script.exchange(request, 5)
    run(10**9, script)
    assert seen == [(5 + REQUEST_NS, FrameDirection.IN, request), (5 + SENT, FrameDirection.OUT, response)]
