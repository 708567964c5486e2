"""Cups and jaws in space: which workpieces they take, and which of two has a workpiece that both hold."""

from __future__ import annotations

import pytest
from space_rig import place, told

from steptwin.controller import MILLISECOND
from steptwin.files.world import World

LIFT = """
[[mic488]]
name = "c"
[[cylinder]]
name = "lift"
extend = "c.OUT1"
stroke = 60
extend_time = "100 ms"
retract_time = "100 ms"
at = [0, 0, 200]
along = "-z"
"""
"""Its end is at 200 mm, lowered at 140 mm."""
JAWS = """
[[gripper]]
name = "jaws"
close = "c.OUT2"
on = "lift"
at = [0, 0, -35]
stroke = 60
"""
"""Lowered, their tips are at 105 mm."""


def nest(*size: float, more: str = "") -> str:
    """A workpiece whose top is at 120 mm."""
    return f'[[nest]]\nname = "n"\nat = [0, 0, {120 - size[-1]}]\nworkpiece = {[*size]}\nfilled = 1\n{more}'


def run(text: str, *steps: tuple[int, str], end: int = 2000) -> World:
    """``steps``: milliseconds, and what is done then: ``+OUT1`` switches an output on, ``bt`` presses a button."""
    world = World.from_toml(text)
    cell = world.mic488["c"]
    for at, what in sorted(step for step in steps if step[0] <= end):
        world.run(until=at / 1000)
        if what[0] in "+-":
            cell.write(what[1:], int(what[0] == "+"))
        else:
            world.press(what)
    world.run(until=end / 1000)
    return world


# ---------------------------------------------------------------------- cups


def cup(name: str, ejector: str, *at: float, diameter: float = 18, on: str = "lift", more: str = "") -> str:
    place = f'on = "{on}"\nat = {[*at]}\ndiameter = {diameter}\nbuild_up = "50 ms"\nrelease = "20 ms"\n'
    return f'[[vacuum]]\nname = "{name}"\nejector = "c.{ejector}"\n{place}{more}'


@pytest.mark.parametrize(
    ("height", "diameter", "is_held"),
    [(2, 18, True), (2.001, 18, False), (-2, 18, True), (-2.001, 18, False), (-15, 18, False), (0, 40, True), (0, 40.002, False)],
)
def test_a_cup_takes_what_closes_it_at_most_its_reach_below_or_pressed_in(height: float, diameter: float, is_held: bool) -> None:
    """The top is at 120 mm, and 40 mm long and wide. What is taken comes to the cup."""
    world = run(LIFT + cup("cup", "OUT2", 0, 0, height - 20, diameter=diameter) + nest(40, 40, 20), (0, "+OUT1"), (300, "+OUT2"))
    assert told(world) == (["cup holds n.1"] if is_held else [])
    assert world.read("cup.held") == is_held
    assert place(world, "n.1") == (0, 0, 100 + height * is_held)


@pytest.mark.parametrize(("size", "by", "events"), [(20, 15, []), (20, 1, ["cup holds n.2"]), (1, 2.5, [])])
def test_a_cup_in_a_stack_takes_none_from_the_middle(size: float, by: float, events: list[str]) -> None:
    """The lower of two is within reach, too."""
    tool = cup("cup", "OUT2", 0, 0, size - 20 - by, more="reach = 30\n")
    world = run(LIFT + tool + nest(40, 40, size).replace("filled = 1", "filled = 2"), (0, "+OUT1"), (300, "+OUT2"))
    assert told(world) == events


# ---------------------------------------------------------------------- jaws


@pytest.mark.parametrize(("lowered", "is_held"), [(140, True), (160, False)])
def test_jaws_that_are_closer_than_a_workpiece_is_wide_do_not_take_it(lowered: int, is_held: bool) -> None:
    """It is between the jaws 83 ms after the lift begins; they are 40 of 60 mm apart at 233 ms."""
    world = run(LIFT + JAWS + nest(40, 40, 20), (200, "+OUT2"), (lowered, "+OUT1"))
    assert told(world) == (["jaws holds n.1"] if is_held else [])
    assert world.read("jaws.held") == is_held
    assert world.read("jaws.closed") == (not is_held)


def test_jaws_that_opened_around_a_workpiece_take_it() -> None:
    world = run(LIFT + JAWS + nest(40, 40, 20), (0, "+OUT2"), (200, "+OUT1"), (400, "-OUT2"), (600, "+OUT2"))
    assert told(world) == ["jaws holds n.1"]


@pytest.mark.parametrize(("width", "events"), [(60, ["jaws: n.1 is too wide"]), (59.999, ["jaws holds n.1"])])
def test_a_workpiece_that_is_as_wide_as_the_open_jaws_is_an_event(width: float, events: list[str]) -> None:
    world = run(LIFT + JAWS + nest(width, 40, 20), (0, "+OUT1"), (300, "+OUT2"))
    assert told(world) == events
    assert world.read("jaws.held") == (width < 60)


TURNING = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "degree"
gear = 100.0
[[axis]]
name = "r"
kind = "rotary"
drive = "c.M1"
pulses_per_unit = 100.0
[[button]]
name = "bt"
to = "c.IN3"
[[gripper]]
name = "jaws"
close = "c.OUT2"
at = [0, 0, 115]
stroke = 60
close_time = "2 s"
"""


@pytest.mark.parametrize("presses", [(), (613, 655)])
def test_the_width_of_a_workpiece_that_turns_counts_when_the_jaws_begin_to_close(presses: tuple[int, ...]) -> None:
    """40 mm of 60 at first: 20 mm of 60 in 2 s, whatever else happens while it turns."""
    world = World.from_toml(TURNING + nest(40, 20, 20, more='on = "r"\n'))
    world.mic488["c"].write("M1_EN", 1)
    world.mic488["c"].write("OUT2", 1)
    world.mic488["c"].write("M1_POS_ABS", 90.0)
    for press in presses:
        world.run(until=press / 1000)
        world.press("bt")
    world.run(until=1.0)
    (held,) = (record for record in world.trace.of("event") if record.subject == "workpiece")
    assert held.time / MILLISECOND == pytest.approx(2000 / 3, abs=1e-5)


@pytest.mark.parametrize("moment_s", [0.22, 0.3])
def test_jaws_with_a_workpiece_between_them_can_be_restored(moment_s: float) -> None:
    text = LIFT + JAWS + nest(40, 40, 20)
    world = run(text, (0, "+OUT1"), (200, "+OUT2"), end=int(moment_s * 1000))
    other = World.from_toml(text)
    other.restore(world.snapshot())
    for one in (world, other):
        one.run(until=1.0)
    assert told(other) == ["jaws holds n.1"]
    assert other.trace.digest() == world.trace.digest()


# ---------------------------------------------------------------------- two on one workpiece


CUPS = LIFT + cup("one", "OUT2", -10, 0, -19) + cup("two", "OUT3", 10, 0, -19.5) + nest(40, 40, 20, more="mass = 0.5\n")
"""Lowered, their tips are 1 and 0.5 mm above the workpiece."""
BOTH = (0, "+OUT1"), (300, "+OUT2"), (310, "+OUT3"), (600, "-OUT1")


def state(world: World) -> list[tuple[float, float, float]]:
    return [(world.read(f"{name}.held"), world.read(f"{name}.mass"), world.read(f"{name}.dropped")) for name in ("one", "two")]


def test_the_first_of_two_cups_has_the_workpiece_and_the_second_is_closed_by_it() -> None:
    world = run(CUPS, *BOTH)
    assert told(world) == ["one holds n.1"]
    assert state(world) == [(1, 0.5, 0), (1, 0, 0)]
    assert place(world, "n.1") == (0, 0, 161)


def test_the_second_of_two_cups_lets_go_of_nothing() -> None:
    world = run(CUPS, *BOTH, (1000, "-OUT3"))
    assert told(world) == ["one holds n.1"]
    assert state(world) == [(1, 0.5, 0), (0, 0, 0)]


@pytest.mark.parametrize("saved", [500, 1010])
def test_the_second_of_two_cups_takes_it_over_where_it_is(saved: int) -> None:
    steps = (*BOTH, (1000, "-OUT2"))
    done = [step for step in steps if step[0] <= saved]
    world = run(CUPS, *done, end=saved)
    other = World.from_toml(CUPS)
    other.restore(world.snapshot())
    for one in (world, other):
        for at, what in [step for step in steps if step[0] > saved]:
            one.run(until=at / 1000)
            one.mic488["c"].write(what[1:], int(what[0] == "+"))
        one.run(until=2.0)
        assert told(one) == ["one holds n.1", "one lets go of n.1", "two holds n.1"]
        assert state(one) == [(0, 0, 0), (1, 0.5, 0)]
        assert place(one, "n.1") == (0, 0, 161)
    assert other.trace.digest() == world.trace.digest()


def test_a_cup_whose_workpiece_another_one_takes_away_takes_the_next_one() -> None:
    """It holds its vacuum for 400 ms; what comes under it 150 ms later closes it again."""
    fixed = '[[body]]\nname = "post"\nat = [0, 0, 300]\nsize = [10, 10, 10]\n'
    slide = '[[cylinder]]\nname = "y"\nextend = "c.OUT4"\nstroke = 100\nextend_time = "20 ms"\nalong = "+y"\n'
    tray = '[[nest]]\nname = "m"\non = "y"\nat = [0, -100, 100]\nworkpiece = [40, 40, 20]\nfilled = 1\n'
    second = cup("second", "OUT3", -10, 0, -180, diameter=4, on="post").replace("20 ms", "400 ms")
    text = LIFT + fixed + slide + tray + second + cup("first", "OUT2", 10, 0, -20, diameter=4) + nest(40, 40, 20)
    steps = (0, "+OUT1"), (300, "+OUT2"), (400, "+OUT3"), (1000, "-OUT1"), (1150, "+OUT4")
    world = run(text, *steps, end=1140)
    assert told(world) == ["first holds n.1"]
    assert world.read("second.held") == 1
    world = run(text, *steps)
    assert told(world) == ["first holds n.1", "second holds m.1"]
    assert run(text, *steps[:-1]).read("second.held") == 0


JAWS_AND_CUP = LIFT + JAWS.replace('on = "lift"\nat = [0, 0, -35]', "at = [5, 0, 110]") + cup("cup", "OUT3", 0, 0, -20)
"""The jaws do not move; 5 mm beside the middle of the workpiece."""


@pytest.mark.parametrize(("release", "events"), [(True, ["cup lets go of n.1", "jaws holds n.1"]), (False, [])])
def test_jaws_close_on_what_a_cup_holds_and_take_it_over_or_lose_it(release: bool, events: list[str]) -> None:
    text = JAWS_AND_CUP + nest(40, 40, 20)
    steps = (0, "+OUT1"), (300, "+OUT3"), (400, "+OUT2"), (800, "-OUT3" if release else "+OUT3"), (1000, "-OUT1")
    world = run(text, *steps, end=700)
    assert (world.read("jaws.held"), world.read("jaws.position")) == (1, pytest.approx(20))
    world = run(text, *steps)
    assert told(world) == ["cup holds n.1", *events]
    assert place(world, "n.1") == ((0, 0, 100) if release else (0, 0, 160))
    assert (world.read("jaws.held"), world.read("jaws.closed")) == ((1, 0) if release else (0, 1))


def test_a_cup_does_not_take_from_jaws() -> None:
    world = run(JAWS_AND_CUP + nest(40, 40, 20), (0, "+OUT2"), (300, "+OUT1"), (500, "+OUT3"), (700, "-OUT1"))
    assert told(world) == ["jaws holds n.1"]
    assert (world.read("jaws.held"), world.read("cup.held")) == (1, 0)
