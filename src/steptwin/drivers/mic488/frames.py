"""Frames on a line in words, for logs and for monitoring a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.mic488.describe import Wording
from steptwin.mic488.registermap import DataType, RegisterMap
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu as modbus
from steptwin.wire.slave import FrameDirection


class ObservedFrame(NamedTuple):
    """One frame: towards the device or back, or bytes that are no frame (direction None)."""

    time: Nanos
    direction: FrameDirection | None
    unit: int | None
    raw: bytes
    meaning: str

    def __str__(self) -> str:
        arrow = "?" if self.direction is None else "→" if self.direction is FrameDirection.IN else "←"
        raw = f"{self.raw.hex(' ')}  " if self.raw else ""
        return f"{self.time / SECOND:12.6f} s  {arrow} {raw}{self.meaning}"


class FrameLog:
    """Decodes the frames of a line and passes them to ``sinks``.

    DATA_TYPE of each unit is taken from the frames that read or write it.
    """

    def __init__(self, registers: RegisterMap | None = None, *, tcp: bool = False) -> None:
        self.sinks: list[Callable[[ObservedFrame], object]] = []
        self._tcp = tcp
        self._registers = registers or register_map()
        self._wordings: dict[int, Wording] = {}
        self._requests: dict[int, bytes] = {}

    def know(self, unit: int, wording: Wording) -> None:
        """Set the known properties of a unit."""
        self._wordings[unit] = wording

    def observe(self, now: Nanos, direction: FrameDirection, raw: bytes) -> None:
        """Take a frame that a master sent or received: a `steptwin.wire.slave.FrameCallback`."""
        self._emit(self.frame(now, direction, raw))

    def unframed(self, now: Nanos, raw: bytes) -> None:
        self._emit(ObservedFrame(now, None, None, raw, "no frame"))

    def lost(self, now: Nanos, count: int) -> None:
        """Take bytes that belong to no frame."""
        self._emit(ObservedFrame(now, None, None, b"", f"no frame: {count} byte{'' if count == 1 else 's'}"))

    def _emit(self, frame: ObservedFrame) -> None:
        for sink in self.sinks:
            sink(frame)

    def frame(self, now: Nanos, direction: FrameDirection, raw: bytes) -> ObservedFrame:
        least = 8 if self._tcp else 4
        if len(raw) < least:
            return ObservedFrame(now, None, None, raw, "no frame")
        unit, pdu = (raw[6], raw[7:]) if self._tcp else (raw[0], raw[1:-2])
        wording = self._wordings.get(unit)
        if wording is None:
            wording = self._wordings[unit] = Wording(self._registers)
        if direction is FrameDirection.IN:
            self._requests[unit] = pdu
            text = wording.request(pdu)
        else:
            asked = self._requests.pop(unit, None)
            self._learn(wording, asked, pdu)
            text = wording.response(pdu, asked)
        return ObservedFrame(now, direction, unit, raw, f"{'broadcast' if unit == 0 else f'unit {unit}'}: {text}")

    def _learn(self, wording: Wording, asked: bytes | None, answered: bytes) -> None:
        """Learn DATA_TYPE from a frame that reads or writes it."""
        address = wording.register_map.of("DATA_TYPE").address
        try:
            request = modbus.decode_request(asked or b"")
            response = modbus.answer(request, answered)
        except (modbus.ModbusException, modbus.BadResponse):
            return
        match request, response:
            case modbus.ReadRequest(function, first, count), modbus.RegistersResponse(words) if (
                function == modbus.READ_HOLDING_REGISTERS
            ):
                if not first <= address < first + count:
                    return
                value = words[address - first]
            case modbus.WriteRegisterRequest(where, value), _ if where == address:
                pass
            case _:
                return
        if value in (DataType.REAL, DataType.DINT):
            wording.data_type = DataType(value)
