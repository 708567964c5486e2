"""Belts against an integration of their own: every workpiece moves by speed times step."""

from __future__ import annotations

from fractions import Fraction
from math import isnan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[[button]]
name = "feeder"
to = "belt.feed"
[[conveyor]]
name = "belt"
length = 400.0
speed = 125.0
run = "a.OUT1"
workpiece = 40.0
[[conveyor.sensor]]
at = 300.0
to = "a.IN1"
"""


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel]


def happened(world: World) -> list[tuple[float, str]]:
    return [(record.time / MILLISECOND, str(record.value)) for record in world.trace.of("event") if record.subject == "workpiece"]


def test_a_workpiece_is_carried_past_a_sensor() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(until=4.0)
    # 300 mm at 125 mm/s; the rear is 40 mm behind the front.
    assert edges(world, "belt.sensor1") == [(0, 0), (2400, 1), (2720 + 1e-6, 0)]
    assert happened(world) == [(0, "belt.1 is on belt"), (3200, "belt.1 leaves belt")]
    assert [world.read(f"belt.{name}") for name in ("fed", "count", "delivered")] == [1, 0, 1]


def test_the_places_of_workpieces_are_signals_but_no_conditions() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(until=1.0)
    world.press("feeder", "10 ms")
    world.run(until=2.0)
    assert [world.read(f"belt.place{n}") for n in (1, 2)] == [250.0, 125.0]
    assert isnan(world.read("belt.place3"))
    # The first leaves at 400 mm; the second is the first then.
    world.run(until=3.4)
    assert world.read("belt.place1") == 300.0
    with pytest.raises(Misuse, match="conditions need a sensor"):
        world.run(until="belt.place1 > 350")


def test_places_lie_on_the_belt() -> None:
    """The scale of a chart is the length of the belt."""
    world = World.from_toml(TEXT)
    assert CONVEYOR.signals is not None
    signals = CONVEYOR.signals(world.objects.built(CONVEYOR)["belt"])
    assert (signals["place1"].bounds, signals["place1"].unit) == ((0.0, 400.0), "mm")
    assert signals["count"].bounds is None


def integrated(runs: list[tuple[int, bool]], feeds: list[int], end: int) -> tuple[list[tuple[int, bool]], int]:
    """Edges of the sensor in milliseconds, and how many were delivered."""
    fronts: list[float] = []
    is_running, before, delivered, edges = False, False, 0, []
    for step in range(end):
        is_running = dict(runs).get(step, is_running)
        if step in feeds and not any(front <= 40.0 for front in fronts):
            fronts.append(0.0)
        covered = any(300.0 <= front <= 340.0 for front in fronts)
        if covered is not before:
            before = covered
            edges.append((step, covered))
        fronts = [front + 0.125 * is_running for front in fronts]
        delivered += sum(front >= 400.0 for front in fronts)
        fronts = [front for front in fronts if front < 400.0]
    return edges, delivered


@given(
    st.lists(st.tuples(st.integers(0, 8000), st.booleans()), max_size=6, unique_by=lambda one: one[0]),
    st.lists(st.integers(0, 400), max_size=6, unique=True),
)
def test_it_is_where_an_integration_has_it(runs: list[tuple[int, bool]], feeds: list[int]) -> None:
    runs = sorted({0: True, **dict(runs)}.items())
    feeds = sorted(20 * feed + 7 for feed in feeds)
    world = World.from_toml(TEXT)
    for at, level in runs:
        world.at(at / 1000, lambda level=level: world.mic488["a"].write("OUT1", int(level)))  # type: ignore[misc]
    for at in feeds:
        world.at(at / 1000, lambda: world.press("feeder", "5 ms"))
    world.run(until=10.0)
    expected, delivered = integrated(runs, feeds, 10_001)
    found = edges(world, "belt.sensor1")[1:]
    assert [bool(level) for _, level in found] == [level for _, level in expected]
    assert [time for time, _ in found] == pytest.approx([time for time, _ in expected], abs=1.5)
    assert world.read("belt.delivered") == pytest.approx(delivered, abs=1)


ON_AN_AXIS = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 100.0
acc = 1000.0
vel = 200.0
[[axis]]
name = "drum"
drive = "a.M1"
unit = "rev"
kind = "rotary"
pulses_per_unit = 3200
[[button]]
name = "feeder"
to = "belt.feed"
[[conveyor]]
name = "belt"
axis = "drum"
mm_per_unit = 160.0
length = 300.0
workpiece = 20.0
next = "second"
[[conveyor.sensor]]
at = 100.0
to = "a.IN1"
contact = "NC"
[[conveyor]]
name = "second"
speed = 50.0
length = 100.0
[[conveyor.sensor]]
at = 50.0
to = "a.IN2"
[[wire]]
from = "a.OUT1"
to = "second.run"
"""


def test_an_axis_moves_a_belt_both_ways() -> None:
    world = World.from_toml(ON_AN_AXIS)
    device = world.mic488["a"]
    device.axis[1].enable()
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    # 3200 pulses are 160 mm: a pulse is 0.05 mm, and 100 pulses are a mm of the controller.
    device.axis[1].move_to(20.5)
    world.run(until="idle")
    assert world.read("a.IN1") == 0
    moved = world.read("drum.position") * 160.0
    assert moved == pytest.approx(102.5)
    device.axis[1].move_to(19.5)
    world.run(until="idle")
    assert world.read("a.IN1") == 1
    device.axis[1].move_to(-1.0)
    world.run(until="idle")
    assert happened(world)[-1][1] == "belt.1 falls off the beginning of belt"
    assert world.read("belt.count") == 0


def test_a_workpiece_goes_on_to_the_next_belt() -> None:
    world = World.from_toml(ON_AN_AXIS)
    device = world.mic488["a"]
    device.axis[1].enable()
    device.write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.axis[1].move_to(70.0)
    world.run(until="second.count == 1", for_=10)
    began = world.now
    world.run(until="a.IN2", for_=10)
    # Its centre is on the next belt, its front at 10 mm: 40 mm at 50 mm/s.
    assert world.now - began == 800 * MILLISECOND
    # 20 mm long there too.
    world.run(until="not a.IN2", for_=10)
    assert world.now - began == pytest.approx(1200 * MILLISECOND, abs=1)
    world.run(until="second.delivered == 1", for_=10)
    assert world.now - began == 1800 * MILLISECOND


def test_workpieces_come_at_a_period_where_there_is_room() -> None:
    world = World.from_toml(TEXT.replace("workpiece", 'feed_every = "300 ms"\nworkpiece'))
    world.mic488["a"].write("OUT1", 1)
    world.run(until=1.0)
    # 37.5 mm in 300 ms, less than the 40 mm of a workpiece.
    assert [time for time, _ in happened(world)] == [300, 900]


def test_a_belt_whose_drive_fails_stands() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.fault("belt-stop element=belt from_s=1 until_s=1.5")
    world.run(until=4.0)
    assert [time for time, _ in edges(world, "belt.sensor1")][1] == 2900
    with pytest.raises(Misuse, match="'belt' is moved by axis 'drum'"):
        World.from_toml(ON_AN_AXIS).fault("belt-stop element=belt")


def test_an_empty_feeder_puts_nothing_on_and_goes_on_with_the_next() -> None:
    world = World.from_toml(TEXT.replace("workpiece", 'feed_every = "400 ms"\nworkpiece'))
    world.mic488["a"].write("OUT1", 1)
    world.fault("empty-feeder element=belt from_s=0.5 until_s=1.5")
    world.run(until="belt.missed == 1", for_=10)
    assert world.now == 800 * MILLISECOND
    world.press("feeder", "10 ms")
    world.run(until=2.1)
    # Due at 800 and 1200 ms, and the button: the belt is free, so that each is missed only through the fault.
    assert [time for time, _ in happened(world)] == [400, 1600, 2000]
    assert [world.read(f"belt.{name}") for name in ("fed", "missed")] == [3, 3]
    assert edges(world, "belt.feeder_stands") == [(500, 1), (1500, 0)]


def test_a_workpiece_before_a_button_is_missed_where_another_one_lies() -> None:
    world = World.from_toml(TEXT)
    for _ in range(3):
        world.press("feeder", "10 ms")
        world.run(for_=0.1)
    assert [world.read(f"belt.{name}") for name in ("fed", "missed")] == [1, 2]


def test_an_empty_feeder_takes_nothing_from_the_conveyor_before() -> None:
    second = '[[conveyor]]\nname = "second"\nlength = 50.0\nspeed = 100.0\nworkpiece = 40.0\n'
    world = World.from_toml(TEXT.replace("workpiece = 40.0", 'workpiece = 40.0\nnext = "second"') + second)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.fault("empty-feeder element=second")
    world.run(until=4.0)
    assert [world.read(f"second.{name}") for name in ("count", "fed", "missed")] == [1, 0, 0]


@pytest.mark.parametrize("moment_s", [0.6, 0.8, 1.3, 1.5])
def test_snapshots_have_an_empty_feeder(moment_s: float) -> None:
    text = TEXT.replace("workpiece", 'feed_every = "400 ms"\nworkpiece')
    text += '[[fault]]\nkind = "empty-feeder"\nelement = "belt"\nfrom_s = 0.5\nuntil_s = 1.5\n'
    world = World.from_toml(text)
    world.mic488["a"].write("OUT1", 1)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=5.0)
    other = World.from_toml(text)
    other.restore(snapshot)
    other.run(until=5.0)
    assert other.trace.digest() == world.trace.digest()
    assert other.read("belt.missed") == world.read("belt.missed") == 2


RAMPS = TEXT.replace("speed = 125.0", 'speed = 125.0\nramp_up = "800 ms"\nramp_down = "400 ms"')
"""50 mm from rest to speed, 25 mm back."""


def test_a_belt_has_ramps() -> None:
    """With its front at 300 mm 250 mm at speed after the ramp; off at 340 mm it comes to 365 mm."""
    world = World.from_toml(RAMPS)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(until=0.4)
    assert world.read("belt.place1") == 12.5
    world.run(until=3.12)
    assert edges(world, "belt.sensor1") == [(0, 0), (2800, 1)]
    assert world.read("belt.place1") == pytest.approx(340)
    world.mic488["a"].write("OUT1", 0)
    world.run(until=3.32)
    assert world.read("belt.place1") == pytest.approx(340 + 18.75)
    world.run(until=5.0)
    assert world.read("belt.place1") == pytest.approx(365)
    assert edges(world, "belt.sensor1")[-1] == (3120 + 1e-6, 0), "the rear: 40 mm behind"


def test_a_stop_holds_while_the_belt_runs_up_and_down() -> None:
    """At 20 mm it is on the ramp up, at 0.506 s; the next one comes there on the ramp down."""
    stop = '[[conveyor.stop]]\nat = 20.0\nhold = "a.OUT2"\n'
    world = World.from_toml(RAMPS.replace("workpiece = 40.0", "workpiece = 10.0") + stop)
    world.mic488["a"].write("OUT2", 1)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(until=1.0)
    assert [(round(time, 3), text) for time, text in happened(world)] == [
        (0, "belt.1 is on belt"),
        (505.964, "belt.1 stands at 20 mm of belt"),
    ]
    world.press("feeder", "10 ms")
    world.mic488["a"].write("OUT1", 0)
    world.run(until=2.0)
    # It is behind the first one after 10 mm of 25: t = 0.4·(1 − √(1 − 10/25)) s.
    assert happened(world)[-1][0] == pytest.approx(1000 + 90.161, abs=0.001)
    assert happened(world)[-1][1].startswith("belt.2 stands at 10 mm")
    world.mic488["a"].write("OUT2", 0)
    world.run(until=3.0)
    assert [round(world.read(f"belt.place{n}"), 3) for n in (1, 2)] == [20.0, 10.0], "the belt stands"


def test_a_drive_with_ramps_that_fails_comes_to_rest_by_its_ramp() -> None:
    world = World.from_toml(RAMPS)
    world.mic488["a"].write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.fault("belt-stop element=belt from_s=1 until_s=2")
    world.run(until=2.0)
    assert world.read("belt.place1") == pytest.approx(50 + 25 + 25)


@pytest.mark.parametrize("keys", ["", 'ramp_up = "600 ms"\nramp_down = "250 ms"\n'])
@pytest.mark.parametrize("moment_s", [0.0, 0.3, 1.0, 2.41, 2.9])
def test_snapshots_have_it(moment_s: float, keys: str) -> None:
    text = TEXT.replace("workpiece", f'{keys}feed_every = "700 ms"\nworkpiece')
    world = World.from_toml(text)
    world.mic488["a"].write("OUT1", 1)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=5.0)
    other = World.from_toml(text)
    other.restore(snapshot)
    other.run(until=5.0)
    assert other.trace.digest() == world.trace.digest()


def test_a_belt_is_longer_than_a_step_of_its_drive() -> None:
    text = TEXT.replace("length = 400.0", "length = 1e-10").replace("at = 300.0", "at = 0.0")
    with pytest.raises(WorldError, match="length = 1e-10 mm: the belt is shorter than one step of its drive, 1e-09 mm"):
        World.from_toml(text)
    assert World.from_toml(text.replace("1e-10", "1e-9")).read("belt.count") == 0
    world = World.from_toml(TEXT.replace("length = 400.0", "length = 1e300").replace("workpiece = 40.0", "workpiece = 1e-300"))
    world.run(until=1.0)
    assert isnan(world.read("belt.place24"))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("speed = 125.0", "", "a conveyor needs one of speed and axis"),
        ("speed = 125.0", 'speed = 125.0\naxis = "x"', "a conveyor needs one of speed and axis"),
        ("speed = 125.0", 'axis = "x"', "no axis is called 'x'"),
        ("speed = 125.0", 'axis = "x"\nramp_up = "1 s"', "ramp_up means nothing without speed"),
        ("at = 300.0", "at = 400.5", "at = 400.5 is beyond length = 400"),
        ("at = 300.0", "", r"\[conveyor.sensor\]: at is missing"),
        ("workpiece = 40.0", 'next = "belt"', "belt is followed by itself"),
        ("workpiece = 40.0", 'next = "other"', "no conveyor is called 'other'"),
        ("workpiece = 40.0", 'next = "a"', "no conveyor is called 'a'"),
        ('to = "a.IN1"', 'to = "a.AIN1"', "a.AIN1 is not a digital input"),
        ("workpiece = 40.0", "workpiece = 40.0\nmarks = [38.5]", "a mark from 38.5 to 40.5 mm is beyond workpiece = 40"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(TEXT.replace(old, new, 1))


HELD = ON_AN_AXIS.replace('next = "second"', "[[conveyor.stop]]\nat = 150.0\n")


def test_a_belt_that_goes_back_takes_what_stands_with_its_first_pulse() -> None:
    text = HELD.replace("[[conveyor.stop]]\nat = 150.0\n", "") + '[[wire]]\nfrom = "a.OUT2"\nto = "belt.stop1"\n'
    text = text.replace("[[conveyor.sensor]]\nat = 100.0", "[[conveyor.stop]]\nat = 150.0\n[[conveyor.sensor]]\nat = 100.0")
    world = World.from_toml(text)
    device = world.mic488["a"]
    device.axis[1].enable()
    device.write("OUT2", 1)
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.axis[1].move_to(40.0)
    world.run(until="idle")
    assert happened(world)[-1][1] == "belt.1 stands at 150 mm of belt"
    began = world.now
    device.axis[1].move_to(30.0)
    world.run(until="idle")
    # 100 pulses/mm and 1000 mm/s²: the first pulse after √(2 / 100 000) s.
    ((back, what),) = happened(world)[-1:]
    assert (back - began / MILLISECOND, what) == (pytest.approx(4.4722, abs=1e-3), "belt.1 goes back on belt")
    (fact,) = [record.facts for record in world.trace.events("a") if "goes back" in str(record.value)]
    assert fact == (("workpiece", "belt.1"), ("element", "belt"), ("what", "goes back"))


def test_a_workpiece_waits_until_the_next_belt_has_room() -> None:
    second = '[[conveyor]]\nname = "second"\nlength = 100.0\nspeed = 50.0\nrun = "a.OUT2"\nworkpiece = 30.0\nfeed = "a.OUT3"\n'
    world = World.from_toml(TEXT.replace("workpiece = 40.0", 'workpiece = 40.0\nnext = "second"') + second)
    device = world.mic488["a"]
    device.write("OUT3", 1)
    device.write("OUT1", 1)
    world.press("feeder", "10 ms")
    world.run(until=5.0)
    # The rear of the other one, with its front at the beginning of the next belt, is on the last 30 mm.
    assert happened(world)[-1] == (2960, "belt.1 stands at 370 mm of belt")
    device.write("OUT2", 1)
    world.run(until=6.1)
    # Room for half of it: 20 mm at 50 mm/s. Then it touches again: 33.3 mm at 125 mm/s, while the other one makes 13.3 mm.
    # At last the rear of that is where its front is when the next belt takes it over.
    assert [one for one in happened(world) if one[0] > 5000] == [
        (pytest.approx(5400, abs=1e-4), "belt.1 goes on along belt"),
        (pytest.approx(5666.667, abs=1e-3), "belt.1 stands at 403.333 mm of belt"),
        (pytest.approx(6000, abs=1e-4), "belt.1 goes on along belt"),
    ]


@pytest.mark.parametrize("mm_per_unit", [160.0, 7.0, 333.0])
def test_places_are_the_nearest_pulses(mm_per_unit: float) -> None:
    world = World.from_toml(ON_AN_AXIS.replace("mm_per_unit = 160.0", f"mm_per_unit = {mm_per_unit}"))
    belt = world.objects.built(CONVEYOR)["belt"].belt
    assert belt.per_mm == Fraction(3200) / Fraction(mm_per_unit)
    for n in range(1, 30):
        assert abs(belt.to_grid(n * 0.37) - Fraction(str(round(n * 0.37, 2))) * belt.per_mm) <= Fraction(1, 2) + Fraction(
            1, 10**6
        )


def test_a_mark_and_a_sensor_may_be_at_the_very_end() -> None:
    text = TEXT.replace("workpiece = 40.0", "workpiece = 40.0\nmarks = [0, 38]").replace("at = 300.0", "at = 400.0")
    assert World.from_toml(text).read("belt.count") == 0
