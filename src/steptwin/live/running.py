"""`steptwin up MACHINE.toml`: run a world in real time, with lines to which other programs connect."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from math import inf
from pathlib import Path
from typing import TypeAlias

from steptwin.access.audit import Audit
from steptwin.controller import Nanos, SendingPort
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.auditfile import wall_clock
from steptwin.files.coverage import CoverageReports
from steptwin.files.export import axis_views, check_target, growing_file, read_trace, write_trace
from steptwin.files.export.tracefile import Kept, Ring, TraceFile, read_kept
from steptwin.files.loader import check_recording_target, is_recording, load_world, set_faults
from steptwin.files.world import World
from steptwin.gateways.contract import OpenGateway
from steptwin.live.clock import Clock
from steptwin.live.display import Display, Lines, Notices, banner, remarks_on
from steptwin.live.gateways import LiveWorldSubject, command_log_of, open_gateways
from steptwin.live.options import UpOptions
from steptwin.live.output import Output
from steptwin.live.pace import Pace, read_speed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.rfc2217 import TwinLine
from steptwin.live.server import Server, clear_ready_file
from steptwin.live.serving import check_name, shows_live_view
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.live.tracedport import TracedPort
from steptwin.live.transports import TRANSPORTS, VISION
from steptwin.live.world import ClientPort, LiveWorld, VisionPort, announced, send_away
from steptwin.live.world_control import WorldControl
from steptwin.services import read_services
from steptwin.simulation.kinds.kind import LinkKind
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.toml.addresses import check_addresses, parse_address
from steptwin.simulation.world.records import is_shown, named_in, read_selection
from steptwin.tracing import is_traced


@dataclass(frozen=True, slots=True)
class Running:
    """A world that is about to run, for what is served beside its lines."""

    server: Server
    live: LiveWorld
    pace: Pace
    control: WorldControl
    gateways: list[OpenGateway] = field(default_factory=list)
    """Those that are open, the history among them; empty until the world runs."""


Addition: TypeAlias = Callable[[Running], Awaitable[None]]
"""Opens further links of the world, which the server closes. With it no records are printed."""


def up(options: UpOptions, addition: Addition | None = None) -> bool:
    """Run a world until SIGINT, SIGTERM or SIGHUP, or until a script stops it. Returns whether all expectations held.

    Raises `Misuse` or another `SteptwinError` with a text for the user.
    """
    if options.world is None:
        raise Misuse("a world is missing: give its description (.toml) or a recording (.json)")
    check_name(options.live.name or options.world.stem)
    read_speed(options.live.speed, least=0)
    with load_world(
        options.world,
        lambda text: sys.stderr.write(f"{text}\n"),
        moment=options.run.moment,
        seed=options.run.seed,
        overrides=options.run.overrides,
        keep_trace=options.live.trace not in (None, "off") or not is_recording(options.world),
        keep_inputs=options.is_recorded,
        allow_outside=options.run.allow_outside,
        state=options.run.state,
    ) as world:
        return up_with(world, options, addition)


def up_with(world: World, options: UpOptions, addition: Addition | None = None) -> bool:
    """As `up`, with an existing world."""
    name = options.live.name or (world.spec.name if options.world is None else options.world.stem)
    speed = read_speed(options.live.speed, least=0)
    if not options.is_closed:
        send_away(world)
    past = [] if world.now else [record for record in world.trace if is_shown(record)]
    kept = read_kept(options.live.trace or world.spec.trace or "off")
    if kept is None:
        world.trace.let_go()
        if not options.is_recorded:
            world.stop_recording()
    set_faults(world, options.run.fault)
    reports = CoverageReports(options.coverage)
    reports.observe(world, Path() if options.world is None else options.world.parent)
    outside = [line for line in world.spec.lines if line.is_open]
    if speed == inf and outside:
        raise Misuse(f"--speed max: line {outside[0].name!r} has external clients, which need real time; use 'steptwin run'")
    addresses = [address for line in world.spec.lines for key, address in line.links.items() if TRANSPORTS[key].is_address]
    addresses += [gateway.listen for gateway in read_services(world.spec.text).gateways]
    world.spec.text.check()  # the description may have been read before the tables of services were known
    check_addresses((*addresses, *(address for _, address in world.spec.vision_addresses())), listen_any=options.live.listen_any)
    if isinstance(kept, Path):
        check_target(kept)
    if options.run.session is not None:
        check_recording_target(options.run.session)
    if options.ready_file is not None:
        clear_ready_file(options.ready_file)
    asyncio.run(_serve(replace(options, live=replace(options.live, name=name)), world, past, kept, reports, addition))
    return not world.failures and not (options.run.strict and world.overdue)


async def _serve(
    options: UpOptions,
    world: World,
    past: list[TraceRecord],
    kept: Kept,
    reports: CoverageReports,
    addition: Addition | None,
) -> None:
    with ExitStack() as stack:
        output = options.log.output()
        stack.callback(output.close)
        stack.enter_context(options.log.tracing(world.spec.name, output.notice))
        world.trace.subscribers.append(past.append)  # controllers may act while links are opened
        live = LiveWorld(world)
        realtime = RealTimeDriver(live, Clock(begin=world.now))
        quiet = addition is not None
        display = Notices(live, output, frames=options.live.log_frames) if quiet else _display(live, realtime, output, options)
        live.show = display.notice
        server = Server(realtime, display.notice)
        live.share_reads(realtime)
        pace = Pace(live, realtime, display.notice, has_clients=any(line.is_open for line in world.spec.lines))
        live.on_stop = server.end if addition is None else None
        begun, recorder = False, None
        try:
            await _open(server, live, pace, options, addition)
            recorder = _recorder(live, kept)
            begun = True
            head = banner(world, server.end_points, remarks_on(world, listen_any=options.live.listen_any))
            world.trace.subscribers.remove(past.append)
            display.begin(head, server.announcement(), past)
            pace.begin(read_speed(options.live.speed, least=0))
            await display.show(server)
            realtime.enter()
        finally:
            pace.close()
            await server.close()
            if begun:
                _keep(options, live, output, recorder, kept, reports)


def _display(live: LiveWorld, realtime: RealTimeDriver, output: Output, options: UpOptions) -> Display:
    selection = read_selection(options.shown.of, options.shown.show, named_in(live.world.objects))
    if not shows_live_view(output, log_frames=options.live.log_frames):
        return Lines(live, output, frames=options.live.log_frames, selection=selection)
    from steptwin.live.view import LiveView

    return LiveView(live, realtime, output, selection)


def _recorder(live: LiveWorld, kept: Kept) -> TraceFile | None:
    """The recorder that writes the trace to a file; None for a ring, which the world keeps."""
    world, recorder = live.world, None
    if isinstance(kept, int):
        live.ring = Ring(world.trace, kept)
    elif kept is not None:
        live.trace_file = kept
        recorder = TraceFile(world.trace, growing_file(kept), axis_views(world), world.spec.name, live.show)
    if kept is not None:
        world.trace.let_go()
    return recorder


def _keep(
    options: UpOptions, live: LiveWorld, output: Output, recorder: TraceFile | None, kept: Kept, reports: CoverageReports
) -> None:
    """Write recording, trace and coverage at the end: the recording first, because a trace can be made from it. Raises
    `Misuse`."""
    world = live.world
    world.advance(world.now)
    world.sync_all()
    failures: list[str] = []
    recording = options.run.session
    writing: list[Callable[[], list[Path]]] = [] if recording is None else [partial(_write_recording, recording, live)]
    if recorder is not None and isinstance(kept, Path):
        writing.append(partial(_write_trace, recorder, kept, world.now))
    writing.append(partial(reports.write, output.line))
    for write in writing:
        try:
            for path in write():
                output.line(f"wrote {path}")
        except Misuse as error:
            failures.append(str(error))
    ended = "" if world.stopped is None else f", ended by: {world.stopped}"
    inputs = f", {len(live.recording().inputs)} inputs" if options.run.session is not None else ""
    digest = f", digest {world.trace.digest()}" if world.trace.is_recorded else ""
    output.line(f"ran for {world.time:.3f} s{inputs}{ended}{digest}")
    if failures:
        raise Misuse("\n".join(failures))


def _write_recording(where: Path, live: LiveWorld) -> list[Path]:
    recordings.save(live.recording(), where)
    return [where]


def _write_trace(recorder: TraceFile, where: Path, ended: Nanos) -> list[Path]:
    """Close the trace, and convert it where another format is wanted."""
    recorder.close(ended)
    if recorder.path == where:
        return [where]
    saved = read_trace(recorder.path)
    written = write_trace(saved.trace, where, views=saved.views, title=saved.title, ended=saved.until)
    if recorder.path not in written:
        recorder.path.unlink()
    return written


# ---------------------------------------------------------------------- links


async def _open(server: Server, live: LiveWorld, pace: Pace, options: UpOptions, addition: Addition | None) -> None:
    name = options.live.name or live.world.spec.name
    control = WorldControl(server.realtime, live, pace, server.announcement)
    server.introduce(name, partial(announced, live.world), options.world)
    services = read_services(live.world.spec.text)
    if options.audit is None and services.history is not None:
        options = replace(options, audit=Audit(wall_clock))
    server.audit = command_log_of(options.audit, lambda: live.world.now)
    if not options.is_closed:
        await _open_for_others(server, live, control, options)
    if options.past:
        server.join(WorldTimeTravel(live, server.realtime, pace))
    running = Running(server, live, pace, control)
    if addition is not None:
        await addition(running)
    if not options.is_closed:
        folder = Path() if options.world is None else options.world.parent
        subject = LiveWorldSubject(control, live)
        subject.audit = server.audit
        running.gateways.extend(
            await open_gateways(server, services, folder, subject, options.audit, listen_any=options.live.listen_any)
        )
    if options.ready_file is not None:
        server.write_ready_file(options.ready_file)


async def _open_for_others(server: Server, live: LiveWorld, control: WorldControl, options: UpOptions) -> None:
    address = None if options.live.control is None else parse_address(options.live.control, listen_any=False)
    await server.open_control(control, address)
    for line in live.world.spec.lines:
        await _open_line(server, live, line, options)
    for controller, where in live.world.spec.vision_addresses():
        make_port = partial(VisionPort, live, controller)
        await server.open(VISION, where, f"vision records, {controller}", make_port, listen_any=options.live.listen_any)


async def _open_line(server: Server, live: LiveWorld, line: LineSpec, options: UpOptions) -> None:
    number, there = count(1), live.world.lines[line.name]
    wire = TwinLine(lambda: there.baud, there.is_timed)

    def maker(link: LinkKind, *, several: bool) -> Callable[[], SendingPort]:
        def make() -> SendingPort:
            port = ClientPort(live, line.name, f"{link.client}-{next(number)}" if several else link.client, link.client_kind)
            return TracedPort(port, line.name) if is_traced() else port

        return make

    on = "" if len(live.world.spec.lines) == 1 else f", {line.name}"
    links = line_kinds()[line.kind].opened_by
    folder = Path() if options.world is None else options.world.parent
    how = {"listen_any": options.live.listen_any, "tls": line.tls, "folder": folder}
    for key, where in line.links.items():
        link, transport = links[key], TRANSPORTS[key]
        make_port = maker(link, several=transport.has_several)
        protocol = f"{link.protocol}{on}"
        await server.open(transport, where, protocol, make_port, line=line.name, wire=wire, **how)
