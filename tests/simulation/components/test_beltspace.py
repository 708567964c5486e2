"""Belts in space: where workpieces are on them, picked from them and put on them; against the fronts that the belts give."""

from __future__ import annotations

from pathlib import Path

import pytest
from space_rig import controller, place_in, told
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.space.frames import FLOOR, pose
from steptwin.subject.world import WorldSubject

CELL = (
    controller("c", 160.0, 2000.0, 400.0)
    + """
[[axis]]
name = "x"
drive = "c.M1"
pitch = 20.0
at = [0, 0, 200]
[[cylinder]]
name = "lift"
extend = "c.OUT1"
stroke = 60.0
extend_time = "250 ms"
retract_time = "200 ms"
on = "x"
at = [50, 0, 0]
along = "-z"
[[vacuum]]
name = "cup"
ejector = "c.OUT2"
on = "lift"
at = [0, 0, -19]
build_up = "80 ms"
release = "30 ms"
[[conveyor]]
name = "infeed"
length = 600.0
speed = 120.0
run = "c.OUT3"
feed_every = "3 s"
workpiece = [40, 30, 20]
at = [50, -500, 100]
along = "+y"
[[beam]]
name = "stop"
at = [0, 18, 110]
length = 100
[[conveyor]]
name = "outfeed"
length = 500.0
speed = 200.0
run = "c.OUT4"
at = [350, 50, 100]
along = "-y"
"""
)


def picked(text: str, place: float = 300.0) -> World:
    """A workpiece is picked at the beam, carried along x, and put down."""
    world = World.from_toml(text)
    cell = world.mic488["c"]
    cell.write("M1_EN", 1)
    cell.write("OUT3", 1)
    world.run(until="stop.seen")
    cell.write("OUT3", 0)
    for register, value, seconds in (
        ("OUT1", 1, 0.4),
        ("OUT2", 1, 0.3),
        ("OUT1", 0, 0.4),
        ("M1_POS_ABS", place, 2.0),
        ("OUT1", 1, 0.4),
        ("OUT2", 0, 0.3),
        ("OUT1", 0, 0.4),
    ):
        cell.write(register, value)
        world.run(for_=seconds)
    return world


@pytest.mark.parametrize("ramp", ["", 'ramp_up = "300 ms"\nramp_down = "200 ms"\n'])
@pytest.mark.parametrize(("along", "unit"), [("+x", (1, 0)), ("-x", (-1, 0)), ("+y", (0, 1)), ("-y", (0, -1))])
def test_workpieces_are_behind_the_fronts_that_the_belt_gives(along: str, unit: tuple[int, int], ramp: str) -> None:
    world = World.from_toml(CELL.replace('along = "+y"', f'along = "{along}"\n{ramp}'))
    world.run(until=3.0)
    for n in range(40):
        world.mic488["c"].write("OUT3", int(n % 8 < 5))
        world.run(for_=0.1 + 0.013 * n)
        bodies = world.objects.workpieces.bodies()
        for k, (name, body) in enumerate(bodies.items()):
            there = pose(body.frame, FLOOR, world.now)
            middle = world.read(f"infeed.place{k + 1}") - 20.0
            assert [one / 1e6 for one in there.at] == pytest.approx(
                [50 + unit[0] * middle, -500 + unit[1] * middle, 100], abs=2e-6
            ), name
            assert there.angle_q % 2 == abs(unit[1])


def test_a_beam_sees_a_workpiece_where_a_sensor_of_the_belt_does() -> None:
    """The sensor is 500 mm along the belt, the beam across it there. The belt has a picometre, contacts half a nanometre."""
    text = CELL.replace("[[beam]]", '[[conveyor.sensor]]\nat = 500.0\nto = "c.IN1"\n[[beam]]').replace(
        "[0, 18, 110]", "[0, 0, 110]"
    )
    for ramp in ("", '\nramp_up = "2 s"\nramp_down = "2 s"'):
        world = World.from_toml(text.replace("speed = 120.0", f"speed = 120.0{ramp}"))
        world.mic488["c"].write("OUT3", 1)
        world.run(until=6.2)
        world.mic488["c"].write("OUT3", 0)
        world.run(until=8.4)
        world.mic488["c"].write("OUT3", 1)
        world.run(until=20.0)
        edges = {name: [one for one in world.trace.edges() if one.subject == name] for name in ("IN1", "stop.seen")}
        assert len(edges["IN1"]) >= 6
        for one, other in zip(edges["IN1"], edges["stop.seen"], strict=True):
            assert one.value == other.value
            assert one.time == pytest.approx(other.time, abs=50)


def test_a_cup_takes_a_workpiece_from_a_belt_and_puts_it_on_another() -> None:
    """It is 40 mm long along y, its front 18 mm beyond the cup; the other belt goes the other way."""
    world = picked(CELL)
    assert told(world)[-2:] == ["cup lets go of infeed.1", "infeed.1 is on outfeed"]
    assert world.read("outfeed.place1") == pytest.approx(50.0 - (18.0 - 20.0) + 20.0, abs=1e-4)
    body = world.objects.workpieces.bodies()["infeed.1"]
    there = pose(body.frame, FLOOR, world.now)
    assert [one / 1e6 for one in there.at] == pytest.approx([350, -2, 100], abs=1e-4)
    assert there.angle_q == 1.0
    begin = world.now
    world.mic488["c"].write("OUT4", 1)
    world.run(until="outfeed.delivered == 1")
    assert (world.now - begin) / SECOND == pytest.approx((500.0 - 72.0) / 200.0, abs=1e-5)


def test_what_is_put_down_beside_a_belt_falls() -> None:
    world = picked(CELL, place=361.0)
    assert told(world)[-2:] == ["infeed.1 falls 101 mm", "infeed.1 lies on the floor"]
    assert world.read("cup.dropped") == 1


def test_what_lies_on_a_workpiece_leaves_with_it() -> None:
    """The next one is let go of above the first one on the belt, which then runs to its end."""
    world = picked(CELL)
    cell = world.mic488["c"]
    cell.write("M1_POS_ABS", 0.0)
    cell.write("OUT3", 1)
    world.run(for_=2.0)
    world.run(until="stop.seen")
    cell.write("OUT3", 0)
    for register, value in (("OUT1", 1), ("OUT2", 1), ("OUT1", 0), ("M1_POS_ABS", 300.0), ("OUT2", 0), ("OUT4", 1)):
        cell.write(register, value)
        world.run(for_=1.2)
    world.run(until="outfeed.delivered == 1", for_="5 s")
    assert told(world)[-4:] == [
        "infeed.2 falls 41 mm",
        "infeed.2 lies on infeed.1",
        "infeed.1 leaves outfeed",
        "infeed.2 leaves with infeed.1",
    ]


def test_what_is_put_on_the_rear_of_another_one_falls_to_the_floor() -> None:
    """Its middle is beside that, so that it does not lie on it."""
    world = picked(CELL)
    cell = world.mic488["c"]
    cell.write("OUT4", 1)
    world.run(for_=0.15)  # 30 mm: the middle of the next one is 10 mm behind it
    cell.write("OUT4", 0)
    cell.write("M1_POS_ABS", 0.0)
    cell.write("OUT3", 1)
    world.run(for_=2.0)
    world.run(until="stop.seen")
    cell.write("OUT3", 0)
    for register, value in (("OUT1", 1), ("OUT2", 1), ("OUT1", 0), ("M1_POS_ABS", 300.0), ("OUT1", 1), ("OUT2", 0)):
        cell.write(register, value)
        world.run(for_=1.2)
    assert told(world)[-3:] == [
        "cup lets go of infeed.2",
        "infeed.2 collides with infeed.1 on outfeed",
        "infeed.2 lies on the floor",
    ]
    assert world.read("cup.dropped") == 1


def test_it_can_be_restored(tmp_path: Path) -> None:
    steps = """
    [[event]]
    at = "1 ms"
    steps = [{ write = { "c.M1_EN" = 1, "c.OUT3" = 1, "c.OUT4" = 1 } }]
    [[event]]
    when = "stop.seen"
    steps = [
      { write = { "c.OUT3" = 0, "c.OUT1" = 1 } }, { wait = "400 ms" }, { write = { "c.OUT2" = 1 } }, { wait = "300 ms" },
      { write = { "c.OUT1" = 0 } }, { wait = "300 ms" }, { write = { "c.M1_POS_ABS" = 300.0 } }, { wait = "1 s" },
      { write = { "c.OUT1" = 1 } }, { wait = "400 ms" }, { write = { "c.OUT2" = 0, "c.OUT3" = 1 } }, { wait = "300 ms" },
      { write = { "c.OUT1" = 0 } }, { wait = "300 ms" }, { write = { "c.M1_POS_ABS" = 0.0 } },
    ]
    """
    world = World.from_toml(CELL + steps)
    check_it_can_be_restored(world, World.from_toml(CELL + steps), 8.6, 25.0, tmp_path)
    assert world.read("outfeed.delivered") >= 2


def test_a_viewer_gets_workpieces_when_they_go_elsewhere() -> None:
    """While a belt moves one, the way of the belt says where it is."""
    world = picked(CELL)
    subject = WorldSubject(world)
    states = {one.name: one for one in subject.workpieces()}
    assert subject.workpieces() is subject.workpieces()
    on_belt = states["infeed.1"]
    assert (on_belt.on, on_belt.size, [one.signal for one in on_belt.moves]) == ("outfeed", (40, 30, 20), ["outfeed.travel"])
    assert on_belt.at == pytest.approx((0, -52, 0), abs=1e-4)
    assert on_belt.yaw == 90.0
    world.mic488["c"].write("OUT4", 1)
    world.run(for_=0.5)
    assert subject.workpieces() is not None
    _, way, _ = place_in(on_belt, world.read)
    body = world.objects.workpieces.bodies()["infeed.1"]
    assert [one / 1e6 for one in pose(body.frame, FLOOR, world.now).at] == pytest.approx([350, 50 + way, 100], abs=1e-4)
    world.run(for_=9.0)
    assert "infeed.1" not in {one.name for one in subject.workpieces()}


LIFT = """
[[mic488]]
name = "c"
[[conveyor]]
name = "main"
length = 200
speed = 100
run = "c.OUT1"
feed_every = "2 s"
workpiece = [40, 30, 20]
next = "up"
at = [0, 0, 100]
[[cylinder]]
name = "lift"
extend = "c.OUT2"
stroke = 80
at = [200, 0, 20]
along = "+z"
[[conveyor]]
name = "up"
length = 200
speed = 100
run = "c.OUT3"
on = "lift"
at = [0, 0, 0]
"""


def test_a_belt_hands_over_where_the_next_one_begins_at_that_moment(tmp_path: Path) -> None:
    """The middle of a workpiece comes to the end 2.2 s after it was fed; a lift that is 80 mm lower catches the first one."""
    script = """
    [[script]]
    name = "s"
    steps = [{ write = { "c.OUT1" = 1 } }, { wait = "4.5 s" }, { write = { "c.OUT2" = 1, "c.OUT3" = 1 } }]
    """
    world = World.from_toml(LIFT + script)
    check_it_can_be_restored(world, World.from_toml(LIFT + script), 4.25, 6.25, tmp_path)
    events = [(one.time / SECOND, str(one.value)) for one in world.trace.of("event") if "main.3" not in str(one.value)]
    assert [text for _, text in events[2:]] == [
        "main.1 leaves main",
        "main.1 falls 80 mm",
        "main.1 is on up",
        "main.2 leaves main",
        "main.2 is on up",
    ]
    assert [time for time, _ in events[2:]] == pytest.approx([4.2, 4.2, 4.2 + (0.16 / 9.80665) ** 0.5, 6.2, 6.2], abs=2e-8)
    there = {name: pose(body.frame, FLOOR, world.now).at for name, body in world.objects.workpieces.bodies().items()}
    assert there["main.2"] == pytest.approx([205 * 10**6, 0, 100 * 10**6], abs=10)


def test_what_comes_to_the_end_while_the_next_belt_is_higher_falls_to_the_floor() -> None:
    world = World.from_toml(LIFT.replace("20]\nalong", "180]\nalong"))
    world.mic488["c"].write("OUT1", 1)
    world.run(until=5.0)
    assert told(world)[-1] == "main.1 lies on the floor"
    assert world.read("up.count") == 0
