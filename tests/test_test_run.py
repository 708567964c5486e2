"""What holds for all tests: time limits that end what hangs, and signals that arrive however pytest was started."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]

HANGS_IN_A_CALLBACK = """
import asyncio
import time

def hang():
    while True:
        time.sleep(0.01)

async def wait_for_it():
    asyncio.get_running_loop().call_soon(hang)
    await asyncio.sleep(3600)

def test_hangs():
    asyncio.run(wait_for_it())
"""


def test_a_test_that_hangs_in_a_callback_of_asyncio_is_ended(pytester: pytest.Pytester) -> None:
    """A limit that raises an exception would be caught by asyncio, and the test would wait on."""
    assert SETTINGS["timeout"] <= 300
    copied = "".join(f"{name} = {SETTINGS[name]}\n" for name in ("timeout_method", "asyncio_default_fixture_loop_scope"))
    pytester.makeini(f"[pytest]\ntimeout = 0.5\n{copied}")
    pytester.makepyfile(HANGS_IN_A_CALLBACK)
    outcome = pytester.runpytest_subprocess("-p", "no:xdist", "-p", "no:steptwin", timeout=30)
    assert outcome.ret != 0
    outcome.stdout.fnmatch_lines(["*Timeout*", "*in hang*"])


def test_interrupts_are_tested_where_sigint_is_ignored_too() -> None:
    """A shell without job control starts background commands, and so perhaps pytest, with SIGINT ignored."""
    tests = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/live/test_interrupts.py"]
    ended = subprocess.run(
        ["bash", "-c", "trap '' INT HUP; exec \"$@\"", "bash", sys.executable, *tests],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout


STARTS_AND_WAITS = """
import subprocess
import sys

from guard import guarded

with guarded():
    subprocess.run([sys.executable, "-c", "pass"])
    wait = "import threading; threading.Event().wait()"
    with subprocess.Popen([sys.executable, "-c", wait]) as child:
        print("started", flush=True)  # and noted: killed a moment before, this run would leave it behind
        child.wait()
"""


def test_a_run_that_is_killed_leaves_no_processes_behind() -> None:
    """Its standard output ends when the last one that writes to it has: the process that it had started."""
    support = {**os.environ, "PYTHONPATH": str(ROOT / "tests/support")}
    with subprocess.Popen([sys.executable, "-c", STARTS_AND_WAITS], stdout=subprocess.PIPE, text=True, env=support) as run:
        assert run.stdout is not None
        assert run.stdout.readline() == "started\n"
        run.kill()
        assert run.stdout.read() == ""


def test_signals_are_not_ignored() -> None:
    assert signal.SIG_IGN not in {signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGHUP)}
