"""``python killed_writers.py FOLDER SEED KILLS``: kills writing commands, and counts what became of their files.

One process has imported everything; each trial is a fork of it that writes the same file again and again. Half of all are killed
at any moment of two runs, half as soon as something has changed in the folder.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

from steptwin.cli import main
from steptwin.files.export import write_trace
from steptwin.files.recording import recording_of, save
from steptwin.files.world import World
from steptwin.live.studio.drawing import WorldArrangement
from steptwin.simulation.describe.arrangement import DrawnPosition

PROGRAM = "if in1=1\ndelay 5\nendif\n" * 800 + "end\n"
IMAGE_OF = "IF IN1 = 1\nDELAY 5\nENDIF\n"
CHIP = "[\n@70\nI1H20\nS200\nV800\nA6000\nR\n]\n"
WORLD = """
[world]
name = "hall"
[[mic488]]
name = "table"
[[script]]
name = "go"
steps = [{ write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 1 } }, { wait = "1 s" }]
"""
AIMED_S = 0.0005
Act = Callable[[], object]


def command(*arguments: str) -> None:
    """``steptwin`` in this process, silent."""
    sys.argv = ["steptwin", *arguments]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), contextlib.suppress(SystemExit):
        main()


def ways(folder: Path) -> dict[str, tuple[Path, bytes, Act]]:
    """What writes: its file, the content that is there before, and the call."""
    for name, text in (("w.toml", WORLD), ("i.prg", IMAGE_OF), ("c.m1486", CHIP)):
        (folder / name).write_text(text)
    os.chdir(folder)
    command("build", "i.prg")
    world = World.load(folder / "w.toml")
    world.run(until=2.0)
    recording = recording_of(world)
    drawn = WorldArrangement(world.spec, ["table"], folder / "drawn.toml")
    old = b"the old one\n" * 2000
    return {
        "fmt": (folder / "a.prg", PROGRAM.encode(), partial(command, "fmt", "a.prg")),
        "save": (folder / "s.json", old, partial(save, recording, folder / "s.json")),
        "save arrangement": (folder / "drawn.toml", WORLD.encode(), partial(drawn.save, [DrawnPosition("table", 1, 2)])),
        "build": (folder / "b.wbc", old, partial(command, "build", "i.prg", "-o", "b.wbc")),
        "decompile": (folder / "d.prg", old, partial(command, "decompile", "i.wbc", "-o", "d.prg")),
        "migrate": (folder / "m.m1486", old, partial(command, "migrate", "c.m1486", "--to", "B", "-o", "m.m1486")),
        "explain": (folder / "e.svg", old, partial(command, "explain", "i.prg", "-o", "e.svg")),
        "trace": (folder / "t.jsonl", old, partial(write_trace, world.trace, folder / "t.jsonl")),
        "coverage": (folder / "c.info", old, partial(command, "run", "w.toml", "--coverage", "c.info")),
    }


def put(path: Path, content: bytes) -> None:
    """The file of before, without a moment at which it is not whole."""
    aside = path.with_name(f"{path.name}.put")
    aside.write_bytes(content)
    aside.replace(path)


def wait_for_change(path: Path, longest_s: float) -> None:
    """Until something is written to a file or made beside it."""
    end = time.monotonic() + longest_s
    before = seen = _seen(path)
    while seen == before and time.monotonic() < end:
        seen = _seen(path)


def _seen(path: Path) -> tuple[int, ...]:
    file, folder = path.stat(), path.parent.stat()
    return file.st_ino, file.st_mtime_ns, file.st_size, folder.st_mtime_ns


def again_and_again(path: Path, old: bytes, act: Act) -> None:
    while True:
        act()
        put(path, old)


def killed(folder: Path, seed: int, kills: int) -> dict[str, dict[str, int]]:
    """For each command how often its file was the old one, the new one, or lost."""
    chance = random.Random(seed)
    known = ways(folder)
    whole: dict[str, bytes] = {}
    took: dict[str, float] = {}
    for name, (path, old, act) in known.items():
        put(path, old)
        begin = time.monotonic()
        act()
        took[name] = time.monotonic() - begin
        whole[name] = path.read_bytes()
        assert whole[name] != old, name
    found: dict[str, Counter[str]] = {name: Counter() for name in known}
    for _ in range(kills):
        name = chance.choice(list(known))
        path, old, act = known[name]
        put(path, old)
        process = os.fork()
        if process == 0:
            again_and_again(path, old, act)
        if chance.random() < 0.5:
            time.sleep(chance.uniform(0, 2 * took[name]))
        else:
            wait_for_change(path, 4 * took[name])
            time.sleep(chance.uniform(0, AIMED_S))
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        content = path.read_bytes() if path.exists() else b""
        found[name][{old: "old", whole[name]: "new"}.get(content, "lost")] += 1
    return {name: dict(counts) for name, counts in found.items()}


if __name__ == "__main__":
    print(json.dumps(killed(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
