"""Lines of a world: controllers on a serial line or a network, and whoever talks to them.

Each talker has a place on the line of its own. What comes back is fetched by the line as it comes, so that it has its moment.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.m1486.line import SerialChain
from steptwin.machine import Nanos, Port, TalkingPort
from steptwin.mic488.device import Mic488, pause_observer
from steptwin.mic488.vision import Com1Port, uses_vision
from steptwin.state import Plain, Stateful
from steptwin.wire.gateway import Gateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.rtu import BURSTY_GAP_NS, UART_GAP_NS
from steptwin.wire.slave import Device, Direction, RtuSlavePort, SlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits
from steptwin.world.faults import Faults, FaultyPort, FaultyTalkingPort
from steptwin.world.faults import Line as FaultLine
from steptwin.world.kernel import Kernel
from steptwin.world.master import Master
from steptwin.world.trace import Record, Recorder

SCRIPTS = "script"
"""The place of the world's own scripts on every line."""
SILENT_CHARACTERS = 4
"""Between an answer and the next request of a master: Modbus RTU asks for 3.5."""


MOST_RECEIVED = 1 << 16
"""More pieces than these are not kept for a program that does not fetch them: the oldest go."""


class FrameFollower(Protocol):
    """Takes what goes over a line."""

    def frame(self, now: Nanos, place: str, direction: Direction, data: bytes) -> None:
        """A frame, or characters; ``place`` is ``"chips"`` for what M1486 chips send."""
        ...

    def rubbish(self, now: Nanos, place: str, count: int) -> None:
        """Bytes came that belong to no frame."""
        ...


class Place(Stateful):
    """Where one program is connected. ``received`` is what has come and was not fetched, with its moments."""

    __slots__ = ("inner", "kind", "on_output", "port", "received", "rubbish", "talks")
    FIXED: ClassVar[frozenset[str]] = frozenset({"inner", "kind", "on_output", "port", "rubbish", "talks"})

    def __init__(self, kind: str, port: FaultyPort, inner: Any, *, talks: bool) -> None:
        self.kind = kind
        self.port = port
        self.inner = inner
        """The port behind the faults of the line."""
        self.rubbish = 0
        """Bytes that belonged to no frame, as far as that was reported."""
        self.talks = talks
        """Whether the port may send without having been asked."""
        self.received: deque[tuple[Nanos, bytes]] = deque(maxlen=MOST_RECEIVED)
        self.on_output: Callable[[], None] | None = None

    def take(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        """What has come by ``now``."""
        taken = []
        while self.received and self.received[0][0] <= now:
            taken.append(self.received.popleft())
        return taken


class Line(Stateful):
    """Base of the lines; a part of its kernel."""

    __slots__ = ("_busy", "_faults", "_followers", "_kernel", "_record", "name", "places")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_busy", "_faults", "_followers", "_kernel", "_record", "name", "places"})

    kinds: ClassVar[tuple[str, ...]]
    """Kinds of places; the first is that of scripts."""
    fault_kinds: ClassVar[Mapping[str, FaultLine]]

    def __init__(self, kernel: Kernel, name: str, record: Recorder | None, faults: Faults) -> None:
        self._kernel = kernel
        self._record = record
        self._faults = faults
        self.name = name
        self.places: dict[str, Place] = {}
        self._followers: list[FrameFollower] = []
        self._busy: dict[str, Place] = {}
        """Places at which something may come without being asked for, or is due later."""

    # ------------------------------------------------------------------ what kinds of lines have of their own

    def _port(self, place: str, kind: str) -> Port:
        """A port for one more program. Its state is copied by `_port_state`."""
        raise NotImplementedError

    @property
    def units(self) -> tuple[int, ...]:
        raise NotImplementedError

    @property
    def baud(self) -> int:
        """The present rate of the line, bit/s."""
        raise NotImplementedError

    @property
    def is_timed(self) -> bool:
        """Whether characters take the time of a wire."""
        raise NotImplementedError

    # ------------------------------------------------------------------ places

    def connect(self, place: str, kind: str | None = None) -> Place:
        """A place for a program; the same one again for the same name. `Misuse` for a kind the line does not have."""
        found = self.places.get(place)
        if found is not None:
            return found
        kind = self.kinds[0] if kind is None else kind
        if kind not in self.kinds:
            raise Misuse(f"line {self.name!r} takes no connection of kind {kind!r}: permitted are {', '.join(self.kinds)}")
        port = self._port(place, kind)
        if isinstance(port, TalkingPort):
            faulty: FaultyPort = FaultyTalkingPort(
                port, place, self._faults, self.fault_kinds[kind], line_name=self.name, is_read=place != SCRIPTS
            )
            port.on_output = self._kernel.mark
            is_busy = True
        else:
            faulty = FaultyPort(
                port,
                place,
                self._faults,
                self.fault_kinds[kind],
                framed=_framed(port),
                units=self.units,
                line_name=self.name,
            )
            is_busy = False
        found = self.places[place] = Place(kind, faulty, port, talks=is_busy)
        if is_busy:
            self._busy[place] = found
        return found

    def leave(self, place: str) -> None:
        """The program has gone."""
        found = self.places.pop(place, None)
        self._busy.pop(place, None)
        if found is not None:
            found.port.close()

    def _count_rubbish(self, name: str, place: Place, now: Nanos) -> None:
        """Report bytes that belonged to no frame."""
        rubbish = getattr(place.inner, "rubbish", 0)
        if rubbish > place.rubbish:
            for follower in self._followers:
                follower.rubbish(now, name, rubbish - place.rubbish)
        place.rubbish = rubbish

    def exchange(self, place: str, found: Place, data: bytes, now: Nanos) -> bytes:
        """Give bytes of the program at ``place``, which is connected as ``found``; the kernel is at ``now``. Returns what is
        answered at once; what is answered later is in `Place.received` then."""
        answer = found.port.exchange(data, now)
        if place in self._busy or found.port.deadline() is not None:
            self._busy[place] = found
            self._kernel.mark()
        if self._followers:
            self._count_rubbish(place, found, now)
        return answer

    def receive(self, place: str, data: bytes, now: Nanos) -> None:
        """Bytes of the program at ``place``, with all answers in `Place.received`; the kernel is at ``now``."""
        found = self.connect(place)
        answer = self.exchange(place, found, data, now)
        if answer:
            self._came(place, found, [(now, answer)])
        self._kernel.mark()

    def _came(self, place: str, found: Place, pieces: list[tuple[Nanos, bytes]]) -> None:
        found.received.extend(pieces)
        if found.on_output is not None:
            found.on_output()

    # ------------------------------------------------------------------ time

    def look(self, now: Nanos) -> None:
        for name, place in tuple(self._busy.items()):
            pieces = place.port.to_send(now)
            if pieces:
                self._came(name, place, pieces)
            if self._followers:
                self._count_rubbish(name, place, now)
            if not place.talks and place.port.deadline() is None:
                self._busy.pop(name, None)

    def deadline(self) -> Nanos | None:
        dues = [due for place in self._busy.values() if (due := place.port.deadline()) is not None]
        return min(dues, default=None)

    def stop_recording(self) -> None:
        """Record no frames from now on."""
        self._record = None

    def _tell(self, now: Nanos, place: str, direction: Direction, data: bytes) -> None:
        if self._record is not None:
            self._record(Record(now, self.name, "frame", f"{place}/{direction.value}", data))
        for follower in self._followers:
            follower.frame(now, place, direction, data)

    def follow_frames(self, follower: FrameFollower) -> None:
        """Call ``follower`` with every frame; what a port carries that is there already is not followed, but for the scripts'."""
        self._followers.append(follower)

    @property
    def _is_followed(self) -> bool:
        return self._record is not None or bool(self._followers)

    # ------------------------------------------------------------------ snapshots

    def copy_state(self) -> Plain:
        places = tuple(
            (name, place.kind, place.copy_state(), place.port.copy_state(), self._port_state(place))
            for name, place in self.places.items()
        )
        return super().copy_state(), places

    def set_state(self, plain: Plain) -> None:
        own, places = plain
        super().set_state(own)
        kept = {name for name, *_ in places}
        for name in [name for name in self.places if name not in kept]:
            self.leave(name)
        for name, kind, state, faulty, port_state in places:
            place = self.connect(name, kind)
            place.set_state(state)
            place.port.set_state(faulty)
            self._set_port_state(place, port_state)
        self._busy = dict(self.places)

    def _port_state(self, place: Place) -> Plain:
        return place.inner.copy_state()

    def _set_port_state(self, place: Place, state: Plain) -> None:
        place.inner.set_state(state)


class ModbusLine(Line):
    """Controllers with different units on one line. With ``timing`` requests take the time of a wire and of the controllers."""

    __slots__ = ("_baud", "_gap", "_seeing", "_timed", "devices", "master", "served")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_baud", "_gap", "_seeing", "devices", "served"}) | Line.FIXED

    kinds = ("rtu", "serial", "tcp")
    """``serial``: a real serial port, on which characters take their time whatever the line timing is."""
    fault_kinds: ClassVar[Mapping[str, FaultLine]] = {"rtu": FaultLine.RTU, "serial": FaultLine.RTU, "tcp": FaultLine.TCP}

    def __init__(
        self,
        kernel: Kernel,
        name: str,
        record: Recorder | None,
        faults: Faults,
        *,
        devices: Mapping[int, Mic488],
        timing: LineTiming | None,
        baud: int = 38400,
        gap: Nanos | None = None,
    ) -> None:
        super().__init__(kernel, name, record, faults)
        self.devices = devices
        self.served: Mapping[int, Device] = devices
        """What executes the requests of programs outside without line timing; ports that are made from now on use it."""
        self._baud = baud
        self._gap = gap
        # WBC-15: a vision system belongs to one controller; without its registers in a program it costs nothing.
        device = next(iter(devices.values()))
        sees = len(devices) == 1 and any(map(uses_vision, device.program.programs.values()))
        self._seeing = device if sees else None
        self._timed: tuple[TimedUnits, Gateway] | None = None
        if timing is not None:
            units = TimedUnits(devices, timing)
            self._timed = units, Gateway(units)
        self.master = Master(self._ask, 0 if timing is None else timing.line.duration(SILENT_CHARACTERS))
        """Sends the requests of scripts."""

    def _ask(self, frame: bytes, now: Nanos) -> None:
        self.receive(SCRIPTS, frame, now)

    def _came(self, place: str, found: Place, pieces: list[tuple[Nanos, bytes]]) -> None:
        if place == SCRIPTS:
            self.master.answered(b"".join(data for _, data in pieces), pieces[-1][0])
        else:
            super()._came(place, found, pieces)

    def look(self, now: Nanos) -> None:
        super().look(now)
        self.master.look(now)

    def deadline(self) -> Nanos | None:
        own, masters = super().deadline(), self.master.deadline()
        return own if masters is None else masters if own is None else min(own, masters)

    @property
    def units(self) -> tuple[int, ...]:
        return tuple(self.devices)

    def _port(self, place: str, kind: str) -> Port:
        def tell(now: Nanos, direction: Direction, data: bytes) -> None:
            self._tell(now, place, direction, data)

        observe = tell if self._is_followed else None
        if self._timed is None and kind == "tcp":
            return TcpSlavePort(self.served, on_frame=observe)
        if self._timed is not None and kind == "tcp":
            return TcpGatewayPort(self._timed[1], on_frame=observe)
        if self._timed is not None and place == SCRIPTS:
            return ScriptPort(self._timed[1], on_frame=observe)
        usual = UART_GAP_NS if kind == "serial" else BURSTY_GAP_NS
        gap = usual if self._gap is None else self._gap
        on_pause = pause_observer(self.devices)
        port: RtuSlavePort | TimedRtuSlavePort
        if self._timed is not None:
            port = TimedRtuSlavePort(self._timed[0], gap_ns=gap, on_frame=observe, on_pause=on_pause)
        else:
            devices = self.devices if place == SCRIPTS else self.served
            wire = SerialLine(self._baud) if kind == "serial" else None
            port = RtuSlavePort(devices, gap_ns=gap, line=wire, on_frame=observe, on_pause=on_pause)
        return port if self._seeing is None or place == SCRIPTS else Com1Port(self._seeing, port)

    @property
    def baud(self) -> int:
        return self._baud

    @property
    def is_timed(self) -> bool:
        return self._timed is not None


class ChipLine(Line):
    """M1486 chips on one serial line. All hear everybody, and everybody hears all chips."""

    __slots__ = ("chain",)
    FIXED: ClassVar[frozenset[str]] = Line.FIXED

    kinds = ("raw",)
    fault_kinds: ClassVar[Mapping[str, FaultLine]] = {"raw": FaultLine.CHARACTERS}

    def __init__(self, kernel: Kernel, name: str, record: Recorder | None, faults: Faults, chips: list[M1486]) -> None:
        super().__init__(kernel, name, record, faults)
        self.chain = SerialChain(chips)
        self.connect(SCRIPTS)

    @property
    def units(self) -> tuple[int, ...]:
        return ()

    @property
    def baud(self) -> int:
        return next(iter(self.chain.chips.values())).uart.baud

    @property
    def is_timed(self) -> bool:
        return next(iter(self.chain.chips.values())).is_timed

    def _port(self, place: str, kind: str) -> Port:
        return self.chain.port()

    def exchange(self, place: str, found: Place, data: bytes, now: Nanos) -> bytes:
        self._tell(now, place, Direction.IN, data)
        return super().exchange(place, found, data, now)

    def _came(self, place: str, found: Place, pieces: list[tuple[Nanos, bytes]]) -> None:
        if place == SCRIPTS:  # output is recorded here; scripts do not read it
            for moment, data in pieces:
                self._tell(moment, "chips", Direction.OUT, data)
        else:
            super()._came(place, found, pieces)

    def _port_state(self, place: Place) -> Plain:
        return self.chain.copy_state(), tuple(place.inner.pending)

    def _set_port_state(self, place: Place, state: Plain) -> None:
        chain, pending = state
        self.chain.set_state(chain)
        place.inner.pending = list(pending)


def timing_of(baud: int, *, strict: bool) -> LineTiming:
    return LineTiming(SerialLine(baud), strict=strict)


def _framed(port: Port) -> SlavePort | None:
    """What reports frames in a port of a line."""
    inner = port.modbus if isinstance(port, Com1Port) else port
    return inner if isinstance(inner, SlavePort) else None
