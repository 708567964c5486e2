"""MIC488 controllers on a line: what `steptwin serve mic488` puts together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory
from steptwin.files.programbanks import Banks
from steptwin.live.cell import Cell
from steptwin.live.control import axis_number, changes, number
from steptwin.live.sharedreads import share_reads
from steptwin.machine import Event, MotionController, Nanos, Port
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488, check_pin, check_turn, pause_observer
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.vision import Com1Port, uses_vision
from steptwin.served.demo import place_switches
from steptwin.served.faults import FaultDesk
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wire.gateway import Gateway, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.rtu import BURSTY_GAP_NS
from steptwin.wire.slave import Device, RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits
from steptwin.words.frames import FrameLog, WatchedRtuPort
from steptwin.words.mic488_state import state_of
from steptwin.world.faults import FaultyPort, Line, Mic488Body
from steptwin.world.kernel import Kernel


@dataclass(frozen=True, slots=True)
class LineOptions:
    """How requests are served.

    With ``timing`` requests take the time of a wire at ``baud`` and of the controllers; ``strict`` as well: a pause above 750 µs
    inside a frame drops it.
    """

    baud: int = 38400
    timing: bool = False
    strict: bool = False
    frames: bool = False
    """Whether frames are put into words."""


class Mic488Line:
    """Controllers with different units on one line, their memories, and what a person can ask of them."""

    def __init__(
        self,
        config: ControllerConfig,
        units: Sequence[int],
        firmware: str,
        banks: Banks | None = None,
        *,
        lenient: bool = False,
        statement_time: Nanos = STATEMENT_TIME,
        state: StateDirectory | None = None,
        demo: bool = False,
        options: LineOptions | None = None,
    ) -> None:
        self.options = options or LineOptions()
        banks = banks or Banks()
        self.kernel = Kernel()
        self.devices: dict[int, Mic488] = {}
        for unit in units:
            memory = state.load(memory_name(unit)) if state is not None else None
            device = Mic488(
                config,
                firmware,
                lenient=lenient,
                memory=memory,
                programs=banks.programs,
                positions=banks.positions,
                statement_time=statement_time,
            )
            if state is not None:
                device.store = partial(state.save, memory_name(unit))
            self.devices[unit] = device
            self.kernel.add(str(unit), device)
            if demo:
                place_switches(self.kernel, str(unit))
        self.frames = FrameLog(self.devices)
        self.faults = FaultDesk(self.kernel, {str(u): partial(Mic488Body, d, u) for u, d in self.devices.items()})
        numbers = ", ".join(map(str, units))
        self.title = f"MIC488 firmware {firmware}, unit{'s' if len(units) > 1 else ''} {numbers}"
        self._served: Mapping[int, Device] = self.devices
        self._on_pause = pause_observer(self.devices)
        self._gateway: Gateway | None = None
        if self.options.timing:
            timing = LineTiming(SerialLine(self.options.baud), strict=self.options.strict)
            self._gateway = Gateway(TimedUnits(self.devices, timing))
        self._connections = count(1)
        # WBC-15; without vision registers in a program it costs nothing.
        self._hears_records = len(units) == 1 and any(map(uses_vision, banks.programs.values()))

    # ------------------------------------------------------------------ ports

    def share_reads(self, cell: Cell) -> None:
        """From now on ports are for many clients that ``cell`` serves."""
        self._served = share_reads(self.devices, cell)

    def tcp_port(self) -> Port:
        """A port for one more client."""
        link = f"tcp-{next(self._connections)}"
        observer = self.frames.observer(link, tcp=True) if self.options.frames else None
        port: TcpSlavePort | TcpGatewayPort
        if self._gateway is not None:
            port = TcpGatewayPort(self._gateway, on_frame=observer)
        else:
            port = TcpSlavePort(self._served, on_frame=observer)
        return FaultyPort(port, link, self.faults.faults, Line.TCP, framed=port, units=tuple(self.devices))

    def rtu_port(self, link: str, gap_ns: Nanos = BURSTY_GAP_NS, *, baud: int | None = None) -> Port:
        """A port for one more program on the line, or client of it; ``baud`` where a real line delivers the characters."""
        observer = self.frames.observer(link, tcp=False) if self.options.frames else None
        port: RtuSlavePort | TimedRtuSlavePort
        if self._gateway is not None:
            port = TimedRtuSlavePort(self._gateway.units, gap_ns=gap_ns, on_frame=observer, on_pause=self._on_pause)
        else:
            line = None if baud is None else SerialLine(baud)
            port = RtuSlavePort(self._served, gap_ns=gap_ns, line=line, on_frame=observer, on_pause=self._on_pause)
        shared = Com1Port(self._only_device(), port) if self._hears_records else port
        watched = WatchedRtuPort(shared, self.frames, link) if self.options.frames else shared
        return FaultyPort(watched, link, self.faults.faults, Line.RTU, framed=port, units=tuple(self.devices))

    def rtu_client_port(self, gap_ns: Nanos = BURSTY_GAP_NS) -> Port:
        """A port for one more client of RTU over TCP."""
        return self.rtu_port(f"rtu-{next(self._connections)}", gap_ns)

    def vision_port(self) -> Port:
        """A port for a vision system on a connection of its own."""
        return Com1Port(self._only_device())

    def _only_device(self) -> Mic488:
        if len(self.devices) > 1:
            raise Misuse("a vision system belongs to one controller: serve a single unit")
        return next(iter(self.devices.values()))

    # ------------------------------------------------------------------ control requests

    def handlers(self, cell: Cell) -> dict[str, Callable[[Mapping[str, Any]], object]]:
        """Requests of the control endpoint; ``unit`` chooses the controller where there are several."""

        def acting(action: Callable[[Mic488, Mapping[str, Any], Nanos], object]) -> Callable[[Mapping[str, Any]], object]:
            def handle(request: Mapping[str, Any]) -> object:
                device = self._chosen(request.get("unit"))
                now = cell.enter()
                try:
                    return action(device, request, now)
                finally:
                    cell.leave()

            return handle

        return {
            "pin": acting(lambda device, request, now: _pin(device, self._terminals(device), request, now)),
            "power-cycle": acting(lambda device, request, now: device.power_cycle(now)),
            "encoder": acting(_encoder),
            "state": acting(lambda device, request, now: state_of(device, now)),
            "fault": self.faults.handler(cell),
        }

    def _terminals(self, device: Mic488) -> MotionController:
        """Where a hand reaches the inputs of a controller: before a switch that is stuck, not behind it."""
        return next(self.kernel.machines[str(unit)] for unit, served in self.devices.items() if served is device)

    def _chosen(self, unit: object) -> Mic488:
        if unit is None and len(self.devices) == 1:
            return next(iter(self.devices.values()))
        served = ", ".join(map(str, self.devices))
        if unit is None:
            raise Misuse(f"several units are served: choose one with --unit: {served}")
        if not isinstance(unit, int) or isinstance(unit, bool) or unit not in self.devices:
            raise Misuse(f"no unit {unit}: served are {served}")
        return self.devices[unit]

    def watch_events(self, sink: Callable[[int, Event], None]) -> None:
        """Tell ``sink`` (unit, event) what no register shows."""
        for unit, device in self.devices.items():
            device.on_event = partial(sink, unit)

    def told(self, unit: int, event: Event) -> str:
        """An event in words; the unit is named where there are several."""
        return f"unit {unit}: {event.text}" if len(self.devices) > 1 else event.text


def memory_name(unit: int) -> str:
    return f"mic488-{unit}-user-registers"


def open_state(stack: ExitStack, path: Path | None) -> StateDirectory | None:
    return stack.enter_context(StateDirectory(path)) if path is not None else None


def _pin(device: Mic488, terminals: MotionController, request: Mapping[str, Any], now: Nanos) -> object:
    """All changes or none, then every pin."""
    levels = {pin: number(pin, value) for pin, value in changes(request).items()}
    for pin, level in levels.items():
        check_pin(pin, level)
    for pin, level in levels.items():
        terminals.set_pin(pin, level, now)
    return dict(device.pins())


def _encoder(device: Mic488, request: Mapping[str, Any], now: Nanos) -> object:
    """Turn or couple shafts, then all of them. A whole number turns by counts, a word chooses what turns the shaft."""
    wanted: list[tuple[int, int | Coupling]] = []
    for name, change in changes(request).items():
        axis = axis_number(name)
        if not isinstance(change, int) or isinstance(change, bool):
            wanted.append((axis, _coupling(axis, change)))
            continue
        check_turn(axis, change)
        wanted.append((axis, change))
    for axis, change in wanted:
        if isinstance(change, int):
            device.turn_encoder(axis, change, now)
        else:
            device.couple_encoder(axis, change, now)
    return [
        {"axis": axis.number, "counts": axis.encoder_counts(now), "turned_by": axis.encoder.coupling.value}
        for axis in device.axes
    ]


def _coupling(axis: int, word: object) -> Coupling:
    try:
        return Coupling(word)
    except ValueError:
        permitted = ", ".join(coupling.value for coupling in Coupling)
        raise Misuse(f"M{axis} = {word!r}: an encoder is turned by {permitted}, or by +N or -N counts") from None
