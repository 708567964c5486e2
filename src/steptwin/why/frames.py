"""The frames of lines: their meaning, and what they may change."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.kinds.lines import TrafficLog
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


class Refused(NamedTuple):
    """A request that was refused, and the reason that its answer gave."""

    request: TraceRecord
    reason: str


class Frames:
    """The frames of the lines of a world in words."""

    def __init__(self, world: Simulation) -> None:
        self._read: list[FrameLine] = []
        self._asked: dict[tuple[str, str], tuple[int, TraceRecord]] = {}
        """The last request of each client, with its order, by line."""
        self.requests: dict[int, Collection[int]] = {}
        """Addresses of the controllers that a frame may change, by its order."""
        self.sent: dict[int, TraceRecord] = {}
        """All requests to lines whose controllers choose themselves what they hear."""
        self.selecting: dict[int, TraceRecord] = {}
        """Those that chose who listens to the ones after them."""
        self.refused: dict[int, Refused] = {}
        """By the order of the request."""
        self.traffic: dict[str, TrafficLog] = {
            spec.name: line_kinds()[spec.kind].traffic_log(world.lines[spec.name], "", self._read.append)
            for spec in world.spec.lines
        }

    def meaning(self, record: TraceRecord) -> str:
        """A request in words."""
        return self.words(record.controller, record.subject.rpartition("/")[0], record.data(), record.time)

    def words(self, line: str, client: str, data: bytes, time: Nanos) -> str:
        """The request of a client over a line in words, whether or not it comes so."""
        self._read.clear()
        self.traffic[line].frame(time, client, FrameDirection.IN, data)
        return "; ".join(one.meaning for one in self._read) if self._read else data.decode("ascii", "backslashreplace")

    def take(self, record: TraceRecord, order: int) -> None:
        """Note a frame when it comes: its client may leave."""
        client, _, direction = record.subject.rpartition("/")
        traffic, data = self.traffic[record.controller], record.data()
        if direction == FrameDirection.IN.value:
            self._asked[record.controller, client] = order, record
            if changed := traffic.changes(client, data):
                self.requests[order] = changed
            if traffic.selects(data):
                self.selecting[order] = record
            self.sent[order] = record
        elif (reason := traffic.refusal(client, data)) is not None and (record.controller, client) in self._asked:
            asked, request = self._asked[record.controller, client]
            self.refused[asked] = Refused(request, reason)
