"""Frames in words: time, link, direction, bytes and meaning of every frame a twin exchanges."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from steptwin.machine import SECOND, Nanos
from steptwin.mic488.describe import Scale, Wording
from steptwin.mic488.device import Mic488
from steptwin.mic488.registermap import DataType
from steptwin.mic488.vision import Com1Port
from steptwin.wire.rtu import BROADCAST
from steptwin.wire.slave import Direction, FrameObserver, RtuSlavePort
from steptwin.wire.timed import TimedRtuSlavePort

ONE_DEVICE_UNITS = (0, 255)
"""MIC-23: on TCP these address the only device too."""


class FrameLine(NamedTuple):
    """One frame as people read it."""

    time: Nanos
    link: str
    direction: Direction
    raw: bytes
    meaning: str

    def __str__(self) -> str:
        arrow = "→" if self.direction is Direction.IN else "←"
        raw = f"{self.raw.hex(' ')}  " if self.raw else ""
        return f"{self.time / SECOND:12.6f} s  {self.link:<7} {arrow} {raw}{self.meaning}"


class FrameLog:
    """Puts frames into words and hands them to ``sinks``."""

    def __init__(self, devices: Mapping[int, Mic488]) -> None:
        self._devices = devices
        self._wording = {
            unit: Wording(device.registers, [Scale(axis.unit_name, axis.gear) for axis in device.config.axes])
            for unit, device in devices.items()
        }
        self.sinks: list[Callable[[FrameLine], None]] = []

    def observer(self, link: str, *, tcp: bool) -> FrameObserver:
        """An observer for the frames of one connection."""
        asked: dict[int, bytes] = {}

        def observe(now: Nanos, direction: Direction, raw: bytes) -> None:
            unit, pdu = (raw[6], raw[7:]) if tcp else (raw[0], raw[1:-2])
            line = FrameLine(now, link, direction, raw, self._meaning(unit, pdu, direction, asked, tcp=tcp))
            for sink in self.sinks:
                sink(line)

        return observe

    def rubbish(self, now: Nanos, link: str, count: int) -> None:
        """Bytes came that belong to no frame."""
        line = FrameLine(now, link, Direction.IN, b"", f"{count} byte{'s' if count > 1 else ''} that belong to no frame")
        for sink in self.sinks:
            sink(line)

    def _meaning(self, unit: int, pdu: bytes, direction: Direction, asked: dict[int, bytes], *, tcp: bool) -> str:
        several = len(self._devices) > 1
        first = next(iter(self._devices))
        if unit in self._devices:
            addressed, whose = unit, f"unit {unit}: " if several else ""
        elif unit == BROADCAST and (several or not tcp):
            addressed, whose = first, "broadcast: "
        elif tcp and unit in ONE_DEVICE_UNITS and not several:
            addressed, whose = first, f"unit {unit}: "
        else:
            return f"unit {unit} is not served here"
        wording = self._wording[addressed]
        wording.data_type = DataType(self._devices[addressed].data_type)
        if direction is Direction.OUT:
            return whose + wording.response(pdu, asked.pop(unit, None))
        asked[unit] = pdu
        return whose + wording.request(pdu)


class WatchedRtuPort:
    """An RTU port that reports rubbish too: a wrong CRC, another protocol, another baud rate look like that."""

    broken = None

    def __init__(self, port: RtuSlavePort | TimedRtuSlavePort | Com1Port, log: FrameLog, link: str) -> None:
        self._port = port
        self._log = log
        self._link = link
        self._told = 0

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        answer = self._port.exchange(data, now)
        self._look(now)
        return answer

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        out = self._port.to_send(now)
        self._look(now)
        return out

    def deadline(self) -> Nanos | None:
        return self._port.deadline()

    def close(self) -> None:
        self._port.close()

    def _look(self, now: Nanos) -> None:
        rubbish = self._port.rubbish
        if rubbish > self._told:
            self._log.rubbish(now, self._link, rubbish - self._told)
            self._told = rubbish
