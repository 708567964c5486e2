"""A studio as the real command in a process of its own."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import pytest
from tests.conftest import STEPTWIN, until
from websockets.sync.client import ClientConnection, connect

from steptwin.commands.demo import FOLDER, describe_demo

WORLD = """
    [world]
    name = "hall"
    [[line]]
    name = "bus"
    kind = "modbus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = 400.0
    dec = 400.0
    vel = 40.0
    [[line]]
    name = "chips"
    kind = "m1486"
    tcp = "127.0.0.1:0"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
"""

FILES: dict[str, str] = {}
"""Those that it names."""


class Process:
    """``steptwin studio`` on free ports, with a small world, ``--demo`` with the demo machine; ``--itself`` without a file."""

    def __init__(self, directory: Path, *options: str) -> None:
        self.directory = directory
        self.ready_file = directory / "ready.json"
        world = directory / "hall.toml"
        world.write_text(describe_demo(free_ports=True) if "--demo" in options else WORLD)
        shutil.copy(FOLDER / "demo.prg", directory)
        for name, text in FILES.items():
            (directory / name).write_text(text)
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(directory), "TERM": "dumb"}
        self._opened = ExitStack()
        self._err = (directory / "err").open("w+")
        self._out = (directory / "out").open("w+")
        given = [] if "--itself" in options else [str(world)]
        http = [] if "--http" in options else ["--http", "127.0.0.1:0"]
        rest = [option for option in options if option not in ("--demo", "--itself")]
        self.process = subprocess.Popen(
            [STEPTWIN, "studio", *given, *http, "--no-browser", "--ready-file", str(self.ready_file), *rest],
            stdout=self._out,
            stderr=self._err,
            env=self.environment,
        )

    def wait_until_ready(self) -> Self:
        until(lambda: self.ready_file.exists() or self.process.poll() is not None, "the ready file is there")
        assert self.process.poll() is None, self.errors
        points = json.loads(self.ready_file.read_text())["end_points"]
        self.end_points: dict[str, dict[str, Any]] = {point["kind"]: point for point in reversed(points)}
        return self

    @property
    def errors(self) -> str:
        return (self.directory / "err").read_text()

    @property
    def output(self) -> str:
        return (self.directory / "out").read_text()

    @property
    def url(self) -> str:
        return self.end_points["http"]["url"].rstrip("/")

    def connect(self, path: str = "/ws", **options: Any) -> ClientConnection:
        return self._opened.enter_context(connect(f"{self.url.replace('http', 'ws', 1)}{path}", max_size=None, **options))

    def end(self) -> None:
        """As Ctrl-C does; nothing may be left behind and nothing complained about."""
        self._opened.close()
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(60) == 0, self.errors
        assert self.errors == ""
        assert "internal error" not in self.output
        assert not self.ready_file.exists()

    def close(self) -> None:
        self._opened.close()
        self.process.kill()
        self.process.wait()
        self._out.close()
        self._err.close()


@pytest.fixture
def start_studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Process]]:
    """``start_studio("--remote", ...)``; it is ended cleanly after the test."""
    started: list[Process] = []

    def start(*options: str) -> Process:
        process = Process(tmp_path_factory.mktemp("studio"), *options)
        started.append(process)
        return process.wait_until_ready()

    yield start
    try:
        for process in started:
            if process.process.poll() is None:
                process.end()
    finally:
        for process in started:
            process.close()
