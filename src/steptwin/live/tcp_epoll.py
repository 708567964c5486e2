"""TCP clients served in turns from one epoll set: the fast way, on Linux."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any
from weakref import WeakSet

from steptwin.controller import Port, SourcedPort
from steptwin.live.clients import RETRY_S, Clients
from steptwin.live.descriptors import descriptors
from steptwin.live.links import SLICE_BYTES, Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason

AT_ONCE = 64
"""Clients accepted before the existing ones are served."""


class EpollConnection:
    """One client of a port. While it does not read its answers, its requests are not read; large input is served in slices."""

    __slots__ = (
        "__weakref__",
        "_clients",
        "_descriptors",
        "_ending",
        "_feed",
        "_peer",
        "_receive",
        "_send",
        "_socket",
        "_unsent",
        "port",
    )

    def __init__(self, client: socket.socket, peer: Address, realtime: RealTimeDriver, port: Port, clients: Clients) -> None:
        self.port = port
        self._peer = peer
        self._socket = client
        self._receive = client.recv
        self._send = client.send
        self._clients = clients
        self._unsent = b""
        self._ending = False
        self._feed = Feed(realtime, port, self)
        if isinstance(port, SourcedPort):
            port.used_by(str(peer))
        self._descriptors = descriptors()
        self._descriptors.await_input(client.fileno(), self._serve)
        clients.present.add(self)

    @property
    def waiting(self) -> int:
        """Number of bytes for which the client has no room."""
        return len(self._unsent)

    def _serve(self) -> None:
        try:
            data = self._receive(SLICE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        self._feed.take(data)
        if self.port.broken is not None and self._socket.fileno() >= 0:
            self._clients.made_no_sense(self._peer, self.port.broken)
            self._ending = True
            if not self._unsent:
                self.close()

    def write(self, data: bytes) -> None:
        """Send bytes; those without room wait."""
        if self._unsent:
            self._unsent += data
            return
        try:
            sent = self._send(data)
        except BlockingIOError:
            sent = 0
        except OSError:
            self.close()
            return
        if sent < len(data):
            self._unsent = data[sent:]
            self._feed.is_read = False
            self._descriptors.await_room(self._socket.fileno(), self._send_rest)

    def _send_rest(self) -> None:
        rest, self._unsent = self._unsent, b""
        self.write(rest)
        if self._unsent or self._socket.fileno() < 0:
            return
        if self._ending:
            self.close()
        else:
            self._feed.is_read = True
            self._descriptors.await_input(self._socket.fileno(), self._serve)

    def close(self) -> None:
        """Nothing more is read or sent. A closed connection may be closed again."""
        if self._socket.fileno() >= 0:
            self._descriptors.forget(self._socket.fileno())
            self._socket.close()
            self._unsent = b""
            self._clients.present.discard(self)
            self._feed.close()


class EpollListener:
    """See `steptwin.live.tcp.Listener`."""

    def __init__(
        self,
        listening: socket.socket,
        address: Address,
        realtime: RealTimeDriver,
        make_port: Callable[[], Port],
        clients: Clients,
    ) -> None:
        self._listening = listening
        self._address = address
        self._realtime = realtime
        self._make_port = make_port
        self._clients = clients
        self._connections: WeakSet[EpollConnection] = WeakSet()
        self._retry: asyncio.TimerHandle | None = None

    async def start(self) -> None:
        self._listen()

    def _listen(self) -> None:
        descriptors().await_input(self._listening.fileno(), self._accept)

    def _accept(self) -> None:
        try:
            for _ in range(AT_ONCE):
                self._welcome(*self._listening.accept())
        except (BlockingIOError, ConnectionAbortedError):
            return
        except OSError as error:
            self._clients.tell("", f"no client is accepted on {self._address} for {RETRY_S:g} s: {reason(error)}")
            descriptors().forget(self._listening.fileno())
            self._retry = asyncio.get_running_loop().call_later(RETRY_S, self._listen)

    def _welcome(self, client: socket.socket, peer: tuple[Any, ...]) -> None:
        if not self._clients.have_room():
            client.close()
            return
        client.setblocking(False)
        self._connections.add(EpollConnection(client, Address(*peer[:2]), self._realtime, self._make_port(), self._clients))

    async def close(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
        descriptors().forget(self._listening.fileno())
        self._listening.close()
        for connection in list(self._connections):
            connection.close()
