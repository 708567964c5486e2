"""pymodbus' clients, each over its own kind of link."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from pymodbus import FramerType
from pymodbus.client import AsyncModbusTcpClient, ModbusSerialClient, ModbusTcpClient

pytestmark = pytest.mark.peers


def test_rtu_over_tcp(serve: Callable[..., Any]) -> None:
    port = serve("--demo").rtu_tcp_port
    with ModbusTcpClient("127.0.0.1", port=port, framer=FramerType.RTU, timeout=60, retries=0) as client:
        assert not client.write_registers(100, [1, 2, 65535], device_id=1).isError()
        assert client.read_holding_registers(99, count=5, device_id=1).registers == [0, 1, 2, 65535, 0]
        refused = client.read_holding_registers(9000, count=1, device_id=1)
        assert (refused.isError(), refused.exception_code) == (True, 2)


def test_pty(serve: Callable[..., Any]) -> None:
    with ModbusSerialClient(str(serve("--demo").pty), baudrate=38400, timeout=60, retries=0) as client:
        assert not client.write_coil(6001, True, device_id=1).isError()
        assert client.read_coils(6000, count=8, device_id=1).bits == [False, True, *[False] * 6]
        assert not client.write_register(1999, 7, device_id=1).isError()
        assert client.read_holding_registers(1998, count=2, device_id=1).registers == [0, 7]


def test_asynchronous_clients_at_once(serve: Callable[..., Any]) -> None:
    """Each writes and reads registers of its own, again and again, all on one controller."""
    port = serve("--demo").tcp_port

    async def work(number: int) -> list[list[int]]:
        client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=60, retries=0)
        assert await client.connect()
        seen = []
        for turn in range(10):
            await client.write_registers(10 * number, [number, turn], device_id=1)
            seen.append(list((await client.read_holding_registers(10 * number, count=2, device_id=1)).registers))
        client.close()
        return seen

    async def all_of_them() -> list[list[list[int]]]:
        return await asyncio.gather(*(work(number) for number in range(30)))

    seen = asyncio.run(all_of_them())
    assert seen == [[[number, turn] for turn in range(10)] for number in range(30)]


def test_several_units_on_every_link(serve: Callable[..., Any]) -> None:
    twin = serve("--units", "1,2,5")
    tcp = ModbusTcpClient("127.0.0.1", port=twin.tcp_port, timeout=60, retries=0)
    line = ModbusSerialClient(str(twin.pty), baudrate=38400, timeout=60, retries=0)
    with tcp, line:
        for unit in (1, 2, 5):
            assert not tcp.write_register(0, 100 + unit, device_id=unit).isError()
        assert [line.read_holding_registers(0, count=1, device_id=unit).registers for unit in (5, 1, 2)] == [[105], [101], [102]]
        nobody = tcp.read_holding_registers(0, count=1, device_id=3)
        assert nobody.exception_code == 11
        # A broadcast reaches all of them and is answered by none.
        line.write_register(1, 9, device_id=0, no_response_expected=True)
        assert [line.read_holding_registers(1, count=1, device_id=unit).registers for unit in (1, 2, 5)] == [[9], [9], [9]]
