"""A twin in the thread of the test: time advances only while the test or a driver waits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from typing import TypeVar

from steptwin.controller import MILLISECOND, SECOND, Nanos, Port
from steptwin.drivers import LineLost, Mic488
from steptwin.drivers.lineaddress import LineAddress
from steptwin.drivers.m1486 import M1486
from steptwin.drivers.m1486.lines import BAUD, talking
from steptwin.drivers.mic488.lines import FRAMES_PER_SECOND, modbus_exchanger
from steptwin.drivers.tcp import Channel
from steptwin.drivers.threads import ThreadLine
from steptwin.live.realtimedriver import Advanceable
from steptwin.mic488.config import ControllerConfig

T = TypeVar("T")

LOOK_NS: Nanos = 10 * MILLISECOND
"""A condition is evaluated at this interval, and after every event."""


class VirtualTime:
    """Controllers that are advanced only while the test waits, so that it gives the same result each time."""

    def __init__(self, controllers: Advanceable) -> None:
        self.controllers = controllers
        self._planned: list[tuple[Nanos, int, Callable[[], object]]] = []
        self._count = count()

    def now(self) -> Nanos:
        return self.controllers.now

    def call(self, act: Callable[[Nanos], T]) -> T:
        """Do something with the controllers at the present moment."""
        try:
            return act(self.now())
        finally:
            self.controllers.deadline()  # signals settle

    def sleep(self, seconds: float) -> None:
        self.advance(self.now() + max(round(seconds * SECOND), 0))

    def advance(self, moment: Nanos) -> None:
        while self._planned and self._planned[0][0] <= moment:
            at, _, act = heappop(self._planned)
            self.controllers.advance(at)
            act()
        self.controllers.advance(moment)

    def deadline(self) -> Nanos | None:
        """When something happens next by itself, or was planned."""
        due = self.controllers.deadline()
        planned = self._planned[0][0] if self._planned else None
        return due if planned is None or (due is not None and due < planned) else planned

    def later(self, seconds: float, act: Callable[[], object]) -> None:
        """Do something when so much time has passed."""
        heappush(self._planned, (self.now() + max(round(seconds * SECOND), 0), next(self._count), act))

    def until(self, condition: Callable[[], object], within_s: float) -> bool:
        """Wait until a condition is true; whether it became true."""
        end = self.now() + round(within_s * SECOND)
        while not condition():
            now = self.now()
            if now >= end:
                return False
            due = self.deadline()
            look = min(now + LOOK_NS, end)
            self.advance(look if due is None else min(due, look))
        return True

    def close(self) -> None:
        """Nothing is open."""


class MemoryEndpoint:
    """A line of a twin as a driver opens it: see `steptwin.drivers.lineaddress.Endpoint`. Bytes take no time."""

    def __init__(self, time: VirtualTime, make_port: Callable[[], Port], place: str) -> None:
        self._time = time
        self._make_port = make_port
        self._place = place

    def __str__(self) -> str:
        return self._place

    def open(self) -> Channel:
        return MemoryChannel(self._time, self._make_port(), self._place)

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        raise LineLost(f"{self._place} is in virtual time, in which no event loop runs: use time='real'")


class MemoryChannel:
    """Bytes to and from a port of the twin."""

    def __init__(self, time: VirtualTime, port: Port, place: str) -> None:
        self._time = time
        self._port = port
        self._place = place
        self._received = b""
        self._closed = False

    def write(self, data: bytes) -> None:
        if self._closed or self._port.broken is not None:
            raise LineLost(f"{self._place}: {self._port.broken or 'it was closed'}")
        self._received += self._time.call(lambda now: self._port.exchange(data, now))

    def read(self, timeout_s: float) -> bytes:
        time, port = self._time, self._port
        end = time.now() + max(round(timeout_s * SECOND), 0)
        while True:
            self._received += b"".join(piece for _, piece in port.to_send(time.now()))
            if self._received or time.now() >= end:
                received, self._received = self._received, b""
                return received
            deadlines = (time.deadline(), port.deadline())
            due = min((due for due in deadlines if due is not None), default=end)
            time.advance(min(max(due, time.now() + 1), end))

    def close(self) -> None:
        self._closed = True
        self._port.close()


def connected_driver(
    endpoint: MemoryEndpoint, time: VirtualTime, unit: int, *, framed: bool, firmware: str, config: ControllerConfig
) -> Mic488:
    """A driver; while it waits, the time of the twin advances. ``framed``: Modbus TCP rather than RTU."""
    exchanger, shared = modbus_exchanger(LineAddress(endpoint, framed=framed), FRAMES_PER_SECOND, None)
    line = ThreadLine(endpoint, exchanger, shared, clock=time.now, sleeping=time.sleep)
    return Mic488(line, unit, firmware=firmware, config=config)


def connected_chip(endpoint: MemoryEndpoint, time: VirtualTime, address: int) -> M1486:
    """A driver of a chip; while it waits, the time of the twin advances."""
    exchanger, shared = talking(endpoint, BAUD, None)
    line = ThreadLine(endpoint, exchanger, shared, clock=time.now, sleeping=time.sleep)
    return M1486(line, address)
