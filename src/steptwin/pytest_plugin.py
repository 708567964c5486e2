"""The pytest plugin: fixtures for twins and worlds, ``--device``, ``--steptwin-coverage``.

pytest loads it wherever steptwin is installed, so it brings nothing along until a test asks for a fixture.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from steptwin.errors import Misuse, SteptwinError

if TYPE_CHECKING:
    from steptwin.campaign.summary import CampaignSummary
    from steptwin.files.coverage import CoverageReports
    from steptwin.simulation.world.simulation import Simulation
    from steptwin.testing.m1486 import M1486Rig
    from steptwin.testing.mic488 import Mic488Rig
    from steptwin.testing.rig import Rig
    from steptwin.testing.world import WorldRig

T = TypeVar("T")

FIXTURES = {
    "mic488": "mic488(*, firmware, config, program, positions, unit, time, speed, link, faults, seed, lenient, line_timing, "
    "baud, twin_only): the MIC488 that the fixture mic488 is (steptwin)",
    "m1486": "m1486(*, variant, address, interface, program, time, speed, link, faults, seed, line_timing, baud, twin_only): the "
    "M1486 that the fixture m1486 is (steptwin)",
    "steptwin_campaign": "steptwin_campaign(file, *, runs, seed, search, jobs, out): the campaign that the fixture "
    "steptwin_campaign has run (steptwin)",
    "steptwin_world": "steptwin_world(file, *, time, speed): the world that the fixture steptwin_world is (steptwin)",
}
"""Fixtures and markers, which have the same names."""
TIME = "steptwin_time"
WORKER_COVERAGE = "steptwin_coverage"
"""The key under which processes of xdist give their coverage."""

_devices: pytest.StashKey[dict[str, str]] = pytest.StashKey()
_coverage: pytest.StashKey[CoverageReports] = pytest.StashKey()
_rigs: pytest.StashKey[dict[str, Rig]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("steptwin", "steptwin: twins of the MIC488 and M1486")
    group.addoption(
        "--device",
        action="append",
        default=[],
        metavar="[NAME=]ADDRESS",
        help="run tests of the fixtures mic488 and m1486 against a real device: /dev/ttyUSB0, tcp://HOST:PORT, "
        "rtu-tcp://HOST:PORT or rfc2217://HOST:PORT, with ,unit=N ,baud=N ,config=FILE behind it. IT MOVES. NAME= before it "
        "selects the device if tests need several: mic488=, m1486=, or a controller of a world",
    )
    group.addoption(
        "--steptwin-coverage",
        action="append",
        default=[],
        metavar="PATH",
        help="report which statements of motion programs the twins of all tests have executed, and which ways branches went: "
        ".info (lcov), .html, .json; '-' prints a table. Repeatable",
    )
    parser.addini(TIME, "real or virtual: time of twins, unless their marker sets it", default="real")


def pytest_configure(config: pytest.Config) -> None:
    for text in FIXTURES.values():
        config.addinivalue_line("markers", text)
    _configure_coverage(config)
    given = config.getoption("--device")
    config.stash[_devices] = {}
    if not given:
        return
    from steptwin.testing.devices import parse_devices

    try:
        config.stash[_devices] = dict(parse_devices(given))
    except Misuse as misuse:
        raise pytest.UsageError(str(misuse)) from None
    if getattr(config.option, "numprocesses", None) or hasattr(config, "workerinput"):
        raise pytest.UsageError("--device: several processes (-n) cannot share a device: run without -n")


def _configure_coverage(config: pytest.Config) -> None:
    targets = config.getoption("--steptwin-coverage")
    if targets:
        from steptwin.files.coverage import CoverageReports

        try:
            config.stash[_coverage] = CoverageReports(targets)
        except Misuse as misuse:
            raise pytest.UsageError(str(misuse)) from None


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A process of xdist gives its coverage to the one that reports."""
    config = session.config
    if _coverage in config.stash and hasattr(config, "workeroutput"):
        config.workeroutput[WORKER_COVERAGE] = config.stash[_coverage].coverage.to_json()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A process of xdist has ended; one that crashed gives nothing."""
    given = getattr(node, "workeroutput", {}).get(WORKER_COVERAGE)
    if given is not None:
        from steptwin.coverage.counts import Coverage

        for text in Coverage.from_json(given):
            node.config.stash[_coverage].coverage.add(text)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if _coverage in config.stash:
        terminalreporter.section("coverage of motion programs")
        try:
            for path in config.stash[_coverage].write(terminalreporter.write_line):
                terminalreporter.write_line(f"wrote {path}")
        except Misuse as misuse:
            terminalreporter.write_line(f"ERROR: {misuse}", red=True)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    devices = config.stash[_devices]
    strange = devices.keys() - {"", "mic488", "m1486"}
    if strange and items:
        known = {"mic488", "m1486", *_controllers(items)}
        for name in sorted(strange - known):
            raise pytest.UsageError(
                f"--device {name}={devices[name]}: no test here has a device of that name: there are {', '.join(sorted(known))}"
            )
    used = {name for item in items for name in ("mic488", "m1486") if name in getattr(item, "fixturenames", ())}
    if "" in devices and len(used - set(devices)) > 1:
        raise pytest.UsageError(
            f"--device {devices['']}: these tests are for a MIC488 and for an M1486: name the device, mic488=ADDRESS or "
            "m1486=ADDRESS, or select tests with -k"
        )


def _controllers(items: list[pytest.Item]) -> set[str]:
    """Names of the controllers in the worlds of tests."""
    from steptwin.testing.world import controllers_in

    files = {
        item.path.parent / marker.args[0]
        for item in items
        for marker in item.iter_markers("steptwin_world")
        if marker.args and isinstance(marker.args[0], str | Path)
    }
    names: set[str] = set()
    for file in files:
        with contextlib.suppress(Misuse):  # the test itself reports errors of its world
            names.update(controllers_in(file))
    return names


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """A test that passes fails where a property of its twins is violated at its end."""
    result = yield
    violated = [line for rig in item.stash.get(_rigs, {}).values() for line in rig.violated()]
    if violated:
        pytest.fail("\n".join(violated), pytrace=False)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that fails shows what went over the lines of its twins at last."""
    report = yield
    if report.failed:
        for name, rig in item.stash.get(_rigs, {}).items():
            log = rig.log()
            if log:
                report.sections.append((f"{name}: what happened last", log))
    return report


# ---------------------------------------------------------------------- fixtures


def _options(request: pytest.FixtureRequest, name: str) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """The options of a test's markers; the nearest marker takes precedence."""
    arguments: tuple[Any, ...] = ()
    options: dict[str, Any] = {"time": request.config.getini(TIME)}
    for marker in reversed(list(request.node.iter_markers(name))):
        arguments = marker.args or arguments
        options |= marker.kwargs
    return arguments, options


def _rig(request: pytest.FixtureRequest, name: str, make: Callable[[], Rig]) -> Iterator[Any]:
    rig = _without_traceback(name, make)
    request.node.stash.setdefault(_rigs, {})[name] = rig
    try:
        _without_traceback(name, rig.begin)
        yield rig
    finally:
        _without_traceback(f"{name}, after the test", rig.close)
        if _coverage in request.config.stash:
            request.config.stash[_coverage].close()


def _observe(request: pytest.FixtureRequest, world: Simulation, folder: Path) -> None:
    """Count what programs of a world execute, if that is to be reported."""
    if _coverage in request.config.stash:
        request.config.stash[_coverage].observe(world, folder)


def _without_traceback(name: str, do: Callable[[], T]) -> T:
    """Report wrong use, and devices that do not respond, in one line."""
    try:
        return do()
    except SteptwinError as error:
        text = f"fixture {name}: {error}"
    pytest.fail(text, pytrace=False)


@pytest.fixture
def mic488(request: pytest.FixtureRequest, tmp_path: Any) -> Iterator[Mic488Rig]:
    """A running MIC488 (`steptwin.testing.Mic488Rig`), new for each test. ``@pytest.mark.mic488(...)`` has its options.

    It is a twin, in real time on a free port unless the marker says otherwise; with ``--device`` it is that device.
    """
    from steptwin.testing.devices import device_for
    from steptwin.testing.mic488 import Mic488Marker, Mic488Rig
    from steptwin.testing.rig import options_of

    def make() -> Rig:
        options = options_of("mic488", Mic488Marker, *_options(request, "mic488"))
        device = device_for(request.config.stash[_devices], "mic488")
        return Mic488Rig(options, device, tmp_path, request.path.parent, partial(_observe, request))

    yield from _rig(request, "mic488", make)


@pytest.fixture
def m1486(request: pytest.FixtureRequest, tmp_path: Any) -> Iterator[M1486Rig]:
    """A running M1486 (`steptwin.testing.M1486Rig`), new for each test. ``@pytest.mark.m1486(...)`` has its options.

    It is a twin, in real time on a free port unless the marker says otherwise; with ``--device`` it is that device.
    """
    from steptwin.testing.devices import device_for
    from steptwin.testing.m1486 import M1486Marker, M1486Rig
    from steptwin.testing.rig import options_of

    def make() -> Rig:
        options = options_of("m1486", M1486Marker, *_options(request, "m1486"))
        device = device_for(request.config.stash[_devices], "m1486")
        return M1486Rig(options, device, tmp_path, request.path.parent, partial(_observe, request))

    yield from _rig(request, "m1486", make)


@pytest.fixture
def steptwin_world(request: pytest.FixtureRequest) -> Iterator[WorldRig]:
    """A running world (`steptwin.testing.WorldRig`), new for each test.

    ``@pytest.mark.steptwin_world("controller.toml")`` names its file. Its lines are on free ports, whatever the file gives.
    """
    from steptwin.testing.rig import options_of
    from steptwin.testing.world import WorldOptions, WorldRig

    def make() -> Rig:
        arguments, given = _options(request, "steptwin_world")
        options = options_of("steptwin_world", WorldOptions, arguments, given)
        return WorldRig(options, request.config.stash[_devices], request.path.parent, partial(_observe, request))

    yield from _rig(request, "steptwin_world", make)


@pytest.fixture
def steptwin_campaign(request: pytest.FixtureRequest, tmp_path: Path) -> CampaignSummary:
    """The summary of a campaign that was run (`steptwin.campaign.summary.CampaignSummary`). The test fails if a run did.

    ``@pytest.mark.steptwin_campaign("campaign.toml", runs=100)`` names its file, beside the test.
    """
    from steptwin.testing.campaign import CampaignMarker, run_campaign
    from steptwin.testing.rig import options_of

    def run() -> tuple[CampaignSummary, str]:
        arguments, given = _options(request, "steptwin_campaign")
        given.pop("time", None)
        options = options_of("steptwin_campaign", CampaignMarker, arguments, given)
        return run_campaign(options, request.path.parent, tmp_path / "campaign")

    summary, text = _without_traceback("steptwin_campaign", run)
    if text:
        pytest.fail(text, pytrace=False)
    return summary


@pytest.fixture
def steptwin_coverage(request: pytest.FixtureRequest) -> Iterator[Callable[[Simulation], None]]:
    """Call it with a world that the test has made, so that ``--steptwin-coverage`` counts what that executes until the test ends.

    Names of its files are relative to the folder of the test.
    """
    yield lambda world: _observe(request, world, request.path.parent)
    if _coverage in request.config.stash:
        request.config.stash[_coverage].close()
