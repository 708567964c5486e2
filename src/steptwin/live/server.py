"""A served twin: its real-time driver, links and control endpoint, from start to clean end."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import logging
import os
import traceback
from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from steptwin.access.audit import CommandLog
from steptwin.controller import SECOND, Nanos, Port
from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.files.writing import new_text
from steptwin.inputfiles import read_bytes
from steptwin.live.clients import Clients
from steptwin.live.control import ControlEndpoint
from steptwin.live.filelimit import allow_many_files
from steptwin.live.links import Link
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.rfc2217 import TwinLine
from steptwin.live.signals import on_end
from steptwin.live.transports import LinkArguments, Transport
from steptwin.simulation.kinds.links import TlsFiles
from steptwin.simulation.toml.addresses import Address
from steptwin.subject.contract import PlannedSubject
from steptwin.system import process_exists, reason

OTHER_FILES = 32
"""Open files other than clients."""
REPEAT_S = 1.0
"""Time within which the same notice is not repeated, s."""


UNTIMED = TwinLine()
"""For links on which characters take no time."""

Controllers = Callable[[], Sequence[Mapping[str, object]]]
"""The controllers of a twin at present: ``name``, ``kind``, ``line`` (None: on none), and their address there: ``unit`` of a
MIC488, ``chip`` (a hexadecimal digit) of an M1486."""


@dataclass(frozen=True, slots=True)
class EndPoint:
    """An address on which a twin listens. ``kind``: pty, serial, tcp, tls, rtu-tcp, rfc2217, vision, control, http.

    ``line``: the name of the one reached there."""

    kind: str
    place: str
    protocol: str
    details: Mapping[str, object] = field(default_factory=dict)
    line: str | None = None

    def announced(self) -> dict[str, object]:
        """The announcement in JSON."""
        return {"kind": self.kind, "protocol": self.protocol, "line": self.line, **self.details}


class Server:
    """Opens links one after the other, and closes all of them in any case.

    ``show`` is called with notices for the user.
    """

    def __init__(self, realtime: RealTimeDriver, show: Callable[[str], None]) -> None:
        self.realtime = realtime
        self.audit: CommandLog | None = None
        """Records what clients write that prove who they are; of links that are opened from then on."""
        self.end_points: list[EndPoint] = []
        self._show = show
        self._reported: dict[str, float] = {}
        self._links: list[Link] = []
        self._ready_file: tuple[Path, str] | None = None
        self._name = ""
        self._controllers: Controllers = tuple
        self._file: Path | None = None
        self._ended: asyncio.Event = asyncio.Event()
        self._failure: str | None = None
        realtime.on_lag = self._lagged
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._trouble)
        # its warning that a client has gone while it was written to is no news
        logging.getLogger("asyncio").addHandler(logging.NullHandler())
        logging.getLogger("asyncio").propagate = False
        on_end(loop, self._ended.set)
        self._clients = Clients(max(1, allow_many_files() - OTHER_FILES), self.notice)

    def notice(self, text: str) -> None:
        """Show a notice to the user, but not the same one repeatedly."""
        now = asyncio.get_running_loop().time()
        self._reported = {known: at for known, at in self._reported.items() if now - at < REPEAT_S}
        if text not in self._reported:
            self._reported[text] = now
            self._show(text)

    async def open(
        self,
        transport: Transport,
        where: str,
        protocol: str,
        make_port: Callable[[], Port],
        *,
        line: str | None = None,
        wire: TwinLine = UNTIMED,
        listen_any: bool = False,
        tls: TlsFiles | None = None,
        folder: Path = Path(),
    ) -> None:
        """Open a link to the ports that ``make_port`` makes; ``where`` is the value for the transport.

        Raises `LineFailure`, or `Misuse` for a place that is not permitted.
        """
        wire = replace(wire, notice=self.notice)
        opened = await transport.open(
            LinkArguments(
                where=where,
                make_port=make_port,
                line=wire,
                realtime=self.realtime,
                clients=self._clients,
                listen_any=listen_any,
                tls=tls,
                folder=folder,
                audit=self.audit,
                line_name=line or "",
            )
        )
        self._links.append(opened.link)
        self.end_points.append(EndPoint(transport.kind, opened.place, protocol, opened.details, line))

    def introduce(self, name: str, controllers: Controllers = tuple, file: Path | None = None) -> None:
        """Name the twin, made from ``file``, in its announcement."""
        self._name, self._controllers, self._file = name, controllers, file

    async def open_control(self, subject: PlannedSubject, address: Address | None = None) -> None:
        """Open the control endpoint of ``subject``; also over TCP if there is an ``address``."""
        endpoint = ControlEndpoint(self._name, subject, address)
        await endpoint.open()
        self._links.append(endpoint)
        if endpoint.listening is not None:
            self.end_points.append(EndPoint("control", str(endpoint.listening), "control", {"file": str(endpoint.announcement)}))

    def join(self, link: Link, end_point: EndPoint | None = None) -> None:
        """A link that is open already; it is closed with the others. Without an end point it cannot be reached from outside."""
        self._links.append(link)
        if end_point is not None:
            self.end_points.append(end_point)

    def announcement(self) -> dict[str, object]:
        """The announcement of the twin: name, process, file, controllers, end points."""
        return {
            "name": self._name,
            "pid": os.getpid(),
            "file": None if self._file is None else str(self._file.absolute()),
            "controllers": list(self._controllers()),
            "end_points": [end_point.announced() for end_point in self.end_points],
        }

    def write_ready_file(self, path: Path) -> None:
        """Write the `announcement` to a JSON file; it is removed when the server ends."""
        text = json.dumps(self.announcement(), indent=2) + "\n"
        try:
            with new_text(path) as file:
                file.write(text)
        except OSError as error:
            raise LineFailure(f"cannot write the ready file {path}: {reason(error)}") from error
        self._ready_file = path, text

    def end(self) -> None:
        """End the server normally."""
        self._ended.set()

    def fail(self, reason: str) -> None:
        """End the server with an error."""
        self._failure = self._failure or reason
        self._ended.set()

    async def unless_ended(self, work: Coroutine[Any, Any, None]) -> bool:
        """Wait for ``work``, which is cancelled if the server is to end before. Returns whether it was done; raises its error."""
        task, ended = asyncio.create_task(work), asyncio.create_task(self._ended.wait())
        await asyncio.wait((task, ended), return_when=asyncio.FIRST_COMPLETED)
        ended.cancel()
        is_done = task.done()
        task.cancel()
        await asyncio.wait((task, ended))
        if is_done:
            task.result()
        return is_done

    async def until_ended(self) -> None:
        """Serve until SIGINT, SIGTERM or SIGHUP. Raises `LineFailure` when the server could not go on."""
        gc.freeze()  # what is there from the start stays; to look through it takes 0.2 s, in which clients would wait
        self.realtime.start()
        await self._ended.wait()
        if self._failure is not None:
            raise LineFailure(self._failure)

    def _lagged(self, by: Nanos) -> None:
        self.notice(f"this process did not run for {by / SECOND:.1f} s; the time of the twin stood still meanwhile")

    def _trouble(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handle an error without a caller: end the server if controllers cannot continue, else give a notice."""
        error = context.get("exception")
        if isinstance(error, SteptwinError):
            self.fail(str(error))
        elif isinstance(error, OSError):
            self.notice(f"{context['message']}: {reason(error)}")
        elif error is None:
            self.notice(context["message"])
        else:
            place = traceback.extract_tb(error.__traceback__)[-1:]
            at = f" ({place[0].filename}:{place[0].lineno})" if place else ""
            self.notice(f"internal error, please report it: {type(error).__name__}: {error}{at}")

    async def close(self) -> None:
        gc.unfreeze()
        async with contextlib.AsyncExitStack() as stack:
            stack.callback(self._remove_ready_file)
            stack.callback(self.realtime.close)
            for link in self._links:
                stack.push_async_callback(link.close)
            self._links.clear()

    def _remove_ready_file(self) -> None:
        if self._ready_file is None:
            return
        path, text = self._ready_file
        self._ready_file = None
        with contextlib.suppress(OSError):
            if path.read_text(encoding="utf-8") == text:
                path.unlink()


def clear_ready_file(path: Path) -> None:
    """Remove the ready file of an ended server, so that a waiting program does not mistake it for the new one.

    Raises `Misuse` if another kind of file is at the path.
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
        raise Misuse(f"{path} exists and is not a ready file: choose another --ready-file")
    if pid == os.getpid() or not process_exists(pid):
        path.unlink()
