"""Processes that jog and are suspended (SIGSTOP), very often: none of the axes moves again when they go on."""

from __future__ import annotations

import json
import os
import random
import select
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

import pytest
from soak import scaled
from tests.conftest import STEPTWIN

from steptwin.live.remote import RemoteSubject
from steptwin.subject.subscriptions import filter_of

JOGGING = Path(__file__).parents[1] / "support/jogging.py"
LINES = (("mic488", 9600, "threads"), ("mic488", 9600, "tasks"), ("B", 1200, "threads"), ("B", 1200, "tasks"),
         ("B2x", 9600, "threads"), ("B2x", 9600, "tasks"))  # fmt: skip
"""Kind or type, rate and driver. A MIC488 has no rate below 9600 bit/s, and only an M1486 with 24 MHz has that one."""
LEAST_AWAY_S = 0.45
STARTED_S = 60.0


def _read(stream: IO[str], within_s: float) -> str:
    """A line of the program, empty if none comes in time."""
    ready, _, _ = select.select([stream], [], [], within_s)
    return stream.readline().strip() if ready else ""


@contextmanager
def _ended(process: subprocess.Popen[str]) -> Generator[subprocess.Popen[str]]:
    try:
        yield process
    finally:
        process.send_signal(signal.SIGCONT)
        process.kill()
        process.communicate()


def _served(folder: Path, kind: str, baud: int, name: str) -> subprocess.Popen[str]:
    """A twin with the timing of its line."""
    ready = folder / f"{name}.json"
    own = ["mic488", "--rtu-tcp"] if kind == "mic488" else ["m1486", "--variant", kind, "--chain", "7", "--tcp"]
    command = [STEPTWIN, "serve", *own, "127.0.0.1:0", "--baud", str(baud), "--line-timing", "real", "--name", name]
    twin = subprocess.Popen([*command, "--ready-file", ready], stdout=subprocess.DEVNULL, text=True)
    end = time.monotonic() + STARTED_S
    while not ready.exists() and time.monotonic() < end:
        time.sleep(0.05)
    return twin


class Trials:
    """Those of one line: a twin, and a program that jogs it."""

    def __init__(self, twin: RemoteSubject, program: subprocess.Popen[str], point: str, seed: int) -> None:
        self._twin = twin
        self._program = program
        self._point = point
        self._chance = random.Random(seed)
        self._plans, _ = twin.subscribe_from_now(filter_of(["plan"]), 10_000)

    def _position(self) -> float | None:
        (reading,) = self._twin.read(self._point)
        return reading.value

    def _next_motion(self) -> None:
        self._plans.take()
        end = time.monotonic() + 10.0
        while not self._plans.take().events and time.monotonic() < end:
            self._twin.pump(0.002)

    def _at_rest(self) -> float | None:
        before, position = None, self._position()
        while position != before:
            time.sleep(0.1)
            before, position = position, self._position()
        return position

    def trial(self, *, aimed: bool) -> str | None:
        """What was wrong. ``aimed``: suspended as soon as a motion has begun, between R and the next `hold`."""
        program, chance = self._program, self._chance
        assert program.stdin is not None
        assert program.stdout is not None
        program.stdin.write("go\n")
        program.stdin.flush()
        for _ in range(chance.randrange(1, 4)):
            self._next_motion()
        if not aimed:
            time.sleep(chance.uniform(0.0, 0.4))
        os.kill(program.pid, signal.SIGSTOP)
        suspended = time.monotonic()
        self._at_rest()
        away_s = chance.uniform(LEAST_AWAY_S, 2.5)
        time.sleep(max(0.0, away_s - (time.monotonic() - suspended)))
        stood = self._at_rest()
        os.kill(program.pid, signal.SIGCONT)
        end = _read(program.stdout, 30.0)
        time.sleep(0.5)
        if self._at_rest() != stood:
            return f"{self._point}, aimed {aimed}, away {time.monotonic() - suspended:.2f} s: it moved again ({end})"
        return None if end else f"{self._point}: the program did not end its jog"


def _run(folder: Path, number: int, trials: int) -> list[str]:
    kind, baud, way = LINES[number % len(LINES)]
    name = f"jogs{os.getpid()}-{number}"
    with ExitStack() as stack:
        stack.enter_context(_ended(_served(folder, kind, baud, name)))
        ready = json.loads((folder / f"{name}.json").read_text())
        line = next(one for one in ready["end_points"] if one["kind"] in ("tcp", "rtu-tcp"))
        scheme = "rtu-tcp" if kind == "mic488" else "tcp"
        address = f"{scheme}://127.0.0.1:{line['port']}"
        program = subprocess.Popen(
            [sys.executable, JOGGING, kind, address, str(baud), way], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        stack.enter_context(_ended(program))
        assert program.stdout is not None
        assert _read(program.stdout, STARTED_S) == "ready"
        twin = stack.enter_context(RemoteSubject(name))
        point = f"{ready['controllers'][0]['name']}.{'M1.' if kind == 'mic488' else ''}position"
        made = Trials(twin, program, point, number)
        return [f"{kind} {way} {wrong}" for i in range(trials) if (wrong := made.trial(aimed=i % 3 != 1)) is not None]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_none_of_the_axes_that_were_jogged_moves_again(tmp_path: Path) -> None:
    trials = scaled(1000)
    chosen = range(len(LINES)) if trials >= 10 * len(LINES) else (0, 2, 3)
    each = max(2, -(-trials // len(LINES)))
    with ThreadPoolExecutor(len(chosen)) as pool:
        found = pool.map(lambda number: _run(tmp_path, number, each), chosen)
        wrong = [one for of_line in found for one in of_line]
    assert not wrong, "\n".join(wrong)
