"""TCP links: Modbus TCP, and raw bytes as serial device servers send them."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple, cast

from steptwin.errors import LineFailure, Misuse
from steptwin.runtime.cell import Cell
from steptwin.runtime.links import SLICE_BYTES, Feed, Port, where

LOOPBACK = "127.0.0.1"
READ_BYTES = 65536
BACKLOG = 1024
BACKLOG_OF_STDLIB = 128
"""The loop of the standard library accepts as many at once before it serves the first: each of them is an open file."""


class Address(NamedTuple):
    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def parse_address(text: str, *, listen_any: bool) -> Address:
    """``HOST:PORT`` (port 0: any free one). Only loopback unless ``listen_any``: Modbus has no authentication."""
    host, colon, number = text.rpartition(":")
    host = host.strip("[]")
    if host in ("", "localhost"):
        host = LOOPBACK  # one address: port 0 would be two ports on the two that "localhost" has
    if not colon or not number.isdecimal() or int(number) > 65535:
        raise Misuse(f"{text!r} is no address: expected HOST:PORT with a port from 0 to 65535, such as 127.0.0.1:5020")
    if not listen_any and not _is_loopback(host):
        raise Misuse(
            f"{host} is not a loopback address: the protocols served here have no authentication, whoever reaches the port "
            "moves the axes; --listen-any permits it"
        )
    return Address(host, int(number))


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _unnoticed(text: str) -> None:
    """For shells that nobody watches."""


@dataclass(slots=True)
class Clients:
    """All TCP clients of a process. Every one is an open file, so there is a limit: ``most``.

    ``notice`` is told of clients that were turned away or made no sense.
    """

    most: int = 65536
    notice: Callable[[str], None] = _unnoticed
    present: set[Connection] = field(default_factory=set)


class Connection(asyncio.Protocol):
    """One client of a port. Its answers wait when it does not read; its flood is served in slices."""

    def __init__(self, cell: Cell, make_port: Callable[[], Port], clients: Clients) -> None:
        self._cell = cell
        self.make_port = make_port
        self._clients = clients
        self._backlog = b""
        self._writable = True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # uvloop's transports are no subclasses of asyncio's.
        self._transport = transport = cast(asyncio.Transport, transport)
        self._port = self.make_port()
        self._feed = Feed(self._cell, self._port, transport)
        clients = self._clients
        clients.present.add(self)
        if len(clients.present) > clients.most:
            clients.notice(f"more than {clients.most} clients at once are turned away")
            transport.abort()
            return
        connected = transport.get_extra_info("socket")
        if connected is not None:
            connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients.present.discard(self)
        self._feed.close()
        self._backlog = b""

    def data_received(self, data: bytes) -> None:
        if self._backlog or len(data) > SLICE_BYTES:
            self._backlog += data
            self._transport.pause_reading()
            self._serve_backlog()
        else:
            self._serve(data)

    def _serve(self, data: bytes) -> None:
        self._feed.take(data)
        if self._port.broken is not None and not self._transport.is_closing():
            self._clients.notice(f"client {_peer(self._transport)}: {self._port.broken}; its connection is closed")
            self._transport.close()

    def _serve_backlog(self) -> None:
        if self._transport.is_closing() or not self._writable:
            return
        data, self._backlog = self._backlog[:SLICE_BYTES], self._backlog[SLICE_BYTES:]
        self._serve(data)
        if self._backlog:
            asyncio.get_running_loop().call_soon(self._serve_backlog)
        elif self._writable and not self._transport.is_closing():
            self._transport.resume_reading()

    def pause_writing(self) -> None:
        self._writable = self._feed.is_read = False
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        self._writable = self._feed.is_read = True
        if self._backlog:
            asyncio.get_running_loop().call_soon(self._serve_backlog)
        else:
            self._transport.resume_reading()

    def abort(self) -> None:
        self._transport.abort()


def _peer(transport: asyncio.Transport) -> Address:
    host, port, *_ = transport.get_extra_info("peername")
    return Address(host, port)


class BufferedConnection(Connection, asyncio.BufferedProtocol):
    """A `Connection` that keeps its receive buffer: the loop of the standard library makes a new one for each read else."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._buffer = bytearray(READ_BYTES)
        self._view = memoryview(self._buffer)
        super().connection_made(transport)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self.data_received(bytes(self._view[:nbytes]))


class TcpLink:
    """A listening address; every client gets a port of its own from ``make_port``."""

    def __init__(self, cell: Cell, address: Address, make_port: Callable[[], Port], clients: Clients) -> None:
        self._cell = cell
        self._asked = address
        self._make_port = make_port
        self._clients = clients
        self._server: asyncio.Server | None = None

    async def open(self) -> Address:
        """Listen; returns the address with the port in use. Raises `LineFailure` naming the address."""
        loop = asyncio.get_running_loop()
        of_stdlib = type(loop).__module__.startswith("asyncio")
        kind, backlog = (BufferedConnection, BACKLOG_OF_STDLIB) if of_stdlib else (Connection, BACKLOG)
        host, port = self._asked
        try:
            self._server = await loop.create_server(
                lambda: kind(self._cell, self._make_port, self._clients), host, port, backlog=backlog
            )
        except OSError as error:
            raise LineFailure(f"cannot listen on {self._asked}: {where(error)}") from error
        return Address(host, self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            for client in list(self._clients.present):
                if client.make_port is self._make_port:
                    client.abort()
            await self._server.wait_closed()
            self._server = None
