"""The server of Channel Access: the library's, at the given addresses rather than those of the environment."""

from __future__ import annotations

import asyncio
import functools
import logging
import socket
from collections.abc import Callable, Coroutine
from typing import Any, NoReturn

from caproto import ErrorResponse, WriteNotifyResponse
from caproto.asyncio.server import Context, VirtualCircuit
from caproto.asyncio.utils import _DatagramProtocol, _TransportWrapper, _UdpTransportWrapper
from caproto.server.common import DisconnectedCircuit

from steptwin.errors import LineFailure
from steptwin.gateways.clients import address_text
from steptwin.gateways.contract import ClientState
from steptwin.gateways.epics.channels import PvDatabase
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason

MONITORS_S = 1.0
"""How long an answer waits for monitors, which a client that does not read can hold up."""
ATTEMPTS = 20
"""For a free port that TCP and UDP have alike."""


class _Circuit(VirtualCircuit):
    """A connection. The answer to a put is behind the monitors of its end: who learns that it is over has seen them.

    The library collects monitors for 10 ms, and answers at once.
    """

    async def subscription_queue_loop(self) -> None:
        """Send what has been published together, without waiting for more."""
        self.events_on.set()
        queue = self.subscription_queue
        try:
            while True:
                found = [await queue.get()]
                while not queue.empty():
                    found.append(queue.get_nowait())
                wanted = {sub.subscriptionid for subs in self.subscriptions.values() for sub in subs}
                # What a slow client has not taken in time is None: newer values follow.
                commands = [command for command in (one() for one in found) if command is not None]
                await super().send(*(command for command in commands if command.subscriptionid in wanted))
                for _ in found:
                    queue.task_done()
        except DisconnectedCircuit:
            await self._on_disconnect()
            self.circuit.disconnect()
            await self.context.circuit_disconnected(self)

    async def send(self, *commands: Any) -> None:
        if any(isinstance(command, WriteNotifyResponse | ErrorResponse) for command in commands):
            published = asyncio.ensure_future(self._published())
            either = [published] if self._sub_task is None else [published, self._sub_task]
            try:
                await asyncio.wait(either, timeout=MONITORS_S, return_when=asyncio.FIRST_COMPLETED)
            finally:
                published.cancel()
        await super().send(*commands)

    async def _published(self) -> None:
        """All that has been published is sent."""
        await self.context.subscription_queue.join()
        await self.subscription_queue.join()


class ChannelAccessServer(Context):
    """Serves ``database`` at ``address``: searches over UDP, and circuits over TCP, at the same port.

    ``on_leave`` is called with the address of a client whose connection has ended.
    """

    CircuitClass = _Circuit

    def __init__(self, database: PvDatabase, address: Address, beacons: Address, on_leave: Callable[[object], None]) -> None:
        logger = logging.getLogger("caproto")
        logger.addHandler(logging.NullHandler())
        logger.propagate = False
        super().__init__(database, [address.host])
        self._address = address
        self._beacons = beacons
        self._on_leave = on_leave
        self._listening: asyncio.Server | None = None
        self._loops: list[asyncio.Task[None]] = []

    async def open(self) -> int:
        """The port. Raises `LineFailure`."""
        host, port = self._address
        for attempt in range(ATTEMPTS):
            try:
                self._listening = await asyncio.start_server(self._enter, host, port)
                self.port = int(self._listening.sockets[0].getsockname()[1])
                await self._search_at(host, self.port)
                break
            except OSError as error:
                if self._listening is not None:
                    self._listening.close()
                if port or attempt == ATTEMPTS - 1:
                    raise LineFailure(f"cannot listen on {self._address}: {reason(error)}") from error
        self.broadcaster.server_addresses.append((host, self.port))
        await self._announce_to(self._beacons)
        loops: tuple[Coroutine[Any, Any, None], ...] = (
            self.broadcaster_receive_loop(),
            self.broadcaster_queue_loop(),
            self.subscription_queue_loop(),
            self.broadcast_beacon_loop(),
        )
        self._loops = [asyncio.create_task(one) for one in loops]
        return self.port

    async def _search_at(self, host: str, port: int) -> None:
        """Two servers cannot share a port: only one of them would be asked."""
        protocol = functools.partial(_DatagramProtocol, parent=self, identifier=host, queue=self.broadcaster_datagram_queue)
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(protocol, local_addr=(host, port))
        self.udp_socks[host] = _UdpTransportWrapper(transport)

    async def _announce_to(self, address: Address) -> None:
        there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        there.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        there.setblocking(False)
        there.connect(address)
        self.beacon_socks[tuple(address)] = (self._address.host, _UdpTransportWrapper(there, tuple(address)))

    def _enter(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        transport = _TransportWrapper(reader, writer)
        self.server_tasks.create(self.tcp_handler(transport, transport.getpeername()))

    async def circuit_disconnected(self, circuit: Any) -> None:
        await super().circuit_disconnected(circuit)
        self._on_leave(circuit.circuit.address)

    async def subscription_queue_loop(self) -> NoReturn:
        while True:
            await self._subscription_queue_iteration(*await self.subscription_queue.get())
            self.subscription_queue.task_done()

    @property
    def has_clients(self) -> bool:
        return bool(self.circuits)

    def clients(self, role: str) -> list[ClientState]:
        """Those that are connected, with the names that they give themselves."""
        follows: dict[Any, dict[str, None]] = {circuit: {} for circuit in self.circuits}
        for subscription in (one for many in self.subscriptions.values() for one in many):
            follows.setdefault(subscription.circuit, {})[str(subscription.channel.name)] = None
        return [
            ClientState(_user(circuit), address_text(circuit.circuit.address), role, tuple(names))
            for circuit, names in follows.items()
        ]

    async def close(self) -> None:
        if self._listening is not None:
            self._listening.close()
        tasks = [*self._loops, *self.server_tasks.tasks]
        for circuit in list(self.circuits):
            tasks += circuit.tasks.tasks
            circuit.client.close()
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)
        for transport in self.udp_socks.values():
            transport.close()
        for _, transport in self.beacon_socks.values():
            transport.close()


def _user(circuit: Any) -> str:
    known = (circuit.client_username, circuit.client_hostname)
    return "@".join(str(name) for name in known if name)
