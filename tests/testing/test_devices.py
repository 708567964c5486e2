"""Fixtures for devices instead of twins."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "testing"
WORLD = ROOT / "examples" / "worlds" / "feeder.toml"


Run = Callable[..., pytest.RunResult]


def test_the_example_passes(pytester: pytest.Pytester) -> None:
    _copy_example(pytester)
    pytester.runpytest_inprocess("-W", "error").assert_outcomes(passed=6)


def test_the_example_runs_on_a_device_too(pytester: pytest.Pytester, serve: Callable[..., Any]) -> None:
    served = serve("--demo")
    _copy_example(pytester)
    address = f"tcp://127.0.0.1:{served.tcp_port}"
    pytester.runpytest_inprocess("-W", "error", "--device", address, "-k", "operator").assert_outcomes(passed=1, deselected=5)
    assert any("M1 is at its home position" in line for line in served.lines)


def _copy_example(pytester: pytest.Pytester) -> None:
    for file in EXAMPLE.iterdir():
        if file.is_file():
            shutil.copy(file, pytester.path)


def test_axes_of_a_device_are_stopped_after_the_test(run: Run, serve: Callable[..., Any]) -> None:
    served = serve("--demo")
    address = f"tcp://127.0.0.1:{served.tcp_port}"
    result = run(
        """
        import pytest

        def test_it(mic488):
            mic488.driver.enable(1)
            mic488.driver.axis(1).move_velocity(5.0)
            assert False, "something else went wrong"

        @pytest.mark.mic488(twin_only=True)
        def test_twin(mic488):
            raise AssertionError

        def test_look(mic488):
            mic488.axis(1)

        @pytest.mark.mic488(firmware="1.23")
        def test_other(mic488):
            raise AssertionError
        """,
        "--device",
        address,
        "-rs",
    )
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(["*axis(1) exists on a twin only, and --device names tcp:*"])
    result.stdout.fnmatch_lines(["*this test is for firmware 1.23, tcp:* has 1.70"])
    axis = served.state()["axes"][0]
    assert axis["enabled"]
    assert axis["velocity"] == 0.0


def test_a_device_that_is_not_there_is_told_in_a_line(run: Run) -> None:
    result = run("def test_it(mic488):\n    mic488.driver\n", "--device", "tcp://127.0.0.1:1")
    result.stdout.fnmatch_lines(["fixture mic488, after the test: cannot connect to tcp://127.0.0.1:1: connection refused"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--device", "nonsense:"], "*'nonsense:' is not an address*"),
        (["--device", "/dev/a", "--device", "/dev/b"], "*there is an address already: /dev/a*"),
        (["--device", "m1486=/dev/a", "--device", "m1486=/dev/b"], "*m1486 has an address already: /dev/a*"),
        (["--device", "/dev/a", "-p", "xdist", "-n2"], "*several processes (-n) cannot share a device: run without -n*"),
        (["--device", "/dev/a"], "*for a MIC488 and for an M1486: name the device, mic488=ADDRESS or m1486=ADDRESS*"),
    ],
)
def test_devices_that_cannot_be_meant_are_refused_before_anything_moves(run: Run, options: list[str], message: str) -> None:
    result = run("def test_it(mic488, m1486):\n    raise AssertionError\n", *options)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([message])


def test_a_name_that_no_test_knows_is_refused(run: Run, pytester: pytest.Pytester) -> None:
    shutil.copy(WORLD, pytester.path)
    text = """
        import pytest

        @pytest.mark.steptwin_world("feeder.toml", twin_only=True)
        def test_feeder(steptwin_world):
            raise AssertionError

        @pytest.mark.steptwin_world("none.toml")
        def test_other(steptwin_world):
            raise AssertionError

        def test_mic(mic488):
            raise AssertionError
    """
    result = run(text, "--device", "mci488=/dev/a", "--device", "m1486=/dev/b")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--device mci488=/dev/a: no test here has a device of that name: there are drum, *, table"])
    run(text, "--device", "table=/dev/a", "-k", "feeder").assert_outcomes(skipped=1, deselected=2)


def test_a_world_of_several_controllers_asks_which_of_them_is_there(
    run: Run, pytester: pytest.Pytester, serve: Callable[..., Any]
) -> None:
    served = serve("--demo")
    shutil.copy(WORLD, pytester.path)
    address = f"tcp://127.0.0.1:{served.tcp_port}"
    text = """
        import pytest

        @pytest.mark.steptwin_world("feeder.toml")
        def test_it(steptwin_world):
            steptwin_world.driver("table").enable(1)
            steptwin_world.axis("x")
    """
    named = run(text, "--device", f"table={address}", "-rs")
    named.stdout.fnmatch_lines(["*the world exists on a twin only, and --device names tcp:*"])
    assert served.state()["axes"][0]["enabled"]
    run(text, "--device", address, "-rs").stdout.fnmatch_lines(["*a world of several controllers (--device NAME=ADDRESS*"])
