"""TCP links: Modbus TCP, and raw bytes as serial device servers send them."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable
from typing import Protocol

from steptwin.controller import Port
from steptwin.errors import LineFailure
from steptwin.live.clients import Clients, listening
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.tcp_asyncio import AsyncioListener
from steptwin.live.tcp_epoll import EpollListener
from steptwin.simulation.toml.addresses import Address
from steptwin.system import HAS_EPOLL, reason


class Listener(Protocol):
    """Accepts the clients of a listening socket and serves them."""

    def __init__(
        self,
        listening: socket.socket,
        address: Address,
        realtime: RealTimeDriver,
        make_port: Callable[[], Port],
        clients: Clients,
    ) -> None: ...
    async def start(self) -> None: ...
    async def close(self) -> None:
        """Close the socket and every connection."""
        ...


LISTENER: type[Listener] = EpollListener if HAS_EPOLL else AsyncioListener


def listening_at(address: Address) -> socket.socket:
    """A listening socket. Raises `LineFailure` naming the address."""
    try:
        return listening(address)
    except OSError as error:
        hint = "; port 0 takes a free one" if error.errno == errno.EADDRINUSE else ""
        raise LineFailure(f"cannot listen on {address}: {reason(error)}{hint}") from error
    except UnicodeError as error:
        raise LineFailure(f"cannot listen on {address}: no name of a host") from error


class TcpLink:
    """A listening address; every client gets a port of its own from ``make_port``."""

    def __init__(
        self,
        realtime: RealTimeDriver,
        address: Address,
        make_port: Callable[[], Port],
        clients: Clients,
        listener: type[Listener] = LISTENER,
    ) -> None:
        self._realtime = realtime
        self._asked = address
        self._make_port = make_port
        self._clients = clients
        self._kind = listener
        self._listener: Listener | None = None

    async def open(self) -> Address:
        """Listen; returns the address with the port in use. Raises `LineFailure` naming the address."""
        listener = listening_at(self._asked)
        address = Address(self._asked.host, listener.getsockname()[1])
        self._listener = self._kind(listener, address, self._realtime, self._make_port, self._clients)
        await self._listener.start()
        return address

    async def close(self) -> None:
        if self._listener is not None:
            await self._listener.close()
            self._listener = None
