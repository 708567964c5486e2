"""Twins at the other end of a wire in virtual time, for tests of drivers: nothing waits, and any byte can go wrong.

`Wire` carries bytes between a master and the twin. `Fault`s are put on it by direction and number of the byte. A `VirtualLoop`
runs asyncio in the wire's time; `thread_line` gives a line for blocking drivers in the same time.
"""

from __future__ import annotations

import asyncio
import heapq
import selectors
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from steptwin.drivers import AsyncMic488, Mic488
from steptwin.drivers.exchange import Exchanger, LineLost
from steptwin.drivers.mic488.frames import FrameWords
from steptwin.drivers.modbus import Query, RtuMaster, TcpMaster
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.threads import ThreadLine
from steptwin.machine import MICROSECOND, MILLISECOND, SECOND
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort

T = TypeVar("T")
Direction = Literal["to twin", "to master"]
Kind = Literal["drop", "corrupt", "duplicate", "late", "too late", "much too late", "cut"]
KINDS: tuple[Kind, ...] = ("drop", "corrupt", "duplicate", "late", "too late", "much too late", "cut")

LATENCY = 500 * MICROSECOND
LATE = {"late": 60 * MILLISECOND, "too late": 350 * MILLISECOND, "much too late": 700 * MILLISECOND}
"""Within the time-out of an exchange, after it, and after the first repetition too."""
SPACING = 1 * MILLISECOND
"""What waited on the way comes one after the other."""


GEAR = 100.0
KL_P, KR_P = -1000, 25000
"""Pulses per mm, and where the switches of each axis are."""


def spindles() -> ControllerConfig:
    """Four axes in mm with a switch at each end: KL on IN1 to IN4, KR on IN5 to IN8; homing backs off the switch (HOME1)."""
    return ControllerConfig(
        axes=tuple(
            AxisConfig(unit=3, gear=GEAR, acc=50.0, dec=50.0, vel=25.0, home_mode=1, limit_mode=3, in_kl=axis, in_kr=axis + 4)
            for axis in range(4)
        )
    )


@dataclass
class Fault:
    """Once: what happens to byte ``index`` of those sent in a direction from now on.

    ``late`` holds up the byte and all behind it, for bytes do not overtake each other; ``cut`` loses the rest of the burst.
    """

    direction: Direction
    index: int
    kind: Kind
    met: bool = False


class Wire:
    """A twin in virtual time and the bytes on their way to and from it."""

    def __init__(
        self,
        *,
        tcp: bool = False,
        config: ControllerConfig | None = None,
        firmware: str = "1.70",
        units: tuple[int, ...] = (1,),
        switches: bool = True,
        lenient: bool = False,
        latency: int = LATENCY,
        real_line: bool = False,
    ) -> None:
        self.now = 1000 * SECOND
        self.tcp = tcp
        self.latency = latency
        self.config = config or spindles()
        self.twins = {unit: Mic488Device(self.config, firmware, lenient=lenient) for unit in units}
        self._switches = [(axis, high) for axis in range(4) for high in (False, True)] if switches else []
        for twin in self.twins.values():
            twin.advance(self.now)
        self._ports: list[Any] = []
        self.open()
        self.faults: list[Fault] = []
        self.severed = False
        """Whether the line is cut: nothing arrives anywhere, and nobody notices but by silence."""
        self.gone: str | None = None
        """Why the port is gone, which its owner notices."""
        self.sent: list[tuple[int, bytes]] = []
        """What the master sent, with its moment."""
        self.before_each: Callable[[bytes], None] | None = None
        self.before_read: Callable[[], None] | None = None
        """Called when a frame is sent, and when a thread waits for bytes."""
        self._events: list[tuple[int, int, Direction, bytes]] = []
        self._count = 0
        self._passed = {"to twin": 0, "to master": 0}
        self._latest = {"to twin": 0, "to master": 0}
        self.unread = b""
        self.opened = 0

    @property
    def twin(self) -> Mic488Device:
        return next(iter(self.twins.values()))

    def open(self) -> None:
        self._port = TcpSlavePort(self.twins) if self.tcp else RtuSlavePort(self.twins)

    # ------------------------------------------------------------------ bytes

    def put(self, *faults: Fault) -> None:
        """Put faults on the line; bytes are counted from now on."""
        self._passed = {"to twin": 0, "to master": 0}
        self.faults = list(faults)

    def send(self, data: bytes, now: int | None = None) -> None:
        """The master sends."""
        if self.before_each is not None:
            self.before_each(data)
        self.now = max(self.now, self.now if now is None else now)
        self.sent.append((self.now, data))
        self._carry("to twin", data)

    def _carry(self, direction: Direction, data: bytes) -> None:
        if self.severed:
            return
        pieces: list[tuple[int, bytes]] = []
        at, kept = max(self.now + self.latency, self._latest[direction] + SPACING), b""
        begin = self._passed[direction]
        if not any(f.direction == direction and begin <= f.index < begin + len(data) and not f.met for f in self.faults):
            self._passed[direction] += len(data)
            kept, data = data, b""
        for byte in data:
            number = self._passed[direction]
            self._passed[direction] += 1
            fault = next((f for f in self.faults if not f.met and f.direction == direction and f.index == number), None)
            piece = bytes((byte,))
            if fault is not None:
                fault.met = True
                if fault.kind == "cut":
                    break
                if fault.kind in LATE:
                    pieces.append((at, kept))
                    at, kept = at + LATE[fault.kind], b""
                elif fault.kind == "drop":
                    piece = b""
                elif fault.kind == "duplicate":
                    piece *= 2
                else:
                    piece = bytes((byte ^ 0x10,))
            kept += piece
        self._latest[direction] = at
        for moment, part in [*pieces, (at, kept)]:
            if part:
                self._count += 1
                heapq.heappush(self._events, (moment, self._count, direction, part))

    def inject(self, data: bytes, after: int = 0) -> None:
        """Bytes that nobody sent reach the master."""
        self._count += 1
        heapq.heappush(self._events, (self.now + after, self._count, "to master", data))

    def due(self) -> int | None:
        """When the next bytes arrive somewhere, or the port has something to say."""
        moments = [self._events[0][0]] if self._events else []
        port = self._port.deadline()
        if port is not None:
            moments.append(port)
        return min(moments, default=None)

    def run(self, until: int) -> list[bytes]:
        """Everything until then; returns what arrived at the master, and stops there."""
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
        for twin in self.twins.values():
            while (due := self._next_event(twin)) is not None and due <= self.now:
                twin.advance(due)
                self._set_switches(twin)
            twin.advance(self.now)

    def _next_event(self, twin: Mic488Device) -> int | None:
        dues = [twin.deadline()]
        for axis, high in self._switches:
            profile = twin.axes[axis].profile
            if profile.moving(twin.now):
                edges = (KR_P - 1, KR_P) if high else (KL_P, KL_P + 1)
                dues += [profile.pulse_time(edge, twin.now) for edge in edges]
        return min((due for due in dues if due is not None), default=None)

    def _set_switches(self, twin: Mic488Device) -> None:
        for axis, high in self._switches:
            count = twin.axes[axis].profile.count(twin.now)
            twin.set_pin(f"IN{axis + 1 + 4 * high}", float(count >= KR_P if high else count <= KL_P), twin.now)

    def _step(self) -> list[bytes]:
        arrived = []
        while self._events and self._events[0][0] <= self.now:
            _, _, direction, data = heapq.heappop(self._events)
            if direction == "to master":
                arrived.append(data)
            elif not self.severed:
                self._answer(self._port.exchange(data, self.now))
        for _, data in self._port.to_send(self.now):
            self._answer(data)
        return arrived

    def _answer(self, data: bytes) -> None:
        if data:
            self._carry("to master", data)

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

    # ------------------------------------------------------------------ what the twin does

    def position(self, axis: int = 1) -> int:
        """Counted position in pulses."""
        return self.twin.axes[axis - 1].coordinate_p(self.now)

    def moving(self, axis: int = 1) -> bool:
        return self.twin.axes[axis - 1].profile.moving(self.now)

    def rest(self, seconds: float = 1000.0) -> None:
        """Until nothing moves by itself any more."""
        self.sleep(seconds)


# ---------------------------------------------------------------------- lines for threads


class MemoryChannel:
    def __init__(self, wire: Wire) -> None:
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
    def __init__(self, wire: Wire, loop: asyncio.AbstractEventLoop, protocol: asyncio.Protocol) -> None:
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
    def __init__(self, wire: Wire) -> None:
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


INTERVAL = 10 * MILLISECOND


def _exchanger(wire: Wire, interval: int, log: list[str] | None) -> tuple[Exchanger[Query, bytes], dict[str, object]]:
    notes: dict[str, object] = {"tcp": wire.tcp}
    observer = None
    if log is not None:
        frames = FrameWords(tcp=wire.tcp)
        frames.sinks.append(lambda heard: log.append(f"{heard.direction.value if heard.direction else '?'} {heard.meaning}"))
        notes["frames"] = frames
        observer = frames.observe
    discipline = TcpMaster("memory", on_frame=observer) if wire.tcp else RtuMaster(on_frame=observer)
    return Exchanger(discipline, "memory", interval), notes


def thread_line(wire: Wire, *, interval: int = INTERVAL, log: list[str] | None = None) -> ThreadLine[Query, bytes]:
    exchanger, notes = _exchanger(wire, interval, log)
    line = ThreadLine(MemoryEndpoint(wire), exchanger, clock=wire.clock, sleeping=wire.sleep)
    line.notes.update(notes)
    return line


def task_line(wire: Wire, *, interval: int = INTERVAL, log: list[str] | None = None) -> TaskLine[Query, bytes]:
    exchanger, notes = _exchanger(wire, interval, log)
    line = TaskLine(MemoryEndpoint(wire), exchanger)
    line.notes.update(notes)
    return line


def driver(wire: Wire, unit: int = 1, *, log: list[str] | None = None, **options: Any) -> Mic488:
    """A blocking driver of a twin on the wire, opened, that knows its configuration."""
    options.setdefault("config", wire.config)
    options.setdefault("firmware", wire.twin.firmware.name)
    mic = Mic488(thread_line(wire, log=log), unit, **options)
    mic.open()
    return mic


# ---------------------------------------------------------------------- asyncio in virtual time


class _VirtualSelector(selectors.DefaultSelector):
    loop: VirtualLoop

    def select(self, timeout: float | None = None) -> list[Any]:
        found = super().select(0)
        if not found and timeout is None:
            raise RuntimeError("nothing will ever happen in this loop any more")
        if not found and timeout:
            self.loop.elapsed += timeout
        return found


class VirtualLoop(asyncio.SelectorEventLoop):
    """Sleeps take no time; the clock jumps to the next timer."""

    def __init__(self, start: float) -> None:
        selector = _VirtualSelector()
        selector.loop = self
        self.elapsed = start
        super().__init__(selector)

    def time(self) -> float:
        return self.elapsed


def run_virtual(wire: Wire, main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in the time of the wire."""
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(wire.now / SECOND)) as runner:
        return runner.run(main)


def async_driver(line: TaskLine[Query, bytes], wire: Wire, unit: int = 1, **options: Any) -> AsyncMic488:
    options.setdefault("config", wire.config)
    options.setdefault("firmware", wire.twin.firmware.name)
    return AsyncMic488(line, unit, **options)
