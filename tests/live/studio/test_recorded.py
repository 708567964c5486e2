"""Recorded recordings to look at."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import recording_of, save
from steptwin.files.world import World
from steptwin.later import finish
from steptwin.live.studio.recorded import replayed
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.snapshotlog import PastWorld

TEXT = '[[mic488]]\nname = "table"\nprogram = "cell.prg"\nstart = true\n'
PROGRAM = b"n = 0\nLOOP:\nn = n + 1\n$R4 = n\nDELAY 0.2\nJUMP LOOP\n"
POINTS = ("time", "table.USER_REGISTER[4]:real", "table.IN3")


def shown(world: World | PastWorld) -> tuple[float, ...]:
    simulation = world.world if isinstance(world, PastWorld) else world
    return tuple(simulation.read(point) for point in POINTS)


def make(path: Path) -> dict[int, tuple[float, ...]]:
    """Record a recording of 10 s; what was seen at some of its moments."""
    world = World.from_toml(TEXT, {"cell.prg": PROGRAM})
    seen: dict[int, tuple[float, ...]] = {}
    for step in range(20):
        world.run(for_="0.5s")
        world.apply_input(do.Set((("table", "IN3", step % 2),)))
        seen[world.now] = shown(world)
    save(recording_of(world), path)
    return seen


def test_every_moment_of_a_session_can_be_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    seen = make(path)
    world, snapshots, differs = finish(replayed(path))
    assert differs == ""
    assert (world.now, snapshots.begin) == (10 * SECOND, 0)
    assert len(snapshots) == 11
    past = PastWorld(snapshots)
    for moment in sorted(seen, key=lambda one: one % 700_000_001):
        for _ in past.go(moment):
            pass
        assert shown(past) == seen[moment]


def test_a_session_that_ran_otherwise_is_shown_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    make(path)
    data = json.loads(path.read_text())
    del data["inputs"][1]  # IN3 = 1
    path.write_text(json.dumps(data))
    _, _, differs = finish(replayed(path))
    assert "differs from the run recorded" in differs


def test_a_description_is_no_recording() -> None:
    with pytest.raises(Misuse, match=r"machine\.toml: --view shows a recording"):
        finish(replayed(Path("machine.toml")))
