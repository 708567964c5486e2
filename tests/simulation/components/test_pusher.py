"""Bodies that push workpieces across belts, against times and places that follow from the lengths and speeds."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import pytest
from space_rig import BELT, BLADE, ROD, place
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.errors import Refusal
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

AXIS = """
[[axis]]
name = "rod"
drive = "c.M1"
pitch = 20.0
at = [300, -80, 110]
along = "+y"
"""
SIDE = """
[[conveyor]]
name = "side"
length = 400
speed = 80
run = "c.OUT1"
at = [100, 100, 100]
"""
TRAY = """
[[nest]]
name = "tray"
at = [330, 75, 100]
workpiece = [50, 40, 30]
filled = 1
"""
"""Its workpiece begins 55 mm beside the middle of the belt."""


def pushing(text: str, until: float = 5.2, **levels: float) -> World:
    """The middle of the first workpiece comes to that of the blade at 5.2 s: there the rod is extended."""
    world = World.from_toml(text)
    for name, level in {"OUT1": 1, **levels}.items():
        world.mic488["c"].write(name, level)
    world.run(until=5.2)
    world.mic488["c"].write("OUT2", 1)
    world.run(until=until)
    return world


def told(world: World, name: str = "main.1") -> list[tuple[float, str]]:
    """What happened to a workpiece since it was fed, with its time in s."""
    records = [one for one in world.trace.of("event") if one.subject == "workpiece" and name in str(one.value)]
    return [(record.time / SECOND, str(record.value)) for record in records[1:]]


def seconds(*found: float) -> object:
    return pytest.approx(list(found), abs=2e-8)


def test_it_pushes_a_workpiece_onto_another_belt_and_on_there() -> None:
    """60 mm to its side, 50 mm until its middle is at the edge; the blade comes to 45 mm. The other belt goes at 80 mm/s."""
    world = pushing(BELT + ROD + BLADE + SIDE, 6.0)
    times, texts = zip(*told(world), strict=True)
    assert texts == ("blade pushes main.1 on main", "main.1 is on side", "blade pushes main.1 on side")
    assert list(times) == seconds(5.35, 5.475, 5.475)
    at_side = 300.0 + 27.5
    assert place(world, "main.1") == pytest.approx((at_side + 80.0 * (6.0 - 5.475), 60.0, 100.0), abs=5e-6)
    assert world.read("blade.pushed") == 2


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("along", "unit"), [("+x", (1, 0)), ("-x", (-1, 0)), ("+y", (0, 1)), ("-y", (0, -1))])
def test_its_face_sets_how_far_across_a_workpiece_is(along: str, unit: tuple[int, int], side: int) -> None:
    """The belt goes on, and the blade covers 60 mm of it: 0.35 s of that with half of the workpiece."""
    (x, y), way = unit, "y" if unit[0] else "x"
    left = side * (unit[0] or -unit[1])
    at = [300 * x - 80 * left * abs(y), 300 * y - 80 * left * abs(x), 110]
    rod = ROD.replace("[300, -80, 110]", str(at)).replace("+y", f"{'+' if left > 0 else '-'}{way}")
    rod = rod.replace("stroke = 120", 'stroke = 70\nextend_time = "175 ms"')
    size = "[60, 10, 30]" if x else "[10, 60, 30]"
    belt = BELT.replace('run = "c.OUT1"', f'run = "c.OUT1"\nalong = "{along}"')
    world = pushing(belt + rod + BLADE.replace("[60, 10, 30]", size), 5.36)
    across = 0.0
    for _ in range(20):
        travel = world.read("main.place1") - 20.0
        across = max(min(400.0 * (world.now / SECOND - 5.2), 70.0) - 80.0 + 5.0 + 15.0, 0.0) * left
        assert place(world, "main.1") == pytest.approx(
            [travel * x + across * abs(y), travel * y + across * abs(x), 100.0], abs=5e-6
        )
        world.run(for_=0.01)
    assert across == 10.0 * left


def test_what_is_pushed_off_a_belt_falls() -> None:
    world = pushing(BELT + ROD + BLADE, 6.0)
    times, texts = zip(*told(world), strict=True)
    assert texts == ("blade pushes main.1 on main", "main.1 falls 100 mm", "main.1 lies on the floor")
    assert list(times) == seconds(5.35, 5.475, 5.475 + sqrt(2.0 * 0.1 / 9.80665))
    assert world.read("main.delivered") == 0


def test_a_workpiece_stays_where_it_was_pushed_when_the_blade_goes_back() -> None:
    """An axis with ramps comes to 80 mm, so that the workpiece is 20 mm from the middle, and pushes the next one by 5 mm."""
    world = pushing(BELT + AXIS + BLADE, M1_EN=1, M1_POS_ABS=0)
    for target in (80.0, 0.0):
        world.mic488["c"].write("M1_POS_ABS", target)
        world.run(for_=0.5)
    world.run(until=7.2)
    world.mic488["c"].write("M1_POS_ABS", 65.0)
    world.run(for_=0.6)
    assert place(world, "main.1") == pytest.approx((560.0, 20.0, 100.0), abs=5e-6)
    assert place(world, "main.2")[1] == pytest.approx(5.0, abs=5e-6)
    assert world.read("blade.pushed") == 2


def test_a_workpiece_that_comes_stands_before_a_blade_until_that_is_gone() -> None:
    """It has its front at 270 mm. The blade, 50 mm to each side of the rod, is beside it after 105 mm of the way back."""
    world = World.from_toml(BELT + ROD + BLADE.replace("[60, 10, 30]", "[60, 100, 30]"))
    world.mic488["c"].write("OUT1", 1)
    world.mic488["c"].write("OUT2", 1)
    world.run(until=6.0)
    world.mic488["c"].write("OUT2", 0)
    world.run(until=7.0)
    times, texts = zip(*told(world), strict=True)
    assert texts == ("main.1 stands at 270 mm of main", "main.1 goes on along main")
    assert list(times) == seconds(4.7, 6.0 + 105.0 / 400.0)
    assert world.read("blade.pushed") == 0


def test_it_jams_where_a_workpiece_comes_against_another_one_and_is_free_when_it_goes_back() -> None:
    world = pushing(BELT + ROD + BLADE + TRAY, 5.5)
    assert world.read("blade.jammed") == 1
    at = 40.0 + 60.0
    assert world.read("rod.position") == pytest.approx(at, abs=1e-5)
    assert place(world, "main.1") == pytest.approx((330.0, 40.0, 100.0), abs=5e-6)
    world.mic488["c"].write("OUT2", 0)
    world.run(until=5.6)
    assert world.read("blade.jammed") == 0
    assert world.read("rod.position") == pytest.approx(at - 40.0, abs=1e-5)
    assert [text for _, text in told(world)] == [
        "blade pushes main.1 on main",
        "blade stands: main.1 is pushed against tray.1",
    ]


def test_it_goes_on_when_nothing_is_in_the_way_any_more() -> None:
    """The belt carries the workpiece past the other one, 25 mm behind the middle of that and its own 20 mm."""
    world = pushing(BELT + ROD + BLADE.replace("[60", "[200") + TRAY, 6.0)
    (free,) = (one.time for one in world.trace.of("event") if str(one.value) == "blade is free again")
    assert free / SECOND == pytest.approx(5.2 + (330.0 + 25.0 + 20.0 - 300.0) / 100.0, abs=1e-8)
    assert world.read("rod.position") == 120.0


def test_an_axis_that_is_jammed_is_free_when_it_is_moved_back() -> None:
    world = pushing(BELT + AXIS + BLADE + TRAY, M1_EN=1)
    world.mic488["c"].write("M1_POS_ABS", 120.0)
    world.run(for_=0.4)
    assert world.read("blade.jammed") == 1
    assert world.read("rod.position") == pytest.approx(100.0, abs=0.01)
    world.mic488["c"].write("M1_POS_ABS", 90.0)
    world.run(for_=0.4)
    assert world.read("blade.jammed") == 0
    assert world.read("rod.position") < 90.0


def test_workpieces_pass_each_other_where_none_is_before_the_other() -> None:
    """The first one stands at a stop and is pushed 35 mm aside, by 95 mm of the rod. The second one stands behind it, then before
    the blade, and goes on when that is 60 mm out: to the stop, beside the first one."""
    stop = '[[conveyor.stop]]\nat = 330\nhold = "c.OUT3"\n'
    rod = ROD.replace("stroke = 120", 'stroke = 95\nretract_time = "500 ms"').replace("300, -80", "310, -80")
    world = World.from_toml(BELT + stop + rod + BLADE.replace("[60", "[40"))
    for output in ("OUT1", "OUT3"):
        world.mic488["c"].write(output, 1)
    world.run(until=7.0)
    assert [world.read(f"main.place{n}") for n in (1, 2)] == pytest.approx([330.0, 290.0], abs=1e-5)
    for level in (1, 0):
        world.mic488["c"].write("OUT2", level)
        world.run(for_=1.0)
    assert [world.read(f"main.place{n}") for n in (1, 2)] == pytest.approx([330.0, 330.0], abs=1e-5)
    assert place(world, "main.1")[1] == pytest.approx(35.0, abs=1e-5)
    goes_on = next(time for time, text in told(world, "main.2") if time > 8.0 and "goes on" in text)
    assert goes_on == pytest.approx(8.0 + (95.0 - 60.0) / 190.0, abs=1e-7)


def test_what_it_cannot_push_is_an_event() -> None:
    text = BELT + ROD + BLADE + TRAY.replace("75", "40").replace("330", "300")
    world = pushing(text.replace('feed_every = "2 s"\n', ""), 6.0)
    assert [str(one.value) for one in world.trace.of("event")] == ["blade and tray.1 collide"]


def test_what_it_comes_into_from_above_is_not_thrown_aside() -> None:
    down = '[[cylinder]]\nname = "rod"\nextend = "c.OUT2"\nstroke = 90\nat = [300, 3, 200]\nalong = "-z"\n'
    world = pushing(BELT + down + BLADE, 5.9)
    assert [text for _, text in told(world)] == ["blade and main.1 collide"]
    assert place(world, "main.1")[1] == 0.0
    assert world.read("blade.pushed") == 0


def test_a_face_that_overtakes_the_one_that_pushes_takes_over() -> None:
    """The first one stands at 80 mm, where the second one comes 0.3 s * 80 / 120 after 6 s. A tine moves with the first one."""
    first = BLADE.replace("[60, 10, 30]", "[10, 10, 30]\nat = [-15, 0, 0]")
    with_it = first.replace("blade", "tine").replace("-15", "15")
    second = ROD.replace('"rod"', '"rod2"').replace("OUT2", "OUT3") + BLADE.replace("rod", "rod2").replace("blade", "second")
    rod = ROD.replace("stroke = 120", "stroke = 80")
    belt = BELT.replace("length = 600", "length = 600\nwidth = 300").replace('feed_every = "2 s"\n', "")
    world = World.from_toml(belt + rod + first + with_it + second.replace("[60", "[10"))
    world.put("main", front=320.0)
    for output, until in (("OUT2", 6.0), ("OUT3", 8.0)):
        world.mic488["c"].write(output, 1)
        world.run(until=until)
    times, texts = zip(*told(world), strict=True)
    assert texts == ("blade pushes main.1 on main", "second pushes main.1 on main")
    assert list(times) == seconds(0.3 * 60.0 / 80.0, 6.0 + 0.3 * 80.0 / 120.0)
    assert place(world, "main.1")[1] == pytest.approx(60.0, abs=5e-6)


def test_nothing_is_put_where_it_is() -> None:
    world = World.from_toml(BELT + ROD.replace("stroke = 120", "stroke = 80") + BLADE)
    world.mic488["c"].write("OUT2", 1)
    world.run(until=1.0)
    with pytest.raises(Refusal, match="main has no room there"):
        world.put("main", front=320.0)
    world.put("main", front=200.0)


@pytest.mark.parametrize(
    ("stroke", "moves", "fed", "begins"),
    [
        (120, {5.0: 1, 6.0: 1}, "main.2", 5.0 + 100.0 / 400.0),  # pushed so that its strip begins at 15 mm
        (80, {0.0: 1, 6.0: 0}, "main.1", 6.0 + 20.0 / 80.0 * 0.3),  # the blade has been in the way
    ],
)
def test_a_feeder_that_waits_feeds_as_soon_as_there_is_room(
    stroke: int, moves: dict[float, int], fed: str, begins: float
) -> None:
    belt = BELT.replace("length = 600", "length = 600\nwidth = 400").replace('"2 s"', '"2 s"\nfeed_waits = true')
    world = World.from_toml(belt + ROD.replace("[300", "[-20").replace("stroke = 120", f"stroke = {stroke}") + BLADE)
    for moment, level in moves.items():
        world.run(until=moment)
        world.mic488["c"].write("OUT2", level)
    world.run(until=6.5)
    times = [one.time / SECOND for one in world.trace.of("event") if str(one.value) == f"{fed} is on main"]
    assert times == seconds(begins)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (BELT + ROD + BLADE.replace('on = "rod"', ""), "pushes means nothing without on"),
        (BELT + ROD + BLADE + 'when = "c.OUT4"', "exclude each other"),
        (BELT.split("[[conveyor]]", maxsplit=1)[0] + ROD + BLADE, "'blade' pushes, but no [[conveyor]] has a place in space"),
        (
            BELT + ROD + 'on = "t"\n[[axis]]\nname = "t"\ndrive = "c.M2"\nkind = "rotary"\nat = [0, 0, 0]\n' + BLADE,
            "'blade' pushes, but 't' turns it against 'main': what pushes moves straight",
        ),
        (
            BELT + '[[integrator]]\nname = "rod"\nrate = "c.OUT2"\nalong = "+y"\n' + BLADE,
            "'blade' pushes, but rod moves it, and cannot stand where a workpiece is in the way",
        ),
    ],
)
def test_what_does_not_fit_is_refused(text: str, problem: str) -> None:
    with pytest.raises(WorldError) as error:
        World.from_toml(text)
    assert problem in str(error.value)


@pytest.mark.parametrize("moment", [5.0, 5.4, 5.5, 6.0])
def test_it_can_be_restored_at_any_moment(moment: float, tmp_path: Path) -> None:
    script = """
    [[script]]
    name = "s"
    steps = [{ write = { "c.OUT1" = 1 } }, { wait = "5.2 s" }, { write = { "c.OUT2" = 1 } }, { wait = "1.1 s" },
      { write = { "c.OUT2" = 0 } }]
    """
    text = BELT + ROD + BLADE.replace("[60", "[200") + TRAY + script
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment, 7.5, tmp_path)


def test_two_that_push_a_workpiece_against_each_other_stand_until_one_goes_back() -> None:
    """Their faces are 80 - 5 mm beside the middle: that of the blade is at -15 mm after 150 ms, where it begins to push; that of
    the other one, which comes 25 ms later, meets the workpiece at its other side."""
    other = ROD.replace("rod", "arm").replace("OUT2", "OUT3").replace("-80", "80").replace("+y", "-y")
    far = BLADE.replace("blade", "palm").replace("rod", "arm")
    world = pushing(BELT + ROD + BLADE + other + far, 5.225)
    world.mic488["c"].write("OUT3", 1)
    world.run(until=5.6)
    meets = 5.35 + (5.2 + 0.15 + 0.025 - 5.35) / 2
    times, texts = zip(*told(world), strict=True)
    assert texts == (
        "blade pushes main.1 on main",
        "blade stands: main.1 is pushed against palm",
        "palm stands: main.1 is pushed against blade",
    )
    assert times[0] == pytest.approx(5.35, abs=2e-8)
    assert times[1:] == pytest.approx((meets, meets), abs=1e-6)
    stands = world.read("rod.position"), world.read("arm.position")
    assert (world.read("blade.jammed"), world.read("palm.jammed")) == (1, 1)
    assert sum(stands) == pytest.approx(160 - 10 - 30, abs=0.002)
    world.mic488["c"].write("OUT3", 0)
    world.run(for_=0.01)
    assert (world.read("blade.jammed"), world.read("palm.jammed")) == (0, 0)
    assert world.read("rod.position") > stands[0]
    assert world.read("arm.position") < stands[1]
