"""Modbus lines with MIC488 controllers as a kind of line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.mic488.config import BAUDS
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.framelog import FrameLog
from steptwin.simulation.faults import Faults
from steptwin.simulation.kinds.kind import LineKind, LinkKind, Member
from steptwin.simulation.kinds.lines import LineWrite
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.kinds.mic488.line import ModbusBus, timing_of
from steptwin.simulation.kinds.mic488.trafficlog import ModbusTrafficLog
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.wire.frameline import FrameLine
from steptwin.wire.pdu import REFUSED


class ModbusLines(LineKind[Mic488Device, ModbusBus]):
    name = "modbus"
    meaning = "modbus (MIC488)"
    links: Mapping[str, LinkKind] = {
        "pty": LinkKind("rtu", "pty", "Modbus RTU"),
        "serial": LinkKind("serial", "serial", "Modbus RTU"),
        "rtu_tcp": LinkKind("rtu", "rtu", "RTU over TCP"),
        "tcp": LinkKind("tcp", "tcp", "Modbus TCP"),
        "rfc2217": LinkKind("rtu", "rtu", "network port"),
        "tls_tcp": LinkKind("tcp", "tcp", "Modbus TCP Security"),
    }
    keys = frozenset({"gap"})

    def make(
        self, spec: LineSpec, members: Sequence[Member[Mic488Device]], scheduler: Scheduler, record: RecordSink, faults: Faults
    ) -> ModbusBus:
        """As `LineKind.make`. Raises `Misuse` for units that are taken, and rates that no MIC488 has."""
        devices: dict[int, Mic488Device] = {}
        names: dict[int, str] = {}
        for member in members:
            if member.address in devices:
                raise Misuse(f"unit {member.address} is both {names[member.address]!r} and {member.spec.name!r}")
            devices[member.address] = member.controller
            names[member.address] = member.spec.name
        if spec.baud is not None and spec.baud not in BAUDS:
            raise Misuse(f"baud = {spec.baud}: a MIC488 has {', '.join(map(str, BAUDS))} bit/s")
        baud = spec.baud or next(iter(devices.values())).config.ports[0].baud
        timing = None if spec.timing == "off" else timing_of(baud, strict=spec.timing == "strict")
        return ModbusBus(scheduler, spec.name, record, faults, devices=devices, timing=timing, baud=baud, gap=spec.gap)

    def traffic_log(self, line: ModbusBus, prefix: str, sink: Callable[[FrameLine], None]) -> ModbusTrafficLog:
        return ModbusTrafficLog(line, prefix, sink)

    def writes(self, line: ModbusBus, take: Callable[[LineWrite], None]) -> Callable[[], None]:
        log = FrameLog(line.devices)

        def seen(client: str, now: Nanos, unit: int, request: bytes, response: bytes) -> None:
            there = line.clients.get(client)
            words = log.request(unit, request, tcp=there is not None and there.kind == "tcp")
            units = (unit,) if unit in line.devices else line.units
            outcome = "" if not response else "refusal" if response[0] & REFUSED else "done"
            take(LineWrite(now, client, units, words, outcome))

        line.subscribe_to_writes(seen)
        return partial(line.subscribe_to_writes, None)
