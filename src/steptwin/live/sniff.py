"""Decode the traffic of a line, either by listening or as a relay between a client and the device."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import cast

from steptwin.controller import SECOND, Nanos, Port
from steptwin.drivers.kind import Decoder
from steptwin.drivers.lineaddress import LineAddress
from steptwin.errors import LineFailure, Misuse
from steptwin.live.clients import Clients
from steptwin.live.clock import Clock
from steptwin.live.pty import PtyLink
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.tcp import TcpLink
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.toml.addresses import Address
from steptwin.wire.slave import FrameDirection

ARROWS = {FrameDirection.IN: "→", FrameDirection.OUT: "←"}


class _RelayPort:
    """A port that passes the bytes of its client to the device, and those of the device to the client. See `SendingPort`."""

    broken: str | None = None

    def __init__(self, tap: Tap) -> None:
        self._tap = tap
        self._waiting: deque[tuple[Nanos, bytes]] = deque()
        self.on_output: Callable[[], None] | None = None
        tap.clients.append(self)

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self._tap.pass_on(data)
        return b""

    def send(self, data: bytes, now: Nanos) -> None:
        self._waiting.append((now, data))
        if self.on_output is not None:
            self.on_output()

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        waiting = list(self._waiting)
        self._waiting.clear()
        return waiting

    def deadline(self) -> Nanos | None:
        return None

    def close(self) -> None:
        if self in self._tap.clients:
            self._tap.clients.remove(self)


class Tap(asyncio.Protocol):
    """The connection to the device; programs that use it through this relay are `clients`."""

    def __init__(self, decoder: Decoder, *, is_relay: bool) -> None:
        self.clients: list[_RelayPort] = []
        self.ended: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._decoder = decoder
        self._is_relay = is_relay
        self._begin = time.monotonic_ns()
        self._transport: asyncio.Transport | None = None
        self._silence: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)  # serialx' is not a subclass

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result(str(exc) if exc else "the other end closed it")

    def data_received(self, data: bytes) -> None:
        now = self._now()
        for client in self.clients:
            client.send(data, now)
        self._decode(data, FrameDirection.OUT if self._is_relay else None)

    def pass_on(self, data: bytes) -> None:
        if self._transport is not None:
            self._transport.write(data)
        self._decode(data, FrameDirection.IN)

    def _now(self) -> Nanos:
        return time.monotonic_ns() - self._begin

    def _decode(self, data: bytes, direction: FrameDirection | None) -> None:
        self._decoder.feed(data, self._now(), direction)
        self._wait_for_silence()

    def _wait_for_silence(self) -> None:
        """Timers come before their time by as much as the clock goes on at once, 16 ms on Windows: then it is waited again."""
        if self._silence is not None:
            self._silence.cancel()
        due = self._decoder.deadline()
        if due is not None:
            self._silence = asyncio.get_running_loop().call_later(max(due - self._now(), 0) / SECOND, self._expire)

    def _expire(self) -> None:
        due = self._decoder.deadline()
        if due is not None and due <= self._now():
            self._decoder.expire(self._now())
        self._wait_for_silence()


async def sniff(
    place: LineAddress,
    decoder: Decoder,
    *,
    listen: Address | None = None,
    pty: Path | None = None,
    ready: Callable[[str], object] = str,
) -> None:
    """Decode a line until it is lost, which raises `LineFailure`.

    ``listen`` or ``pty``: the address at which clients connect to the relay. ``ready`` is called with the open address.
    """
    if place.framed and listen is None:
        raise Misuse("a Modbus TCP connection cannot be monitored from outside: use a relay, --listen HOST:PORT")
    tap = Tap(decoder, is_relay=listen is not None or pty is not None)
    transport = await place.endpoint.connect(lambda: tap)
    realtime = RealTimeDriver(Scheduler(), Clock())
    links: list[TcpLink | PtyLink] = []

    def port() -> Port:
        return _RelayPort(tap)

    try:
        if listen is not None:
            tcp = TcpLink(realtime, listen, port, Clients())
            links.append(tcp)
            ready(str(await tcp.open()))
        if pty is not None:
            terminal = PtyLink(realtime, pty, port)
            links.append(terminal)
            ready(str(await terminal.open()))
        if not links:
            ready(f"listening on {place.endpoint}")
        why = await tap.ended
        raise LineFailure(f"{place.endpoint} was lost: {why}")
    finally:
        for link in links:
            await link.close()
        transport.abort()
        realtime.close()
