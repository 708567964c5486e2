"""The traffic between a master and MIC488 controllers, for `steptwin sniff`."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import Nanos
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.mic488.listening import RtuListener, TcpListener
from steptwin.mic488.registers import register_map
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


class ModbusDecoder:
    """Decodes Modbus RTU or TCP, with the register names of a MIC488."""

    def __init__(self, sink: Callable[[FrameLine], None], firmware: str, *, tcp: bool) -> None:
        log = FrameLog(register_map(firmware), tcp=tcp)
        log.sinks.append(lambda h: sink(FrameLine(h.time, "", h.direction or FrameDirection.OUT, h.raw, h.meaning)))
        self._tcp = TcpListener(log) if tcp else None
        self._rtu = RtuListener(log)

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None:
        if self._tcp is not None and direction is not None:
            self._tcp.feed(data, now, direction)
        else:
            self._rtu.feed(data, now)

    def deadline(self) -> Nanos | None:
        return self._rtu.deadline()

    def expire(self, now: Nanos) -> None:
        self._rtu.expire(now)
