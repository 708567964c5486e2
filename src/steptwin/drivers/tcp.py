"""Lines over TCP, and what every line offers: a `Channel` for a thread, an `Endpoint` that opens one."""

from __future__ import annotations

import asyncio
import errno
import socket
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from steptwin.drivers.exchange import LineLost
from steptwin.messages import Message
from steptwin.system import reason

CONNECT_S = 3.0
READ_BYTES = 4096
CANNOT_CONNECT = Message("drivers.cannot-connect", "cannot connect to {place}: {why}")
NO_ANSWER_WITHIN = Message("drivers.no-answer-within", "no answer within {connect_s:g} s")
TAKES_NOTHING = Message("drivers.takes-nothing", "{place}: the other end takes nothing any more")
CLOSED_BY_THE_OTHER = Message("drivers.closed-by-the-other", "{place}: the other end closed the connection")
CONNECTION_FAILED = Message("drivers.connection-failed", "{place}: {reason}")


class Channel(Protocol):
    """Bytes to and from a line, for a thread that waits. All methods raise `LineLost` if the line is lost."""

    def write(self, data: bytes) -> None: ...

    def read(self, timeout_s: float) -> bytes:
        """The received bytes; empty after ``timeout_s``."""
        ...

    def close(self) -> None: ...


class Endpoint(Protocol):
    """An address that can be opened. Its text is the address."""

    def open(self) -> Channel:
        """Open it for a thread. Raises `LineLost` with the address."""
        ...

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        """Open it for a task. Raises `LineLost` with the address."""
        ...


@dataclass(frozen=True, slots=True)
class TcpEndpoint:
    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"

    def open(self) -> Channel:
        try:
            return CHANNEL(socket.create_connection((self.host, self.port), CONNECT_S), str(self))
        except OSError as error:
            raise self._failed(error) from error

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(CONNECT_S):
                transport, _ = await loop.create_connection(make, self.host, self.port)
        except OSError as error:
            raise self._failed(error) from error
        return transport

    def _failed(self, error: OSError) -> LineLost:
        why = NO_ANSWER_WITHIN(connect_s=CONNECT_S) if isinstance(error, TimeoutError) else reason(error)
        return LineLost(CANNOT_CONNECT(place=str(self), why=why))


class SocketChannel:
    """A connection with the time-out of the operating system, which saves a call for each exchange."""

    def __init__(self, connected: socket.socket, place: str) -> None:
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        connected.setblocking(True)
        self._socket = connected
        self._place = place
        self._timeout_us = 0

    def write(self, data: bytes) -> None:
        try:
            if self._send(data) < len(data):
                raise BlockingIOError(errno.EAGAIN, "")
        except BlockingIOError:
            raise LineLost(TAKES_NOTHING(place=self._place)) from None
        except OSError as error:
            raise LineLost(CONNECTION_FAILED(place=self._place, reason=reason(error))) from error

    def read(self, timeout_s: float) -> bytes:
        try:
            data = self._receive(timeout_s)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise LineLost(CONNECTION_FAILED(place=self._place, reason=reason(error))) from error
        if not data:
            raise LineLost(CLOSED_BY_THE_OTHER(place=self._place))
        return data

    def close(self) -> None:
        self._socket.close()

    def _send(self, data: bytes) -> int:
        """Send without waiting; returns the number of bytes sent. Raises `BlockingIOError` if none can be."""
        return self._socket.send(data, socket.MSG_DONTWAIT)

    def _receive(self, timeout_s: float) -> bytes:
        """Received bytes. Raises `BlockingIOError` if there are none within ``timeout_s``."""
        timeout_us = int(timeout_s * 1e6)
        flags = 0
        if timeout_us <= 0:
            flags = socket.MSG_DONTWAIT
        elif timeout_us != self._timeout_us:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", *divmod(timeout_us, 1_000_000)))
            self._timeout_us = timeout_us
        return self._socket.recv(READ_BYTES, flags)


class TimedSocketChannel(SocketChannel):
    """The same for systems without non-blocking single calls (Windows)."""

    def _send(self, data: bytes) -> int:
        self._socket.settimeout(0.0)
        return self._socket.send(data)

    def _receive(self, timeout_s: float) -> bytes:
        self._socket.settimeout(max(timeout_s, 0.0))
        try:
            return self._socket.recv(READ_BYTES)
        except TimeoutError:
            raise BlockingIOError(errno.EAGAIN, "") from None


CHANNEL = SocketChannel if hasattr(socket, "MSG_DONTWAIT") else TimedSocketChannel
