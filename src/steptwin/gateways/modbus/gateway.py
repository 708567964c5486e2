"""Several Modbus masters over TCP at real devices: each request goes to its device in the order in which they came, a stop first.

A device that does not answer gives exception 0B, a full queue and what a stop or 5 s have overtaken 06, what the role of a master
does not permit 01. Nothing is repeated that moves.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from steptwin.access.modbusroles import permit_of
from steptwin.access.notices import ClientNotices
from steptwin.access.roles import ROLES, Role
from steptwin.controller import SECOND
from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.gateways.clients import GatewayClient, NotPermitted, address_text
from steptwin.gateways.contract import ClientState, GatewayState, GatewaySubject
from steptwin.gateways.modbus.options import ModbusSpec
from steptwin.simulation.script.steps import Request
from steptwin.simulation.toml.addresses import is_loopback, parse_address
from steptwin.subject.contract import ControllerDescription, Result
from steptwin.system import reason
from steptwin.wire import rtu
from steptwin.wire.mbap import HEADER_BYTES, TcpFramer
from steptwin.wire.pdu import (
    DEVICE_BUSY,
    GATEWAY_TARGET_FAILED,
    ILLEGAL_DATA_ADDRESS,
    ILLEGAL_FUNCTION,
    READS,
    WRITES,
    ModbusException,
    decode_request,
    exception_pdu,
)
from steptwin.wire.slave import tcp_response

MOST_MASTERS = 64
MOST_READS = 16
"""Reads that wait for their answers, of all masters. Writes wait at their device, which bounds them."""
READ_BYTES = 4096
MODBUS = "modbus"


def _by_unit(spec: ModbusSpec, subject: GatewaySubject) -> dict[int, ControllerDescription]:
    """The devices on Modbus lines. Raises `Misuse`."""
    kinds = {line.name: line.kind for line in subject.description.lines}
    parts = {part.name: part for part in subject.description.controllers}
    if strange := spec.units.keys() - parts.keys():
        raise Misuse(f"[gateway.modbus]: units: no controller is called {min(strange)!r}; there are {', '.join(parts)}")
    if not all(part.is_real for part in parts.values()):
        raise Misuse("[gateway.modbus] is for devices (steptwin bridge): masters reach a line of a world by its key tcp")
    found: dict[int, ControllerDescription] = {}
    for part in parts.values():
        unit = spec.units.get(part.name, part.unit)
        if kinds.get(part.line or "") != MODBUS or unit is None:
            continue
        if unit in found:
            one, other = found[unit].name, part.name
            raise Misuse(f"[gateway.modbus]: {one} and {other} have the unit {unit}: give one another, units = {{ {other} = 2 }}")
        found[unit] = part
    if not found:
        raise Misuse("[gateway.modbus]: no device is on a Modbus line")
    return found


class MasterGateway:
    """See `steptwin.gateways.contract.Gateway`."""

    protocol = "Modbus TCP"

    def __init__(self, spec: ModbusSpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._subject = subject
        self._units: Mapping[int, ControllerDescription] = {}
        self._server: asyncio.Server | None = None
        self._masters: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._reads = 0

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        spec = self._spec
        self._units = _by_unit(spec, self._subject)
        address = parse_address(spec.listen, listen_any=listen_any)
        self._role = ROLES[spec.role] if spec.role else Role.ENGINEER if is_loopback(address.host) else Role.VIEWER
        self._notices = ClientNotices(notice, time.monotonic_ns)
        try:
            self._server = await asyncio.start_server(self._welcome, *address, limit=READ_BYTES)
        except OSError as error:
            raise LineFailure(f"[gateway.modbus]: cannot listen on {address}: {reason(error)}") from error
        return {"host": address.host, "port": self._server.sockets[0].getsockname()[1]}

    async def _welcome(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = cast("asyncio.Task[None]", asyncio.current_task())
        if len(self._masters) >= MOST_MASTERS:
            self._notices.say("", f"more than {MOST_MASTERS} masters at once are turned away")
            writer.transport.abort()
            return
        self._masters[task] = writer
        client = GatewayClient("master", self._role, f"Modbus TCP, {address_text(writer.get_extra_info('peername'))}")
        try:
            await _Master(self, client, writer).serve(reader)
        except OSError:
            pass  # it is gone
        finally:
            del self._masters[task]
            writer.transport.abort()

    def devices_at(self, unit: int) -> list[ControllerDescription]:
        """Those that a unit addresses: 0 all of them, of a single one 0 and 255, too (MIC-2, MIC-23)."""
        if unit == rtu.BROADCAST or (unit == 255 and len(self._units) == 1):
            return list(self._units.values())
        return [self._units[unit]] if unit in self._units else []

    def made_no_sense(self, client: GatewayClient, why: str) -> None:
        host = client.place.rpartition(":")[0]
        self._notices.say(host, f"{client}: {why}; its connection is closed")

    async def ask(self, client: GatewayClient, part: ControllerDescription, pdu: bytes) -> bytes:
        """The answer of a device, or an exception."""
        function = pdu[0]
        wanted = Request(cast("str", part.line), cast("int", part.unit), pdu, SECOND)
        try:
            decode_request(pdu)
            if function in READS:
                return await self._read(wanted)
            return _pdu(await client.do(self._subject, wanted, permit_of(function).role))
        except ModbusException as error:
            return exception_pdu(function, error.code)
        except NotPermitted:
            return exception_pdu(function, ILLEGAL_FUNCTION)
        except LineFailure:
            return exception_pdu(function, GATEWAY_TARGET_FAILED)
        except Misuse:  # it is not sent, because no device has registers there
            return exception_pdu(function, ILLEGAL_DATA_ADDRESS)
        except SteptwinError:  # overtaken by a stop, or too late
            return exception_pdu(function, DEVICE_BUSY)

    async def _read(self, wanted: Request) -> bytes:
        if self._reads >= MOST_READS:
            return exception_pdu(wanted.pdu[0], DEVICE_BUSY)
        self._reads += 1
        try:
            return _pdu(await self._subject.do(wanted))
        finally:
            self._reads -= 1

    def state(self) -> GatewayState:
        places = (address_text(writer.get_extra_info("peername")) for writer in self._masters.values())
        clients = tuple(ClientState("master", place, self._role.title) for place in places)
        return GatewayState(is_up=self._server is not None, text="listens", clients=clients)

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
        for writer in self._masters.values():
            writer.transport.abort()
        if self._masters:
            await asyncio.wait(list(self._masters))


class _Master:
    """One connection. Its requests go to the device at once, so that a stop need not wait for the answers before it."""

    def __init__(self, gateway: MasterGateway, client: GatewayClient, writer: asyncio.StreamWriter) -> None:
        self._gateway = gateway
        self._client = client
        self._writer = writer
        self._answers: set[asyncio.Task[None]] = set()

    async def serve(self, reader: asyncio.StreamReader) -> None:
        framer = TcpFramer()
        try:
            while data := await reader.read(READ_BYTES):
                for frame in framer.feed(data):
                    self._take(frame.raw)
                await self._writer.drain()
                if framer.broken is not None:
                    self._gateway.made_no_sense(self._client, framer.broken)
                    return
        finally:
            for task in self._answers:
                task.cancel()  # what waits is not sent any more

    def _take(self, request: bytes) -> None:
        unit, pdu = request[6], request[HEADER_BYTES:]
        parts = self._gateway.devices_at(unit)
        if unit == rtu.BROADCAST and len(parts) > 1:
            parts = parts if pdu[0] in WRITES else []
        elif not parts:
            self._answer(request, exception_pdu(pdu[0], GATEWAY_TARGET_FAILED))
        for part in parts:
            task = asyncio.get_running_loop().create_task(self._ask(request, part, pdu, is_answered=len(parts) == 1))
            self._answers.add(task)
            task.add_done_callback(self._answers.discard)

    async def _ask(self, request: bytes, part: ControllerDescription, pdu: bytes, *, is_answered: bool) -> None:
        answer = await self._gateway.ask(self._client, part, pdu)
        if is_answered:
            self._answer(request, answer)

    def _answer(self, request: bytes, pdu: bytes) -> None:
        if not self._writer.is_closing():
            self._writer.write(tcp_response(request, pdu))


def _pdu(result: Result) -> bytes:
    answer: Any = result.value
    return bytes.fromhex(answer["pdu"])


make = MasterGateway
