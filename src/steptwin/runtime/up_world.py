"""`steptwin up MACHINE.toml`: a world in real time, whose lines other programs can talk on."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import count
from math import inf
from pathlib import Path
from typing import Any

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.mic488.device import Mic488
from steptwin.runtime import session as sessions
from steptwin.runtime.beginning import begin_world, check_session_target, set_faults
from steptwin.runtime.cell import Cell
from steptwin.runtime.clock import Clock
from steptwin.runtime.control import Handler
from steptwin.runtime.export import axis_views, check_target, write_trace
from steptwin.runtime.m1486_state import state_of as state_of_chip
from steptwin.runtime.mic488 import state_of
from steptwin.runtime.output import Output
from steptwin.runtime.pace import Pace, read_speed
from steptwin.runtime.run_world import describe, is_told
from steptwin.runtime.server import Server, clear_ready_file
from steptwin.runtime.serving import check_name
from steptwin.runtime.tcp import parse_address
from steptwin.runtime.world import World
from steptwin.world import script as do
from steptwin.world.actions import Bytes, Leave
from steptwin.world.faults import read as read_fault
from steptwin.world.lines import SCRIPTS, Place
from steptwin.world.spec import LineSpec
from steptwin.world.trace import Record


@dataclass(frozen=True, slots=True, kw_only=True)
class UpOptions:
    """The command's options as given; see ``steptwin up --help``."""

    world: Path
    """A description, or a session to go on from."""
    moment: Nanos | None = None
    """That of the session; None: its end."""
    seed: int | None = None
    speed: str = "1"
    name: str | None = None
    session: Path | None = None
    trace: Path | None = None
    faults: Sequence[str] = ()
    ready_file: Path | None = None
    listen_any: bool = False


class LiveWorld:
    """A world as a `Cell` keeps it up with real time."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.stale = True
        """Something was done to it since somebody asked for the deadline."""
        self.on_stop: Callable[[], None] | None = None
        """Told when a script has stopped it: nothing happens by itself from then on."""

    @property
    def now(self) -> Nanos:
        return self.world.now

    def advance(self, now: Nanos) -> None:
        world = self.world
        while (due := self._due()) is not None and due <= now:
            world.advance(due)
            if world.stopped is not None:
                break
            for kernel in world.kernels:
                at = kernel.deadline()
                if at is not None and at <= due:
                    kernel.advance(due)
        world.advance(now)
        if world.stopped is not None and self.on_stop is not None:
            self.on_stop()

    def deadline(self) -> Nanos | None:
        self.stale = False
        return self._due()

    def _due(self) -> Nanos | None:
        if self.world.stopped is not None:
            return None
        dues = [due for kernel in self.world.kernels if (due := kernel.deadline()) is not None]
        own = self.world.next()
        return min(dues if own is None else [*dues, own], default=None)


class PlacePort:
    """A place on a line for a program outside; everything it sends goes into the session."""

    broken: str | None = None

    def __init__(self, live: LiveWorld, line: str, place: str, kind: str) -> None:
        self._live = live
        self._line = line
        self._name = place
        self._kind = kind
        self.on_output: Callable[[], None] | None = None

    def _place(self) -> Place:
        place = self._live.world.lines[self._line].connect(self._name, self._kind)
        place.on_output = self._came
        return place

    def _came(self) -> None:
        if self.on_output is not None:
            self.on_output()

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        world = self._live.world
        place = self._place()
        place.on_output = None  # what comes at once is given back at once
        world.outside(Bytes(self._line, self._name, self._kind, data))
        self._live.stale = True
        answer = b"".join(piece for _, piece in place.take(now))
        place.on_output = self._came
        self.broken = place.port.broken
        return answer

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._live.world.touch(self._line)
        return self._place().take(now)

    def deadline(self) -> Nanos | None:
        """Nothing to be asked for: ``on_output`` tells when there is something."""
        return None

    def close(self) -> None:
        self._live.world.outside(Leave(self._line, self._name))


def up(options: UpOptions) -> bool:
    """Run a world until SIGINT, SIGTERM or SIGHUP, or until a script stops it; whether all expectations held.

    Raises `Misuse` or another `SteptwinError` with a text for the user.
    """
    name = options.name or options.world.stem
    check_name(name)
    speed = read_speed(options.speed, least=0)
    world = begin_world(
        options.world,
        lambda text: sys.stderr.write(f"{text}\n"),
        moment=options.moment,
        seed=options.seed,
        keep_trace=options.trace is not None,
    )
    _send_away(world)
    set_faults(world, options.faults)
    outside = [line for line in world.spec.lines if line.tcp or line.rtu_tcp or line.pty or line.serial]
    if speed == inf and outside:
        raise Misuse(f"--speed max: line {outside[0].name!r} has clients outside, which need a clock; use 'steptwin run'")
    for line in world.spec.lines:
        for address in (line.tcp, line.rtu_tcp):
            if address is not None:
                parse_address(address, listen_any=options.listen_any)
    if options.trace is not None:
        check_target(options.trace)
    if options.session is not None:
        check_session_target(options.session)
    if options.ready_file is not None:
        clear_ready_file(options.ready_file)
    asyncio.run(_serve(options, world, speed, name, has_clients=bool(outside)))
    return not world.failures


def _send_away(world: World) -> None:
    """Who was there in the session is not there now."""
    for line in world.lines.values():
        for place in [place for place in line.places if place != SCRIPTS]:
            world.outside(Leave(line.name, place))


async def _serve(options: UpOptions, world: World, speed: float, name: str, *, has_clients: bool) -> None:
    with ExitStack() as stack:
        output = Output(sys.stdout)
        stack.callback(output.close)
        live = LiveWorld(world)
        server = Server(Cell(live, Clock(begin=world.now)), output.line)
        pace = Pace(live, server.cell, output.line, has_clients=has_clients)
        live.on_stop = server.end
        begun = False
        try:
            await _open(server, live, pace, options, name)
            begun = True
            _greet(output, server, world)
            world.trace.watchers.append(lambda record: _tell(output, record))
            pace.begin(speed)
            await server.until_ended()
            server.cell.enter()
        finally:
            pace.close()
            await server.close()
            if begun:
                _keep(options, world, output)


def _greet(output: Output, server: Server, world: World) -> None:
    output.line(f"{world.spec.name}: {', '.join(world.machines)}")
    for end_point in server.end_points:
        output.line(f"  {end_point.protocol:<24} {end_point.place}")
    output.line("Ctrl-C ends")


def _tell(output: Output, record: Record) -> None:
    if is_told(record):
        output.line(describe(record))


def _keep(options: UpOptions, world: World, output: Output) -> None:
    """Write what was asked for when it is over. The session first: a trace can be made from it. Raises `Misuse`."""
    session = sessions.session_of(world)
    failures: list[str] = []
    for where, write in ((options.session, _write_session), (options.trace, _write_trace)):
        if where is not None:
            try:
                for path in write(where, world, session):
                    output.line(f"wrote {path}")
            except Misuse as error:
                failures.append(str(error))
    ended = "" if world.stopped is None else f", ended by: {world.stopped}"
    output.line(f"{world.time:.3f} s, {len(session.inputs)} inputs{ended}, digest {session.digest}")
    if failures:
        raise Misuse("\n".join(failures))


def _write_session(where: Path, world: World, session: sessions.Session) -> list[Path]:
    sessions.save(session, where)
    return [where]


def _write_trace(where: Path, world: World, session: sessions.Session) -> list[Path]:
    views = axis_views(world.machines, world.axes)
    return write_trace(world.trace, where, views=views, title=world.spec.name, ended=world.now)


# ---------------------------------------------------------------------- links


async def _open(server: Server, live: LiveWorld, pace: Pace, options: UpOptions, name: str) -> None:
    await server.open_control(name, {**handlers_of(server.cell, live), **pace.handlers()})
    for line in live.world.spec.lines:
        await _open_line(server, live, line, options)
    if options.ready_file is not None:
        server.write_ready_file(options.ready_file, name)


async def _open_line(server: Server, live: LiveWorld, line: LineSpec, options: UpOptions) -> None:
    number = count(1)
    serial_kind = "rtu" if line.kind == "modbus" else "raw"
    what = f"Modbus RTU, {line.name}" if line.kind == "modbus" else f"M1486 line, {line.name}"

    def maker(link: str, kind: str, *, several: bool) -> Callable[[], PlacePort]:
        return lambda: PlacePort(live, line.name, f"{link}-{next(number)}" if several else link, kind)

    if line.pty is not None:
        await server.open_pty(Path(line.pty), what, maker("pty", serial_kind, several=False))
    if line.serial is not None:
        baud = line.baud or 38400
        await server.open_serial(line.serial, baud, what, maker("serial", serial_kind, several=False))
    if line.tcp is not None:
        address = parse_address(line.tcp, listen_any=options.listen_any)
        kind = "tcp" if line.kind == "modbus" else "raw"
        protocol = f"Modbus TCP, {line.name}" if line.kind == "modbus" else what
        await server.open_tcp("tcp", address, protocol, maker("tcp", kind, several=True))
    if line.rtu_tcp is not None:
        address = parse_address(line.rtu_tcp, listen_any=options.listen_any)
        await server.open_tcp("rtu-tcp", address, f"RTU over TCP, {line.name}", maker("rtu", "rtu", several=True))


# ---------------------------------------------------------------------- a hand at the machine


def _worked(world: World, name: str, value: float) -> do.Press | do.Release | None:
    """A button by its name; None if there is no such button."""
    button = next((b for b in world.plan.buttons if b.upper() == name.upper()), None)
    if button is None:
        return None
    if value not in (0, 1):
        raise Misuse(f"{button} = {value:g}: a button takes 1 (pressed) and 0 (released)")
    return do.Press(button) if value else do.Release(button)


def _chosen(world: World, wanted: str, pin: str | None) -> str:
    """The machine meant, which is the only one where none is named."""
    if not wanted and len(world.machines) == 1:
        return next(iter(world.machines))
    for name in world.machines:
        if name.upper() == wanted.upper():
            return name
    machines = ", ".join(world.machines)
    if pin is not None and not wanted:
        buttons = ", ".join(world.plan.buttons) or "none"
        raise Misuse(f"{pin}: give a pin as MACHINE.PIN; machines are {machines}; buttons are {buttons}")
    raise Misuse(f"choose a machine with --unit: {machines}")


def handlers_of(cell: Cell, live: LiveWorld) -> dict[str, Handler]:
    """Requests of the control endpoint. ``unit`` is the name of a machine; pins are ``MACHINE.PIN``, buttons their names."""
    world = live.world

    def acting(action: Callable[[Mapping[str, Any]], object]) -> Handler:
        def handle(request: Mapping[str, Any]) -> object:
            cell.enter()
            try:
                return action(request)
            finally:
                live.stale = True
                cell.leave()

        return handle

    def chosen(request: Mapping[str, Any], pin: str | None = None) -> str:
        return _chosen(world, str(request.get("unit") or ""), pin)

    def pin(request: Mapping[str, Any]) -> object:
        for name, value in (request.get("set") or {}).items():
            if not isinstance(value, int | float):
                raise Misuse(f"{name} = {value!r}: a pin takes a number")
            if "." in name:
                owner, _, pin = name.rpartition(".")
                step: do.Set | do.Press | do.Release = do.Set(((chosen({"unit": owner}), pin.upper(), float(value)),))
            else:
                step = _worked(world, name, value) or do.Set(((chosen(request, name), name.upper(), float(value)),))
            world.outside(step)
        shown = list(world.machines) if request.get("unit") is None else [chosen(request)]
        for name in shown:
            world.touch(name)
        return {f"{name}.{pin}": value for name in shown for pin, value in world.machines[name].pins().items()}

    def state(request: Mapping[str, Any]) -> object:
        name = chosen(request)
        world.touch(name)
        machine = world.machines[name]
        return state_of(machine, world.now) if isinstance(machine, Mic488) else state_of_chip(machine, world.now)

    def power_cycle(request: Mapping[str, Any]) -> object:
        world.outside(do.PowerCycle(chosen(request)))
        return None

    def encoder(request: Mapping[str, Any]) -> object:
        name = chosen(request)
        device = world.controller(name, "encoder")
        for number, change in (request.get("set") or {}).items():
            if not isinstance(change, int):
                raise Misuse("what turns a shaft is said in the world's file: an encoder is turned by +N or -N counts")
            world.outside(do.Turn(name, int(number), change))
        world.touch(name)
        return [
            {"axis": a.number, "counts": a.encoder_counts(world.now), "turned_by": a.encoder.coupling.value} for a in device.axes
        ]

    return {
        "pin": acting(pin),
        "state": acting(state),
        "power-cycle": acting(power_cycle),
        "encoder": acting(encoder),
        "fault": acting(lambda request: _fault(world, request)),
    }


def _fault(world: World, request: Mapping[str, Any]) -> object:
    faults = world.plan.faults
    wanted = [read_fault(line) for line in request.get("set") or []]
    for fault in wanted:
        world.rigging.check(fault)
    unwanted = request.get("clear") or []
    for name in [active.name for active in faults.active] if unwanted is True else unwanted:
        world.outside(do.ClearFault(name))
    for fault in wanted:
        world.outside(do.SetFault(fault))
    return [{"name": a.name, "fault": str(a.fault), "happened": a.struck} for a in faults.active]
