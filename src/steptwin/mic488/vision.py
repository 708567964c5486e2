"""Records of a vision system on COM1 (WBC registers Vision…): ASCII ``N3 X12.5 Y-7 A90`` and a line end (WBC-27).

COM1 carries Modbus too: what forms a record outside a Modbus frame is taken as one (WBC-15).
"""

from __future__ import annotations

import re
from typing import NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.mic488.program_banks import LoadedProgram
from steptwin.state import Stateful
from steptwin.wbc import steps as s
from steptwin.wire.slave import FrameDirection, RtuSlavePort
from steptwin.wire.timed import TimedRtuSlavePort

VISION = "VISION"
"""How the registers of the vision system begin."""
LONGEST_RECORD = 80
"""Most characters of a record; of a longer line the last ones are kept."""

_LINE_END = re.compile(rb"[\r\n]+")
_NUMBER = rb"\s*([+-]?\d{1,9}(?:[.,]\d{1,9})?)\s*"
_RECORD = re.compile(rb"N" + _NUMBER + rb"X" + _NUMBER + rb"Y" + _NUMBER + rb"A" + _NUMBER + rb"\Z", re.ASCII | re.IGNORECASE)


class VisionRecord(NamedTuple):
    """``n`` goes to VisionNo."""

    n: float
    x: float
    y: float
    a: float


class VisionReceiver(Stateful):
    """Cuts records out of received characters, in pieces of any size. A line that is no record is ignored."""

    __slots__ = ("_line",)

    def __init__(self) -> None:
        self._line = b""

    def feed(self, data: bytes) -> list[VisionRecord]:
        """The records completed by ``data``."""
        *lines, rest = _LINE_END.split(self._line + data)
        self._line = rest[-LONGEST_RECORD:]
        found = (_RECORD.search(line[-LONGEST_RECORD:]) for line in lines)
        return [VisionRecord(*(float(number.replace(b",", b".")) for number in match.groups())) for match in found if match]

    def forget(self) -> None:
        """Forget the beginning of the present line: it is not part of a record."""
        self._line = b""


class SeeingDevice(Protocol):
    """Receiver of records of the vision system."""

    def see(self, record: VisionRecord, now: Nanos) -> None: ...


class Com1Port(Stateful):
    """COM1 of one controller as a `steptwin.controller.Port`: Modbus RTU through ``modbus``, if it is given, and records."""

    broken = None

    FIXED = ("_device", "_frames")
    __slots__ = (*FIXED, "_receiver", "modbus")

    def __init__(self, device: SeeingDevice, modbus: RtuSlavePort | TimedRtuSlavePort | None = None) -> None:
        self._device = device
        self._receiver = VisionReceiver()
        self.modbus = modbus
        self._frames: list[bytes] = []
        if modbus is not None:
            callback = modbus.on_frame

            def note(now: Nanos, direction: FrameDirection, frame: bytes) -> None:
                if direction is FrameDirection.IN:
                    self._frames.append(frame)
                if callback is not None:
                    callback(now, direction, frame)

            modbus.on_frame = note

    @property
    def unframed(self) -> int:
        """Bytes that belonged to no frame; those of records are among them."""
        return 0 if self.modbus is None else self.modbus.unframed

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        answer = b""
        if self.modbus is not None:
            answer = self.modbus.exchange(data, now)
            for frame in self._frames:
                if frame in data:
                    data = data.replace(frame, b"\n", 1)
                else:
                    # It began in an earlier piece and ends in this one.
                    self._receiver.forget()
                    data = b""
            self._frames.clear()
        for record in self._receiver.feed(data):
            self._device.see(record, now)
        return answer

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        if self.modbus is None:
            return []
        sent = self.modbus.to_send(now)
        if self._frames:
            # Found only when the line fell silent.
            self._frames.clear()
            self._receiver.forget()
        return sent

    def deadline(self) -> Nanos | None:
        return None if self.modbus is None else self.modbus.deadline()

    def close(self) -> None:
        """The requests that wait are not executed."""
        if self.modbus is not None:
            self.modbus.close()


def uses_vision(program: LoadedProgram) -> bool:
    """Whether a program reads or writes a register of the vision system."""
    used = [source for step in program.steps for source in step.sources()]
    used += [step.target for step in program.steps if isinstance(step, s.SetStep)]
    return any(isinstance(source, s.RegisterOperand) and source.row.key.startswith(VISION) for source in used)
