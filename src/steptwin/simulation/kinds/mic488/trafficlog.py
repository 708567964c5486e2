"""Words for the traffic on a Modbus line."""

from __future__ import annotations

from collections.abc import Callable, Collection

from steptwin.controller import Nanos
from steptwin.mic488.framelog import FrameLog
from steptwin.simulation.kinds.mic488.line import ModbusBus
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.wire.frameline import FrameLine
from steptwin.wire.pdu import EXCEPTION_NAMES, REFUSED, WRITES
from steptwin.wire.slave import FrameCallback, FrameDirection


class ModbusTrafficLog:
    """Log of the frames of a line. As `steptwin.simulation.kinds.lines.TrafficLog`."""

    def __init__(self, line: ModbusBus, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._line = line
        self._prefix = prefix
        self._log = FrameLog(line.devices)
        self._log.sinks.append(sink)
        self._callbacks: dict[str, FrameCallback] = {}

    def frame(self, now: Nanos, client: str, direction: FrameDirection, data: bytes) -> None:
        callback = self._callbacks.get(client)
        if callback is None:
            for gone in [name for name in self._callbacks if name not in self._line.clients]:
                del self._callbacks[gone]
            callback = self._callbacks[client] = self._log.callback(self._prefix + client, tcp=self._is_tcp(client, data))
        callback(now, direction, data)

    def _is_tcp(self, client: str, data: bytes) -> bool:
        """Whether a frame has the header of Modbus TCP; where the client has gone, the frame tells by protocol and length."""
        there = self._line.clients.get(client)
        if there is not None:
            return there.kind == "tcp"
        return data[2:4] == b"\0\0" and int.from_bytes(data[4:6], "big") == len(data) - 6

    def changes(self, client: str, data: bytes) -> Collection[int]:
        unit, function = (data[6], data[7]) if self._is_tcp(client, data) else (data[0], data[1])
        if function not in WRITES:
            return ()
        return (unit,) if unit in self._line.units else self._line.units

    def selects(self, data: bytes) -> bool:
        return False  # each request has its address

    def refusal(self, client: str, data: bytes) -> str | None:
        pdu = data[7:] if self._is_tcp(client, data) else data[1:-2]
        return EXCEPTION_NAMES.get(pdu[1], "") if len(pdu) > 1 and pdu[0] & REFUSED else None

    def unframed(self, now: Nanos, client: str, count: int) -> None:
        self._log.unframed(now, self._prefix + client, count)

    def recorded(self, record: TraceRecord) -> None:
        """Only frames are shown of what goes over the line."""
