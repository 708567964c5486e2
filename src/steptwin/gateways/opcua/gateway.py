"""The server: opened with its nodes, and kept up to date until it is closed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from pathlib import Path

from asyncua import Server

from steptwin import __version__
from steptwin.controller import SECOND
from steptwin.errors import LineFailure, SteptwinError
from steptwin.eventloop import endless
from steptwin.files.certificate import APPLICATION_URI
from steptwin.gateways.contract import GatewayState, GatewaySubject
from steptwin.gateways.opcua.addressspace import NAMESPACE, NAMESPACE_URI, AddressSpaceBuilder
from steptwin.gateways.opcua.historyread import HistoryNodes
from steptwin.gateways.opcua.limits import tell_limits
from steptwin.gateways.opcua.notifications import Notifications
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.opcua.security import Security
from steptwin.gateways.opcua.service import NodeService
from steptwin.gateways.opcua.session import GatewayServer
from steptwin.gateways.points import registers_by_controller
from steptwin.gateways.sampling import Sampler
from steptwin.simulation.toml.addresses import Address, is_loopback, parse_address
from steptwin.system import reason

LOOK_S = 60.0
"""Time between two checks of its certificate."""
PRODUCT_URI = "urn:steptwin"


class OpcUaGateway:
    """Serves ``subject`` at the address of ``spec``. A `Gateway`."""

    protocol = "OPC UA"

    def __init__(self, spec: OpcUaSpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._folder = folder
        self._subject = subject
        self._server: Server | None = None
        self._inside: GatewayServer | None = None
        self._shown = 0
        self._sampler: Sampler | None = None
        self._notifications: Notifications | None = None
        self._service: NodeService | None = None
        self._task: asyncio.Task[None] | None = None
        self._guard: asyncio.Task[None] | None = None
        self._address: Address | None = None
        """Where it listens, once it does."""
        self._trouble: str | None = None
        """Why its clients refuse it; None while they do not."""
        self._failed: str | None = None
        """Why nothing is published any more."""

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        address = self._address or parse_address(self._spec.listen, listen_any=listen_any)
        security = Security(self._spec, self._folder, is_local=is_loopback(address.host))
        registers = self._registers()
        logging.getLogger("asyncua").addHandler(logging.NullHandler())
        logging.getLogger("asyncua").propagate = False
        inside = GatewayServer(user_manager=security)
        server = Server(inside)
        inside.connections = lambda: () if server.bserver is None else server.bserver.clients
        server.set_endpoint(f"opc.tcp://{address}/")
        server.set_server_name(f"steptwin {self._subject.description.name}")
        await server.init()
        await tell_limits(server)
        await server.set_application_uri(APPLICATION_URI)
        await server.set_build_info(PRODUCT_URI, "steptwin", "steptwin", __version__, "", security.began)
        if await server.register_namespace(NAMESPACE_URI) != NAMESPACE:
            raise AssertionError
        await security.apply(server)
        builder = AddressSpaceBuilder(self._subject.description, registers, is_kept=self._subject.history is not None)
        await builder.add_to(server)
        self._sampler = Sampler(self._subject.samples, registers, self._spec.interval)
        history = None if self._subject.history is None else HistoryNodes(self._subject.history, builder.nodes())
        service = NodeService(server, self._subject, self._sampler, builder, history)
        inside.service = self._service = service
        await service.refresh_all()
        self._notifications = await Notifications.open(server, self._subject)
        try:
            await server.start()
        except OSError as error:
            raise LineFailure(f"cannot listen on {address}: {reason(error)}") from error
        self._security = security
        self._server, self._inside, self._shown = server, inside, sum(map(len, builder.points.values()))

        def failed(text: str) -> None:
            self._failed = text
            notice(f"[gateway.opcua]: {text}")

        self._task = endless(self._publish(inside, service, self._notifications), failed)
        port = _port(server)
        self._address = Address(address.host, port)
        if security.valid_until is not None and self._guard is None:
            self._guard = endless(self._watch(listen_any=listen_any, notice=notice), failed)
        return {"host": address.host, "port": port, "url": f"opc.tcp://{Address(address.host, port)}/"}

    async def _watch(self, *, listen_any: bool, notice: Callable[[str], None]) -> None:
        """Look whether the certificate has expired, and begin anew with another one."""
        while True:
            before = self._trouble
            try:
                if self._server is None or self._security.is_renewed():
                    await self._stop()
                    await self.open(listen_any=listen_any, notice=notice)
                    notice(f"[gateway.opcua]: {self._spec.certificate} has been renewed; clients have to connect again")
                self._trouble = self._security.trouble()
            except SteptwinError as error:
                self._trouble = str(error).removeprefix("[gateway.opcua]: ")
            if self._trouble is not None and self._trouble != before:
                notice(f"[gateway.opcua]: {self._trouble}")
            await asyncio.sleep(LOOK_S)

    def _registers(self) -> dict[str, list[str]]:
        return registers_by_controller("[gateway.opcua]", self._spec.registers, self._subject.description)

    async def _publish(self, inside: GatewayServer, service: NodeService, notifications: Notifications) -> None:
        loop, interval_s = asyncio.get_running_loop(), self._spec.interval / SECOND
        at = loop.time() + interval_s
        while True:
            await service.publish(max(at - loop.time(), 0.0))
            if loop.time() >= at:
                at = loop.time() + interval_s
                service.keep_followed(inside.followed())
                await service.publish_arrays()
                await notifications.publish()

    def state(self) -> GatewayState:
        clients = () if self._inside is None else tuple(self._inside.clients())
        trouble = self._failed or self._trouble
        is_up = self._server is not None and trouble is None
        return GatewayState(is_up=is_up, text=trouble or "listens", shown=self._shown, clients=clients)

    async def close(self) -> None:
        if self._guard is not None:
            self._guard.cancel()
            await asyncio.wait((self._guard,))
        await self._stop()

    async def _stop(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait((self._task,))
        if self._server is not None:
            await self._server.stop()
        for one in (self._service, self._sampler, self._notifications):
            if one is not None:
                one.close()
        self._task = self._server = self._inside = self._service = self._sampler = self._notifications = self._failed = None


make = OpcUaGateway


def _port(server: Server) -> int:
    """That of a server that has been started; the library gives it its own number where 0 was asked for."""
    return 0 if server.bserver is None else int(server.bserver.port or 0)
