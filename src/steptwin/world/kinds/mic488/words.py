"""What goes over a Modbus line in words."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.machine import Nanos
from steptwin.mic488.framelog import FrameLog
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection, FrameObserver
from steptwin.world.kinds.mic488.line import ModbusBus
from steptwin.world.trace import TraceRecord


class ModbusWords:
    """The frames of a line in words. As `steptwin.world.lines.LineWords`."""

    def __init__(self, line: ModbusBus, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._line = line
        self._prefix = prefix
        self._log = FrameLog(line.devices)
        self._log.sinks.append(sink)
        self._observers: dict[str, FrameObserver] = {}

    def frame(self, now: Nanos, place: str, direction: FrameDirection, data: bytes) -> None:
        observer = self._observers.get(place)
        if observer is None:
            for gone in [name for name in self._observers if name not in self._line.places]:
                del self._observers[gone]
            there = self._line.places.get(place)
            tcp = there is not None and there.kind == "tcp"
            observer = self._observers[place] = self._log.observer(self._prefix + place, tcp=tcp)
        observer(now, direction, data)

    def rubbish(self, now: Nanos, place: str, count: int) -> None:
        self._log.rubbish(now, self._prefix + place, count)

    def recorded(self, record: TraceRecord) -> None:
        """Only frames are shown of what goes over the line."""
