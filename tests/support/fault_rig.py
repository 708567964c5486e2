"""A MIC488 behind a faulty line in virtual time, and what comes over the wire."""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.faults import ActiveFault, Faults, FaultyController, FaultyPort, LineProtocol, prepare_for_faults, read
from steptwin.simulation.kinds.mic488.faults import Mic488Body
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.wire.gateway import ModbusGateway, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

READ = bytes.fromhex("03 00 63 00 02")
"""Two user registers from 99 on; 100 holds 1234H."""


def crc(data: bytes) -> bytes:
    """CRC-16 of Modbus, bit by bit."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")


def rtu(unit: int, pdu: bytes) -> bytes:
    frame = bytes((unit,)) + pdu
    return frame + crc(frame)


def tcp(transaction: int, unit: int, pdu: bytes) -> bytes:
    return transaction.to_bytes(2, "big") + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + bytes((unit,)) + pdu


ANSWER_PDU = bytes.fromhex("03 04 00 00 12 34")
REQUEST = rtu(1, READ)
ANSWER = rtu(1, ANSWER_PDU)


class FaultRig:
    """``units`` of one line, its port, and what arrives with its moment. ``now`` moves by `wait` and `ask`."""

    def __init__(
        self,
        *faults: str,
        line: LineProtocol = LineProtocol.RTU,
        units: tuple[int, ...] = (1,),
        seed: int = 0,
        is_timed: bool = False,
        config: ControllerConfig | None = None,
    ) -> None:
        self.scheduler = Scheduler()
        self.faults = Faults(seed)
        self.devices = {unit: Mic488Device(config or ControllerConfig()) for unit in units}
        self.controllers: dict[int, FaultyController] = {}
        for unit, device in self.devices.items():
            device.execute(bytes.fromhex("06 00 64 12 34"), 0)
            self.scheduler.add(str(unit), device)
            self.controllers[unit] = prepare_for_faults(self.scheduler, str(unit), self.faults, Mic488Body(device, unit))
        self.records: list[TraceRecord] = []
        self.faults.sinks.append(self.records.append)
        if line is LineProtocol.TCP and is_timed:
            self.inner = TcpGatewayPort(ModbusGateway(TimedUnits(self.devices, LineTiming(SerialLine(9600)))))
        elif line is LineProtocol.TCP:
            self.inner = TcpSlavePort(self.devices)
        elif is_timed:
            self.inner = TimedRtuSlavePort(TimedUnits(self.devices, LineTiming(SerialLine(9600))))
        else:
            self.inner = RtuSlavePort(self.devices)
        self.port = FaultyPort(self.inner, "link-1", self.faults, line, framed=self.inner, units=units)
        self.line = line
        self.transaction = 0
        self.now = 0
        self.add(*faults)

    @property
    def device(self) -> Mic488Device:
        return next(iter(self.devices.values()))

    def add(self, *faults: str) -> list[ActiveFault]:
        self.scheduler.advance(self.now)
        added = [self.faults.add(read(fault), self.now) for fault in faults]
        self.scheduler.propagate()
        return added

    def send(self, data: bytes) -> bytes:
        """What comes at once."""
        self.scheduler.advance(self.now)
        answer = self.port.exchange(data, self.now)
        self.scheduler.propagate()
        return answer

    def ask(self, pdu: bytes = READ, unit: int = 1, ms: float = 10.0) -> bytes:
        """A request; its answer, if it comes at once. Then time passes."""
        self.transaction += 1
        answer = self.send(tcp(self.transaction, unit, pdu) if self.line is LineProtocol.TCP else rtu(unit, pdu))
        self.now += round(ms * MILLISECOND)
        return answer

    def arrivals(self, seconds: float = 1.0) -> list[tuple[int, bytes]]:
        """What comes from now on."""
        end = self.now + round(seconds * SECOND)
        out = []
        while True:
            deadlines = [due for due in (self.port.deadline(), self.scheduler.deadline()) if due is not None]
            due = min(deadlines, default=end + 1)
            if due > end:
                break
            self.now = max(due, self.now)
            self.scheduler.advance(self.now)
            out += self.port.to_send(self.now)
        self.now = end
        self.scheduler.advance(end)
        return out

    def wait(self, seconds: float) -> None:
        self.now += round(seconds * SECOND)
        self.scheduler.advance(self.now)

    def pin(self, pin: str, level: float, unit: int = 1) -> None:
        """Something outside drives an input."""
        self.scheduler.advance(self.now)
        self.scheduler.drive(PinName(str(unit), pin), level)
        self.scheduler.propagate()

    def level(self, pin: str) -> float:
        return self.device.pins()[pin]

    def told(self) -> list[str]:
        return [f"{record.subject}: {record.value}" for record in self.records if record.kind == "fault"]

    def levels(self, pin: str) -> list[tuple[int, float]]:
        """The edges that faults made, with their moments."""
        return [(r.time, float(str(r.value))) for r in self.records if r.kind == "edge" and r.subject == pin]
