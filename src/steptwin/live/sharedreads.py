"""Reads that several clients make at one moment are computed once."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.controller import Nanos
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.wire.pdu import READS
from steptwin.wire.slave import SlaveDevice


class _SharedReads:
    """A unit that keeps its answers to reads until time passes, signals settle or another request is executed."""

    __slots__ = ("_answers", "_execute", "_moment", "_realtime")

    def __init__(self, device: SlaveDevice, realtime: RealTimeDriver) -> None:
        self._execute = device.execute
        self._realtime = realtime
        self._moment = -1
        self._answers: dict[bytes, bytes] = {}

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        if pdu[0] not in READS:
            self._moment = -1
            return self._execute(pdu, now)
        moment = self._realtime.moments
        if moment != self._moment:
            self._moment = moment
            self._answers = {}
        answer = self._answers.get(pdu)
        if answer is None:
            answer = self._answers[pdu] = self._execute(pdu, now)
        return answer


def share_reads(devices: Mapping[int, SlaveDevice], realtime: RealTimeDriver) -> dict[int, SlaveDevice]:
    """The units of a line for clients that one real-time driver serves together. Units must not change each other but by the
    cell's scheduler."""
    return {unit: _SharedReads(device, realtime) for unit, device in devices.items()}
