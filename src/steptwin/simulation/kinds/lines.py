"""Lines of a world: controllers on a serial line or a network, and the programs connected to them.

Each program is a client of the line with its own end point. Responses are collected at the moment they arrive, so that each has
its time.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, ClassVar, NamedTuple, Protocol

from steptwin.controller import Nanos, Port, sends_by_itself
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.faults import Faults, FaultyPort, FaultySendingPort
from steptwin.simulation.faults import LineProtocol as FaultLine
from steptwin.simulation.kinds.master import Master
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.state import Plain, Stateful
from steptwin.wire.slave import FrameCallback, FrameDirection, SlaveDevice, SlavePort

SCRIPTS = "script"
"""The name on each line of the client that the world's own scripts are."""

MOST_RECEIVED = 1 << 16
"""Limit of received pieces kept for a program that does not fetch them; the oldest are dropped."""


class FrameSubscriber(Protocol):
    """Observes the traffic of a line."""

    def frame(self, now: Nanos, client: str, direction: FrameDirection, data: bytes) -> None:
        """Take a frame, or characters; ``client`` is ``"chips"`` for characters that M1486 chips send."""
        ...

    def unframed(self, now: Nanos, client: str, count: int) -> None:
        """Take the number of bytes that belong to no frame."""
        ...


class LineTraffic(NamedTuple):
    """Numbers of what the programs on a line have sent since the beginning; no state, so a restore leaves them."""

    requests: int = 0
    errors: int = 0
    """Answers with an exception, and requests lost because the controller was busy; of characters, those lost on the wire."""
    unframed: int = 0
    """Bytes that belonged to no frame."""

    def plus(self, other: LineTraffic) -> LineTraffic:
        return LineTraffic(self.requests + other.requests, self.errors + other.errors, self.unframed + other.unframed)


class LineWrite(NamedTuple):
    """Request of a program that is no read. ``units``: the controllers that it addresses; empty where that is not known.

    ``outcome``: ``done``, ``refusal``; empty where there is no answer.
    """

    time: Nanos
    client: str
    units: tuple[int, ...]
    words: str
    outcome: str


class TrafficLog(FrameSubscriber, Protocol):
    """Decodes the traffic of a line into text."""

    def recorded(self, record: TraceRecord) -> None:
        """Take a trace record of a controller on the line."""
        ...

    def changes(self, client: str, data: bytes) -> Collection[int]:
        """The addresses of the controllers that a request or characters of a program may change."""
        ...

    def selects(self, data: bytes) -> bool:
        """Whether characters choose the controllers that listen to those after them."""
        ...

    def refusal(self, client: str, data: bytes) -> str | None:
        """The reason that an answer gives for a request that was refused; None for another answer."""
        ...


class LineEndPoint(Stateful):
    """The connection of one program. ``received``: pieces not fetched yet, with their moments."""

    FIXED: ClassVar[tuple[str, ...]] = (
        "framed",
        "inner",
        "is_connected",
        "kind",
        "on_output",
        "port",
        "talks",
        "unframed",
    )
    __slots__ = (*FIXED, "received")

    def __init__(self, kind: str, port: FaultyPort, inner: Any, framed: SlavePort | None, *, talks: bool) -> None:
        self.kind = kind
        self.port = port
        self.inner = inner
        """The port without the faults of the line."""
        self.framed = framed
        """The port that reports Modbus frames."""
        self.unframed = 0
        """Number of reported bytes that belonged to no frame."""
        self.is_connected = True
        """False after the program has disconnected."""
        self.talks = talks
        """Whether the port may send without a request."""
        self.received: deque[tuple[Nanos, bytes]] = deque(maxlen=MOST_RECEIVED)
        self.on_output: Callable[[], None] | None = None

    def take(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        """Remove and return the pieces received by ``now``."""
        taken = []
        while self.received and self.received[0][0] <= now:
            taken.append(self.received.popleft())
        return taken


LINE_CARRIES_NO_MODBUS = Message(
    "simulation.line-carries-no-modbus", "line {name!r} carries no Modbus: requests need a line of kind modbus"
)
OTHER_KIND_OF_CONNECTION = Message(
    "simulation.other-kind-of-connection", "line {name!r} takes no connection of kind {kind!r}: permitted are {names}"
)


class Line(Stateful, ABC):
    """Base class of lines; a part of its scheduler."""

    FIXED: ClassVar[tuple[str, ...]] = ("_before", "_busy", "_faults", "_subscribers", "_scheduler", "_record", "name", "clients")
    __slots__ = (*FIXED,)

    kinds: ClassVar[tuple[str, ...]]
    """Kinds of clients; the first is that of scripts."""
    fault_kinds: ClassVar[Mapping[str, FaultLine]]
    is_shared: ClassVar[bool] = False
    """Whether every program on it receives all that is sent, requested or not."""

    def __init__(self, scheduler: Scheduler, name: str, record: RecordSink | None, faults: Faults) -> None:
        self._scheduler = scheduler
        self._record = record
        self._faults = faults
        self.name = name
        self.clients: dict[str, LineEndPoint] = {}
        self._subscribers: list[FrameSubscriber] = []
        self._before = LineTraffic()
        """Traffic of programs that have disconnected."""
        self._busy: dict[str, LineEndPoint] = {}
        """Clients that may send without a request, or later."""

    # ------------------------------------------------------------------ implemented by kinds of lines

    @abstractmethod
    def _port(self, client: str, kind: str) -> Port:
        """A new port for a program. Its state is copied by `_port_state`."""

    def _framed(self, port: Any) -> SlavePort | None:
        """The port that reports Modbus frames, for a port made by `_port`."""
        return None

    @property
    def master(self) -> Master:
        """Sends the Modbus requests of scripts. Raises `Misuse` for a line without Modbus."""
        raise Misuse(LINE_CARRIES_NO_MODBUS(name=self.name))

    def recall(self, unit: int, now: Nanos) -> None:
        """Drop what scripts have asked of the controller with an address and is not executed yet."""

    def serve_by(self, served: Callable[[Mapping[int, SlaveDevice]], Mapping[int, SlaveDevice]]) -> None:
        """Replace the devices that execute external Modbus requests: ``served`` maps those by unit to their wrappers."""

    @property
    @abstractmethod
    def units(self) -> tuple[int, ...]:
        """The addresses of its controllers."""

    @property
    @abstractmethod
    def baud(self) -> int:
        """The present rate of the line, bit/s."""

    @property
    @abstractmethod
    def is_timed(self) -> bool:
        """Whether characters take transmission time."""

    # ------------------------------------------------------------------ clients

    def connect(self, client: str, kind: str | None = None) -> LineEndPoint:
        """The end point of a client, made on first use. Raises `Misuse` for a kind the line does not have."""
        found = self.clients.get(client)
        if found is not None:
            return found
        kind = self.kinds[0] if kind is None else kind
        if kind not in self.kinds:
            raise Misuse(OTHER_KIND_OF_CONNECTION(name=self.name, kind=kind, names=list(self.kinds)))
        port = self._port(client, kind)
        framed = self._framed(port)
        if sends_by_itself(port):
            faulty: FaultyPort = FaultySendingPort(
                port, client, self._faults, self.fault_kinds[kind], line_name=self.name, is_read=client != SCRIPTS
            )
            port.on_output = partial(self._scheduler.notify, self.name)
            is_busy = True
        else:
            faulty = FaultyPort(
                port,
                client,
                self._faults,
                self.fault_kinds[kind],
                framed=framed,
                units=self.units,
                line_name=self.name,
            )
            is_busy = False
        found = self.clients[client] = LineEndPoint(kind, faulty, port, framed, talks=is_busy)
        if is_busy:
            self._busy[client] = found
        return found

    def leave(self, client: str) -> None:
        """Remove the end point of a client that has disconnected."""
        found = self.clients.pop(client, None)
        self._busy.pop(client, None)
        if found is not None:
            found.is_connected = False
            self._before = self._before.plus(self._traffic_of(found))
            found.port.close()

    @property
    def traffic(self) -> LineTraffic:
        """Traffic of all programs, scripts included."""
        traffic = self._before
        for client in self.clients.values():
            traffic = traffic.plus(self._traffic_of(client))
        return traffic

    def _traffic_of(self, client: LineEndPoint) -> LineTraffic:
        framed = client.framed
        if framed is None:
            return LineTraffic()
        return LineTraffic(framed.requests, framed.exceptions + framed.lost, framed.unframed)

    def _count_unframed(self, name: str, client: LineEndPoint, now: Nanos) -> None:
        """Report bytes that belonged to no frame."""
        if client.framed is None:
            return
        unframed = client.framed.unframed
        if unframed > client.unframed:
            for subscriber in self._subscribers:
                subscriber.unframed(now, name, unframed - client.unframed)
        client.unframed = unframed

    def exchange(self, client: str, found: LineEndPoint, data: bytes, now: Nanos) -> bytes:
        """Take bytes of ``client``, connected as ``found``; the scheduler is at ``now``. Returns the immediate
        answer; later answers go to `LineEndPoint.received`."""
        answer = found.port.exchange(data, now)
        if client in self._busy or found.port.deadline() is not None:
            self._busy[client] = found
            self._scheduler.notify(self.name)
        if self._scheduler.is_step_exact or self._scheduler.hears_requests:
            self._scheduler.notify()
        if self._subscribers:
            self._count_unframed(client, found, now)
        return answer

    def is_idle_read(self, client: LineEndPoint, data: bytes) -> bool:
        """Whether bytes of a program are a read without side effects, which need not be recorded for a replay."""
        return False

    def exchange_unrecorded(self, client: str, found: LineEndPoint, data: bytes, now: Nanos) -> bytes:
        """As `exchange`; subscribers see the frames, the trace does not."""
        record, self._record = self._record, None
        try:
            return self.exchange(client, found, data, now)
        finally:
            self._record = record

    def receive(self, client: str, data: bytes, now: Nanos) -> None:
        """Take bytes of ``client``; all answers go to `LineEndPoint.received`. The scheduler is at ``now``."""
        found = self.clients.get(client) or self.connect(client)
        answer = self.exchange(client, found, data, now)
        if answer:
            self._came(client, found, [(now, answer)])

    def _came(self, client: str, found: LineEndPoint, pieces: list[tuple[Nanos, bytes]]) -> None:
        found.received.extend(pieces)
        if found.on_output is not None:
            found.on_output()

    # ------------------------------------------------------------------ time

    def update(self, now: Nanos) -> None:
        for name, client in tuple(self._busy.items()):
            pieces = client.port.to_send(now)
            if pieces:
                self._came(name, client, pieces)
            if self._subscribers:
                self._count_unframed(name, client, now)
            if not client.talks and client.port.deadline() is None:
                self._busy.pop(name, None)

    def deadline(self) -> Nanos | None:
        if not self._busy:
            return None
        deadlines = [due for client in self._busy.values() if (due := client.port.deadline()) is not None]
        return min(deadlines, default=None)

    def stop_recording(self) -> None:
        """Record no frames from now on."""
        self._record = None

    def _report(self, client: str, now: Nanos, direction: FrameDirection, data: bytes) -> None:
        if self._record is not None:
            self._record(TraceRecord(now, self.name, "frame", f"{client}/{direction.value}", data))
        for subscriber in self._subscribers:
            subscriber.frame(now, client, direction, data)

    def subscribe_to_frames(self, subscriber: FrameSubscriber) -> None:
        """Call ``subscriber`` with every frame from now on."""
        self._subscribers.append(subscriber)
        self._watch_ports()

    def unsubscribe_from_frames(self, subscriber: FrameSubscriber) -> None:
        """Stop calling ``subscriber``."""
        self._subscribers.remove(subscriber)
        self._watch_ports()

    def _watch_ports(self) -> None:
        for name, client in self.clients.items():
            client.port.call_with_frames(self._frame_callback(name))

    def _frame_callback(self, client: str) -> FrameCallback | None:
        """The callback of frames for the port of ``client``; None if frames are not observed, or the line has none."""

        return None

    @property
    def _has_subscribers(self) -> bool:
        return self._record is not None or bool(self._subscribers)

    # ------------------------------------------------------------------ snapshots

    def copy_state(self) -> Plain:
        clients = tuple(
            (name, client.kind, client.copy_state(), client.port.copy_state(), self._port_state(client))
            for name, client in self.clients.items()
        )
        return super().copy_state(), clients, tuple(self._busy)

    def set_state(self, plain: Plain) -> None:
        own, clients, busy = plain
        kept = {name for name, *_ in clients}
        for name in [name for name in self.clients if name not in kept]:
            self.leave(name)
        for name, kind, state, faulty, port_state in clients:
            client = self.connect(name, kind)
            client.set_state(state)
            client.port.set_state(faulty)
            self._set_port_state(client, port_state)
        super().set_state(own)  # at last: who connects may collect what is on the wire
        self._busy = {name: self.clients[name] for name in busy}  # in their order, which is that of simultaneous answers

    def _port_state(self, client: LineEndPoint) -> Plain:
        return client.inner.copy_state()

    def _set_port_state(self, client: LineEndPoint, state: Plain) -> None:
        client.inner.set_state(state)
