"""Workpieces in space: cups and jaws take them from nests, bodies and each other, and put them down; what falls, lies crooked."""

from __future__ import annotations

from pathlib import Path

import pytest
from space_rig import controller, place, told
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError
from steptwin.subject.describe import workpiece_states

MACHINE = (
    controller("c", 160.0, 4000.0, 400.0)
    + """[mic488.M2]
unit = "degree"
gear = 100.0
[[axis]]
name = "x"
drive = "c.M1"
pitch = 20.0
at = [0, 0, 200]
[[cylinder]]
name = "lift"
extend = "c.OUT1"
stroke = 60.0
extend_time = "100 ms"
retract_time = "100 ms"
on = "x"
along = "-z"
[[nest]]
name = "tray"
at = [0, 0, 100]
cells = [3, 2]
pitch = [60, 50]
workpiece = [40, 30, 20]
mass = 0.25
filled = 7
[[body]]
name = "table"
at = [400, 0, 80]
size = [120, 120, 20]
[[axis]]
name = "plate"
drive = "c.M2"
kind = "rotary"
pulses_per_unit = 100.0
at = [600, 0, 90]
[[body]]
name = "disc"
on = "plate"
diameter = 300.0
height = 10.0
"""
)
CUP = """
[[vacuum]]
name = "cup"
ejector = "c.OUT2"
on = "lift"
at = [0, 0, -19]
diameter = 18.0
build_up = "50 ms"
release = "20 ms"
"""
JAWS = """
[[gripper]]
name = "jaws"
close = "c.OUT2"
on = "lift"
at = [0, 0, -30]
along = "+y"
stroke = 50.0
close_time = "100 ms"
open_time = "100 ms"
overlap = 8.0
"""


FAN = """
[[axis]]
name = "fan"
drive = "c.M3"
kind = "rotary"
pulses_per_unit = 40.0
at = [400, 10, 300]
along = "+y"
[[body]]
name = "blade"
on = "fan"
size = [10, 100, 10]
"""


class Rig:
    def __init__(self, text: str) -> None:
        self.world = World.from_toml(text)
        self._cell = self.world.mic488["c"]
        self._cell.write("M1_EN", 1)

    def go(self, x: float) -> None:
        self._cell.write("M1_POS_ABS", x)
        self.world.run(for_=3.0)

    def lower(self, *, hold: bool) -> None:
        """Lower it, take or let go, and lift it again."""
        self._cell.write("OUT1", 1)
        self.world.run(for_=0.3)
        self._cell.write("OUT2", int(hold))
        self.world.run(for_=0.3)
        self._cell.write("OUT1", 0)
        self.world.run(for_=0.3)

    def take(self, x: float) -> None:
        self.go(x)
        self.lower(hold=True)

    def put(self, x: float) -> None:
        self.go(x)
        self.lower(hold=False)

    def told(self) -> list[str]:
        return told(self.world)

    def place(self, name: str) -> tuple[float, ...]:
        return place(self.world, name)


def test_a_nest_is_filled_cell_by_cell_and_layer_by_layer() -> None:
    rig = Rig(MACHINE + CUP)
    assert rig.world.read("tray.count") == 7
    assert [rig.place(f"tray.{n}") for n in (1, 3, 4, 6, 7)] == [
        (0, 0, 100),
        (120, 0, 100),
        (0, 50, 100),
        (120, 50, 100),
        (0, 0, 120),
    ]


def test_a_nest_of_thousands_is_counted_in_one_pass() -> None:
    """In 30 layers; without that this takes a minute."""
    rig = Rig(MACHINE.replace("[3, 2]", "[20, 10]").replace("filled = 7", "filled = 6000"))
    assert rig.world.read("tray.count") == 6000
    assert rig.place("tray.6000") == (19 * 60, 9 * 50, 100 + 29 * 20)


def test_a_nest_needs_nothing_that_takes_from_it(tmp_path: Path) -> None:
    text = '[[mic488]]\nname = "c"\n[[nest]]\nname = "tray"\nat = [0, 0, 100]\nworkpiece = 20\nfilled = 3\n'
    world = World.from_toml(text)
    check_it_can_be_restored(world, World.from_toml(text), 1.0, 2.0, tmp_path)
    assert world.read("tray.count") == 3
    assert [state.on for state in workpiece_states(world)] == ["tray"] * 3


def test_a_cup_takes_the_highest_one_below_it_and_puts_it_down_as_it_took_it() -> None:
    """The upper one of two is 19 mm higher than the cup reaches down to: 1 mm below its tip is the top of the lower one."""
    rig = Rig(MACHINE.replace("filled = 7", "filled = 6") + CUP)
    rig.take(63.0)
    assert rig.told() == ["cup holds tray.2"]
    assert (rig.world.read("cup.held"), rig.world.read("cup.mass"), rig.world.read("tray.count")) == (1, 0.25, 5)
    assert rig.place("tray.2") == (60, 0, 200 - 19 - 20)
    rig.put(403.0)
    assert rig.told()[1:] == ["cup lets go of tray.2", "tray.2 lies on table"]
    assert rig.place("tray.2") == (400, 0, 100)


def test_a_cup_that_is_not_closed_all_around_holds_nothing() -> None:
    """A cup of 18 mm on a workpiece of 40 mm: 11 mm beside its middle."""
    rig = Rig(MACHINE.replace("filled = 7", "filled = 6") + CUP)
    rig.take(60.0 + 10.99)
    assert rig.told() == ["cup holds tray.2"]
    rig.put(60.0 + 10.99)
    rig.take(60.0 + 11.01)
    assert len(rig.told()) == 3
    assert rig.world.read("cup.held") == 0


def test_a_workpiece_that_is_put_near_a_cell_is_aligned() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1").replace("snap", "#") + CUP)
    rig.take(3.0)
    rig.put(67.5)
    assert rig.told()[2:] == ["tray.1 lies on tray"]
    assert rig.place("tray.1") == (60, 0, 100)
    rig.take(60.0)
    rig.put(67.0)
    assert rig.told()[-1] == "tray.1 lies crooked on tray"
    assert rig.world.read("tray.crooked") == 1.0
    assert rig.place("tray.1") == (67, 0, 100)


def test_what_is_put_on_another_one_goes_with_it() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 2").replace("at = [400, 0, 80]", "at = [400, 0, 60]") + CUP)
    rig.take(0.0)
    rig.put(400.0)  # 20 mm lower: it falls
    assert rig.told()[1:] == ["cup lets go of tray.1", "tray.1 falls 21 mm", "tray.1 lies on table"]
    rig.take(60.0)
    rig.put(402.0)
    assert rig.told()[-1] == "tray.2 lies on tray.1"
    assert rig.place("tray.2") == (402, 0, 100)
    body = rig.world.objects.workpieces
    assert body.bodies()["tray.2"].frame.on is body.bodies()["tray.1"].frame


def test_what_is_let_go_in_the_air_falls_for_as_long_as_it_does() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP)
    rig.take(0.0)
    rig.go(200.0)
    rig.world.mic488["c"].write("OUT2", 0)
    rig.world.run(for_=2.0)
    falls, lies = [record for record in rig.world.trace.of("event") if record.subject == "workpiece"][-2:]
    assert (falls.value, lies.value) == ("tray.1 falls 161 mm", "tray.1 lies on the floor")
    assert (lies.time - falls.time) / SECOND == pytest.approx((2 * 0.161 / 9.80665) ** 0.5, abs=1e-9)
    assert rig.place("tray.1") == (200, 0, 0)
    assert rig.world.read("cup.dropped") == 1


BEAM = """
[[beam]]
name = "low"
at = [200, -50, 61]
along = "+y"
length = 100.0
[[body]]
name = "hand"
at = [200, 0, 5]
size = [10, 10, 10]
[[collision]]
name = "bump"
between = ["workpieces", "hand"]
"""


def fallen(way: float) -> float:
    """Seconds of a fall, mm."""
    return (2 * way / 9806.65) ** 0.5


def test_what_falls_is_seen_on_its_way_and_nothing_takes_it() -> None:
    """From 161 mm; it is 20 mm high. The beam at 61 mm sees it after 100 mm, until after 120 mm; it comes to a hand of 15 mm. The
    cup leaks just above it, and jaws close on it while its top passes them."""
    catch = JAWS.replace("jaws", "catch").replace('on = "lift"\nat = [0, 0, -30]', "at = [200, 0, 60]").replace("OUT2", "OUT4")
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP + catch + BEAM)
    world = rig.world
    rig.take(0.0)
    rig.go(200.0)
    world.fault("leak element=cup name=hole")
    world.run(for_=0.06)
    begin = next(one.time for one in world.trace.of("event") if str(one.value).endswith("falls 146 mm"))
    world.run(until=begin / SECOND + fallen(107.0) - 0.04)  # the jaws are as wide as it is then
    world.mic488["c"].write("OUT4", 1)
    world.run(for_=0.2)
    edges = [(one.time - begin) / SECOND for one in world.trace.edges() if one.subject == "low.seen"][1:]
    assert edges == pytest.approx([fallen(100.0), fallen(120.0)], abs=2e-9)
    assert rig.told()[1:] == ["cup lets go of tray.1", "tray.1 falls 146 mm", "tray.1 lies on hand"]
    assert (world.read("cup.held"), world.read("catch.held")) == (0, 0)


def test_what_falls_can_be_drawn_and_restored() -> None:
    text = MACHINE.replace("filled = 7", "filled = 1") + CUP + BEAM.replace("at = [200, 0, 5]", "at = [220, 0, 5]")
    rig, other = Rig(text), World.from_toml(text)
    rig.take(0.0)
    rig.go(200.0)
    rig.world.mic488["c"].write("OUT2", 0)
    rig.world.run(for_=0.1)
    (state,) = workpiece_states(rig.world)
    assert (state.on, state.moves, state.at[:2]) == (None, (), (200.0, 0.0))
    assert 0.0 < state.at[2] < 161.0
    snapshot = rig.world.snapshot()
    rig.world.run(for_=1.0)
    assert [str(one.value) for one in rig.world.trace.of("event") if one.subject == "collision"] == [
        "bump: hand and tray.1 touch"
    ]
    for world in (rig.world, other):
        digest = rig.world.trace.digest()
        world.restore(snapshot)
        world.run(for_=1.0)
        assert world.trace.digest() == digest


def test_what_lies_on_a_workpiece_falls_with_it() -> None:
    """Two on each other; jaws take the lower one, and let go of both 60 mm above the nest."""
    text = MACHINE.replace("cells = [3, 2]", "").replace("filled = 7", "filled = 2")
    rig = Rig(text + JAWS)
    rig.lower(hold=True)
    assert rig.world.read("jaws.mass") == 0.5
    rig.world.mic488["c"].write("OUT2", 0)
    rig.world.run(for_=0.05)
    (_, _, low), (_, _, high) = (rig.place(f"tray.{n}") for n in (1, 2))
    assert 100 < low < 160
    assert high - low == 20
    rig.world.run(for_=0.5)
    assert rig.told()[1:] == ["jaws lets go of tray.1", "tray.1 falls 60 mm", "tray.1 lies on tray"]
    assert (rig.place("tray.1")[2], rig.place("tray.2")[2], rig.world.read("tray.count")) == (100, 120, 2)


def test_what_falls_goes_on_where_what_it_falls_on_has_gone() -> None:
    """A drawer 100 mm below it is drawn away while it falls."""
    drawer = """
    [[cylinder]]
    name = "pull"
    extend = "c.OUT3"
    stroke = 200.0
    extend_time = "100 ms"
    at = [200, 0, 0]
    [[body]]
    name = "drawer"
    on = "pull"
    at = [0, 0, 51]
    size = [50, 50, 10]
    """
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP + drawer)
    rig.take(0.0)
    rig.go(200.0)
    rig.world.mic488["c"].write("OUT2", 0)
    rig.world.run(for_=0.05)
    rig.world.mic488["c"].write("OUT3", 1)
    rig.world.run(for_=1.0)
    _, falls, lies = (
        one for one in rig.world.trace.of("event") if one.subject == "workpiece" and one.value != "cup holds tray.1"
    )
    assert (falls.value, lies.value) == ("tray.1 falls 100 mm", "tray.1 lies on the floor")
    assert (lies.time - falls.time) / SECOND == pytest.approx(fallen(161.0), abs=1e-9)
    assert rig.place("tray.1") == (200, 0, 0)


def belt(name: str, x: float, z: float, more: str) -> str:
    """It carries a workpiece of 40 mm by 20 mm 200 mm along x, from 0 s on at 500 mm/s."""
    return f"""
    [[conveyor]]
    name = "{name}"
    length = 200
    speed = 500
    at = [{x}, 0, {z}]
    workpiece = [40, 40, 20]
    {more}
    """


FALLING = (
    '[[mic488]]\nname = "c"\n'
    + belt("far", 2000, 0, 'run = "c.OUT8"\n')
    + belt("away", 3000, 0, 'run = "c.OUT8"\n')
    + belt("high", 0, 300, 'run = "c.OUT1"\nnext = "away"')
)


LOW = 'run = "c.OUT1"\nnext = "far"'


@pytest.mark.parametrize(
    ("other", "front", "height", "told"),
    [
        (belt("low", 0, 200, LOW), 0.0, 280.0, ["high.1 lies on low.1"]),  # which falls before it
        (belt("low", -30, 200, LOW), 0.0, 300.0, ["high.1 and low.1 collide", "high.1 lies on the floor"]),
        (belt("low", 60, 100, 'run = "c.OUT2"'), 44.0, 180.0, ["high.1 lies on low.1"]),  # which comes below it meanwhile
    ],
)
def test_what_falls_onto_a_workpiece_lies_on_it_or_the_event_says_that_they_collide(
    other: str, front: float, height: float, told: list[str]
) -> None:
    rig = Rig(FALLING + other)
    rig.world.put("high")
    rig.world.put("low", front=front)
    rig.world.mic488["c"].write("OUT1", 1)
    rig.world.run(for_=0.4)
    rig.world.mic488["c"].write("OUT2", 1)
    rig.world.run(for_=1.0)
    events = [one for one in rig.world.trace.of("event") if one.subject == "workpiece" and "high.1" in str(one.value)]
    assert [str(one.value) for one in events][3 : 3 + len(told)] == told
    begin, end = (next(one.time for one in events if what in str(one.value)) for what in ("falls", "high.1 lies"))
    assert (end - begin) / SECOND == pytest.approx(fallen(height), abs=2e-9)


def test_what_lies_on_a_workpiece_weighs_in_the_mass_of_what_carries_that() -> None:
    line = belt("line", 360, 80, 'run = "c.OUT8"\nmass = 0.5')
    noticed = '[[event]]\nwhen = "line.mass > 0.6"\nsteps = [{ note = "heavy" }]\n'
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP + line + noticed)
    rig.world.put("line", front=60.0)
    rig.take(0.0)
    rig.put(400.0)
    assert rig.told()[-1] == "tray.1 lies on line.1"
    assert rig.world.read("line.mass") == 0.75
    assert "heavy" in [str(one.value) for one in rig.world.trace.of("event")]


def test_in_a_pit_it_lies_where_it_is_let_go() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1").replace("0, 200]", "0, -200]").replace("0, 100]", "0, -300]") + CUP)
    rig.take(0.0)
    rig.put(200.0)
    assert rig.told()[1:] == ["cup lets go of tray.1", "tray.1 lies on the floor"]
    assert rig.place("tray.1") == (200, 0, -299)


@pytest.mark.parametrize(("height", "lies"), [(1.9, True), (2.1, False)])
def test_a_workpiece_may_be_pressed_a_little_into_what_it_is_put_on(height: float, lies: bool) -> None:
    """The cup puts it down 1 mm above the table."""
    text = MACHINE.replace("filled = 7", "filled = 1").replace("at = [400, 0, 80]", f"at = [400, 0, {81 + height}]")
    rig = Rig(text + CUP)
    rig.take(0.0)
    rig.put(400.0)
    assert rig.told()[-1] == ("tray.1 lies on table" if lies else "tray.1 lies on the floor")


def test_what_turns_about_another_axis_carries_no_workpiece() -> None:
    """It stands in the way of none, and asking for what is below one is no error."""
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP + FAN)
    rig.take(0.0)
    rig.put(400.0)
    assert rig.told()[-1] == "tray.1 lies on table"


def test_a_workpiece_on_a_turntable_turns_with_it() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP)
    rig.take(0.0)
    rig.put(700.0)
    assert rig.place("tray.1") == (700, 0, 100)
    rig.world.mic488["c"].write("M2_EN", 1)
    rig.world.mic488["c"].write("M2_POS_ABS", 90.0)
    rig.world.run(for_=20.0)
    assert rig.world.axis["plate"].position == 90.0
    assert rig.place("tray.1") == (600, 100, 100)


def test_jaws_take_what_is_between_them_and_centre_it() -> None:
    """Workpieces are 30 mm wide along y, 40 mm along x; the jaws are open by 50 mm, and 20 mm of 50 in 40 ms of 100."""
    text = MACHINE.replace("filled = 7", "filled = 1").replace("at = [0, 0, 100]", "at = [0, 2, 100]") + JAWS
    rig = Rig(text)
    rig.go(5.0)
    rig.lower(hold=True)
    assert rig.told() == ["jaws holds tray.1"]
    assert rig.world.read("jaws.position") == pytest.approx(20.0)
    assert rig.place("tray.1") == (0, 0, 160)
    rig.put(400.0)
    assert rig.place("tray.1") == (395, 0, 100)


@pytest.mark.parametrize(
    ("tool", "told"),
    [
        (CUP + "reach = 1.0\n", ["cup holds tray.1"]),
        (CUP + "reach = 0.999\n", []),
        (JAWS.replace("overlap = 8.0", "overlap = 10.0"), ["jaws holds tray.1"]),
        (JAWS.replace("overlap = 8.0", "overlap = 10.001"), []),
    ],
)
def test_what_is_just_within_reach_is_taken(tool: str, told: list[str]) -> None:
    """The top of the workpiece is at 120 mm; the cup is lowered to 121, the tips of the jaws to 110."""
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + tool)
    rig.take(0.0)
    assert rig.told() == told


def test_a_nest_on_a_plate_is_before_the_plate() -> None:
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + '[[nest]]\nname = "zone"\non = "table"\nat = [0, 0, 20]\n' + CUP)
    rig.take(0.0)
    rig.put(400.0)
    assert rig.told()[-1] == "tray.1 lies on zone"


def test_a_workpiece_that_is_carried_against_something_is_a_collision() -> None:
    """The cup is at 400 mm; what it holds is 40 mm long and comes to a wall, 10 mm long, at 300 mm."""
    wall = """
    [[body]]
    name = "wall"
    at = [300, 0, 0]
    size = [10, 100, 170]
    [[collision]]
    name = "bump"
    between = ["workpieces", "wall"]
    """
    rig = Rig(MACHINE.replace("filled = 7", "filled = 1") + CUP + wall)
    rig.take(0.0)
    rig.go(400.0)
    (first, *_) = (record for record in rig.world.trace.of("event") if record.subject == "collision")
    assert first.value == "bump: tray.1 and wall touch"
    assert rig.world.read("bump.count") == 1
    assert rig.world.read("bump.hit") == 0


def test_what_is_carried_against_a_workpiece_is_a_collision() -> None:
    """It is carried 1 mm above the nest through the next one: their middles are 60 mm apart, they are 40 mm long."""
    bump = '[[collision]]\nname = "bump"\nbetween = ["cup", "workpieces", "table"]\neffect = "jam"\n'
    rig = Rig(MACHINE.replace("filled = 7", "filled = 2") + CUP + bump)
    cell = rig.world.mic488["c"]
    rig.take(0.0)
    assert rig.world.read("bump.count") == 0  # what touches with its sides does not overlap
    cell.write("OUT1", 1)
    rig.world.run(for_=0.5)
    cell.write("M1_POS_ABS", 60.0)
    rig.world.run(for_=3.0)
    (touch,) = (record for record in rig.world.trace.of("event") if record.subject == "collision")
    assert touch.value == "bump: tray.1 and tray.2 touch"
    assert rig.world.axis["x"].position == pytest.approx(20.0, abs=0.01)


def test_a_workpiece_that_is_put_partly_into_another_one_is_said_to_collide() -> None:
    """Cells are 60 mm apart, workpieces 40 mm long: at 30 mm from the next one it is crooked, and overlaps it by 10 mm."""
    rig = Rig(MACHINE.replace("filled = 7", "filled = 2") + CUP)
    rig.take(0.0)
    rig.put(30.0)
    assert rig.told()[-2:] == ["tray.1 lies crooked on tray", "tray.1 collides with tray.2 on tray"]


def test_jaws_without_anything_between_them_close() -> None:
    rig = Rig(MACHINE + JAWS)
    rig.take(250.0)
    assert rig.told() == []
    assert (rig.world.read("jaws.closed"), rig.world.read("jaws.held")) == (1, 0)


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        (CUP + 'pick = "c.OUT3"\n', "pick and on exclude each other"),
        (CUP.replace("diameter", "diametre"), "diametre"),
        (
            CUP.replace('on = "lift"', 'on = "fan"') + FAN,
            "'cup' turns about y: what has to do with workpieces only turns about z",
        ),
        ('[[nest]]\nname = "n"\non = "fan"\n' + FAN, "'n' turns about y"),
        (FAN + '[[beam]]\nname = "b"\non = "fan"\nlength = 9\n', "'b' turns about y"),
        ('[[nest]]\nname = "n"\nfilled = 2', "filled means nothing without workpiece"),
        ('[[nest]]\nname = "n"\ncells = [0, 1]', "permitted are whole numbers from 1 to 1000"),
        ('[[nest]]\nname = "n"\npitch = [1e-7, 50]', "permitted are numbers from 0.001 to 100000"),
        ('[[nest]]\nname = "n"\nworkpiece = [1, 2, 3, 4]', "expected [length, width, height] or [diameter, height]"),
    ],
)
def test_what_does_not_fit_is_refused(more: str, problem: str) -> None:
    with pytest.raises(WorldError) as error:
        World.from_toml(MACHINE + more)
    assert problem in str(error.value)


@pytest.mark.parametrize("tool", [CUP, JAWS])
def test_it_can_be_restored_while_it_carries_a_workpiece(tool: str, tmp_path: Path) -> None:
    text = (
        MACHINE.replace("filled = 7", "filled = 6")
        + tool
        + '[[beam]]\nname = "b"\nat = [300, -50, 165]\nalong = "+y"\nlength = 100\n'
    )
    script = """
    [[script]]
    name = "s"
    steps = [
      { write = { "c.M1_EN" = 1, "c.OUT1" = 1 } }, { wait = "200 ms" }, { write = { "c.OUT2" = 1 } }, { wait = "300 ms" },
      { write = { "c.OUT1" = 0 } }, { wait = "200 ms" }, { write = { "c.M1_POS_ABS" = 400.0 } }, { wait = "3 s" },
      { write = { "c.OUT2" = 0 } },
    ]
    """
    world = World.from_toml(text + script)
    check_it_can_be_restored(world, World.from_toml(text + script), 1.0, 6.0, tmp_path)
    assert [record.subject for record in world.trace.edges() if record.subject == "b.seen"] == ["b.seen"] * 3


def test_it_can_be_restored_in_place_while_a_stack_is_carried() -> None:
    """What lies on a workpiece that is carried belongs to it after that, too: it does not collide with it."""
    tools = JAWS + '[[collision]]\nname = "bump"\nbetween = ["jaws", "workpieces"]\n'
    text = MACHINE.replace("cells = [3, 2]", "").replace("filled = 7", "filled = 2") + tools
    writes = [(0.1, "OUT1", 1), (0.3, "OUT2", 1), (0.6, "OUT1", 0), (0.9, "M1_POS_ABS", 100.0), (2.0, "OUT2", 0)]

    def go(world: World, begin: float, end: float) -> None:
        for moment, name, value in writes:
            if begin <= moment < end:
                world.run(until=moment)
                world.mic488["c"].write(name, value)
        world.run(until=end)

    def begun() -> World:
        world = World.from_toml(text)
        world.mic488["c"].write("M1_EN", 1)
        return world

    straight = begun()
    go(straight, 0.0, 3.0)
    assert straight.read("bump.count") == 0
    for moment in (0.2, 0.35, 0.65, 1.0, 1.5, 1.99, 2.05, 2.5):
        for ahead in (0.0, 0.01, 0.6):
            world = begun()
            go(world, 0.0, moment)
            snapshot = world.snapshot()
            go(world, moment, moment + ahead)
            world.restore(snapshot)
            go(world, moment, 3.0)
            assert world.trace.digest() == straight.trace.digest(), (moment, ahead)
