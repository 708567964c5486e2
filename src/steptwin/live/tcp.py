"""TCP links: Modbus TCP, and raw bytes as serial device servers send them."""

from __future__ import annotations

import asyncio
import errno
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakSet

from steptwin.errors import LineFailure
from steptwin.live.cell import Cell
from steptwin.live.descriptors import descriptors
from steptwin.live.links import SLICE_BYTES, Feed, where
from steptwin.machine import Port
from steptwin.world.addresses import Address

BACKLOG = 1024
AT_ONCE = 64
"""Clients that are accepted before those that are there are served."""
RETRY_S = 1.0
"""How long no client is accepted when the system has no room for one more."""


def _unnoticed(text: str) -> None:
    """For shells without an observer."""


@dataclass(slots=True)
class Clients:
    """All TCP clients of a process. Every one is an open file, so there is a limit: ``most``.

    ``notice`` is called for clients that were turned away or made no sense.
    """

    most: int = 65536
    notice: Callable[[str], None] = _unnoticed
    present: set[Connection] = field(default_factory=set)


class Connection:
    """One client of a port. While it does not read its answers no request of it is read; its flood is served in slices."""

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

    def __init__(self, client: socket.socket, peer: Address, cell: Cell, port: Port, clients: Clients) -> None:
        self.port = port
        self._peer = peer
        self._socket = client
        self._receive = client.recv
        self._send = client.send
        self._clients = clients
        self._unsent = b""
        self._ending = False
        self._feed = Feed(cell, port, self)
        self._descriptors = descriptors()
        self._descriptors.await_input(client.fileno(), self._serve)
        clients.present.add(self)

    @property
    def waiting(self) -> int:
        """Bytes that the client has no room for."""
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
            self._clients.notice(f"client {self._peer}: {self.port.broken}; its connection is closed")
            self._ending = True
            if not self._unsent:
                self.close()

    def write(self, data: bytes) -> None:
        """Send; what finds no room waits for it."""
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


class TcpLink:
    """A listening address; every client gets a port of its own from ``make_port``."""

    def __init__(self, cell: Cell, address: Address, make_port: Callable[[], Port], clients: Clients) -> None:
        self._cell = cell
        self._asked = address
        self._make_port = make_port
        self._clients = clients
        self._connections: WeakSet[Connection] = WeakSet()
        self._listener: socket.socket | None = None
        self._retry: asyncio.TimerHandle | None = None

    async def open(self) -> Address:
        """Listen; returns the address with the port in use. Raises `LineFailure` naming the address."""
        try:
            self._listener = listener = _listening(self._asked)
        except OSError as error:
            hint = "; port 0 takes a free one" if error.errno == errno.EADDRINUSE else ""
            raise LineFailure(f"cannot listen on {self._asked}: {where(error)}{hint}") from error
        except UnicodeError as error:
            raise LineFailure(f"cannot listen on {self._asked}: no name of a host") from error
        self._listen()
        return Address(self._asked.host, listener.getsockname()[1])

    def _listen(self) -> None:
        if self._listener is not None:
            descriptors().await_input(self._listener.fileno(), self._accept)

    def _accept(self) -> None:
        if self._listener is None:
            return
        try:
            for _ in range(AT_ONCE):
                self._welcome(*self._listener.accept())
        except (BlockingIOError, ConnectionAbortedError):
            return
        except OSError as error:
            self._clients.notice(f"no client is accepted on {self._asked} for {RETRY_S:g} s: {where(error)}")
            descriptors().forget(self._listener.fileno())
            self._retry = asyncio.get_running_loop().call_later(RETRY_S, self._listen)

    def _welcome(self, client: socket.socket, peer: tuple[Any, ...]) -> None:
        if len(self._clients.present) >= self._clients.most:
            self._clients.notice(f"more than {self._clients.most} clients at once are turned away")
            client.close()
            return
        client.setblocking(False)
        self._connections.add(Connection(client, Address(*peer[:2]), self._cell, self._make_port(), self._clients))

    async def close(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
        if self._listener is not None:
            descriptors().forget(self._listener.fileno())
            self._listener.close()
            self._listener = None
        for connection in list(self._connections):
            connection.close()


def _listening(address: Address) -> socket.socket:
    family = socket.getaddrinfo(*address, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
    listener = socket.create_server(address, family=family, backlog=BACKLOG)
    listener.setblocking(False)
    # What is accepted inherits these.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    return listener
