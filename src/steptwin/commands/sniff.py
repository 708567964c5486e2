"""Decode the traffic of a line, either by listening or as a relay between a client and the device."""

from __future__ import annotations

import asyncio
import re
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, cast

from steptwin.drivers.mic488.frames import FrameWords
from steptwin.drivers.mic488.listening import RtuListener, TcpListener
from steptwin.drivers.place import LineAddress
from steptwin.errors import LineFailure, Misuse
from steptwin.live.cell import Cell
from steptwin.live.clients import Clients
from steptwin.live.clock import Clock
from steptwin.live.pty import PtyLink
from steptwin.live.tcp import TcpLink
from steptwin.m1486.characterlog import REPORTS, CharacterLog, LineSplitter
from steptwin.m1486.receiver import CR
from steptwin.m1486.registers import UPLOADS
from steptwin.m1486.variants import variant
from steptwin.machine import MILLISECOND, SECOND, Nanos, Port
from steptwin.mic488.registers import register_map
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection
from steptwin.world.addresses import Address
from steptwin.world.kernel import Kernel

Sink = Callable[[FrameLine], None]
QUIET_NS: Nanos = 100 * MILLISECOND
"""Silence that ends a group of bytes from the chips, ns."""
MOST_TYPED = 4096
"""Most characters whose echo is expected: far more than an input buffer holds."""
ARROWS = {FrameDirection.IN: "→", FrameDirection.OUT: "←"}


class Decoder(Protocol):
    """Decodes bytes. ``direction`` is None if both directions share one wire."""

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None: ...
    def deadline(self) -> Nanos | None: ...
    def expire(self, now: Nanos) -> None: ...


class ModbusDecoder:
    """Decodes Modbus RTU or TCP, with the register names of a MIC488."""

    def __init__(self, sink: Sink, firmware: str, *, tcp: bool) -> None:
        words = FrameWords(register_map(firmware), tcp=tcp)
        words.sinks.append(lambda h: sink(FrameLine(h.time, "", h.direction or FrameDirection.OUT, h.raw, h.meaning)))
        self._tcp = TcpListener(words) if tcp else None
        self._rtu = RtuListener(words)

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None:
        if self._tcp is not None and direction is not None:
            self._tcp.feed(data, now, direction)
        else:
            self._rtu.feed(data, now)

    def deadline(self) -> Nanos | None:
        return self._rtu.deadline()

    def expire(self, now: Nanos) -> None:
        self._rtu.expire(now)


class M1486Decoder:
    """Decodes commands and answers of M1486 chips. On one wire all bytes are decoded as commands.

    The bytes of the chips carry no type. Bytes that repeat the characters sent, in order and up to the CR, are their echo
    (function 41); other bytes after a command U are its upload.
    """

    def __init__(self, sink: Sink, kind: str) -> None:
        self._sink = sink
        self._log = CharacterLog(variant(kind))
        self._log.sinks.append(self._observe)
        self._lines = LineSplitter(self._log, "")
        self._typed: deque[int] = deque(maxlen=MOST_TYPED)  # whose echo may follow
        self._count = 0  # of all characters typed
        self._uploads: deque[tuple[int, int]] = deque()  # numbers, with the count of characters up to their CR
        self._repeated = b""  # received bytes that match the echo so far
        self._repeated_ns: Nanos = 0

    def _observe(self, line: FrameLine) -> None:
        upload = re.match(rb"\s*[Uu]\s*(\d+)\s*\r", line.raw) if line.direction is FrameDirection.IN else None
        if upload is not None:
            self._uploads.append((int(upload[1]), self._count))
        self._sink(line)

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None:
        for byte in data:
            if direction is FrameDirection.OUT:
                self._received(byte, now)
                continue
            if direction is FrameDirection.IN:
                self._typed.append(byte)
                self._count += 1
            self._lines.take(bytes((byte,)), now)

    def _received(self, byte: int, now: Nanos) -> None:
        if not self._uploads and byte in self._typed:
            while byte != self._typed[0]:
                self._typed.popleft()  # typed before function 41 was ON
        if self._typed and byte == self._typed[0]:
            self._typed.popleft()
            self._repeated += bytes((byte,))
            self._repeated_ns = now
            if byte == CR:
                self._is_echo()
            return
        self._settle()
        if self._uploads:
            self._is_upload(byte, now)
        elif self._typed and byte not in REPORTS and byte < 0x80:
            typed = chr(self._typed.popleft())
            meaning = f"{chr(byte)!r} where {typed!r} was typed: a garbled echo, or that of several chips at once"
            self._sink(FrameLine(now, "", FrameDirection.OUT, bytes((byte,)), meaning))
        else:
            self._log.sent(now, byte)

    def _settle(self) -> None:
        """End the comparison with the characters sent."""
        if self._uploads:
            for byte in self._repeated:
                self._is_upload(byte, self._repeated_ns)
            self._repeated = b""
        elif self._repeated:
            self._is_echo()

    def _is_echo(self) -> None:
        echo, self._repeated = self._repeated, b""
        self._sink(FrameLine(self._repeated_ns, "", FrameDirection.OUT, echo, f"echo of {echo.decode('latin-1')!r}"))

    def _is_upload(self, byte: int, now: Nanos) -> None:
        if not self._uploads:
            self._log.sent(now, byte)
            return
        number, count = self._uploads.popleft()
        while len(self._typed) > self._count - count:
            self._typed.popleft()  # an echo would have come before
        meaning = f"U{number} {UPLOADS.get(number, 'reserved')} = {byte}"
        self._sink(FrameLine(now, "", FrameDirection.OUT, bytes((byte,)), meaning))

    def deadline(self) -> Nanos | None:
        return self._repeated_ns + QUIET_NS if self._repeated else None

    def expire(self, now: Nanos) -> None:
        if self._repeated and now >= self._repeated_ns + QUIET_NS:
            self._settle()


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
        decoder = self._decoder
        decoder.feed(data, self._now(), direction)
        due = decoder.deadline()
        if due is not None:
            delay_s = max(due - self._now(), 0) / SECOND
            asyncio.get_running_loop().call_later(delay_s, lambda: decoder.expire(self._now()))


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
    cell = Cell(Kernel(), Clock())
    links: list[TcpLink | PtyLink] = []

    def port() -> Port:
        return _RelayPort(tap)

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
        raise LineFailure(f"{place.endpoint} was lost: {why}")
    finally:
        for link in links:
            await link.close()
        transport.abort()
        cell.close()
