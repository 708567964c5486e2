"""Grippers: when jaws come to a workpiece by their speeds, and what becomes of it."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[[button]]
name = "at_pick"
to = "jaws.pick"
[[button]]
name = "at_place"
to = "jaws.place"
[[conveyor]]
name = "feed"
length = 200.0
speed = 100.0
run = "a.OUT1"
feed = "a.OUT2"
workpiece = 30.0
mass = 0.4
marks = [12]
[[conveyor]]
name = "away"
length = 150.0
speed = 50.0
run = "a.OUT3"
[[conveyor.sensor]]
at = 60.0
sees = "mark"
to = "a.IN1"
[[gripper]]
name = "jaws"
close = "a.OUT4"
from = "feed"
pick_at = 120.0
onto = "away"
place_at = 40.0
stroke = 25.0
width = 15.0
close_time = "250 ms"
open_time = "100 ms"
[[load]]
name = "part"
axis = "x"
mass = 1.0
of = "jaws.mass"
points = [[0, 0], [10, 10]]
[[axis]]
name = "x"
drive = "a.M1"
pitch = 5.0
unit = "mm"
pulses_per_rev = 3200
[axis.motor]
torque = [[0, 1.0]]
"""


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels, without the first one."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel][1:]


def brought(text: str = TEXT) -> World:
    """A workpiece is between the open jaws at 1.3 s."""
    world = World.from_toml(text)
    device = world.mic488["a"]
    world.press("at_pick")
    device.write("OUT1", 1)
    device.write("OUT2", 1)
    world.run(until=1.3)
    device.write("OUT1", 0)
    return world


def test_it_takes_a_workpiece_and_puts_it_down_with_mass_and_marks() -> None:
    world = brought()
    device = world.mic488["a"]
    device.write("OUT4", 1)
    world.run(until=2.0)
    # 10 of 25 mm in 250 ms: 100 ms to the workpiece.
    assert edges(world, "jaws.held") == [(1400, 1)]
    assert edges(world, "jaws.closed") == []
    assert [world.read(f"jaws.{name}") for name in ("position", "mass")] == [pytest.approx(10.0), 0.4]
    assert world.read("part.share") == pytest.approx(0.4)
    assert world.read("feed.count") == 0
    world.release("at_pick")
    world.press("at_place")
    device.write("OUT3", 1)
    device.write("OUT4", 0)
    world.run(until=3.0)
    # It opens 10 mm at 250 mm/s. The mark begins at 40 - 12 = 28 mm, 32 mm before the sensor: 640 ms at 50 mm/s.
    assert edges(world, "jaws.held")[1:] == [(2000, 0)]
    assert edges(world, "jaws.opened")[-1] == (pytest.approx(2040, abs=1e-5), 1)
    assert edges(world, "away.sensor1")[0] == (pytest.approx(2640, abs=1e-4), 1)
    assert [world.read(f"away.{name}") for name in ("count", "mass")] == [1, 0.4]
    assert [world.read(f"jaws.{name}") for name in ("dropped", "mass")] == [0, 0]


def test_without_a_workpiece_it_closes_and_takes_none_that_comes_later() -> None:
    world = World.from_toml(TEXT)
    world.press("at_pick")
    for output in ("OUT4", "OUT1", "OUT2"):
        world.mic488["a"].write(output, 1)
    world.run(until=3.0)
    assert edges(world, "jaws.closed") == [(250, 1)]
    assert edges(world, "jaws.held") == []
    assert world.read("feed.delivered") == 1


def test_worn_jaws_let_it_fall() -> None:
    world = brought()
    world.mic488["a"].write("OUT4", 1)
    world.run(until=1.6)
    world.release("at_pick")
    world.fault("worn-jaws element=jaws until_s=1")
    world.run(until=3.0)
    assert edges(world, "jaws.held") == [(1400, 1), (1600, 0)]
    # The jaws go on from 10 to 25 mm.
    assert edges(world, "jaws.closed") == [(pytest.approx(1750, abs=1e-5), 1)]
    assert world.read("jaws.dropped") == 1


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("width = 15.0", "width = 25.0", "width = 25 mm is not below stroke = 25 mm: open jaws must go over a workpiece"),
        ('from = "feed"', 'from = "fed"', "no conveyor is called 'fed'"),
        ("close_time", "close_tim", r"\[gripper\] has no 'close_tim' \(did you mean 'close_time'\?\)"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(TEXT.replace(old, new, 1))


@pytest.mark.parametrize("moment_s", [1.3, 1.35, 1.4, 1.5])
def test_snapshots_have_it(moment_s: float) -> None:
    world = brought()
    world.mic488["a"].write("OUT4", 1)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=2.0)
    other = World.from_toml(TEXT)
    other.restore(snapshot)
    other.run(until=2.0)
    assert other.trace.digest() == world.trace.digest()
    assert other.read("jaws.held") == 1


def test_closed_jaws_take_nothing_whatever_else_happens() -> None:
    world = World.from_toml(TEXT)
    world.press("at_pick")
    for output in ("OUT4", "OUT1", "OUT2"):
        world.mic488["a"].write(output, 1)
    world.run(until=1.3)
    world.press("at_place")
    world.run(until=1.4)
    assert world.read("jaws.held") == 0
