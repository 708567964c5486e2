"""A line between two others in words: listening on it, or standing in it and passing everything on."""

from __future__ import annotations

import asyncio
import re
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, cast

from steptwin.errors import LineFailure, Misuse
from steptwin.host.mic488.frames import FrameWords
from steptwin.host.mic488.listening import RtuListener, TcpListener
from steptwin.host.place import Place
from steptwin.m1486.registers import UPLOADS
from steptwin.m1486.variants import variant
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.registers import register_map
from steptwin.runtime.cell import Cell
from steptwin.runtime.clock import Clock
from steptwin.runtime.frames import FrameLine
from steptwin.runtime.links import Port
from steptwin.runtime.m1486_characters import CharacterLog, LineSplitter
from steptwin.runtime.pty import PtyLink
from steptwin.runtime.tcp import Address, Clients, TcpLink
from steptwin.wire.slave import Direction
from steptwin.world.kernel import Kernel

Sink = Callable[[FrameLine], None]
ARROWS = {Direction.IN: "→", Direction.OUT: "←"}


class Decoder(Protocol):
    """Puts bytes into words. ``direction`` is None where both come from one wire."""

    def heard(self, data: bytes, now: Nanos, direction: Direction | None) -> None: ...
    def deadline(self) -> Nanos | None: ...
    def expire(self, now: Nanos) -> None: ...


class ModbusDecoder:
    """Modbus RTU or TCP, in the words of a MIC488."""

    def __init__(self, sink: Sink, firmware: str, *, tcp: bool) -> None:
        words = FrameWords(register_map(firmware), tcp=tcp)
        words.sinks.append(lambda h: sink(FrameLine(h.time, "", h.direction or Direction.OUT, h.raw, h.meaning)))
        self._tcp = TcpListener(words) if tcp else None
        self._rtu = RtuListener(words)

    def heard(self, data: bytes, now: Nanos, direction: Direction | None) -> None:
        if self._tcp is not None and direction is not None:
            self._tcp.heard(data, now, direction)
        else:
            self._rtu.heard(data, now)

    def deadline(self) -> Nanos | None:
        return self._rtu.deadline()

    def expire(self, now: Nanos) -> None:
        self._rtu.expire(now)


class M1486Decoder:
    """Commands and answers of M1486 chips. On one wire everything is taken for commands.

    The first byte that comes after a command U is taken for what it uploads.
    """

    def __init__(self, sink: Sink, kind: str) -> None:
        self._sink = sink
        self._log = CharacterLog(variant(kind))
        self._log.sinks.append(self._told)
        self._lines = LineSplitter(self._log, "")
        self._uploads: deque[int] = deque()

    def _told(self, line: FrameLine) -> None:
        upload = re.match(rb"\s*[Uu]\s*(\d+)\s*\r", line.raw) if line.direction is Direction.IN else None
        if upload is not None:
            self._uploads.append(int(upload[1]))
        self._sink(line)

    def heard(self, data: bytes, now: Nanos, direction: Direction | None) -> None:
        if direction is Direction.OUT:
            for byte in data:
                if self._uploads:
                    number = self._uploads.popleft()
                    meaning = f"U{number} {UPLOADS.get(number, 'reserved')} = {byte}"
                    self._sink(FrameLine(now, "", Direction.OUT, bytes((byte,)), meaning))
                else:
                    self._log.sent(now, byte)
        else:
            self._lines.take(data, now)

    def deadline(self) -> Nanos | None:
        return None

    def expire(self, now: Nanos) -> None:
        """Lines end by their CR only."""


class _Between:
    """A port that passes on what its client sends, and gives him what the device says. See `TalkingPort`."""

    broken: str | None = None

    def __init__(self, tap: Tap) -> None:
        self._tap = tap
        self._waiting: deque[tuple[Nanos, bytes]] = deque()
        self.on_output: Callable[[], None] | None = None
        tap.clients.append(self)

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self._tap.pass_on(data)
        return b""

    def say(self, data: bytes, now: Nanos) -> None:
        self._waiting.append((now, data))
        if self.on_output is not None:
            self.on_output()

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        said = list(self._waiting)
        self._waiting.clear()
        return said

    def deadline(self) -> Nanos | None:
        return None

    def close(self) -> None:
        if self in self._tap.clients:
            self._tap.clients.remove(self)


class Tap(asyncio.Protocol):
    """The connection to the device; programs that want to talk to it come as `clients`."""

    def __init__(self, decoder: Decoder, *, stands_between: bool) -> None:
        self.clients: list[_Between] = []
        self.ended: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._decoder = decoder
        self._stands_between = stands_between
        self._begin = time.monotonic_ns()
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)  # serialx' is no subclass

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result(str(exc) if exc else "the other end closed it")

    def data_received(self, data: bytes) -> None:
        now = self._now()
        for client in self.clients:
            client.say(data, now)
        self._heard(data, Direction.OUT if self._stands_between else None)

    def pass_on(self, data: bytes) -> None:
        if self._transport is not None:
            self._transport.write(data)
        self._heard(data, Direction.IN)

    def _now(self) -> Nanos:
        return time.monotonic_ns() - self._begin

    def _heard(self, data: bytes, direction: Direction | None) -> None:
        decoder = self._decoder
        decoder.heard(data, self._now(), direction)
        due = decoder.deadline()
        if due is not None:
            delay_s = max(due - self._now(), 0) / SECOND
            asyncio.get_running_loop().call_later(delay_s, lambda: decoder.expire(self._now()))


async def sniff(
    place: Place,
    decoder: Decoder,
    *,
    listen: Address | None = None,
    pty: Path | None = None,
    ready: Callable[[str], object] = str,
) -> None:
    """Put a line into words until it is gone, which is raised as `LineFailure`.

    ``listen`` or ``pty``: where programs connect that then talk to the device through this. ``ready`` is told where.
    """
    if place.framed and listen is None:
        raise Misuse("a Modbus TCP connection cannot be listened to: stand in it, --listen HOST:PORT")
    tap = Tap(decoder, stands_between=listen is not None or pty is not None)
    transport = await place.endpoint.connect(lambda: tap)
    cell = Cell(Kernel(), Clock())
    links: list[TcpLink | PtyLink] = []

    def port() -> Port:
        return _Between(tap)

    try:
        if listen is not None:
            tcp = TcpLink(cell, listen, port, Clients())
            links.append(tcp)
            ready(str(await tcp.open()))
        if pty is not None:
            terminal = PtyLink(cell, pty, port)
            links.append(terminal)
            ready(str(await terminal.open()))
        if not links:
            ready(f"listening on {place.endpoint}")
        why = await tap.ended
        raise LineFailure(f"{place.endpoint} is gone: {why}")
    finally:
        for link in links:
            await link.close()
        transport.abort()
        cell.close()
