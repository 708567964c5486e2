"""M1486 chips at the other end of a wire in virtual time, for tests of drivers: nothing waits, and any character can go wrong.

As `host_rig` for the MIC488: `ChipWire` carries characters, `Fault`s are put on it by direction and number, `chip_line` and
`chip_task_line` are lines for threads and tasks in its time.
"""

from __future__ import annotations

import asyncio
import heapq
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from host_rig import MemoryEndpoint, VirtualLoop

from steptwin.drivers.m1486 import sync
from steptwin.drivers.m1486.lines import TALK, talking
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486 import chip as twin
from steptwin.m1486.line import SerialChain
from steptwin.m1486.variants import variant
from steptwin.machine import MICROSECOND, SECOND

T = TypeVar("T")
Direction = Literal["to chip", "to host"]
Kind = Literal["drop", "flip 4", "flip 0", "invert", "double", "insert", "late"]
KINDS: tuple[Kind, ...] = ("drop", "flip 4", "flip 0", "invert", "double", "insert", "late")
LATENCY = 500 * MICROSECOND
LATE_NS = 700 * 1_000_000
"""Later than the time-out of an exchange."""
NOISE = 0x13
BAUD = 4800


@dataclass
class Fault:
    """Once: what happens to character ``index`` of those that go in a direction from now on."""

    direction: Direction
    index: int
    kind: Kind
    met: bool = False

    def of(self, byte: int) -> bytes:
        match self.kind:
            case "drop":
                return b""
            case "double":
                return bytes((byte, byte))
            case "insert":
                return bytes((NOISE, byte))
            case "invert":
                return bytes((~byte & 0xFF,))
            case "flip 4":
                return bytes((byte ^ 0x10,))
            case "flip 0":
                return bytes((byte ^ 0x01,))
            case _:
                return bytes((byte,))


class ChipWire:
    """Chips in virtual time and the characters on their way to and from them."""

    def __init__(self, kind: str = "B", addresses: tuple[int, ...] = (15,), *, is_timed: bool = True, **options: Any) -> None:
        self.now = 1000 * SECOND
        self.chips = {
            address: twin.M1486Chip(variant(kind), address=address, is_timed=is_timed, baud=BAUD, **options)
            for address in addresses
        }
        self.chain = SerialChain(self.chips.values())
        self._port = self.chain.port()
        self.happened: list[tuple[int, twin.M1486Event]] = []
        for address, chip in self.chips.items():
            chip.advance(self.now)
            chip.on_event = lambda event, address=address: self.happened.append((address, event))
        self.faults: list[Fault] = []
        self.severed = False
        self.gone: str | None = None
        self.sent: list[tuple[int, bytes]] = []
        self.before_each: Callable[[bytes], None] | None = None
        self.before_read: Callable[[], None] | None = None
        self.opened = 0
        self.unread = b""
        self.passed: dict[Direction, int] = {"to chip": 0, "to host": 0}
        self._events: list[tuple[int, int, Direction, bytes]] = []
        self._count = 0
        self._latest: dict[Direction, int] = {"to chip": 0, "to host": 0}
        self._plans: list[tuple[int, int, Callable[[], None]]] = []

    @property
    def chip(self) -> twin.M1486Chip:
        return next(iter(self.chips.values()))

    def open(self) -> None:
        """A new connection: nothing to be done, the line stays."""

    def at(self, seconds: float, action: Callable[[], None]) -> None:
        """Do something so much later, as a hand at the machine does."""
        self._count += 1
        heapq.heappush(self._plans, (self.now + round(seconds * SECOND), self._count, action))

    # ------------------------------------------------------------------ characters

    def put(self, *faults: Fault) -> None:
        """Put faults on the line; characters are counted from now on."""
        self.passed = {"to chip": 0, "to host": 0}
        self.faults = list(faults)

    def send(self, data: bytes, now: int | None = None) -> None:
        if self.before_each is not None:
            self.before_each(data)
        self.now = max(self.now, self.now if now is None else now)
        self.sent.append((self.now, data))
        self._carry("to chip", data, self.now)

    def _carry(self, direction: Direction, data: bytes, now: int) -> None:
        for byte in data:
            number = self.passed[direction]
            self.passed[direction] += 1
            if self.severed:
                continue
            fault = next((f for f in self.faults if not f.met and (f.direction, f.index) == (direction, number)), None)
            piece, at = bytes((byte,)), now + LATENCY
            if fault is not None:
                fault.met = True
                piece = fault.of(byte)
                if fault.kind == "late":
                    at += LATE_NS
            at = self._latest[direction] = max(at, self._latest[direction])
            if piece:
                self._count += 1
                heapq.heappush(self._events, (at, self._count, direction, piece))

    def inject(self, data: bytes, after: int = 0) -> None:
        """Characters that nobody sent reach the host."""
        self._count += 1
        heapq.heappush(self._events, (self.now + after, self._count, "to host", data))

    def due(self) -> int | None:
        moments = [queue[0][0] for queue in (self._events, self._plans) if queue]
        moments += [due for chip in self.chips.values() if (due := chip.deadline()) is not None]
        return min(moments, default=None)

    def run(self, until: int) -> list[bytes]:
        """Everything until then; returns what arrived at the host, and stops there."""
        while True:
            due = self.due()
            if due is None or due > until:
                self._advance(until)
                return []
            self._advance(max(due, self.now))
            arrived = self._step()
            if arrived:
                return arrived

    def _advance(self, now: int) -> None:
        self.now = max(self.now, now)
        for chip in self.chips.values():
            chip.advance(self.now)

    def _step(self) -> list[bytes]:
        while self._plans and self._plans[0][0] <= self.now:
            heapq.heappop(self._plans)[2]()
        arrived = []
        while self._events and self._events[0][0] <= self.now:
            _, _, direction, data = heapq.heappop(self._events)
            if direction == "to host":
                arrived.append(data)
            else:
                self.chain.receive(data, self.now)
        for _, data in self._port.to_send(self.now):
            self._carry("to host", data, self.now)
        return arrived

    # ------------------------------------------------------------------ time without characters

    def clock(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        end = self.now + round(seconds * SECOND)
        while arrived := self.run(end):
            self.unread += b"".join(arrived)

    def read(self, timeout_s: float) -> bytes:
        if self.unread:
            data, self.unread = self.unread, b""
            return data
        return b"".join(self.run(self.now + round(timeout_s * SECOND)))

    # ------------------------------------------------------------------ what the chips do

    def true(self, address: int | None = None) -> int:
        """Where a motor stands, in minimum microsteps from its place at power-on."""
        return self._one(address).drive.true_u(self.now)

    def moving(self, address: int | None = None) -> bool:
        return self._one(address).drive.is_busy

    def _one(self, address: int | None) -> twin.M1486Chip:
        return self.chip if address is None else self.chips[address]

    def codes(self, address: int | None = None) -> list[str]:
        return [event.code for one, event in self.happened if address in (None, one)]


def chip_line(wire: ChipWire, log: Callable[[str], object] | None = None) -> ThreadLine[ChipRequest, bytes]:
    endpoint: Any = MemoryEndpoint(wire)  # type: ignore[arg-type]
    exchanger, talk = talking(endpoint, BAUD, log)
    line: ThreadLine[ChipRequest, bytes] = ThreadLine(endpoint, exchanger, clock=wire.clock, sleeping=wire.sleep)
    line.notes[TALK] = talk
    return line


def chip_task_line(wire: ChipWire) -> TaskLine[ChipRequest, bytes]:
    endpoint: Any = MemoryEndpoint(wire)  # type: ignore[arg-type]
    exchanger, talk = talking(endpoint, BAUD, None)
    line: TaskLine[ChipRequest, bytes] = TaskLine(endpoint, exchanger)
    line.notes[TALK] = talk
    return line


def chip_driver(wire: ChipWire, address: int | None = None, **options: Any) -> sync.M1486:
    """A blocking driver of a chip on the wire, opened."""
    driver = sync.M1486(chip_line(wire, options.pop("log", None)), address, **options)
    driver.open()
    return driver


def run_in(wire: ChipWire, main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in the time of the wire."""
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(wire.now / SECOND)) as runner:
        return runner.run(main)
