"""TCP clients served by asyncio, on every system. Where there is epoll, `steptwin.live.tcp_epoll` is the faster way."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import cast
from weakref import WeakSet

from steptwin.controller import Port, SourcedPort
from steptwin.live.clients import BACKLOG, Clients, set_up
from steptwin.live.links import SLICE_BYTES, Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.simulation.toml.addresses import Address


class AsyncioListener:
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
        self._realtime = realtime
        self._make_port = make_port
        self._clients = clients
        self._connections: WeakSet[AsyncioConnection] = WeakSet()
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._welcome, sock=self._listening, backlog=BACKLOG)

    def _welcome(self) -> asyncio.Protocol:
        if not self._clients.have_room():
            return TurnedAway()
        connection = AsyncioConnection(self._realtime, self._make_port(), self._clients)
        self._connections.add(connection)
        return connection

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        for connection in list(self._connections):
            connection.close()


class TurnedAway(asyncio.Protocol):
    """A refused client."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        cast(asyncio.Transport, transport).abort()


class AsyncioConnection(asyncio.Protocol):
    """One client of a port. While it does not read its answers, its requests are not read; large input is served in slices."""

    def __init__(self, realtime: RealTimeDriver, port: Port, clients: Clients) -> None:
        self._realtime = realtime
        self.port = port
        self._clients = clients
        self._loop = asyncio.get_running_loop()
        self._received = b""
        """Input to be served later."""
        self._next: asyncio.Handle | None = None
        self._is_open = False
        clients.present.add(self)

    @property
    def waiting(self) -> int:
        """Number of bytes for which the client has no room."""
        return self._transport.get_write_buffer_size() if self._is_open else 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._feed = Feed(self._realtime, self.port, self)
        self._transport.set_write_buffer_limits(high=1)  # report pending data at once; with 0, TLS reports none, too
        with contextlib.suppress(OSError):  # the client is gone already; the loop will notice
            set_up(transport.get_extra_info("socket"))
        host, port, *_ = transport.get_extra_info("peername") or ("unknown", 0)
        self._peer = Address(host, port)
        if isinstance(self.port, SourcedPort):
            self.port.used_by(str(self._peer))
        self._is_open = True

    def data_received(self, data: bytes) -> None:
        if self._received:
            self._received += data
        elif len(data) <= SLICE_BYTES and self._feed.is_read:
            self._take(data)
        else:
            self._received = data
            self._transport.pause_reading()
            self._serve()

    def _serve(self) -> None:
        """Serve a slice of the input; other clients are served before the next one."""
        self._next = None
        data, self._received = self._received[:SLICE_BYTES], self._received[SLICE_BYTES:]
        if data:
            self._take(data)
        if not self._is_open or not self._feed.is_read:
            return
        if self._received:
            self._next = self._loop.call_soon(self._serve)
        else:
            self._transport.resume_reading()

    def _take(self, data: bytes) -> None:
        self._feed.take(data)
        if self.port.broken is not None and self._is_open:
            self._clients.made_no_sense(self._peer, self.port.broken)
            self._received = b""
            self._transport.close()  # when its last answers have found room

    def write(self, data: bytes) -> None:
        """Send bytes; those without room wait."""
        self._transport.write(data)

    def pause_writing(self) -> None:
        self._feed.is_read = False
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        self._feed.is_read = True
        if self._next is None:
            self._next = self._loop.call_soon(self._serve)

    def eof_received(self) -> None:
        """Nothing more comes, so the connection ends."""

    def connection_lost(self, exc: Exception | None) -> None:
        self._end()

    def close(self) -> None:
        """Nothing more is read or sent. A closed connection may be closed again."""
        if self._is_open:
            self._transport.abort()
            self._end()

    def _end(self) -> None:
        if self._is_open:
            self._is_open = False
            self._received = b""
            if self._next is not None:
                self._next.cancel()
            self._clients.present.discard(self)
            self._feed.close()
