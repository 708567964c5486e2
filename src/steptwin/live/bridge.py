"""``steptwin bridge``: real devices for programs of a plant. One process owns their lines; commands go through it in order."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from steptwin.access.audit import Audit, CommandLog
from steptwin.controller import Nanos
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.connections import Computer, DeviceConnections
from steptwin.devices.device import RECONNECT_S, DeviceSurroundings
from steptwin.errors import LineFailure
from steptwin.eventloop import result_of
from steptwin.files.auditfile import audit_into, wall_clock
from steptwin.gateways.contract import HistoryValues
from steptwin.gateways.sampling import SharedSamples
from steptwin.inputfiles import read_bytes
from steptwin.later import start
from steptwin.live.devicefile import DeviceFile, DeviceSpec, read_device_file
from steptwin.live.gateways import command_log_of, open_gateways
from steptwin.live.keptsettings import keep_settings
from steptwin.live.options import LogOptions
from steptwin.live.server import Server
from steptwin.live.twins import find_device
from steptwin.live.withoutworld import serve_without_world
from steptwin.simulation.kinds.lines import LineTraffic
from steptwin.simulation.toml.addresses import check_addresses
from steptwin.subject.commands import Command, Jog
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.events import Event, Numbering
from steptwin.subject.jogs import ExtendableJog
from steptwin.subject.subscriptions import Filter, Subscription
from steptwin.textcodec import decode


def bridge(file: Path, *, listen_any: bool, ready_file: Path | None, audit: Path | None, log: LogOptions) -> None:
    """Serve the devices of ``file`` until SIGINT, SIGTERM or SIGHUP. Raises `SteptwinError` with a text for the user."""
    wanted = read_device_file(str(file), decode(read_bytes(file), str(file)).text)
    check_addresses([gateway.listen for gateway in wanted.services.gateways], listen_any=listen_any)

    with audit_into(audit) as commands:

        async def open_all(server: Server) -> None:
            await _open(server, wanted, file, commands, listen_any=listen_any)

        asyncio.run(serve_without_world(ready_file, open_all, log))


async def _open(server: Server, wanted: DeviceFile, file: Path, audit: Audit | None, *, listen_any: bool) -> None:
    begin = time.monotonic_ns()

    def now() -> Nanos:
        return time.monotonic_ns() - begin

    def report(error: Exception) -> None:
        server.notice(f"internal error, please report it: {type(error).__name__}: {error}")

    server.introduce(wanted.name, file=file)
    subject = CompositeSubject(None, now, Numbering({}))
    connections = connections_of(subject, report)
    server.join(connections)
    for device in wanted.devices:
        await open_device(connections, device.beside(file.parent), server.notice)
    devices = _Devices(wanted.name, subject, connections)
    if audit is None and wanted.services.history is not None:
        audit = Audit(wall_clock)
    devices.audit = command_log_of(audit, now)
    await open_gateways(server, wanted.services, file.parent, devices, audit, listen_any=listen_any)


def connections_of(subject: CompositeSubject, on_internal: Callable[[Exception], object]) -> DeviceConnections:
    """Connections to devices that become parts of ``subject``."""
    around = DeviceSurroundings(clock=subject.now, keep=keep_settings, on_internal=on_internal)
    return DeviceConnections(subject, around, Computer(ports=_no_ports, find=find_device))


async def open_device(connections: DeviceConnections, device: DeviceSpec, notice: Callable[[str], None]) -> None:
    """Waits for a device that does not answer: what is served begins with its description."""
    pause_s, is_reported = RECONNECT_S[0], False
    while True:
        try:
            await connections.open(device.address, device.name)
        except LineFailure as failure:
            if not is_reported:
                notice(f"{device.name}: {failure}; nothing is served before it is there")
            is_reported = True
            await asyncio.sleep(pause_s)
            pause_s = min(2.0 * pause_s, RECONNECT_S[1])
        else:
            if is_reported:
                notice(f"{device.name}: it is there")
            return


def _no_ports() -> Sequence[dict[str, object]]:
    return ()


class _Devices:
    """Devices for gateways. See `steptwin.gateways.contract.GatewaySubject`."""

    def __init__(self, name: str, subject: CompositeSubject, connections: DeviceConnections) -> None:
        self.history: HistoryValues | None = None
        self.audit: CommandLog | None = None
        self._name = name
        self._subject = subject
        self._connections = connections
        self.samples = SharedSamples(self)

    @property
    def description(self) -> Description:
        return replace(self._subject.description, name=self._name)

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self._subject.read(*points)

    async def do(self, wanted: Command, /) -> Result:
        return await result_of(start(self._subject.do(wanted)))

    async def begin_jog(self, wanted: Jog, /) -> ExtendableJog:
        return await result_of(start(self._subject.begin_jog(wanted)))

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self._subject.subscribe(what, bound)

    def traffic(self) -> Mapping[str, LineTraffic]:
        return {f"{name}.line": LineTraffic(*counts) for name, counts in self._connections.traffic().items()}

    def plans(self, what: Filter) -> list[Event]:
        return self._subject.plans(what)
