"""Light barriers and curtains: the nanoseconds at which bodies enter and leave them, from positions that the test integrates."""

from __future__ import annotations

from pathlib import Path

import pytest
from space_rig import POST, SLIDE, head
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

BODIES = SLIDE + head("x") + POST
BEAM = """
[[beam]]
name = "gate"
at = [100, -200, 490]
along = "+y"
length = 400
sees = ["head"]
to = "a.IN7"
"""


def started(text: str) -> World:
    world = World.from_toml(text)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 300.0)
    return world


def moment(distance: float) -> float:
    """Seconds until the axis has gone so far: 12.5 mm in half a second, then 50 mm/s."""
    return (distance / 50.0) ** 0.5 if distance < 12.5 else 0.5 + (distance - 12.5) / 50.0


def edges(world: World, subject: str) -> list[tuple[float, float]]:
    return [(one.time / SECOND, float(str(one.value))) for one in world.trace.edges() if one.subject == subject]


def test_it_sees_what_crosses_it_from_its_front_to_its_rear() -> None:
    """The head is 40 mm long and from 470 to 500 mm high."""
    world = started(BODIES + BEAM)
    world.run(until=10.0)
    expected = [(0.0, 0.0), (moment(80.0), 1.0), (moment(120.0), 0.0)]
    assert edges(world, "gate.seen") == [(pytest.approx(at, abs=2e-8), level) for at, level in expected]
    assert edges(world, "IN7")[-2:] == edges(world, "gate.seen")[-2:]


@pytest.mark.parametrize(("height", "seen"), [(469.999, False), (470.001, True), (499.999, True), (500.001, False)])
def test_what_is_above_or_below_it_is_not_seen(height: float, seen: bool) -> None:
    world = started(BODIES + BEAM.replace("490", f"{height}"))
    world.run(until=10.0)
    assert len(edges(world, "gate.seen")) == (3 if seen else 1)


def test_a_proximity_switch_has_a_range_and_a_hysteresis() -> None:
    """It looks along the way of the head, whose front starts 20 mm from the origin of its axis, and comes to 320 mm."""
    text = BEAM.replace("[100, -200, 490]", "[350, 0, 490]").replace("+y", "-x").replace("400", "100\nhysteresis = 20")
    world = started(BODIES + text)
    world.run(until=10.0)
    world.mic488["a"].write("M1_POS_ABS", 0.0)
    world.run(until=20.0)
    (on, _), (off, _) = edges(world, "gate.seen")[1:]
    assert on == pytest.approx(moment(350.0 - 100.0 - 20.0), abs=2e-8)
    # Back from 300 mm: it is seen until its front is at 350 − 120 mm.
    assert off == pytest.approx(10.0 + moment(300.0 - (350.0 - 120.0 - 20.0)), abs=2e-8)


def test_a_curtain_sees_what_is_in_any_of_its_beams_and_may_move() -> None:
    text = BEAM.replace("490", "300").replace("length", 'on = "x"\ncount = 11\npitch = 20\ncontact = "NC"\nlength')
    text = text.replace('"head"', '"post"').replace("[100, -200, 300]", "[100, -200, -190]")
    world = started(BODIES + text)
    world.run(until=10.0)
    # The post is 20 mm long, at 200 mm and up to 440 mm high: the eighth beam is the highest that it is in.
    expected = [(moment(90.0), 1.0), (moment(110.0), 0.0)]
    assert edges(world, "gate.seen")[1:] == [(pytest.approx(at, abs=2e-8), level) for at, level in expected]
    assert [level for _, level in edges(world, "IN7")[-2:]] == [0.0, 1.0]


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        (BEAM.replace('"head"', '"haed"'), "nothing is called 'haed'"),
        (BEAM.replace("length", 'count = 3\nacross = "-y"\nlength'), "across = '-y' is along its beams"),
        (BEAM.replace("length", "pitch = 3\nlength"), "pitch means nothing without count"),
        (BEAM.replace("at = [100, -200, 490]\nalong", "# along"), "'gate' has no place in space: give it on, at or along"),
    ],
)
def test_what_does_not_fit_is_refused(more: str, problem: str) -> None:
    with pytest.raises(WorldError) as error:
        World.from_toml(BODIES + more)
    assert problem in str(error.value)


def test_it_can_be_restored_while_it_sees_something(tmp_path: Path) -> None:
    text = BODIES + BEAM
    check_it_can_be_restored(started(text), World.from_toml(text), moment(100.0), 8.0, tmp_path)
