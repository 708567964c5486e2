"""What all tests share, above all the peers: programs that were not written here and that the tests talk to.

A test takes the fixture `require_peer` or `require_library` and thereby gets the marker ``peers``. Where the peer is not
installed the test is skipped and says what to install; with ``STEPTWIN_REQUIRE_PEERS=1`` it fails instead.
``make peers`` installs them all.

Files in ``tests/soak`` get the marker ``soak`` and a time limit that grows with their length.

The fixture `serve` starts the real command.
"""

from __future__ import annotations

import asyncio
import gc
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine, Generator, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import pytest
from facts import checked_facts
from guard import guarded
from hypothesis import settings
from soak import time_limit
from virtual_loop import VirtualLoop, run_virtually
from warm import COMMAND

import steptwin.services  # noqa: F401  descriptions are checked for their tables, too
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.scheduler.scheduler import Scheduler

T = TypeVar("T")

pytest_plugins = ["pytester"]

# A deadline on the wall clock would make a test depend on what else the machine is doing.
settings.register_profile("steptwin", deadline=None, max_examples=40)
# A change is judged by the same examples every time; `make test` on a developer's machine draws new ones.
settings.register_profile("same", deadline=None, max_examples=40, derandomize=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "steptwin"))

# Commands that tests start inherit ignored signals: SIGINT from a shell without job control (`make test &`), SIGHUP from nohup.
for _number in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)

# Commands that tests start compile nothing twice, whatever the surroundings say.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

STEPTWIN = COMMAND

PEER_FIXTURES = {"require_peer", "require_library"}
IN_WALL_TIME = (
    "cli",
    "dap",
    "editors",
    "gateways",
    "history",
    "live",
    "peers",
    "studio",
    "test_docs_run.py",
    "test_other_systems.py",
)
"""Tests with processes of their own, on a machine that may have other work."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    try:
        soak_limit = time_limit()
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
    for item in items:
        has_peer = bool(PEER_FIXTURES.intersection(getattr(item, "fixturenames", ())))
        if has_peer:
            item.add_marker(pytest.mark.peers)
        place = item.nodeid.removeprefix("tests/").partition("/")[0].partition("::")[0]
        if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1" and (has_peer or place in IN_WALL_TIME):
            item.add_marker(pytest.mark.flaky(reruns=1))
        if place == "soak":
            item.add_marker(pytest.mark.soak)
            item.add_marker(pytest.mark.timeout(soak_limit))


@pytest.hookimpl(optionalhook=True, wrapper=True)
def pytest_xdist_auto_num_workers() -> Generator[None, int, int]:
    """One more than there are processors, for tests with processes and browsers wait; or what the environment says."""
    found = yield
    return found if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ else found + 1


def pytest_collection_finish() -> None:
    """What describes all tests is there to stay: each look for garbage would look at it, too, for half a second."""
    gc.collect()
    gc.freeze()


def _missing(peer: str) -> NoReturn:
    reason = f"{peer} is not installed; 'make peers' installs it"
    if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1":
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope="session", autouse=True)
def facts_of_all_events() -> Iterator[None]:
    """Whatever happens in a controller in any test, its facts are those of its data sheet."""
    with checked_facts():
        yield


@pytest.fixture(scope="session", autouse=True)
def processes_end_with_the_run() -> Iterator[None]:
    """A run that is killed leaves no twins behind."""
    with guarded():
        yield


@pytest.fixture(scope="session")
def require_peer() -> Callable[[str], str]:
    """``require_peer("mbpoll")`` gives the path of an installed program."""

    def find(program: str) -> str:
        return shutil.which(program) or _missing(program)

    return find


@pytest.fixture(scope="session")
def chromium() -> str:
    """The path of a browser. One without windows takes half the processor time of one that only shows none."""
    return shutil.which("chromium-headless-shell") or shutil.which("chromium") or _missing("chromium-headless-shell")


@pytest.fixture(scope="session")
def require_library(require_peer: Callable[[str], str]) -> Callable[[str], list[str]]:
    """``require_library("libmodbus")`` gives the arguments a C compiler needs to use an installed library.

    Compile with ``[require_peer("cc"), "prog.c", "-o", out, *require_library("libmodbus")]``.
    """

    def find(library: str) -> list[str]:
        asked = subprocess.run(
            [require_peer("pkg-config"), "--cflags", "--libs", library], capture_output=True, text=True, check=False
        )
        return asked.stdout.split() if asked.returncode == 0 else _missing(library)

    return find


def run_command(arguments: Sequence[str], environment: Mapping[str, str], script: str = "") -> subprocess.CompletedProcess[str]:
    """``steptwin`` with these arguments in this process, which saves the start of an interpreter; ``script`` is piped into it."""
    from steptwin.cli import main

    out, errors = io.StringIO(), io.StringIO()
    code: object = 0
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(errors):
        for name in os.environ.keys() - environment.keys():
            patch.delenv(name)
        for name, value in environment.items():
            patch.setenv(name, value)
        patch.setattr(sys, "argv", [STEPTWIN, *arguments])
        patch.setattr(sys, "stdin", io.StringIO(script))
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
    assert isinstance(code, int), code
    return subprocess.CompletedProcess([STEPTWIN, *arguments], code, out.getvalue(), errors.getvalue())


class Served:
    """A twin served by the real command in a process of its own."""

    what: tuple[str, ...] = ("mic488", "--tcp", "127.0.0.1:0", "--rtu-tcp", "127.0.0.1:0")

    def __init__(self, directory: Path, *options: str) -> None:
        self.directory = directory
        self.ready_file = directory / "ready.json"
        self.pty = directory / "pty"
        self._end_points: dict[str, dict[str, Any]] = {}
        # What twins share is theirs alone.
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(directory), "COLUMNS": "200", "TERM": "dumb"}
        self._out = (directory / "out").open("w+")
        self._err = (directory / "err").open("w+")
        where = ["--pty", str(self.pty), "--ready-file", str(self.ready_file)]
        self.process = subprocess.Popen(
            [STEPTWIN, "serve", *self.what, *where, *options], stdout=self._out, stderr=self._err, env=self.environment
        )

    def wait_until_ready(self) -> None:
        until(lambda: self.ready_file.exists() or self.process.poll() is not None, "the ready file is there")
        if self.process.poll() is not None:
            raise AssertionError(f"the server ended with {self.process.returncode}: {self.errors}{self.lines}")
        self._end_points = {point["kind"]: point for point in json.loads(self.ready_file.read_text())["end_points"]}
        if "tcp" in self._end_points:
            self.environment["STEPTWIN_DEVICE"] = f"tcp://127.0.0.1:{self.tcp_port}"

    @property
    def lines(self) -> list[str]:
        return (self.directory / "out").read_text().splitlines()

    @property
    def errors(self) -> str:
        return (self.directory / "err").read_text()

    @property
    def tcp_port(self) -> int:
        return self._end_points["tcp"]["port"]

    @property
    def rtu_tcp_port(self) -> int:
        return self._end_points["rtu-tcp"]["port"]

    def command(self, *arguments: str, script: str = "") -> subprocess.CompletedProcess[str]:
        """Run ``steptwin`` where this twin is the only one, and the device that commands mean; ``script`` is piped into it."""
        return run_command(arguments, self.environment, script)

    def state(self) -> dict[str, Any]:
        return json.loads(self.command("state", "--json").stdout)

    def end(self, number: int = signal.SIGINT) -> None:
        """End it as Ctrl-C does; nothing may be left behind and nothing complained about."""
        self.process.send_signal(number)
        assert self.process.wait(60) == 0, self.errors
        assert self.errors == ""
        left = {path.relative_to(self.directory).as_posix() for path in self.directory.rglob("*") if not path.is_dir()}
        assert {name for name in left if not name.startswith("state/")} == {"out", "err"}

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._out.close()
        self._err.close()


class ServedM1486(Served):
    """The same for M1486 chips."""

    what = ("m1486", "--tcp", "127.0.0.1:0")


def until(condition: Callable[[], object], what: str, seconds: float = 60.0) -> None:
    """Wait for a condition; the test fails when it does not come."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"after {seconds} s not yet: {what}"
        time.sleep(0.005)


@pytest.fixture
def serve(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Served]]:
    """``serve("--demo", ...)`` starts a twin on free ports and a pty of its own; it is ended cleanly after the test."""
    yield from _serving(tmp_path_factory, Served)


@pytest.fixture
def serve_m1486(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Served]]:
    """The same for ``steptwin serve m1486``."""
    yield from _serving(tmp_path_factory, ServedM1486)


def _serving(tmp_path_factory: pytest.TempPathFactory, kind: type[Served]) -> Iterator[Callable[..., Served]]:
    served: list[Served] = []

    def start(*options: str, directory: Path | None = None) -> Served:
        twin = kind(directory or tmp_path_factory.mktemp("twin"), *options)
        served.append(twin)
        twin.wait_until_ready()
        return twin

    yield start
    try:
        for twin in served:
            if twin.process.poll() is None:
                twin.end()
    finally:
        for twin in served:
            twin.close()


@pytest.fixture(autouse=True, scope="session")
def own_runtime_directory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Twins of tests that run at the same time have the same names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
        yield


@pytest.fixture
def run() -> Callable[[Coroutine[Any, Any, T]], T]:
    """``run(coroutine)`` in virtual time; what the loop has to complain about fails the test."""
    return run_virtually


@pytest.fixture
def make_realtime() -> Callable[[], tuple[RealTimeDriver, Mic488Device]]:
    """``make_realtime()``, in a running virtual loop: a real-time driver with one MIC488 as it comes from the shop."""

    def make() -> tuple[RealTimeDriver, Mic488Device]:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        device = Mic488Device(ControllerConfig())
        scheduler = Scheduler()
        scheduler.add("1", device)
        return RealTimeDriver(scheduler, loop.clock()), device

    return make
