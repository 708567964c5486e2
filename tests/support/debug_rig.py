"""Worlds to debug."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from tests.conftest import STEPTWIN, until

from steptwin.controller import MILLISECOND
from steptwin.debug.debugger import Debugger
from steptwin.debug.values import Stopped, StopReason
from steptwin.files.world import World

ENTRY = MILLISECOND - 1
"""When programs stop at their entry."""

WBC = """\
n = 0
MAIN:
    n = n + 1
    JUMP COUNT
    DELAY 0.05
JUMP MAIN
COUNT:
    OUT1 = ON
    OUT1 = OFF
    RETURN
INT_IN3:
    OUT2 = ON
    RETURN
"""
CHIP = "[\n:5\n@1\nL2\n+1\nE\n'2\nW5\nJ1\n@2\n+2\n.\n]\n"
BOTH = """
[world]
name = "two"
[[line]]
name = "chips"
kind = "m1486"
[[mic488]]
name = "m"
program = "m.prg"
start = true
[[m1486]]
name = "c"
line = "chips"
program = "c.m1486"
"""
ONE = '[world]\nname = "one"\n[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\n'


def make(text: str = WBC, world: str = ONE) -> World:
    files = {"m.prg": text.encode(), "c.m1486": CHIP.encode()}
    return World.from_toml(world, files, keep_trace=False, keep_inputs=False)


@contextmanager
def running_twin(folder: Path) -> Generator[None]:
    """`BOTH` in a process of its own, called ``two``; its files are in a folder."""
    (folder / "m.prg").write_text(WBC)
    (folder / "c.m1486").write_text(CHIP)
    (folder / "two.toml").write_text(BOTH)
    ready = folder / "ready.json"
    with (folder / "out").open("w") as out:
        command = [STEPTWIN, "up", "two.toml", "--ready-file", "ready.json"]
        process = subprocess.Popen(command, cwd=folder, stdout=out, stderr=out, env={**os.environ, "TERM": "dumb"})
    try:
        until(lambda: ready.exists() or process.poll() is not None, "the twin is ready")
        assert process.poll() is None, (folder / "out").read_text()
        yield
    finally:
        process.terminate()
        process.wait()


def started(text: str | None = None, world: str = ONE) -> Debugger:
    debugger = Debugger(make(world=world) if text is None else make(text, world))
    assert debugger.run_to_entry() == Stopped(StopReason.ENTRY, ENTRY, "m")
    return debugger
