"""Worlds for gateways: in this process, and served by one of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.conftest import STEPTWIN, until

from steptwin import World
from steptwin.access.audit import CommandLog
from steptwin.errors import LineFailure
from steptwin.gateways.contract import HistoryValues
from steptwin.gateways.sampling import SharedSamples
from steptwin.simulation.kinds.lines import LineTraffic
from steptwin.subject import commands as command
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.jogs import ExtendableJog, WorldJogs
from steptwin.subject.subscriptions import Filter, Subscription
from steptwin.subject.world import WorldSubject


class GatewayWorld:
    """A world whose controllers may be silent, as devices are."""

    def __init__(self, text: str) -> None:
        self.world = World.from_toml(text)
        self.inner = WorldSubject(self.world)
        self.jogs = WorldJogs(self.inner)
        self.history: HistoryValues | None = None
        self.audit: CommandLog | None = None
        self.samples = SharedSamples(self)
        self.silent: set[str] = set()
        self.silence: Exception = LineFailure("no answer")
        self.done: list[command.Command] = []

    @property
    def description(self) -> Description:
        return self.inner.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self.inner.read(*points)

    async def do(self, wanted: command.Command, /) -> Result:
        self.done.append(wanted)
        if isinstance(wanted, command.ReadState) and wanted.controller in self.silent:
            raise self.silence
        return self.inner.do(wanted)

    async def begin_jog(self, wanted: command.Jog, /) -> ExtendableJog:
        return await self.jogs.begin_jog(wanted)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self.inner.subscribe(what, bound)

    def traffic(self) -> Mapping[str, LineTraffic]:
        return {name: line.traffic for name, line in self.world.lines.items()}

    def plans(self, what: Filter) -> list[Event]:
        return self.inner.plans(what)


@contextmanager
def served(text: str, folder: Path, *options: str, is_quiet: bool = True) -> Generator[Mapping[str, Mapping[str, Any]]]:
    """The end points of the description ``text`` by kind, while ``steptwin up`` serves it; it ends without an error."""
    (folder / "hall.toml").write_text(text)
    with running(folder, "up", "hall.toml", *options, is_quiet=is_quiet) as found:
        yield found


@contextmanager
def running(folder: Path, *arguments: str, is_quiet: bool = True) -> Generator[Mapping[str, Mapping[str, Any]]]:
    """The end points of ``steptwin`` with these arguments by kind, while it runs; it ends without an error, and without a
    notice of a gateway where it ``is_quiet``. What it tells is in the files ``output`` and ``errors``."""
    ready = folder / f"{arguments[0]}.json"
    output, errors = (folder / "output").open("wb"), (folder / "errors").open("wb")
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder)}
    process = subprocess.Popen(
        [STEPTWIN, *arguments, "--ready-file", str(ready)],
        cwd=folder,
        env=environment,
        stdout=output,
        stderr=errors,
    )
    try:
        until(lambda: ready.exists() or process.poll() is not None, "it is ready")
        assert process.poll() is None, (folder / "errors").read_text()
        found = json.loads(ready.read_text())
        yield {point["kind"]: {**point, "pid": found["pid"]} for point in found["end_points"]}
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)
        output.close()
        errors.close()
    told = (folder / "errors").read_text()
    assert (process.returncode, told) == (0, "")
    assert not is_quiet or "[gateway." not in (folder / "output").read_text()
