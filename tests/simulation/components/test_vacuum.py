"""Suction cups: pressures by the exponential function of the library, and what becomes of workpieces."""

from __future__ import annotations

from math import exp, log
from pathlib import Path
from textwrap import dedent

import pytest

from steptwin.controller import MILLISECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[[button]]
name = "down"
to = "cup.pick"
[[vacuum]]
name = "cup"
ejector = "a.OUT1"
vacuum = 80.0
threshold = 60.0
build_up = "120 ms"
release = "50 ms"
[[wire]]
from = "cup.held"
to = "a.IN1"
"""


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel]


def test_the_pressure_builds_up_and_goes() -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    world.press("down")
    world.at(0.1, lambda: device.write("OUT1", 1))
    evacuating_s, releasing_s = 0.12 / log(80 / (80 - 60)), 0.05 / log(80 / 60)
    for time_s in (0.13, 0.2, 0.4):
        world.run(until=time_s)
        assert world.read("cup.pressure") == pytest.approx(80 * (1 - exp(-(time_s - 0.1) / evacuating_s)), rel=1e-9)
    last = world.read("cup.pressure")
    device.write("OUT1", 0)
    world.run(until=0.5)
    assert world.read("cup.pressure") == pytest.approx(last * exp(-0.1 / releasing_s), rel=1e-9)
    (_, held), (on, _), (off, _) = edges(world, "cup.held")
    assert (held, on) == (0, pytest.approx(220, abs=1e-5))
    assert off == pytest.approx(400 + 1000 * releasing_s * log(last / 60), abs=1e-5)
    # Without a conveyor nothing falls.
    assert world.read("cup.dropped") == 0


def test_a_cup_that_nothing_closes_has_no_vacuum() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.run(until=1.0)
    assert (world.read("cup.pressure"), world.read("a.IN1")) == (0, 0)
    world.press("down")
    world.run(until="cup.held")
    assert world.now == pytest.approx(1120 * MILLISECOND, abs=1)
    # A workpiece that is held closes the cup wherever it is.
    world.release("down")
    world.run(for_=1.0)
    assert world.read("a.IN1") == 1
    world.fault("leak element=cup name=leak")
    world.run(for_=1.0)
    assert world.read("a.IN1") == 0
    world.clear_fault("leak")
    world.run(for_=1.0)
    assert world.read("a.IN1") == 0


def test_less_than_a_kilopascal_takes_its_time_too() -> None:
    world = World.from_toml(TEXT.replace("80.0", "0.8").replace("60.0", "0.6"))
    world.press("down")
    world.mic488["a"].write("OUT1", 1)
    world.run(until="cup.held")
    assert world.now == pytest.approx(120 * MILLISECOND, abs=1)


BELTS = """
[[mic488]]
name = "a"
[[conveyor]]
name = "infeed"
length = 200.0
speed = 100.0
run = "a.OUT2"
feed_every = "500 ms"
workpiece = 30.0
[[conveyor]]
name = "outfeed"
length = 200.0
speed = 100.0
run = "a.OUT3"
[[conveyor.sensor]]
at = 45.0
to = "a.IN2"
[[vacuum]]
name = "cup"
ejector = "a.OUT1"
pick = "a.OUT4"
place = "a.OUT5"
from = "infeed"
pick_at = 80.0
onto = "outfeed"
place_at = 60.0
vacuum = 80.0
threshold = 60.0
build_up = "120 ms"
release = "50 ms"
[[wire]]
from = "cup.held"
to = "a.IN1"
"""


def test_it_takes_a_workpiece_from_a_belt_to_another() -> None:
    world = World.from_toml(BELTS)
    device = world.mic488["a"]
    device.write("OUT2", 1)
    world.run(until="infeed.count == 1")
    world.run(for_=0.9)
    device.write("OUT2", 0)
    # The first stands with its front at 90 mm, over the place where the cup picks; the next, 50 mm behind it, does not.
    device.write("OUT1", 1)
    device.write("OUT4", 1)
    world.run(until="cup.held", for_=1)
    assert world.read("infeed.count") == world.read("infeed.fed") - 1
    device.write("OUT4", 0)
    world.run(for_=0.2)
    device.write("OUT5", 1)
    device.write("OUT1", 0)
    world.run(until="not cup.held", for_=1)
    # 30 mm long, front at 60 mm: it covers the sensor at 45 mm.
    assert (world.read("outfeed.count"), world.read("a.IN2"), world.read("cup.dropped")) == (1, 1, 0)


def test_a_workpiece_is_put_back_where_it_came_from() -> None:
    world = World.from_toml(BELTS)
    device = world.mic488["a"]
    device.write("OUT2", 1)
    world.run(until="infeed.count == 1")
    world.run(for_=0.9)
    device.write("OUT2", 0)
    device.write("OUT1", 1)
    device.write("OUT4", 1)
    world.run(until="cup.held", for_=1)
    held = world.read("infeed.count")
    device.write("OUT1", 0)
    world.run(until="not cup.held", for_=1)
    assert (world.read("infeed.count"), world.read("outfeed.count"), world.read("cup.dropped")) == (held + 1, 0, 0)
    # It lies with its front under the cup, which can take it again.
    device.write("OUT1", 1)
    world.run(until="cup.held", for_=1)


def test_what_is_let_go_elsewhere_falls() -> None:
    world = World.from_toml(BELTS)
    device = world.mic488["a"]
    device.write("OUT2", 1)
    device.write("OUT1", 1)
    world.run(until="infeed.count == 1")
    world.run(for_=0.9)
    device.write("OUT2", 0)
    device.write("OUT4", 1)
    world.run(until="cup.held", for_=1)
    device.write("OUT4", 0)
    device.write("OUT1", 0)
    world.run(until="not cup.held", for_=1)
    assert (world.read("outfeed.count"), world.read("cup.dropped")) == (0, 1)
    texts = [str(record.value) for record in world.trace.of("event") if record.subject == "workpiece"]
    assert texts[-1] == "infeed.1 falls from cup"


def test_a_workpiece_that_passes_too_quickly_is_not_held() -> None:
    """30 mm pass in 300 ms; in 0.9 s the pressure comes to the threshold, in 0.12 s it does."""
    for build_up, held in (("900 ms", 0), ("120 ms", 1)):
        world = World.from_toml(BELTS.replace("120 ms", build_up))
        device = world.mic488["a"]
        for pin in (1, 2, 4):
            device.write(f"OUT{pin}", 1)
        world.run(until=2.0)
        assert world.read("a.IN1") == held, build_up


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("threshold = 60.0", "threshold = 90.0", "threshold = 90 kPa is not below vacuum = 80 kPa"),
        ("vacuum = 80.0", "vacuum = 102.0", "permitted are numbers above 0 to 101"),
        ('from = "infeed"', 'from = "belt"', "no conveyor is called 'belt'"),
        ('onto = "outfeed"', 'onto = "a"', r"no conveyor is called 'a': a place that is no belt is a \[\[nest\]\]"),
        ('onto = "outfeed"', 'onto = "box"', r"there are .*outfeed; a place that is no belt is a \[\[nest\]\]"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(BELTS.replace(old, new, 1))


EXAMPLE = Path(__file__).parents[3] / "examples" / "worlds" / "pick_and_place" / "pick_and_place.toml"


def test_the_example_delivers_five_workpieces() -> None:
    with World.load(EXAMPLE) as world:
        assert world.run(for_=60) == "five workpieces delivered"
        assert not world.failures
        assert not world.overdue


def test_the_example_survives_a_short_leak_and_not_a_jam() -> None:
    with World.load(EXAMPLE) as world:
        world.fault("leak element=cup from_s=8.2 until_s=8.4")
        assert world.run(for_=120) == "five workpieces delivered"
        assert world.read("cup.dropped") == 1
    with World.load(EXAMPLE) as world:
        world.fault("jam element=lift from_s=10")
        world.run(for_=60)
        (record,) = world.overdue
        assert record.value == "check waited in vain for outfeed.delivered == 5; outfeed.delivered is 1"


@pytest.mark.parametrize("moment_s", [1.0, 5.317, 6.2, 7.5, 11.111])
def test_the_example_can_be_restored_anywhere(moment_s: float) -> None:
    with World.load(EXAMPLE) as world, World.load(EXAMPLE) as other:
        world.run(until=moment_s)
        snapshot = world.snapshot()
        world.run(until=15.0)
        other.restore(snapshot)
        other.run(until=15.0)
        assert other.trace.digest() == world.trace.digest()


def test_a_transducer_of_the_pressure_follows_from_the_moment_at_which_the_ejector_switches() -> None:
    """Nothing else happens until the cup holds. The belt is moved by what comes later."""
    text = """
    [[mic488]]
    name = "c"
    [[conveyor]]
    name = "p"
    length = 200
    speed = 100
    run = "cup.held"
    feed = "c.OUT6"
    [[vacuum]]
    name = "cup"
    ejector = "c.OUT1"
    pick = "c.OUT2"
    from = "p"
    build_up = "100 ms"
    [[transducer]]
    name = "air"
    of = "cup.pressure"
    to = "c.AIN1"
    points = [[0, 1], [70, 8]]
    """
    world = World.from_toml(dedent(text))
    for output in ("OUT2", "OUT6", "OUT1"):
        world.mic488["c"].write(output, 1)
    world.run(for_=0.07)
    pressure = world.read("cup.pressure")
    assert world.read("cup.held") == 0
    assert pressure > 30.0
    assert world.read("c.AIN1") == pytest.approx(1.0 + pressure / 10.0, abs=0.2)
    assert world.branch().read("c.AIN1") == world.read("c.AIN1")
