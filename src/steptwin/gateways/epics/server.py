"""The server of Channel Access: the library's, at addresses that are told and not taken from the environment."""

from __future__ import annotations

import asyncio
import functools
import logging
import socket
from collections.abc import Callable, Coroutine
from typing import Any

from caproto.asyncio.server import Context
from caproto.asyncio.utils import _DatagramProtocol, _TransportWrapper, _UdpTransportWrapper

from steptwin.errors import LineFailure
from steptwin.gateways.epics.channels import PvDatabase
from steptwin.system import reason
from steptwin.world.addresses import Address

ATTEMPTS = 20
"""For a free port that TCP and UDP have alike."""


class ChannelAccessServer(Context):
    """Serves ``database`` at ``address``: searches over UDP, and circuits over TCP, at the same port.

    ``on_leave`` is called with the address of a client whose connection has ended.
    """

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

    @property
    def has_clients(self) -> bool:
        return bool(self.circuits)

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
