"""Modbus lines with MIC488 controllers on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from operator import itemgetter
from typing import ClassVar

from steptwin.controller import Nanos, Port
from steptwin.mic488.device import Mic488Device, pause_callback
from steptwin.mic488.vision import Com1Port, uses_vision
from steptwin.simulation.faults import Faults
from steptwin.simulation.faults import LineProtocol as FaultLine
from steptwin.simulation.kinds.lines import SCRIPTS, Line, LineEndPoint
from steptwin.simulation.kinds.master import Master
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.wire.gateway import ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.pdu import READS
from steptwin.wire.rtu import BROADCAST, BURSTY_GAP_NS, UART_GAP_NS
from steptwin.wire.slave import FrameCallback, RtuSlavePort, SlaveDevice, SlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

SILENT_CHARACTERS = 4
"""Between an answer and the next request of a master: Modbus RTU asks for 3.5."""


class ModbusBus(Line):
    """Controllers with different units on one line. With ``timing`` requests take the time of a wire and of the controllers."""

    FIXED: ClassVar[tuple[str, ...]] = ("_baud", "_gap", "_on_write", "_seeing", "_served", "devices")
    __slots__ = (*FIXED, "_master", "_timed")

    kinds = ("rtu", "serial", "tcp")
    """``serial``: a real serial port, on which characters take their time whatever the line timing is."""
    fault_kinds: ClassVar[Mapping[str, FaultLine]] = {"rtu": FaultLine.RTU, "serial": FaultLine.RTU, "tcp": FaultLine.TCP}

    def __init__(
        self,
        scheduler: Scheduler,
        name: str,
        record: RecordSink | None,
        faults: Faults,
        *,
        devices: Mapping[int, Mic488Device],
        timing: LineTiming | None,
        baud: int = 38400,
        gap: Nanos | None = None,
    ) -> None:
        super().__init__(scheduler, name, record, faults)
        self.devices = devices
        self._served: Mapping[int, SlaveDevice] = devices
        self._on_write: Callable[[str, Nanos, int, bytes, bytes], None] | None = None
        self._baud = baud
        self._gap = gap
        # WBC-15: a vision system belongs to one controller; without its registers in a program it costs nothing.
        device = next(iter(devices.values()))
        sees = len(devices) == 1 and any(map(uses_vision, device.program.banks.programs.values()))
        self._seeing = device if sees else None
        self._timed: tuple[TimedUnits, ModbusGateway] | None = None
        if timing is not None:
            units = TimedUnits(devices, timing)
            self._timed = units, ModbusGateway(units)
        self._master = Master(partial(self.receive, SCRIPTS), 0 if timing is None else timing.line.duration(SILENT_CHARACTERS))

    @property
    def master(self) -> Master:
        return self._master

    def serve_by(self, served: Callable[[Mapping[int, SlaveDevice]], Mapping[int, SlaveDevice]]) -> None:
        """Without line timing; ports that are made from now on use it."""
        self._served = served(self.devices)

    def subscribe_to_writes(self, callback: Callable[[str, Nanos, int, bytes, bytes], None] | None) -> None:
        """Call ``callback`` with the client and what `steptwin.wire.slave.WriteCallback` says, from now on; None ends that."""
        self._on_write = callback
        for name, client in self.clients.items():
            if client.framed is not None:
                client.framed.on_write = None if callback is None else partial(callback, name)

    def is_idle_read(self, client: LineEndPoint, data: bytes) -> bool:
        # With timing a request takes the line and the controller; faults count requests.
        is_free = self._timed is None and not self._faults.interfere and client.framed is client.inner
        return is_free and client.framed is not None and client.framed.is_lone_read(data)

    def recall(self, unit: int, now: Nanos) -> None:
        if self._master.recall(lambda frame: frame[0] in (unit, BROADCAST) and frame[1] not in READS, now):
            self.leave(SCRIPTS)  # what is on its way there is lost with the connection
        self._master.update(now)  # requests for others go on

    def _came(self, client: str, found: LineEndPoint, pieces: list[tuple[Nanos, bytes]]) -> None:
        if client == SCRIPTS:
            self._master.answered(b"".join(map(itemgetter(1), pieces)), pieces[-1][0])
        else:
            super()._came(client, found, pieces)

    def update(self, now: Nanos) -> None:
        super().update(now)
        self._master.update(now)

    def deadline(self) -> Nanos | None:
        own, masters = super().deadline(), self._master.deadline()
        return own if masters is None else masters if own is None else min(own, masters)

    @property
    def units(self) -> tuple[int, ...]:
        return tuple(self.devices)

    def _frame_callback(self, client: str) -> FrameCallback | None:
        return partial(self._report, client) if self._has_subscribers else None

    def _port(self, client: str, kind: str) -> Port:
        port = self._slave_port(client, kind)
        if self._on_write is not None:
            port.on_write = partial(self._on_write, client)
        if self._seeing is not None and client != SCRIPTS and isinstance(port, RtuSlavePort | TimedRtuSlavePort):
            return Com1Port(self._seeing, port)
        return port

    def _slave_port(
        self, client: str, kind: str
    ) -> RtuSlavePort | TimedRtuSlavePort | TcpSlavePort | TcpGatewayPort | ScriptPort:
        callback = self._frame_callback(client)
        if self._timed is None and kind == "tcp":
            return TcpSlavePort(self._served, on_frame=callback)
        if self._timed is not None and kind == "tcp":
            return TcpGatewayPort(self._timed[1], on_frame=callback)
        if self._timed is not None and client == SCRIPTS:
            return ScriptPort(self._timed[1], on_frame=callback)
        usual = UART_GAP_NS if kind == "serial" else BURSTY_GAP_NS
        gap = usual if self._gap is None else self._gap
        on_pause = pause_callback(self.devices)
        if self._timed is not None:
            return TimedRtuSlavePort(self._timed[0], gap_ns=gap, on_frame=callback, on_pause=on_pause)
        devices = self.devices if client == SCRIPTS else self._served
        wire = SerialLine(self._baud) if kind == "serial" else None
        return RtuSlavePort(devices, gap_ns=gap, line=wire, on_frame=callback, on_pause=on_pause)

    @property
    def baud(self) -> int:
        return self._baud

    @property
    def is_timed(self) -> bool:
        return self._timed is not None

    def _framed(self, port: SlavePort | Com1Port) -> SlavePort | None:
        return port.modbus if isinstance(port, Com1Port) else port


def timing_of(baud: int, *, strict: bool) -> LineTiming:
    return LineTiming(SerialLine(baud), strict=strict)
