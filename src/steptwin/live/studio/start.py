"""`steptwin studio`: a world in real time, or devices, or both, with a page for them; the lines of a world are open as with
`steptwin up`."""

from __future__ import annotations

import asyncio
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from steptwin import __version__
from steptwin.access.audit import Audit
from steptwin.access.origin import Origins
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate, Token
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.connections import Computer, DeviceConnections
from steptwin.devices.device import DeviceSurroundings
from steptwin.errors import Misuse
from steptwin.explain.model import MemoryUse
from steptwin.files.auditfile import AuditFile, wall_clock
from steptwin.files.export.tracefile import read_kept
from steptwin.files.loader import is_recording
from steptwin.files.tokenfiles import tokens_in
from steptwin.httpservice import Tls, listen
from steptwin.later import finish
from steptwin.live.keptsettings import keep_settings, state_directory
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.ports import serial_ports, twin_ports
from steptwin.live.running import Running, up, up_with
from steptwin.live.server import EndPoint, Server
from steptwin.live.studio.branches import BranchStart, WorldBranches
from steptwin.live.studio.campaigns import FolderCampaigns
from steptwin.live.studio.demo import demo_world
from steptwin.live.studio.devicemachine import DeviceMachine, read_machine
from steptwin.live.studio.models import models_of
from steptwin.live.studio.openpage import DEFAULT, OpenedPage, has_desktop
from steptwin.live.studio.options import StudioOptions
from steptwin.live.studio.owntokens import new_tokens, own_tokens
from steptwin.live.studio.recorded import replayed
from steptwin.live.studio.recordings import WorldRecordings
from steptwin.live.studio.services import LiveServices
from steptwin.live.studio.shownworld import ShownWorld
from steptwin.live.studio.work import LineWork
from steptwin.live.twins import find_device
from steptwin.live.withoutworld import serve_without_world
from steptwin.messages import Message
from steptwin.simulation.toml.addresses import Address, is_loopback, parse_address
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.simulation.world.worldprograms import ShownProgram, ShownProgramText
from steptwin.studio.hub import Hub
from steptwin.studio.service import StudioService
from steptwin.studio.surroundings import PresentMoment, Surroundings
from steptwin.studio.work import DeviceWork
from steptwin.subject.events import Numbering

ANY = ("0.0.0.0", "::")


def studio(own: StudioOptions, options: UpOptions) -> bool:
    """Show a world, devices, or both; by default the demo machine. Whether all expectations of the world's scripts held.

    Raises `Misuse` or another `SteptwinError` with a text for the user.
    """
    if own.view and (options.world is None or own.device):
        raise Misuse("--view shows one recording (.json), and no device: name its file")
    own = replace(own, is_demo=options.world is None and not own.device and not _keeps_files(own, options))
    entrance = _entrance(own)
    with ExitStack() as stack:
        audit = Audit(wall_clock) if own.audit is None else Audit(wall_clock, stack.enter_context(AuditFile(own.audit)).add)
        listening = stack.enter_context(listen(entrance.address, is_fixed=own.http is not None))
        page = _Page(own, entrance, listening, audit)
        if own.view and options.world is not None:
            world, snapshots, differs = finish(replayed(options.world))
            if differs:
                sys.stderr.write(f"{differs}\n")
            stack.enter_context(world)
            opening = partial(page.open, beside=options, snapshots=snapshots)
            return up_with(world, replace(options, live=replace(options.live, speed="0"), is_closed=True), opening)
        if options.world is not None and own.has_no_world:
            opening = partial(page.open_without_world, machine=read_machine(options.world, own.devices))
            asyncio.run(serve_without_world(options.ready_file, opening, options.log))
            return True
        if options.world is not None:
            return up(replace(options, keeps_inputs=True, audit=audit), partial(page.open, beside=options))
        if own.device:
            asyncio.run(serve_without_world(options.ready_file, page.open_without_world, options.log))
            return True
        options = replace(options, keeps_inputs=True)
        with demo_world(options) as world:
            return up_with(world, options, partial(page.open, beside=options))


def studio_of_branch(start: BranchStart) -> None:
    """Show a branch, in which time stands at first. Raises as `studio`."""
    entrance = _entrance(start.own)
    with (
        listen(entrance.address, is_fixed=True) as listening,
        start.state.world() as world,
    ):
        page = _Page(start.own, entrance, listening, Audit(wall_clock))
        options = UpOptions(world=None, live=LiveOptions(speed="0"), ready_file=start.ready_file, is_closed=True)
        up_with(world, options, partial(page.open))


@dataclass(frozen=True, slots=True)
class AccessInfo:
    """The address of the studio, and its tokens."""

    address: Address
    tls: Tls | None
    tokens: tuple[Token, ...]
    """The one of the highest role first; without any, nobody needs one."""
    file: Path | None
    """That of the tokens."""
    highest: Role
    is_demo: bool

    @property
    def asks(self) -> bool:
        """Whether a token is needed for more than devices."""
        return bool(self.tokens) and not self.is_demo

    def gate(self, has_devices: Callable[[], bool]) -> AccessGate:
        """The demo machine is open to all users of this computer, until a device is connected."""
        tokens = [replace(token, role=min(token.role, self.highest)) for token in self.tokens]
        open_to = None if self.asks else self.highest
        return AccessGate(tokens, open_to=open_to, is_open=lambda: not tokens or not has_devices())

    def place(self, url: str) -> str:
        """For people; a token only for those who sit at the terminal."""
        if not self.asks:
            return url if self.file is None else f"{url} (devices: tokens in {self.file})"
        if not sys.stdout.isatty():
            return f"{url} (tokens: {self.file})"
        if is_loopback(self.address.host):
            return f"{url}#token={self.tokens[0].text}"
        return "  ".join(f"{url}#token={token.text} ({token.name}, {token.role.title})" for token in self.tokens)


def _entrance(own: StudioOptions) -> AccessInfo:
    """Raises `Misuse` for options that do not go together."""
    if (own.certificate is None) is not (own.key is None):
        raise Misuse("--certificate and --key go together: both or none")
    tls = None if own.certificate is None or own.key is None else Tls(certificate=own.certificate, key=own.key)
    address = DEFAULT if own.http is None else parse_address(own.http, listen_any=True)
    is_local = is_loopback(address.host)
    if not is_local and tls is None and not own.remote:
        raise Misuse(
            f"--http {address}: others can reach this address, and tokens and commands would go there unencrypted: "
            "give --certificate and --key, or permit it with --remote"
        )
    if own.remote and is_local:
        raise Misuse(f"--remote permits an --http address that others can reach, but {address} is none; such as 0.0.0.0:8488")
    if own.open_to_local_users and not is_local:
        raise Misuse(f"--open-to-local-users is for an --http address of this computer; {address} is reached by others")
    if own.open_to_local_users and own.tokens is not None:
        raise Misuse("--open-to-local-users and --tokens exclude each other")
    is_demo = own.is_demo and is_local and own.tokens is None
    file, tokens = (None, ()) if own.open_to_local_users else _tokens(own.tokens, is_demo=is_demo)
    tokens = tuple(sorted(tokens, key=lambda token: token.role, reverse=True))
    return AccessInfo(address, tls, tokens, file, own.highest, is_demo)


def _tokens(file: Path | None, *, is_demo: bool) -> tuple[Path | None, tuple[Token, ...]]:
    """Those of a file, or of this user. Raises `Misuse`."""
    if file is not None:
        return file, tokens_in(file)
    try:
        return own_tokens()
    except Misuse:
        if is_demo:  # it runs also where nothing can be kept; devices cannot be connected then
            return None, new_tokens()
        raise


def _keeps_files(own: StudioOptions, options: UpOptions) -> bool:
    """Whether what happens is written into files that the user has named."""
    traced = options.live.trace is not None and isinstance(read_kept(options.live.trace), Path)
    return traced or any((own.audit, options.run.state, options.run.session, options.coverage))


class _Page:
    """The page of a world that is about to run, of devices, or of both."""

    def __init__(self, own: StudioOptions, entrance: AccessInfo, listening: socket.socket, audit: Audit) -> None:
        self._own = own
        self._entrance = entrance
        self._listening = listening
        self._audit = audit

    async def open(self, running: Running, *, beside: UpOptions | None = None, snapshots: SnapshotLog | None = None) -> None:
        """Serve it in the event loop of a world, with the past of one that has one already. ``beside``: of the world whose
        recordings are saved; a branch has none."""
        live, server, world = running.live, running.server, None if beside is None else beside.world
        shown = ShownWorld(live, server.realtime, running.pace, running.control, file=world, snapshots=snapshots)
        server.join(shown.time_travel)
        recordings = None if beside is None else self._recordings(running, beside)
        branches = WorldBranches(live, server.realtime, shown.time_travel, self._branch_options())
        server.join(branches)
        campaigns = _campaigns(world)
        if campaigns is not None:
            server.join(campaigns)
        around = partial(
            shown.surroundings,
            branches=branches,
            recordings=recordings,
            recording_files=recordings,
            services=None if beside is None else LiveServices(running.gateways),
            campaigns=campaigns,
            models=models_of(live.subject.description, world),
        )
        await self._serve(server, shown.subject, around)

    def _recordings(self, running: Running, beside: UpOptions) -> WorldRecordings:
        live, server = running.live, running.server
        folder = state_directory() / "recordings" if beside.world is None else beside.world.absolute().parent
        stem = live.world.spec.name if beside.world is None else beside.world.stem
        may_view = is_loopback(self._entrance.address.host)
        access = self._access_of_views() if may_view else None
        recordings = WorldRecordings(live, server.realtime, folder, stem, beside.run.session, access)
        server.join(recordings)
        return recordings

    def _access_of_views(self) -> Sequence[str]:
        """Options by which a view takes the same tokens as this studio."""
        if not self._entrance.asks:
            return ("--open-to-local-users",)
        return () if self._own.tokens is None else ("--tokens", str(self._own.tokens))

    def _branch_options(self) -> StudioOptions | None:
        """How the page of a branch is served: as this one, at a free port; None where others can reach this one."""
        host = self._entrance.address.host
        if not is_loopback(host):
            return None
        return replace(self._own, http=str(Address(host, 0)), audit=None, browser=False, device=(), view=False)

    async def open_without_world(self, server: Server, *, machine: DeviceMachine | None = None) -> None:
        """Serve it in the event loop of ``server``."""
        begin = time.monotonic_ns()

        def moment() -> PresentMoment:
            return PresentMoment(time.monotonic_ns() - begin, running=True, speed=1.0)

        subject = CompositeSubject(None, lambda: moment().time, Numbering({}), None if machine is None else machine.parts)
        models = None if machine is None else machine.models
        await self._serve(server, subject, partial(Surroundings, moment=moment, programs=_NoPrograms(), models=models), machine)

    async def _serve(
        self,
        server: Server,
        subject: CompositeSubject,
        surroundings: Callable[..., Surroundings],
        machine: DeviceMachine | None = None,
    ) -> None:
        loop = asyncio.get_running_loop()

        def report(error: Exception) -> None:
            loop.call_exception_handler({"message": "a request to the studio failed", "exception": error})

        of_devices = DeviceSurroundings(clock=time.monotonic_ns, keep=keep_settings, on_internal=report)
        connections = DeviceConnections(subject, of_devices, Computer(ports=_ports, find=find_device))
        work = DeviceWork(LineWork(), report)
        around = surroundings(
            gate=self._entrance.gate(lambda: subject.has_devices),
            audit=self._audit,
            program=__version__,
            connections=connections,
            work=work,
            on_internal=report,
        )
        hub = Hub(subject, subject, around)
        try:
            for name, address in self._own.devices:
                await connections.open(address, name)
            if machine is not None:
                machine.check(subject.description)
        except BaseException:
            await connections.close()
            raise
        host, port = self._listening.getsockname()[:2]
        entrance = self._entrance
        is_local = is_loopback(entrance.address.host)
        names = () if is_local else (socket.gethostname(), socket.getfqdn())
        origins = Origins(port, names, by_address=not is_local, has_tls=entrance.tls is not None)
        service = StudioService(hub, self._listening, origins, entrance.tls)
        service.start()
        url = f"{'http' if entrance.tls is None else 'https'}://{Address(_reached(host), port)}/"
        details = {"host": host, "port": port, "url": url} | ({} if entrance.file is None else {"tokens": str(entrance.file)})
        links = _Links(service, work, connections)
        server.join(links, EndPoint("http", entrance.place(url), "studio", details))
        if self._own.http is None and port != DEFAULT.port:
            server.notice(f"port {DEFAULT.port} is taken: the studio is at {url}")
        if self._own.browser and has_desktop():
            secret = f"#token={entrance.tokens[0].text}" if entrance.asks else ""
            try:
                links.opened = OpenedPage(url + secret, is_secret=entrance.asks, port=port)
                if links.opened.file is not None:
                    server.notice(
                        f"a browser that may not read {links.opened.file} (snap, flatpak): open the address below in it"
                    )
            except Misuse as error:
                server.notice(str(error))


def _campaigns(path: Path | None) -> FolderCampaigns | None:
    """Those in the folder of a description, or below it."""
    return None if path is None or is_recording(path) else FolderCampaigns(path)


@dataclass(slots=True)
class _Links:
    """Links of viewers and of devices: when viewers have gone, jogs end, and then devices can be left."""

    service: StudioService
    work: DeviceWork
    connections: DeviceConnections
    opened: OpenedPage | None = None
    """In the browser of the desktop."""

    async def close(self) -> None:
        if self.opened is not None:
            self.opened.close()
        await self.service.close()
        await self.work.close()
        await self.connections.close()


TEXTS_OF_A_DEVICE = Message("live.texts-of-a-device", "{controller} is a device: the texts of its programs are not known here")


class _NoPrograms:
    """Programs of devices, whose texts are not known."""

    def list(self) -> Sequence[ShownProgram]:
        return ()

    def files(self) -> Mapping[str, bytes]:
        return {}

    def memory(self, controller: str, place: str, text: str) -> Sequence[MemoryUse]:
        self.text(controller, place)
        return ()

    def text(self, controller: str, place: str) -> ShownProgramText:
        raise Misuse(TEXTS_OF_A_DEVICE(controller=controller))


def _ports() -> Sequence[Mapping[str, object]]:
    return [{"address": port.address, "what": port.what} for port in serial_ports() + twin_ports()]


def _reached(host: str) -> str:
    """An address at which a server that listens on all of them is reached."""
    return socket.gethostname() if host in ANY else host
