"""The gateway: records from the description, and the server that is kept up to date until it is closed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from steptwin.access.roles import ROLES, Role
from steptwin.controller import SECOND
from steptwin.eventloop import endless
from steptwin.extras import missing
from steptwin.gateways.contract import GatewayState, GatewaySubject
from steptwin.gateways.epics.channels import PvDatabase
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.options import EpicsSpec
from steptwin.gateways.epics.records import Record
from steptwin.gateways.epics.recordset import make_records
from steptwin.gateways.epics.server import ChannelAccessServer
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.points import CLOCK, registers_by_controller
from steptwin.gateways.sampling import Sampler
from steptwin.simulation.toml.addresses import Address, is_loopback, parse_address

if TYPE_CHECKING:
    from steptwin.gateways.epics.pvserver import PvAccessServer


class EpicsGateway:
    """Serves ``subject`` at the addresses of ``spec``. A `Gateway`."""

    def __init__(self, spec: EpicsSpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._subject = subject
        self._controllers: dict[str, EpicsController] = {}
        self._sampler: Sampler | None = None
        self._leases = JogLeases(subject)
        self._server: ChannelAccessServer | None = None
        self._pv_server: PvAccessServer | None = None
        self._pv_place = ""
        self._role = Role.VIEWER
        self._shown = 0
        self._task: asyncio.Task[None] | None = None
        self._failed: str | None = None
        """Why nothing is published any more."""
        self._error: BaseException | None = None
        """Error that ended the reading of a controller."""
        self._leaving: set[asyncio.Task[None]] = set()

    @property
    def protocol(self) -> str:
        return f"EPICS Channel Access{self._pv_place}"

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        spec = self._spec
        address = parse_address(spec.listen, listen_any=listen_any)
        beacons = parse_address(spec.beacons, listen_any=listen_any)
        pva = None if spec.pva is None else parse_address(spec.pva, listen_any=listen_any)
        pva_beacons = parse_address(spec.pva_beacons, listen_any=listen_any)
        hosts = [one.host for one in (address, pva) if one is not None]
        open_to = Role.ENGINEER if all(map(is_loopback, hosts)) else Role.VIEWER
        role = self._role = open_to if spec.role is None else ROLES[spec.role]
        registers = registers_by_controller("[gateway.epics]", spec.registers, self._subject.description)
        self._sampler = Sampler(self._subject.samples, registers, spec.interval)
        for name in (*(part.name for part in self._subject.description.controllers), CLOCK):
            self._controllers[name] = EpicsController(name, self._subject, self._sampler, self._leases, role)
        records = make_records(spec.prefix, self._subject, self._controllers, registers)
        server = ChannelAccessServer(PvDatabase(records), address, beacons, self._leave)
        port = await server.open()
        self._server, self._shown = server, len(records)
        found: dict[str, object] = {"host": address.host, "port": port, "prefix": spec.prefix}
        if pva is not None:
            try:
                found["pva"] = await self._open_pv_access(records, pva, pva_beacons)
            except BaseException:
                await self.close()
                raise

        def failed(text: str) -> None:
            self._failed = text
            notice(f"[gateway.epics]: {text}")

        self._task = endless(self._publish(server, self._sampler), failed)
        return found

    async def _open_pv_access(self, records: Mapping[str, Record], address: Address, beacons: Address) -> Mapping[str, object]:
        try:
            from steptwin.gateways.epics.pvserver import PvAccessServer
        except ImportError:
            raise missing("[gateway.epics] pva", "epics") from None
        self._pv_server = PvAccessServer(records, address, beacons, self._leave)
        ports = await self._pv_server.open()
        self._pv_place = f", PV Access at {Address(address.host, ports['port'])}"
        return {"host": address.host, **ports}

    def _leave(self, circuit: object) -> None:
        for controller in self._controllers.values():
            if controller.is_busy:
                task = asyncio.create_task(controller.leave(circuit))
                self._leaving.add(task)
                task.add_done_callback(self._leaving.discard)

    async def _publish(self, server: ChannelAccessServer, sampler: Sampler) -> None:
        while True:
            busy = [name for name, controller in self._controllers.items() if controller.is_busy]
            has_clients = server.has_clients or (self._pv_server is not None and self._pv_server.has_clients)
            wanted = [name for name, one in self._controllers.items() if one.is_wanted] if has_clients else []
            sampler.watch((*wanted, *busy))
            for name in busy:
                sampler.hasten(name)
            for name in await sampler.due(self._spec.interval / SECOND):
                self._controllers[name].look().add_done_callback(self._has_looked)
            if self._error is not None:
                raise self._error

    def _has_looked(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled():
            self._error = task.exception() or self._error

    def state(self) -> GatewayState:
        servers = (self._server, self._pv_server)
        clients = tuple(one for server in servers if server is not None for one in server.clients(self._role.title))
        is_up = self._server is not None and self._failed is None
        return GatewayState(is_up=is_up, text=self._failed or "listens", shown=self._shown, clients=clients)

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait((self._task, *self._leaving))
        for controller in self._controllers.values():
            await controller.close()
        self._leases.close()
        if self._pv_server is not None:
            await self._pv_server.close()
        if self._server is not None:
            await self._server.close()
        if self._sampler is not None:
            self._sampler.close()


make = EpicsGateway
