"""The frames of a Modbus line in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.controller import Nanos
from steptwin.messages import Message, MessageText
from steptwin.mic488.describe import AxisScale, Wording
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registermap import DataType
from steptwin.wire.frameline import FrameLine
from steptwin.wire.rtu import BROADCAST
from steptwin.wire.slave import FrameCallback, FrameDirection

UNFRAMED_BYTE = Message("mic488.unframed-byte", "1 byte that belongs to no frame")
UNFRAMED_BYTES = Message("mic488.unframed-bytes", "{count} bytes that belong to no frame")
UNIT = Message("mic488.unit", "unit {unit}: {what}")
BROADCAST_TO_ALL = Message("mic488.broadcast", "broadcast: {what}")
NOT_SERVED = Message("mic488.not-served", "unit {unit} is not served here")
ONE_DEVICE_UNITS = (0, 255)
"""MIC-23: over TCP these units, too, address the only device."""


class FrameLog:
    """Describes frames in words and passes them to ``sinks``."""

    def __init__(self, devices: Mapping[int, Mic488Device]) -> None:
        self._devices = devices
        self._wording = {
            unit: Wording(device.registers, [AxisScale(axis.unit_name, axis.gear) for axis in device.config.axes])
            for unit, device in devices.items()
        }
        self.sinks: list[Callable[[FrameLine], None]] = []

    def callback(self, link: str, *, tcp: bool) -> FrameCallback:
        """The callback for the frames of one connection."""
        asked: dict[int, bytes] = {}

        def callback(now: Nanos, direction: FrameDirection, raw: bytes) -> None:
            unit, pdu = (raw[6], raw[7:]) if tcp else (raw[0], raw[1:-2])
            line = FrameLine(now, link, direction, raw, self._meaning(unit, pdu, direction, asked, tcp=tcp))
            for sink in self.sinks:
                sink(line)

        return callback

    def request(self, unit: int, pdu: bytes, *, tcp: bool) -> MessageText:
        """A request in words."""
        return self._meaning(unit, pdu, FrameDirection.IN, {}, tcp=tcp)

    def unframed(self, now: Nanos, link: str, count: int) -> None:
        """Log received bytes that belong to no frame."""
        words = UNFRAMED_BYTE() if count == 1 else UNFRAMED_BYTES(count=count)
        line = FrameLine(now, link, FrameDirection.IN, b"", words)
        for sink in self.sinks:
            sink(line)

    def _meaning(self, unit: int, pdu: bytes, direction: FrameDirection, asked: dict[int, bytes], *, tcp: bool) -> MessageText:
        several = len(self._devices) > 1
        first = next(iter(self._devices))
        if unit in self._devices:
            addressed, whose = unit, UNIT if several else None
        elif unit == BROADCAST and (several or not tcp):
            addressed, whose = first, BROADCAST_TO_ALL
        elif tcp and unit in ONE_DEVICE_UNITS and not several:
            addressed, whose = first, UNIT
        else:
            return NOT_SERVED(unit=unit)
        wording = self._wording[addressed]
        wording.data_type = DataType(self._devices[addressed].data_type)
        if direction is FrameDirection.OUT:
            what = wording.response(pdu, asked.pop(unit, None))
        else:
            asked[unit] = pdu
            what = wording.request(pdu)
        return what if whose is None else BROADCAST_TO_ALL(what=what) if whose is BROADCAST_TO_ALL else UNIT(unit=unit, what=what)
