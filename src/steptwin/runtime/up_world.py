"""`steptwin up MACHINE.toml`: a world in real time, whose lines other programs can talk on."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import count
from math import inf
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.runtime import session as sessions
from steptwin.runtime.beginning import begin_world, check_session_target, set_faults
from steptwin.runtime.cell import Cell
from steptwin.runtime.clock import Clock
from steptwin.runtime.export import axis_views, check_target, write_trace
from steptwin.runtime.output import Output
from steptwin.runtime.pace import Pace, read_speed
from steptwin.runtime.run_world import describe, is_told
from steptwin.runtime.server import Server, clear_ready_file
from steptwin.runtime.serving import check_name
from steptwin.runtime.tcp import check_addresses, parse_address
from steptwin.runtime.world import World
from steptwin.runtime.world_control import WorldControl
from steptwin.world.actions import Bytes, Leave, Outside
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
    strict: bool = False
    """Whether what was waited for in vain counts as a failure."""
    listen_any: bool = False
    allow_outside: bool = False
    """Files of the description may lie anywhere."""


MOST_INPUTS = 200_000
MOST_INPUT_BYTES = 16 << 20
"""Where a recorded session ends, so that its memory and its file stay bounded."""


class LiveWorld:
    """A world as a `Cell` keeps it up with real time."""

    def __init__(self, world: World, tell: Callable[[str], None] = lambda _: None) -> None:
        self.world = world
        self._tell = tell
        self._recorded_bytes = sum(_size(given.what) for given in world.inputs)
        self._full: sessions.Session | None = None
        self.stale = True
        """Something was done to it since somebody asked for the deadline."""
        self.on_stop: Callable[[], None] | None = None
        """Told when a script has stopped it: nothing happens by itself from then on."""

    @property
    def now(self) -> Nanos:
        return self.world.now

    def outside(self, what: Outside) -> None:
        """Do something from outside at the present moment, recorded where a session was asked for. Raises `Misuse`."""
        world = self.world
        if world.keeps_inputs:
            if len(world.inputs) >= MOST_INPUTS or self._recorded_bytes >= MOST_INPUT_BYTES:
                self._end_session()
            else:
                self._recorded_bytes += _size(what)
        world.outside(what)

    def _end_session(self) -> None:
        world = self.world
        self._full = sessions.session_of(world)
        world.keeps_inputs = False
        world.inputs.clear()
        self._tell(f"the session is full and ends at {world.time:g} s, after {len(self._full.inputs)} inputs")

    def session(self) -> sessions.Session:
        """The session up to now, or up to where it was full. Raises `Misuse` where none is recorded."""
        if self._full is not None:
            return self._full
        if not self.world.keeps_inputs:
            raise Misuse("this world records no session: start it with --session FILE")
        return sessions.session_of(self.world)

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


def _size(what: Outside) -> int:
    return len(what.data) if isinstance(what, Bytes) else 0


class PlacePort:
    """A place on a line for a program outside."""

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
        place = self._place()
        place.on_output = None  # what comes at once is given back at once
        self._live.outside(Bytes(self._line, self._name, self._kind, data))
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
        self._live.outside(Leave(self._line, self._name))


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
    set_faults(world, options.faults)
    outside = [line for line in world.spec.lines if line.tcp or line.rtu_tcp or line.pty or line.serial]
    if speed == inf and outside:
        raise Misuse(f"--speed max: line {outside[0].name!r} has clients outside, which need a clock; use 'steptwin run'")
    check_addresses((address for line in world.spec.lines for address in (line.tcp, line.rtu_tcp)), listen_any=options.listen_any)
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
    output.line(f"{world.time:.3f} s{inputs}{ended}, digest {world.trace.digest()}")
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
