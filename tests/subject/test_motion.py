"""Positions that are computed from followed plans are those that the world shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.simulation.script.steps import Write
from steptwin.subject.commands import Enable, Move
from steptwin.subject.events import read_event
from steptwin.subject.motion import Motions
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

FEEDER = Path(__file__).parents[2] / "examples" / "worlds" / "feeder.toml"


@pytest.mark.parametrize(("controller", "axis"), [("table", "M1."), ("drum", "")])
def test_they_are_those_of_the_world(controller: str, axis: str) -> None:
    world = World.load(FEEDER)
    subject = WorldSubject(world)
    part = next(part for part in subject.description.controllers if part.name == controller)
    what = filter_of(["plan", "coordinate"])
    motions = Motions(part, subject.plans(what))
    subscription = subject.subscribe(what, 10_000)
    moved = 0
    for _ in range(300):
        world.run(for_=0.05)
        for event in subscription.take().events:
            motions.take(read_event(json.loads(json.dumps(event.to_json()))))
        assert motions.position("1", world.now) == pytest.approx(world.read(f"{controller}.{axis}position"), abs=1e-9)
        assert motions.velocity("1", world.now) == pytest.approx(world.read(f"{controller}.{axis}velocity"), abs=1e-9)
        moved += motions.is_moving(world.now)
    assert moved > 5


def test_a_coordinate_begins_anew_as_that_of_the_controller() -> None:
    world = World.from_toml(
        '[[mic488]]\nname = "m"\n[mic488.M1]\nunit = "mm"\ngear = 100.0\nacc = 1000.0\ndec = 1000.0\nvel = 500.0\n'
    )
    subject = WorldSubject(world)
    what = filter_of(["plan", "coordinate"])
    motions = Motions(subject.description.controllers[0], subject.plans(what))
    subscription = subject.subscribe(what, 100)
    subject.do(Enable("m", 1))
    subject.do(Write((("m", "M1_POS_ACT", 21_474_835.0),)))
    subject.do(Move("m", 1, by=10.0))
    shown = set()
    for _ in range(20):
        world.run(for_=0.02)
        for event in subscription.take().events:
            motions.take(event)
        assert motions.position("1", world.now) == world.read("m.M1.position")
        shown.add(world.read("m.M1.position") > 0)
    assert shown == {True, False}
