"""What observers of writes are told by each kind of port: requests that are no reads, with their responses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from steptwin.wire import mbap
from steptwin.wire.crc import with_crc
from steptwin.wire.gateway import ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

READ = bytes.fromhex("03 00 05 00 01")
WRITE = bytes.fromhex("06 00 05 00 2A")
UNKNOWN = bytes.fromhex("07")
TIMING = LineTiming(SerialLine(38400))
SECOND = 10**9

MAKERS: dict[str, tuple[Callable[[dict[int, Any]], Any], bool]] = {
    "rtu": (RtuSlavePort, False),
    "tcp": (TcpSlavePort, True),
    "timed rtu": (lambda banks: TimedRtuSlavePort(TimedUnits(banks, TIMING)), False),
    "timed tcp": (lambda banks: TcpGatewayPort(ModbusGateway(TimedUnits(banks, TIMING))), True),
    "timed script": (lambda banks: ScriptPort(ModbusGateway(TimedUnits(banks, TIMING))), False),
}


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("is_logged", [False, True])
def test_writes_are_told_with_their_responses_and_reads_are_not(kind: str, is_logged: bool, new_bank: Callable[[], Any]) -> None:
    make, is_tcp = MAKERS[kind]
    banks = {1: new_bank(), 2: new_bank()}
    port: Any = make(banks)
    seen: list[tuple[int, bytes, bytes]] = []
    port.on_write = lambda now, unit, request, response: seen.append((unit, request, response))
    if is_logged:
        port.on_frame = lambda *_: None
    now = 0
    for unit, pdu in ((1, READ), (2, WRITE), (1, UNKNOWN), (0, WRITE), (0, READ)):
        data = mbap.encode_frame(1, unit, pdu) if is_tcp else with_crc(bytes((unit,)) + pdu)
        port.exchange(data, now)
        for _ in range(10):
            now += SECOND // 100
            port.to_send(now)
    broadcast = [one for one in seen if not one[2]]
    assert [one for one in seen if one[2]] == [(2, WRITE, WRITE), (1, UNKNOWN, bytes.fromhex("87 01"))]
    assert {pdu for _, pdu, _ in broadcast} == {WRITE}
    assert [bank.registers[5] for bank in banks.values()] == [42, 42]
