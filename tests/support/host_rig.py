"""MIC488 twins at the other end of a line in virtual time, for tests of drivers (`line_rig`).

`Wire` carries bytes between a master and the twins, `Fault`s are put on it by direction and number of the byte; `thread_line` and
`task_line` are lines in its time for threads and tasks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from line_rig import LATENCY, MemoryChannel, MemoryEndpoint, MemoryTransport, VirtualWire, run_virtual

from steptwin.controller import MILLISECOND
from steptwin.drivers import AsyncMic488, Mic488
from steptwin.drivers.exchange import Exchanger
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.modbus import ModbusQuery, RtuMaster, TcpMaster
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.threads import ThreadLine
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort

__all__ = [
    "GEAR", "INTERVAL", "KINDS", "KL_P", "KR_P", "LATE", "Direction", "Fault", "Kind", "MemoryChannel", "MemoryEndpoint",
    "MemoryTransport", "Wire", "async_driver", "driver", "run_virtual", "spindles", "task_line", "thread_line",
]  # fmt: skip

Direction = Literal["to twin", "to master"]
Kind = Literal["drop", "corrupt", "duplicate", "late", "too late", "much too late", "cut"]
KINDS: tuple[Kind, ...] = ("drop", "corrupt", "duplicate", "late", "too late", "much too late", "cut")

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


class Wire(VirtualWire):
    """MIC488 twins on a line."""

    there, back = "to twin", "to master"

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
    ) -> None:
        super().__init__()
        self.tcp = tcp
        self.latency = latency
        self.config = config or spindles()
        self.twins = {unit: Mic488Device(self.config, firmware, lenient=lenient) for unit in units}
        self._switches = [(axis, high) for axis in range(4) for high in (False, True)] if switches else []
        for twin in self.twins.values():
            twin.advance(self.now)
        self._port: TcpSlavePort | RtuSlavePort
        self.open()
        self.faults: list[Fault] = []

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

    def _carry(self, direction: str, data: bytes, now: int) -> None:
        if self.severed:
            return
        pieces: list[tuple[int, bytes]] = []
        at, kept = max(now + self.latency, self._latest[direction] + SPACING), b""
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
            self._arrive(direction, part, moment)

    def _receive(self, data: bytes) -> bytes:
        return self._port.exchange(data, self.now)

    def _spoken(self) -> bytes:
        return b"".join(data for _, data in self._port.to_send(self.now))

    def _deadline(self) -> int | None:
        return self._port.deadline()

    def _advance(self, now: int) -> None:
        self.now = max(self.now, now)
        for twin in self.twins.values():
            while (due := self._next_event(twin)) is not None and due <= self.now:
                twin.advance(due)
                self._set_switches(twin)
            twin.advance(self.now)

    def _next_event(self, twin: Mic488Device) -> int | None:
        deadlines = [twin.deadline()]
        for axis, high in self._switches:
            profile = twin.axes[axis].profile
            if profile.moving(twin.now):
                edges = (KR_P - 1, KR_P) if high else (KL_P, KL_P + 1)
                deadlines += [profile.pulse_time(edge, twin.now) for edge in edges]
        return min((due for due in deadlines if due is not None), default=None)

    def _set_switches(self, twin: Mic488Device) -> None:
        for axis, high in self._switches:
            count = twin.axes[axis].profile.count(twin.now)
            twin.set_pin(f"IN{axis + 1 + 4 * high}", float(count >= KR_P if high else count <= KL_P), twin.now)

    # ------------------------------------------------------------------ what the twin does

    def position(self, axis: int = 1) -> int:
        """Counted position in pulses."""
        return self.twin.axes[axis - 1].coordinate_p(self.now)

    def moving(self, axis: int = 1) -> bool:
        return self.twin.axes[axis - 1].profile.moving(self.now)

    def rest(self, seconds: float = 1000.0) -> None:
        """Until nothing moves by itself any more."""
        self.sleep(seconds)


INTERVAL = 10 * MILLISECOND
TIMEOUT = 300 * MILLISECOND


def fill(wire: Wire) -> None:
    """Write its own number into each user register."""
    for number in range(500):
        wire.twin.user[number] = number


def _exchanger(wire: Wire, interval: int, log: list[str] | None) -> tuple[Exchanger[ModbusQuery, bytes], dict[str, object]]:
    shared: dict[str, object] = {"tcp": wire.tcp}
    observer = None
    if log is not None:
        frames = FrameLog(tcp=wire.tcp)
        frames.sinks.append(lambda frame: log.append(f"{frame.direction.value if frame.direction else '?'} {frame.meaning}"))
        shared["frames"] = frames
        observer = frames.observe
    discipline = TcpMaster("memory", on_frame=observer) if wire.tcp else RtuMaster(on_frame=observer)
    return Exchanger(discipline, "memory", interval), shared


def thread_line(wire: Wire, *, interval: int = INTERVAL, log: list[str] | None = None) -> ThreadLine[ModbusQuery, bytes]:
    exchanger, shared = _exchanger(wire, interval, log)
    line = ThreadLine(MemoryEndpoint(wire), exchanger, clock=wire.clock, sleeping=wire.sleep)
    line.shared.update(shared)
    return line


def task_line(wire: Wire, *, interval: int = INTERVAL, log: list[str] | None = None) -> TaskLine[ModbusQuery, bytes]:
    exchanger, shared = _exchanger(wire, interval, log)
    line = TaskLine(MemoryEndpoint(wire), exchanger)
    line.shared.update(shared)
    return line


def driver(wire: Wire, unit: int = 1, *, log: list[str] | None = None, **options: Any) -> Mic488:
    """A blocking driver of a twin on the wire, opened, that knows its configuration."""
    options.setdefault("config", wire.config)
    options.setdefault("firmware", wire.twin.firmware.name)
    mic = Mic488(thread_line(wire, log=log), unit, **options)
    mic.open()
    return mic


def async_driver(line: TaskLine[ModbusQuery, bytes], wire: Wire, unit: int = 1, **options: Any) -> AsyncMic488:
    options.setdefault("config", wire.config)
    options.setdefault("firmware", wire.twin.firmware.name)
    return AsyncMic488(line, unit, **options)
