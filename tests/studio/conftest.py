"""A studio as the real command in a process of its own."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import pytest
from tests.conftest import STEPTWIN, until
from websockets.sync.client import ClientConnection, connect

from steptwin.errors import Refusal
from steptwin.live.studio.demo import FOLDER, describe_demo
from steptwin.studio.page import find_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser
    from studio_page import Studio

TABLE = """
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
"""
WORLD = (
    TABLE
    + """
    [[line]]
    name = "chips"
    kind = "m1486"
    tcp = "127.0.0.1:0"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
"""
)

ROOT = Path(__file__).parent.parent.parent


def web_builder() -> Any:
    """studio-web/build.py as a module."""
    spec = importlib.util.spec_from_file_location("studio_web_build", ROOT / "studio-web/build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def require_node() -> None:
    try:
        web_builder().node_folder()
    except Exception as error:  # noqa: BLE001  of the module that was loaded
        if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1":
            pytest.fail(str(error), pytrace=False)
        pytest.skip(str(error))


class StudioWorld(NamedTuple):
    """A description of a world, and the files that it names."""

    text: str = WORLD
    files: Mapping[str, str | bytes] = MappingProxyType({})
    command: tuple[str, ...] = (STEPTWIN,)


@pytest.fixture
def studio_world() -> StudioWorld:
    """What `start_studio` serves; a module may have its own."""
    return StudioWorld()


class Process:
    """``steptwin studio`` on free ports, with a small world, ``--demo`` with the demo machine; ``--itself`` without a file.

    It asks for a token ``--with-token``, and where it has to.
    """

    def __init__(self, directory: Path, served: StudioWorld, *options: str) -> None:
        self.directory = directory
        self.ready_file = directory / "ready.json"
        world = directory / "hall.toml"
        world.write_text(describe_demo(free_ports=True) if "--demo" in options else served.text)
        shutil.copy(FOLDER / "demo.prg", directory)
        for name, content in served.files.items():
            (directory / name).write_bytes(content.encode() if isinstance(content, str) else content)
        own = {"XDG_RUNTIME_DIR": str(directory), "TERM": "dumb"}
        self.environment = {"XDG_STATE_HOME": str(directory / "state"), **os.environ, **own}
        self._opened = ExitStack()
        self._err = (directory / "err").open("w+")
        self._out = (directory / "out").open("w+")
        given = [] if "--itself" in options else [str(world)]
        http = [] if "--http" in options else ["--http", "127.0.0.1:0"]
        rest = [option for option in options if option not in ("--demo", "--itself", "--with-token")]
        if not {"--with-token", "--tokens", "0.0.0.0:0", "[::]:0"} & {*options}:
            rest.append("--open-to-local-users")
        self.process = subprocess.Popen(
            [*served.command, "studio", *given, *http, "--no-browser", "--ready-file", str(self.ready_file), *rest],
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
    def token(self) -> str:
        """Of an engineer, in the file of the user."""
        lines = Path(self.end_points["http"]["tokens"]).read_text().splitlines()
        return next(line.split()[2] for line in lines if line.startswith("engineer "))

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
def start_studio(tmp_path_factory: pytest.TempPathFactory, studio_world: StudioWorld) -> Iterator[Callable[..., Process]]:
    """``start_studio("--remote", ...)``; it is ended cleanly after the test."""
    started: list[Process] = []

    def start(*options: str) -> Process:
        process = Process(tmp_path_factory.mktemp("studio"), studio_world, *options)
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


def newer_source(page: Path, web: Path = ROOT / "studio-web") -> Path | None:
    """A source of the page that is newer than the built one, compared as `make page` does; None if there is none."""
    built = (page / "index.html").stat().st_mtime
    for folder, folders, files in os.walk(web):
        folders[:] = set(folders) - {"node_modules", "__pycache__"}
        for name in files:
            if name != "types.ts" and (Path(folder) / name).stat().st_mtime > built:
                return Path(folder) / name
    return None


@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    """Skipped without a browser or a page; a page that is older than its sources fails."""
    from playwright.sync_api import sync_playwright

    try:
        changed = newer_source(find_page())
    except Refusal as error:
        pytest.skip(str(error))
    if changed is not None:
        pytest.fail(f"{changed.relative_to(ROOT)} is newer than the built page of the studio: run 'make page'", pytrace=False)
    with sync_playwright() as playwright:
        # Root has no user namespace to put the sandbox into; drawing by a graphics card that is not there costs a tenth more.
        started = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        yield started
        started.close()


@pytest.fixture
def studio(start_studio: Callable[..., Process], browser: Browser) -> Iterator[Studio]:
    """A studio with ``studio_world``, whose pages must not complain."""
    from studio_page import Studio

    found = Studio(start_studio(), browser)
    yield found
    found.close()
    assert found.complaints == []
