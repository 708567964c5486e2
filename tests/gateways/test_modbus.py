"""Modbus masters at devices in memory: what becomes of their requests. At real ones: tests/gateways/opcua/test_bridge.py."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest
from bridge_rig import BridgeRig
from gateway_rig import GatewayWorld

from steptwin.access.roles import Role
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.modbus.gateway import MOST_READS, MasterGateway
from steptwin.gateways.modbus.options import ModbusSpec
from steptwin.live.devicefile import read_device_file
from steptwin.simulation.script.steps import Request
from steptwin.subject.contract import Description, LineDescription, Result

HALL = '[[mic488]]\nname = "one"\n[[mic488]]\nname = "two"\nunit = 2\n'
CELL = '[[device]]\nname = "one"\naddress = "/dev/ttyUSB0"\n[gateway.modbus]\nlisten = "127.0.0.1:0"\n'


class Devices(GatewayWorld):
    """Devices that answer every request with itself, after they were let."""

    def __init__(self, *units: int) -> None:
        super().__init__(HALL)
        inner = self.inner.description
        controllers = [
            replace(part, is_real=True, line=f"tcp://{part.name}:502", unit=unit)
            for part, unit in zip(inner.controllers, units, strict=False)
        ]
        lines = tuple(LineDescription(part.line or "", "modbus", None) for part in controllers)
        self._description = replace(inner, controllers=tuple(controllers), lines=lines)
        self.asked: list[Request] = []
        self.let = asyncio.Event()
        self.let.set()
        self.error: Exception | None = None

    @property
    def description(self) -> Description:
        return self._description

    async def do(self, wanted: Any, /) -> Result:
        self.asked.append(wanted)
        await self.let.wait()
        if self.error is not None:
            raise self.error
        return Result({"pdu": wanted.pdu.hex()}, 0, 1)


def played(
    run: Any, play: Callable[[asyncio.StreamReader, asyncio.StreamWriter, Devices], Awaitable[Any]], *units: int, keys: str = ""
) -> Any:
    async def scene() -> Any:
        devices = Devices(*(units or (1,)))
        gateway = MasterGateway(spec(keys), devices, Path())
        place = await gateway.open(listen_any=False, notice=lambda text: None)
        reader, writer = await asyncio.open_connection(str(place["host"]), cast("int", place["port"]))
        try:
            return await play(reader, writer, devices)
        finally:
            writer.close()
            await gateway.close()

    return run(scene())


def spec(keys: str = "") -> ModbusSpec:
    (found,) = read_device_file("cell.toml", CELL + keys).services.gateways
    assert isinstance(found, ModbusSpec)
    return found


def frame(number: int, unit: int, pdu: str) -> bytes:
    data = bytes((unit,)) + bytes.fromhex(pdu)
    return number.to_bytes(2, "big") + b"\0\0" + len(data).to_bytes(2, "big") + data


READ, WRITE = "0300000001", "0600050003"


def test_requests_come_to_their_devices_with_the_units_there(run: Any) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> list[tuple[str, int]]:
        for number, unit in enumerate((1, 7)):
            writer.write(frame(number, unit, WRITE))
            assert await reader.readexactly(12) == frame(number, unit, WRITE)
        return [(wanted.line, wanted.unit) for wanted in devices.asked]

    asked = played(run, play, 1, 1, keys="units = { two = 7 }\n")
    assert asked == [("tcp://one:502", 1), ("tcp://two:502", 1)]


def test_a_broadcast_is_written_to_all_and_not_answered(run: Any) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> tuple[bytes, list[int]]:
        writer.write(frame(1, 0, WRITE) + frame(2, 0, READ) + frame(3, 3, READ))
        return await reader.readexactly(9), [wanted.unit for wanted in devices.asked]

    answer, asked = played(run, play, 1, 2)
    assert answer == frame(3, 3, "830b"), "another unit"
    assert asked == [1, 2]


@pytest.mark.parametrize("unit", [0, 255])
def test_a_single_device_has_the_units_of_a_controller_with_tcp(run: Any, unit: int) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> bytes:
        writer.write(frame(1, unit, READ))
        return await reader.readexactly(12)

    assert played(run, play) == frame(1, unit, READ)


@pytest.mark.parametrize(("error", "code"), [(LineFailure("no answer"), "0b"), (Refusal("a stop was requested meanwhile"), "06")])
def test_what_could_not_be_done(run: Any, error: Exception, code: str) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> bytes:
        devices.error = error
        writer.write(frame(1, 1, WRITE))
        return await reader.readexactly(9)

    assert played(run, play) == frame(1, 1, f"86{code}")


@pytest.mark.parametrize(
    ("pdu", "exception"),
    [("2b0e0100", "ab01"), ("0300000000", "8303")],
)
def test_what_is_no_request_of_the_device_is_not_sent(run: Any, pdu: str, exception: str) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> tuple[bytes, int]:
        writer.write(frame(1, 1, pdu))
        return await reader.readexactly(9), len(devices.asked)

    assert played(run, play) == (frame(1, 1, exception), 0)


@pytest.mark.parametrize("request_", ["03ffff0002", "01ffff07d0", "02ffff0009", "03ffdc007d", "10ffff00020400000000"])
def test_what_runs_past_the_last_address_is_answered_as_by_the_device(run: Any, request_: str) -> None:
    async def scene() -> tuple[str, str]:
        rig = BridgeRig()
        await rig.open()
        gateway = MasterGateway(spec(), rig.subject, Path())
        (part,) = rig.subject.description.controllers
        asked = bytes.fromhex(request_)
        found = (
            await gateway.ask(GatewayClient("master", Role.ENGINEER), part, asked),
            rig.device.execute(asked, rig.realtime.enter()),
        )
        await rig.close()
        return found[0].hex(), found[1].hex()

    answer, expected = run(scene())
    assert answer == expected == f"{int(request_[:2], 16) | 0x80:02x}02"


def test_a_viewer_reads(run: Any) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> tuple[bytes, list[Any]]:
        logged: list[Any] = []
        devices.audit = lambda who, do, fields, outcome: logged.append((str(who), do, fields["pdu"], outcome))
        writer.write(frame(1, 1, READ))
        assert await reader.readexactly(12) == frame(1, 1, READ)
        writer.write(frame(2, 1, WRITE))
        return await reader.readexactly(9), logged

    answer, logged = played(run, play, keys='role = "viewer"\n')
    assert answer == frame(2, 1, "8601")
    assert [(who.partition(",")[0], *what) for who, *what in logged] == [("master (Modbus TCP", "request", WRITE, "refusal")]


def test_reads_that_wait_have_a_bound_and_what_waits_ends_with_its_master(run: Any) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> tuple[bytes, int]:
        devices.let.clear()
        writer.write(b"".join(frame(number, 1, READ) for number in range(MOST_READS + 1)))
        answer = await reader.readexactly(9)
        writer.close()
        await writer.wait_closed()
        await asyncio.sleep(1.0)
        return answer, sum(task.get_name() != "main" for task in asyncio.all_tasks())

    answer, tasks = played(run, play)
    assert answer == frame(MOST_READS, 1, "8306")
    assert tasks <= 2, "that of the scene, and of the server"


def test_a_wrong_header_ends_the_connection(run: Any) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> bytes:
        writer.write(b"GET / HTTP/1.1\r\n\r\n")
        try:
            return await reader.read()
        except ConnectionError:
            return b""

    assert played(run, play) == b""


@pytest.mark.parametrize(
    ("units", "keys", "message"),
    [
        ((1, 1), "", "one and two have the unit 1: give one another, units = { two = 2 }"),
        ((1, 2), "units = { three = 3 }\n", "units: no controller is called 'three'; there are one, two"),
    ],
)
def test_units_that_do_not_fit(run: Any, units: tuple[int, ...], keys: str, message: str) -> None:
    async def play(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, devices: Devices) -> None: ...

    with pytest.raises(Misuse, match=message.replace("{", r"\{")):
        played(run, play, *units, keys=keys)


def test_worlds_have_lines_for_masters(run: Any) -> None:
    async def scene() -> None:
        await MasterGateway(spec(), GatewayWorld(HALL), Path()).open(listen_any=False, notice=lambda text: None)

    with pytest.raises(Misuse, match="masters reach a line of a world by its key tcp"):
        run(scene())
