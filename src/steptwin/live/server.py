"""A served twin: its cell, its links, its control endpoint, from start to clean end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import resource
import signal
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.inputfiles import read_bytes
from steptwin.live.cell import Cell
from steptwin.live.control import END_POINTS, ControlEndpoint, Handler
from steptwin.live.links import Link, where
from steptwin.live.pty import PtyLink
from steptwin.live.tcp import Clients, TcpLink
from steptwin.machine import SECOND, Nanos, Port
from steptwin.world.addresses import Address

MOST_FILES = 65536
"""Every client is an open file; the usual limit of 1024 is for programs with few."""
OTHER_FILES = 32
"""Files that are no clients."""
REPEAT_S = 1.0
"""The same notice is not given again within this time."""


@dataclass(frozen=True, slots=True)
class EndPoint:
    """Where a twin listens. ``kind``: pty, serial, tcp, rtu-tcp."""

    kind: str
    place: str
    protocol: str
    details: Mapping[str, object] = field(default_factory=dict)


class Server:
    """Opens links one after the other and closes all of them, whatever happened.

    ``tell`` is called with texts for the person watching.
    """

    def __init__(self, cell: Cell, tell: Callable[[str], None]) -> None:
        self.cell = cell
        self.end_points: list[EndPoint] = []
        self._tell = tell
        self._told: dict[str, float] = {}
        self._links: list[Link] = []
        self._ready_file: tuple[Path, str] | None = None
        self._ended: asyncio.Event = asyncio.Event()
        self._failure: str | None = None
        cell.on_lag = self._lagged
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._trouble)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
                loop.add_signal_handler(number, self._ended.set)
        self._clients = Clients(max(1, allow_many_files() - OTHER_FILES), self.notice)

    def notice(self, text: str) -> None:
        """Tell the person watching, but not the same thing again and again."""
        now = asyncio.get_running_loop().time()
        self._told = {told: at for told, at in self._told.items() if now - at < REPEAT_S}
        if text not in self._told:
            self._told[text] = now
            self._tell(text)

    async def open_pty(self, path: Path, protocol: str, make_port: Callable[[], Port]) -> None:
        link = PtyLink(self.cell, path, make_port)
        await link.open()
        self._links.append(link)
        self.end_points.append(EndPoint("pty", str(link.path), protocol, {"path": str(link.path)}))

    async def open_serial(self, device: str, baud: int, protocol: str, make_port: Callable[[], Port]) -> None:
        from steptwin.live.serialport import SerialLink

        link = SerialLink(self.cell, device, baud, make_port, self.notice)
        await link.open()
        self._links.append(link)
        self.end_points.append(EndPoint("serial", f"{device} at {baud} bit/s", protocol, {"device": device, "baud": baud}))

    async def open_tcp(self, kind: str, address: Address, protocol: str, make_port: Callable[[], Port]) -> None:
        link = TcpLink(self.cell, address, make_port, self._clients)
        listening = await link.open()
        self._links.append(link)
        details = {"host": listening.host, "port": listening.port}
        self.end_points.append(EndPoint(kind, str(listening), protocol, details))

    async def open_control(self, name: str, handlers: Mapping[str, Handler]) -> None:
        """Open the control endpoint: what ``handlers`` do, and the ``end-points`` of the server."""
        endpoint = ControlEndpoint(name, {**handlers, END_POINTS: lambda _: self._where()})
        await endpoint.open()
        self._links.append(endpoint)

    def _where(self) -> list[dict[str, object]]:
        return [{"kind": e.kind, "protocol": e.protocol, **e.details} for e in self.end_points]

    def write_ready_file(self, path: Path, name: str) -> None:
        """A JSON file with process id and end points; whole or not there at all, gone when the server ends."""
        text = json.dumps({"name": name, "pid": os.getpid(), "end_points": self._where()}, indent=2) + "\n"
        fresh = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh.write_text(text)
            fresh.replace(path)
        except OSError as error:
            fresh.unlink(missing_ok=True)
            raise LineFailure(f"cannot write the ready file {path}: {where(error)}") from error
        self._ready_file = path, text

    def end(self) -> None:
        """End the server because what it serves is over."""
        self._ended.set()

    def fail(self, reason: str) -> None:
        """End the server because it cannot go on."""
        self._failure = self._failure or reason
        self._ended.set()

    async def until_ended(self) -> None:
        """Serve until SIGINT, SIGTERM or SIGHUP. Raises `LineFailure` when the server could not go on."""
        self.cell.start()
        await self._ended.wait()
        if self._failure is not None:
            raise LineFailure(self._failure)

    def _lagged(self, by: Nanos) -> None:
        self.notice(f"this process was held up for {by / SECOND:.1f} s; the time of the twin was held up as long")

    def _trouble(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Errors without a caller: the end where machines cannot go on, else a notice."""
        error = context.get("exception")
        if isinstance(error, SteptwinError):
            self.fail(str(error))
        elif isinstance(error, OSError):
            self.notice(f"{context['message']}: {where(error)}")
        elif error is None:
            self.notice(context["message"])
        else:
            place = traceback.extract_tb(error.__traceback__)[-1:]
            at = f" ({place[0].filename}:{place[0].lineno})" if place else ""
            self.notice(f"internal error, please report it: {type(error).__name__}: {error}{at}")

    async def close(self) -> None:
        async with contextlib.AsyncExitStack() as stack:
            stack.callback(self._remove_ready_file)
            stack.callback(self.cell.close)
            for link in self._links:
                stack.push_async_callback(link.close)
            self._links.clear()

    def _remove_ready_file(self) -> None:
        if self._ready_file is None:
            return
        path, text = self._ready_file
        self._ready_file = None
        with contextlib.suppress(OSError):
            if path.read_text() == text:
                path.unlink()


def clear_ready_file(path: Path) -> None:
    """Remove what a server that is gone left behind, so that a waiting program does not take it for the new one's.

    Raises `Misuse` where the path is taken by another kind of file.
    """
    try:
        data = read_bytes(path)
    except Misuse as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return
        raise Misuse(f"{path} cannot be a ready file: {error}") from error
    try:
        found = json.loads(data)
        pid = found["pid"] if "end_points" in found else None
    except (ValueError, TypeError, KeyError, RecursionError):
        pid = None
    if not isinstance(pid, int) or not 0 < pid < 1 << 31:
        raise Misuse(f"{path} exists and is no ready file: choose another --ready-file")
    if pid == os.getpid() or not Path(f"/proc/{pid}").exists():
        path.unlink()


def allow_many_files() -> int:
    """Raise the limit of open files as far as this process may, up to `MOST_FILES`; returns it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, MOST_FILES)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return MOST_FILES if soft == resource.RLIM_INFINITY else soft
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return wanted
