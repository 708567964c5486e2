"""What tests of drivers have in common: bytes on their way in virtual time, and lines that carry them for threads and tasks.

Nothing waits, and any byte can go wrong. `host_rig` has MIC488 twins at the other end, `chip_rig` M1486 chips.
"""

from __future__ import annotations

import asyncio
import heapq
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

import pytest
from virtual_loop import VirtualLoop

from steptwin.controller import MICROSECOND, SECOND
from steptwin.drivers.exchange import LineLost
from steptwin.drivers.lineaddress import LineAddress
from steptwin.drivers.m1486 import lines as m1486_lines
from steptwin.drivers.mic488 import lines as mic488_lines
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import SteptwinError

T = TypeVar("T")
LATENCY = 500 * MICROSECOND


class VirtualWire(ABC):
    """Bytes on their way ``there``, to the twins, and ``back``. `run` lets time pass until some have come back."""

    there: str
    back: str

    def __init__(self) -> None:
        self.now = 1000 * SECOND
        self.severed = False
        """Whether the line is cut: nothing arrives anywhere, and nobody notices but by silence."""
        self.gone: str | None = None
        """Why the port is gone, which its owner notices."""
        self.sent: list[tuple[int, bytes]] = []
        """What the driver sent, with its moment."""
        self.before_each: Callable[[bytes], None] | None = None
        self.before_read: Callable[[], None] | None = None
        """Called when a frame is sent, and when a thread waits for bytes."""
        self.unread = b""
        self.opened = 0
        self._passed = {self.there: 0, self.back: 0}
        """How many bytes have gone since faults were put on the line."""
        self._latest = {self.there: 0, self.back: 0}
        """When the last of them arrive."""
        self._events: list[tuple[int, int, str, bytes]] = []
        self._plans: list[tuple[int, int, Callable[[], None]]] = []
        self._count = 0

    # ------------------------------------------------------------------ what each kind has

    @abstractmethod
    def open(self) -> None:
        """A new connection."""

    @abstractmethod
    def _carry(self, direction: str, data: bytes, now: int) -> None:
        """Bytes set out; `_arrive` says when they come to the other end."""

    @abstractmethod
    def _deadline(self) -> int | None:
        """When the twins have something to send, or do something."""

    @abstractmethod
    def _advance(self, now: int) -> None:
        """Bring the twins, and `now`, to a moment."""

    @abstractmethod
    def _receive(self, data: bytes) -> bytes:
        """Bytes come to the twins; what they answer at once."""
        raise NotImplementedError

    @abstractmethod
    def _spoken(self) -> bytes:
        """What the twins send besides."""

    # ------------------------------------------------------------------ bytes

    def send(self, data: bytes, now: int | None = None) -> None:
        """The driver sends."""
        if self.before_each is not None:
            self.before_each(data)
        self.now = max(self.now, self.now if now is None else now)
        self.sent.append((self.now, data))
        self._carry(self.there, data, self.now)

    def _arrive(self, direction: str, data: bytes, at: int) -> None:
        if data:
            self._count += 1
            heapq.heappush(self._events, (at, self._count, direction, data))

    def inject(self, data: bytes, after: int = 0) -> None:
        """Bytes that nobody sent reach the driver."""
        self._arrive(self.back, data, self.now + after)

    def at(self, seconds: float, action: Callable[[], None]) -> None:
        """Do something so much later, as a hand at the machine does."""
        self._count += 1
        heapq.heappush(self._plans, (self.now + round(seconds * SECOND), self._count, action))

    def due(self) -> int | None:
        """When something happens next: bytes arrive somewhere, or the twins do something."""
        moments = [queue[0][0] for queue in (self._events, self._plans) if queue]
        twins = self._deadline()
        if twins is not None:
            moments.append(twins)
        return min(moments, default=None)

    def run(self, until: int) -> list[bytes]:
        """Everything until then; returns what came back, and stops there."""
        while True:
            due = self.due()
            if due is None or due > until:
                self._advance(until)
                return []
            self._advance(max(due, self.now))
            arrived = self._step()
            if arrived:
                return arrived

    def _step(self) -> list[bytes]:
        while self._plans and self._plans[0][0] <= self.now:
            heapq.heappop(self._plans)[2]()
        arrived = []
        while self._events and self._events[0][0] <= self.now:
            _, _, direction, data = heapq.heappop(self._events)
            if direction == self.back:
                arrived.append(data)
            elif not self.severed and (answer := self._receive(data)):
                self._carry(self.back, answer, self.now)
        if spoken := self._spoken():
            self._carry(self.back, spoken, self.now)
        return arrived

    # ------------------------------------------------------------------ time without bytes

    def clock(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        """Time passes while no thread listens; what comes waits in the buffer."""
        end = self.now + round(seconds * SECOND)
        while arrived := self.run(end):
            self.unread += b"".join(arrived)

    def read(self, timeout_s: float) -> bytes:
        if self.unread:
            data, self.unread = self.unread, b""
            return data
        return b"".join(self.run(self.now + round(timeout_s * SECOND)))


# ---------------------------------------------------------------------- lines


class MemoryChannel:
    def __init__(self, wire: VirtualWire) -> None:
        self._wire = wire

    def _check(self) -> None:
        if self._wire.gone is not None:
            raise LineLost(self._wire.gone)

    def write(self, data: bytes) -> None:
        self._check()
        self._wire.send(data)

    def read(self, timeout_s: float) -> bytes:
        self._check()
        if self._wire.before_read is not None:
            self._wire.before_read()
        return self._wire.read(timeout_s)

    def close(self) -> None:
        pass


class MemoryTransport(asyncio.Transport):
    def __init__(self, wire: VirtualWire, loop: asyncio.AbstractEventLoop, protocol: asyncio.Protocol) -> None:
        super().__init__()
        self._wire = wire
        self._loop = loop
        self._protocol = protocol
        self._timer: asyncio.TimerHandle | None = None
        self._closed = False

    def _now(self) -> int:
        return round(self._loop.time() * SECOND)

    def write(self, data: bytes) -> None:  # type: ignore[override]
        self._wire.send(bytes(data), self._now())
        self._arm()

    def _arm(self) -> None:
        due = self._wire.due()
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None if due is None or self._closed else self._loop.call_at(due / SECOND, self._pump)

    def _pump(self) -> None:
        for data in self._wire.run(self._now()):
            self._protocol.data_received(data)
        if not self._closed:
            self._arm()

    def lose(self, error: Exception | None = None) -> None:
        self._closed = True
        self._loop.call_soon(self._protocol.connection_lost, error)

    def close(self) -> None:
        if not self._closed:
            self.lose()
        if self._timer is not None:
            self._timer.cancel()

    abort = close

    def is_closing(self) -> bool:
        return self._closed


class MemoryEndpoint:
    def __init__(self, wire: VirtualWire) -> None:
        self._wire = wire
        self.transport: MemoryTransport | None = None

    def __str__(self) -> str:
        return "memory"

    def open(self) -> MemoryChannel:
        self._opened()
        return MemoryChannel(self._wire)

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> MemoryTransport:
        self._opened()
        protocol = make()
        self.transport = MemoryTransport(self._wire, asyncio.get_running_loop(), protocol)
        protocol.connection_made(self.transport)
        return self.transport

    def _opened(self) -> None:
        if self._wire.gone is not None:
            raise LineLost(f"cannot open memory: {self._wire.gone}")
        self._wire.opened += 1
        self._wire.open()


def at_every_address(monkeypatch: pytest.MonkeyPatch, wire: VirtualWire) -> None:
    """Whoever opens an address, of whatever device, finds the wire, and lives in its time."""
    monkeypatch.setattr(ThreadLine.__init__, "__kwdefaults__", {"clock": wire.clock, "sleeping": wire.sleep})
    for lines in (mic488_lines, m1486_lines):
        monkeypatch.setattr(lines, "parse_line_address", lambda text, baud: LineAddress(MemoryEndpoint(wire)))


def run_virtual(wire: VirtualWire, main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in the time of the wire."""
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(wire.now, is_alone=True)) as runner:
        return runner.run(main)


def in_threads(*tasks: Callable[[], object]) -> list[Exception]:
    """Run them at once; what they raised."""
    raised: list[Exception] = []

    def guarded(task: Callable[[], object]) -> None:
        try:
            task()
        except (AssertionError, SteptwinError) as error:
            raised.append(error)

    threads = [threading.Thread(target=guarded, args=(task,)) for task in tasks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()
    return raised
