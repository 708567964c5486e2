"""Decode the Modbus traffic between two other devices. No I/O."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.wire import mbap
from steptwin.wire.rtu import BURSTY_GAP_NS, FrameRole, RtuFrame, RtuFramer
from steptwin.wire.slave import FrameDirection


class RtuListener:
    """Decodes requests and answers on one wire; the frames show which is which."""

    def __init__(self, log: FrameLog, gap_ns: Nanos = BURSTY_GAP_NS) -> None:
        self._log = log
        self._framer = RtuFramer(gap_ns=gap_ns)
        self._unframed = 0

    def feed(self, data: bytes, now: Nanos) -> None:
        self._take(self._framer.feed(data, now), now)

    def deadline(self) -> Nanos | None:
        """The time at which `expire` must be called if no byte arrives before, ns."""
        return self._framer.deadline()

    def expire(self, now: Nanos) -> None:
        """End the present frame after a silence."""
        deadline = self._framer.deadline()
        if deadline is not None and deadline <= now:
            self._take(self._framer.expire(now), now)

    def _take(self, frames: list[RtuFrame], now: Nanos) -> None:
        for frame in frames:
            if frame.role is FrameRole.UNKNOWN:
                self._log.unframed(now, frame.raw)
            else:
                self._log.observe(now, FrameDirection.IN if frame.role is FrameRole.REQUEST else FrameDirection.OUT, frame.raw)
        lost = self._framer.unframed - self._unframed
        if lost:
            self._unframed += lost
            self._log.lost(now, lost)


class TcpListener:
    """Decodes the two directions of a Modbus TCP connection."""

    def __init__(self, log: FrameLog) -> None:
        self._log = log
        self._framers = {FrameDirection.IN: mbap.TcpFramer(), FrameDirection.OUT: mbap.TcpFramer()}

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection) -> None:
        framer = self._framers[direction]
        for frame in framer.feed(data):
            self._log.observe(now, direction, frame.raw)
        if framer.broken is not None:
            self._log.unframed(now, data)
            self._framers[direction] = mbap.TcpFramer()
