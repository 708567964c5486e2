"""`steptwin up MACHINE.toml`: a world in real time, whose lines other programs can talk on."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import count
from math import inf
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files import session as sessions
from steptwin.files.beginning import begin_world, check_session_target, set_faults
from steptwin.files.export import axis_views, check_target, write_trace
from steptwin.files.world import World
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.output import Output
from steptwin.live.pace import Pace, read_speed
from steptwin.live.rfc2217 import TwinLine, over_network
from steptwin.live.server import Server, clear_ready_file
from steptwin.live.serving import check_name
from steptwin.live.world import LiveWorld, PlacePort, VisionPort
from steptwin.live.world_control import WorldControl
from steptwin.live.world_frames import follow_frames
from steptwin.machine import Nanos
from steptwin.words.records import describe, is_told
from steptwin.world.actions import Leave
from steptwin.world.addresses import check_addresses, parse_address
from steptwin.world.lines import SCRIPTS
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
    strict: bool = False
    """Whether what was waited for in vain counts as a failure."""
    listen_any: bool = False
    log_frames: bool = False
    allow_outside: bool = False
    """Files of the description may lie anywhere."""


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
        keep_inputs=options.session is not None,
        allow_outside=options.allow_outside,
    )
    _send_away(world)
    if options.session is None and options.trace is None:
        world.stop_recording()
    set_faults(world, options.faults)
    outside = [line for line in world.spec.lines if line.is_open]
    if speed == inf and outside:
        raise Misuse(f"--speed max: line {outside[0].name!r} has clients outside, which need a clock; use 'steptwin run'")
    addresses = [address for line in world.spec.lines for address in (line.tcp, line.rtu_tcp, line.rfc2217)]
    check_addresses((*addresses, *(spec.vision for spec in world.spec.mic488)), listen_any=options.listen_any)
    if options.trace is not None:
        check_target(options.trace)
    if options.session is not None:
        check_session_target(options.session)
    if options.ready_file is not None:
        clear_ready_file(options.ready_file)
    asyncio.run(_serve(options, world, speed, name, has_clients=bool(outside)))
    return not world.failures and not (options.strict and world.overdue)


def _send_away(world: World) -> None:
    """Who was there in the session is not there now."""
    for line in world.lines.values():
        for place in [place for place in line.places if place != SCRIPTS]:
            world.outside(Leave(line.name, place))


async def _serve(options: UpOptions, world: World, speed: float, name: str, *, has_clients: bool) -> None:
    with ExitStack() as stack:
        output = Output(sys.stdout)
        stack.callback(output.close)
        live = LiveWorld(world, output.line)
        server = Server(Cell(live, Clock(begin=world.now)), output.line)
        live.share_reads(server.cell)
        pace = Pace(live, server.cell, output.line, has_clients=has_clients)
        live.on_stop = server.end
        begun = False
        try:
            if options.log_frames:
                follow_frames(live, lambda frame: output.line(str(frame)))
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
                _keep(options, live, output)


def _greet(output: Output, server: Server, world: World) -> None:
    output.line(f"{world.spec.name}: {', '.join(world.machines)}")
    for end_point in server.end_points:
        output.line(f"  {end_point.protocol:<24} {end_point.place}")
    output.line("Ctrl-C ends")


def _tell(output: Output, record: Record) -> None:
    if is_told(record):
        output.line(describe(record))


def _keep(options: UpOptions, live: LiveWorld, output: Output) -> None:
    """Write what was asked for when it is over. The session first: a trace can be made from it. Raises `Misuse`."""
    world = live.world
    world.advance(world.now)
    world.settle_all()
    failures: list[str] = []
    for where, write in ((options.session, _write_session), (options.trace, _write_trace)):
        if where is not None:
            try:
                for path in write(where, live):
                    output.line(f"wrote {path}")
            except Misuse as error:
                failures.append(str(error))
    ended = "" if world.stopped is None else f", ended by: {world.stopped}"
    inputs = f", {len(live.session().inputs)} inputs" if options.session is not None else ""
    digest = f", digest {world.trace.digest()}" if world.trace.is_recorded else ""
    output.line(f"{world.time:.3f} s{inputs}{ended}{digest}")
    if failures:
        raise Misuse("\n".join(failures))


def _write_session(where: Path, live: LiveWorld) -> list[Path]:
    sessions.save(live.session(), where)
    return [where]


def _write_trace(where: Path, live: LiveWorld) -> list[Path]:
    world = live.world
    views = axis_views(world.machines, world.axes)
    return write_trace(world.trace, where, views=views, title=world.spec.name, ended=world.now)


# ---------------------------------------------------------------------- links


async def _open(server: Server, live: LiveWorld, pace: Pace, options: UpOptions, name: str) -> None:
    await server.open_control(name, {**WorldControl(server.cell, live).handlers(), **pace.handlers()})
    for line in live.world.spec.lines:
        await _open_line(server, live, line, options)
    for spec in live.world.spec.mic488:
        if spec.vision is not None:
            address = parse_address(spec.vision, listen_any=options.listen_any)
            await server.open_tcp("vision", address, f"vision records, {spec.name}", partial(VisionPort, live, spec.name))
    if options.ready_file is not None:
        server.write_ready_file(options.ready_file, name)


async def _open_line(server: Server, live: LiveWorld, line: LineSpec, options: UpOptions) -> None:
    number, there = count(1), live.world.lines[line.name]
    serial_kind = "rtu" if line.kind == "modbus" else "raw"
    what = f"Modbus RTU, {line.name}" if line.kind == "modbus" else f"M1486 line, {line.name}"

    def maker(link: str, kind: str, *, several: bool) -> Callable[[], PlacePort]:
        return lambda: PlacePort(live, line.name, f"{link}-{next(number)}" if several else link, kind)

    if line.pty is not None:
        await server.open_pty(Path(line.pty), what, maker("pty", serial_kind, several=False))
    if line.serial is not None:
        kind = "serial" if line.kind == "modbus" else "raw"
        await server.open_serial(line.serial, there.baud, what, maker("serial", kind, several=False))
    if line.tcp is not None:
        address = parse_address(line.tcp, listen_any=options.listen_any)
        kind = "tcp" if line.kind == "modbus" else "raw"
        protocol = f"Modbus TCP, {line.name}" if line.kind == "modbus" else what
        await server.open_tcp("tcp", address, protocol, maker("tcp", kind, several=True))
    if line.rtu_tcp is not None:
        address = parse_address(line.rtu_tcp, listen_any=options.listen_any)
        await server.open_tcp("rtu-tcp", address, f"RTU over TCP, {line.name}", maker("rtu", "rtu", several=True))
    if line.rfc2217 is not None:
        address = parse_address(line.rfc2217, listen_any=options.listen_any)
        make = maker("rtu" if line.kind == "modbus" else "tcp", serial_kind, several=True)
        wire = TwinLine(lambda: there.baud, there.is_timed, server.notice)
        await server.open_tcp("rfc2217", address, f"network port, {line.name}", lambda: over_network(make(), wire))
