"""Workpieces that scripts and programs put into a world and take out of it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml.reader import WorldError
from steptwin.subject.describe import workpiece_states

CELL = """
[[mic488]]
name = "c"
[[conveyor]]
name = "line"
length = 300
speed = 100
run = "c.OUT1"
workpiece = [60, 40, 20]
at = [0, 300, 100]
[[conveyor]]
name = "flat"
length = 200
speed = 100
run = "c.OUT1"
workpiece = 50
[[nest]]
name = "tray"
at = [0, 0, 0]
cells = [2, 1]
workpiece = [40, 40, 20]
filled = 1
[[vacuum]]
name = "cup"
ejector = "c.OUT2"
pick = "c.OUT3"
from = "flat"
pick_at = 40
"""


def there(world: World) -> list[str]:
    return sorted(one.name for one in workpiece_states(world))


def told(world: World) -> list[str]:
    return [str(record.value) for record in world.trace.of("event") if record.subject == "workpiece"]


def test_a_workpiece_is_put_where_it_is_said_and_goes_on_from_there() -> None:
    world = World.from_toml(CELL)
    world.mic488["c"].write("OUT1", 1)
    world.put("line", front=120.0)
    world.put("flat")
    world.run(for_=0.5)
    assert world.read("line.place1") == pytest.approx(170.0)
    assert world.read("flat.place1") == pytest.approx(50.0)
    assert world.read("line.fed") == 1


def test_a_nest_takes_further_ones_cell_by_cell_and_layer_by_layer() -> None:
    world = World.from_toml(CELL)
    for _ in range(3):
        world.put("tray")
    assert told(world) == ["tray.2 lies on tray", "tray.3 lies on tray.1", "tray.4 lies on tray.2"]
    assert world.read("tray.count") == 4
    assert world.read("tray.crooked") == 0


def test_one_that_is_removed_is_gone_wherever_it_was() -> None:
    """On a belt in space and on another, in a cup, under another one, and while it falls: what was on it falls."""
    world = World.from_toml(CELL)
    for on in ("line", "flat", "tray", "tray", "tray"):
        world.put(on)
    world.mic488["c"].write("OUT1", 1)
    world.run(for_=0.5)
    world.mic488["c"].write("OUT3", 1)
    world.mic488["c"].write("OUT2", 1)
    world.run(for_=0.3)
    assert world.read("cup.held") == 1
    for name in ("line.1", "flat.1", "tray.1"):
        world.remove(name)
    assert there(world) == ["tray.2", "tray.3", "tray.4"]
    world.run(for_=0.01)
    world.remove("tray.3")
    assert there(world) == ["tray.2", "tray.4"]
    world.run(for_=1.0)
    assert [world.read(name) for name in ("line.count", "tray.count", "cup.held")] == [0, 2, 0]
    assert [text for text in told(world) if "tray.3" in text][1:] == ["tray.3 falls 20 mm"]


@pytest.mark.parametrize(
    ("step", "error", "problem"),
    [
        (do.Put("lin"), Misuse, "no conveyor or nest is called 'lin' (did you mean 'line'?); there are line, flat, tray"),
        (do.Put("line", 301.0), Misuse, "front = 301.0 mm: permitted are 0 to 300, the length of line"),
        *(
            (do.Put("line", front), Misuse, f"front = {front!r} mm: permitted are 0 to 300")  # type: ignore[arg-type]
            for front in (-0.5, math.nan, math.inf, True, "5")
        ),
        (do.Put(None), Misuse, "None: expected the name of a conveyor or nest"),  # type: ignore[arg-type]
        (do.Put("tray", 1.0), Misuse, "front = 1.0: tray is a nest, which takes a workpiece into its first free cell"),
        (do.Put("line", 130.0), Refusal, "line has no room there for another workpiece"),
        (do.Remove("line.7"), Refusal, "there is no line.7 now"),
        *(
            (do.Remove(name), Misuse, f"{name!r}: expected the name of a workpiece, such as line.3")  # type: ignore[arg-type]
            for name in (None, 5, "", ".", "line", "line.", "line.x")
        ),
        (do.Remove("lin.1"), Misuse, "no conveyor or nest is called 'lin'"),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(step: do.Step, error: type[Exception], problem: str) -> None:
    world = World.from_toml(CELL)
    world.put("line", front=100.0)
    before = world.trace.digest()
    with pytest.raises(error) as raised:
        world.apply_input(step)
    assert problem in str(raised.value)
    assert world.trace.digest() == before


SCRIPT = """
[[script]]
name = "s"
steps = [
  { write = { "c.OUT1" = 1 } }, { put = "line" }, { put = "line" }, { wait = "1 s" }, { put = "line", front = 10 },
  { put = "tray" }, { put = "tray" }, { wait = "500 ms" }, { remove = "tray.1" }, { remove = "line.1" }, { remove = "line.1" },
]
"""


def test_scripts_put_and_remove_and_say_what_they_could_not() -> None:
    world = World.from_toml(CELL + SCRIPT)
    world.run(until=3.0)
    failures = [str(record.value) for record in world.trace.of("event") if record.subject == "expectation"]
    assert failures == ["line has no room there for another workpiece", "there is no line.1 now"]
    assert there(world) == ["line.2", "tray.2", "tray.3"]


def test_names_in_scripts_are_checked_before() -> None:
    with pytest.raises(WorldError, match="no conveyor or nest is called 'lne'"):
        World.from_toml(CELL + SCRIPT.replace('{ put = "line" }', '{ put = "lne" }'))


def test_it_can_be_restored_and_replayed(tmp_path: Path) -> None:
    check_it_can_be_restored(World.from_toml(CELL + SCRIPT), World.from_toml(CELL + SCRIPT), 1.2, 3.0, tmp_path)


def test_what_comes_from_outside_is_replayed(tmp_path: Path) -> None:
    world = World.from_toml(CELL)
    world.run(until=0.25)
    world.put("line")
    world.put("tray")
    world.run(until=0.5)
    world.remove("tray.1")
    world.run(until=1.0)
    save(recording_of(world), tmp_path / "r.json")
    assert load(tmp_path / "r.json").replay().trace.digest() == world.trace.digest()


def test_who_put_a_workpiece_is_a_cause() -> None:
    world = World.from_toml(CELL)
    world.run(until=0.25)
    world.put("line")
    world.run(until=0.5)
    texts = [link.text for link in world.why("line.count").links]
    assert texts == ["line.1 is on line", "from outside: puts a workpiece on line"]


WAITING = """
[[mic488]]
name = "c"
[[conveyor]]
name = "line"
length = 300
speed = 100
run = "c.OUT1"
feed_every = "300 ms"
feed_waits = true
workpiece = 60
[[conveyor.stop]]
at = 200
hold = "c.OUT2"
"""


def test_a_workpiece_waits_for_room_and_the_next_one_for_its_time() -> None:
    """60 mm need 0.6 s. With the stop from 1 s to 5 s four of them fill the belt; the next one comes when the fourth is clear."""
    world = World.from_toml(WAITING)
    world.mic488["c"].write("OUT1", 1)
    world.mic488["c"].write("OUT2", 1)
    world.run(until=5.0)
    assert world.read("line.fed") == 4
    world.mic488["c"].write("OUT2", 0)
    world.run(until=5.9)
    times = [one.time / SECOND for one in world.trace.of("event") if str(one.value).endswith("is on line")]
    assert times == pytest.approx([0.3, 0.9, 1.5, 2.1, 5.4], abs=1e-8)
    assert world.read("line.missed") == 0
