"""Positions that are computed from followed plans are those that the world shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.subject.events import read_event
from steptwin.subject.following import filter_of
from steptwin.subject.motion import Motions
from steptwin.subject.world import WorldSubject

FEEDER = Path(__file__).parents[2] / "examples" / "worlds" / "feeder.toml"


@pytest.mark.parametrize(("machine", "axis"), [("table", "M1."), ("drum", "")])
def test_they_are_those_of_the_world(machine: str, axis: str) -> None:
    world = World.load(FEEDER)
    subject = WorldSubject(world)
    part = next(part for part in subject.description.machines if part.name == machine)
    what = filter_of(["plan", "coordinate"])
    motions = Motions(part, subject.plans(what))
    following = subject.follow(what, 10_000)
    moved = 0
    for _ in range(300):
        world.run(for_=0.05)
        for event in following.take().events:
            motions.take(read_event(json.loads(json.dumps(event.plain()))))
        assert motions.position("1", world.now) == pytest.approx(world.read(f"{machine}.{axis}position"), abs=1e-9)
        assert motions.velocity("1", world.now) == pytest.approx(world.read(f"{machine}.{axis}velocity"), abs=1e-9)
        moved += motions.is_moving(world.now)
    assert moved > 5
