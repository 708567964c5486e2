"""The frames of lines: their meaning, and what they may change."""

from __future__ import annotations

from collections.abc import Collection

from steptwin.simulation.kinds.lines import TrafficLog
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


class Frames:
    """The frames of the lines of a world in words."""

    def __init__(self, world: Simulation) -> None:
        self._read: list[FrameLine] = []
        self.traffic: dict[str, TrafficLog] = {
            spec.name: line_kinds()[spec.kind].traffic_log(world.lines[spec.name], "", self._read.append)
            for spec in world.spec.lines
        }

    def meaning(self, record: TraceRecord) -> str:
        """A request in words."""
        client, _, _ = record.subject.rpartition("/")
        self._read.clear()
        self.traffic[record.controller].frame(record.time, client, FrameDirection.IN, record.data())
        if self._read:
            return "; ".join(one.meaning for one in self._read)
        return record.data().decode("ascii", "backslashreplace")

    def changes(self, record: TraceRecord) -> Collection[int]:
        """The addresses of the controllers that a frame may change, if it is a request. It is asked when the frame comes: its
        client may leave."""
        client, _, direction = record.subject.rpartition("/")
        return self.traffic[record.controller].changes(client, record.data()) if direction == FrameDirection.IN.value else ()
