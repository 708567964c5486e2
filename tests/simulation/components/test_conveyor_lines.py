"""Conveyors one behind the other: a workpiece occupies every belt below it, and no two of them share a place."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from steptwin.controller import MILLISECOND
from steptwin.files.world import World
from steptwin.simulation.components.conveyor import CONVEYOR

LINE = """
[[mic488]]
name = "a"
[[button]]
name = "feeder"
to = "first.feed"
[[conveyor]]
name = "first"
length = 200.0
speed = 100.0
run = "a.OUT1"
workpiece = 40.0
next = "second"
[[conveyor.sensor]]
at = 195.0
to = "a.IN1"
[[conveyor]]
name = "second"
length = 200.0
speed = 50.0
run = "a.OUT2"
feed = "a.OUT3"
workpiece = 30.0
[[conveyor.sensor]]
at = 10.0
to = "a.IN2"
[[conveyor.stop]]
at = 5.0
hold = "a.OUT4"
[[gripper]]
name = "jaws"
close = "a.OUT5"
pick = "a.OUT6"
from = "first"
pick_at = 190.0
onto = "second"
place = "a.OUT7"
place_at = 60.0
close_time = "20 ms"
open_time = "20 ms"
[[wire]]
from = "jaws.held"
to = "a.IN3"
"""


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels, without the first one."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel][1:]


def happened(world: World) -> list[tuple[float, str]]:
    return [(record.time / MILLISECOND, str(record.value)) for record in world.trace.of("event") if record.subject == "workpiece"]


def running(text: str = LINE, *outputs: int) -> World:
    world = World.from_toml(text)
    for output in outputs:
        world.mic488["a"].write(f"OUT{output}", 1)
    return world


def test_sensors_near_both_ends_see_a_workpiece_that_is_on_both_belts() -> None:
    world = running(LINE, 1, 2)
    world.press("feeder", "10 ms")
    world.run(until=5.0)
    # The front comes to 195 mm at 1.95 s. At 2.2 s the centre is at 200 mm; then the rear makes 15 mm at 50 mm/s.
    assert edges(world, "first.sensor1") == [(1950, 1), (pytest.approx(2500, abs=1e-5), 0)]
    # The front comes to 10 mm at 2.1 s, the rear, at -20 mm at 2.2 s, at 2.8 s.
    assert edges(world, "second.sensor1") == [(2100, 1), (pytest.approx(2800, abs=1e-5), 0)]
    assert happened(world)[1:3] == [(2200, "first.1 leaves first"), (2200, "first.1 is on second")]


def test_the_belt_under_its_centre_moves_it() -> None:
    """One of them stands: either the front half of it is on the second belt, or its rear is on the first one."""
    world = running(LINE, 1)
    world.press("feeder", "10 ms")
    world.run(until=2.15)
    assert [world.read(f"first.{name}") for name in ("count", "place1", "delivered")] == [1, 215, 0]
    assert (world.read("a.IN1"), world.read("a.IN2")) == (1, 1)
    world.run(until=4.0)
    assert [world.read(f"second.{name}") for name in ("count", "place1")] == [1, 20]
    assert (world.read("a.IN1"), world.read("a.IN2")) == (1, 1), "its rear is at 180 mm of the first one, which runs"
    # What comes stands behind it.
    world.press("feeder", "10 ms")
    world.run(until=6.0)
    assert happened(world)[-1] == (pytest.approx(5800, abs=1e-5), "first.2 stands at 180 mm of first")


def test_a_feeder_waits_for_a_workpiece_that_is_partly_there() -> None:
    world = running(LINE, 1)
    world.press("feeder", "10 ms")
    world.run(until=2.1)
    world.mic488["a"].write("OUT1", 0)
    world.mic488["a"].write("OUT3", 1)
    world.run(until=2.2)
    assert [world.read(f"second.{name}") for name in ("fed", "missed")] == [0, 1]
    # Nor is there room for what is behind the beginning, on the belt before.
    world = running(LINE, 1)
    world.press("feeder", "10 ms")
    world.run(until=1.9)
    world.mic488["a"].write("OUT1", 0)
    world.mic488["a"].write("OUT3", 1)
    world.run(until=2.0)
    assert [world.read(f"second.{name}") for name in ("fed", "missed")] == [0, 1]


def test_a_stop_of_the_next_belt_holds_the_front() -> None:
    world = running(LINE, 1, 2, 4)
    world.press("feeder", "10 ms")
    world.at(4.0, lambda: world.mic488["a"].write("OUT4", 0))
    world.run(until=5.0)
    assert happened(world)[1:4] == [
        (2050, "first.1 stands at 205 mm of first"),
        (4000, "first.1 goes on along first"),
        (4150, "first.1 leaves first"),
    ]


def test_a_queue_goes_on_to_a_belt_as_quick_without_a_wait() -> None:
    text = LINE.replace("speed = 50.0", "speed = 100.0").replace('to = "first.feed"', 'to = "a.IN4"')
    text = text.replace(
        'next = "second"', 'next = "second"\nfeed_every = "500 ms"\n[[conveyor.stop]]\nat = 150.0\nhold = "a.OUT8"'
    )
    world = running(text, 1, 2, 8)
    world.at(3.0, lambda: world.mic488["a"].write("OUT8", 0))
    world.run(until=3.7)
    stood = [text for _, text in happened(world) if "stands" in text]
    assert stood == [f"first.{n} stands at {place} mm of first" for n, place in ((1, 150), (2, 110), (3, 70), (4, 30))]
    after = [(time, text) for time, text in happened(world) if time > 3000 and "leaves" in text]
    assert after == [(3700, "first.1 leaves first")]
    world.run(until=6.0)
    assert not [text for time, text in happened(world) if time > 3000 and "stands" in text]
    leaves = [time for time, text in happened(world) if text.endswith("leaves first")]
    assert [other - one for one, other in pairwise(leaves)][:2] == pytest.approx([400, 400], abs=1e-4)


@pytest.mark.parametrize(("apart", "lies"), [(0.0, False), (29.999, False), (30.0, True), (45.0, True)])
def test_putting_down_where_another_one_lies_is_a_collision(apart: float, lies: bool) -> None:
    """The finding: a cup that does not wait puts two workpieces on one place of a belt that stands."""
    text = LINE.replace("workpiece = 40.0", "workpiece = 30.0")
    world = running(text, 1, 6)
    device = world.mic488["a"]

    def carry() -> None:
        world.press("feeder", "10 ms")
        world.run(for_=2.0)
        device.write("OUT1", 0)
        device.write("OUT5", 1)
        world.run(for_=0.1)
        assert world.read("jaws.held") == 1
        device.write("OUT6", 0)
        device.write("OUT7", 1)
        device.write("OUT5", 0)
        world.run(for_=0.1)
        device.write("OUT7", 0)
        device.write("OUT6", 1)
        device.write("OUT1", 1)

    carry()
    device.write("OUT2", 1)
    world.run(for_=apart / 50.0)
    device.write("OUT2", 0)
    carry()
    assert (world.read("second.count"), world.read("jaws.dropped")) == ((2, 0) if lies else (1, 1))
    assert happened(world)[-1][1] == ("first.2 is on second" if lies else "first.2 collides with first.1 on second")
    if not lies:
        (fact,) = [record.facts for record in world.trace.events("a") if "collides" in str(record.value)]
        assert fact == (("workpiece", "first.2"), ("element", "second"), ("what", "collides"))


def test_a_gripper_takes_what_is_over_its_place_from_the_belt_that_moves_it() -> None:
    world = running(LINE, 1, 6)
    device = world.mic488["a"]
    world.press("feeder", "10 ms")
    world.run(until=3.0)
    assert world.read("second.count") == 1
    device.write("OUT5", 1)
    world.run(until=3.1)
    assert [world.read(name) for name in ("jaws.held", "second.count", "first.count")] == [1, 0, 0]


JOINING = """
[[mic488]]
name = "a"
[[conveyor]]
name = "left"
length = 100.0
speed = 100.0
feed_every = "700 ms"
workpiece = 20.0
next = "out"
[[conveyor.sensor]]
at = 99.0
to = "a.IN1"
[[conveyor]]
name = "right"
length = 100.0
speed = 100.0
feed_every = "700 ms"
workpiece = 20.0
next = "out"
[[conveyor.sensor]]
at = 99.0
to = "a.IN2"
[[conveyor]]
name = "out"
length = 200.0
speed = 100.0
"""


def test_where_two_ways_join_one_goes_after_the_other() -> None:
    text = JOINING + "".join(f'[[wire]]\nfrom = "a.OUT1"\nto = "{name}.run"\n' for name in ("left", "right", "out"))
    world = running(text, 1)
    world.run(until=2.2)
    assert [one for one in happened(world) if one[0] > 1600 and "is on left" not in one[1] and "is on right" not in one[1]] == [
        (1700, "left.1 stands at 100 mm of left"),
        (1800, "right.1 leaves right"),
        (1800, "right.1 is on out"),
        (pytest.approx(1900, abs=1e-4), "left.1 goes on along left"),
        (pytest.approx(2000, abs=1e-4), "left.1 leaves left"),
        (pytest.approx(2000, abs=1e-4), "left.1 is on out"),
    ]
    # A rear is on the way that it came.
    assert edges(world, "left.sensor1")[:2] == [(1690, 1), (pytest.approx(2090, abs=1e-4), 0)]
    assert edges(world, "right.sensor1")[:2] == [(1690, 1), (pytest.approx(1890, abs=1e-4), 0)]


ON_AXES = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 20.0
acc = 1000.0
vel = 100.0
[mic488.M2]
unit = "mm"
gear = 20.0
acc = 1000.0
vel = 100.0
[[axis]]
name = "x"
drive = "a.M1"
unit = "mm"
pulses_per_unit = 20
[[axis]]
name = "y"
drive = "a.M2"
unit = "mm"
pulses_per_unit = 20
[[button]]
name = "feeder"
to = "first.feed"
[[conveyor]]
name = "first"
length = 100.0
axis = "x"
workpiece = 40.0
next = "second"
[[conveyor]]
name = "second"
length = 100.0
axis = "y"
"""


def test_a_belt_that_goes_back_gives_a_workpiece_back() -> None:
    world = running(ON_AXES)
    device = world.mic488["a"]
    for axis in (1, 2):
        device.axis[axis].enable()
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.axis[1].move_to(120.0)
    world.run(until="idle")
    assert [world.read(f"second.{name}") for name in ("count", "place1")] == [1, 20]
    device.axis[2].move_to(30.0)
    world.run(until="idle")
    device.axis[2].move_to(-25.0)
    world.run(until="idle")
    assert [text for _, text in happened(world)][-2:] == ["first.1 leaves second", "first.1 is on first"]
    # A pulse is 0.05 mm.
    assert [world.read(f"first.{name}") for name in ("count", "place1")] == [1, 99.95]
    device.axis[1].move_to(100.0)
    world.run(until="idle")
    assert world.read("first.place1") == pytest.approx(79.95)
    device.axis[1].move_to(20.0)
    world.run(until="idle")
    assert happened(world)[-1][1] == "first.1 falls off the beginning of first"


def test_two_belts_against_each_other_move_a_workpiece_to_and_fro() -> None:
    """By half of its length each time: from where its front is at the end to where its centre is."""
    world = running(ON_AXES)
    device = world.mic488["a"]
    for axis in (1, 2):
        device.axis[axis].enable()
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.write("M1_VEL_ABS", 50.0)
    device.write("M2_VEL_ABS", -50.0)
    world.run(until=6.0)
    moments = [time for time, text in happened(world) if text == "first.1 is on second"]
    assert moments[0] == pytest.approx(2500, abs=30)
    assert [other - one for one, other in pairwise(moments)] == pytest.approx([800] * 4, abs=5)


def test_what_a_belt_pushes_back_against_another_one_collides_with_it() -> None:
    world = running(ON_AXES)
    device = world.mic488["a"]
    for axis in (1, 2):
        device.axis[axis].enable()
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.axis[1].move_to(42.0)
    world.run(until="idle")
    world.press("feeder", "10 ms")
    world.run(for_=0.1)
    device.axis[1].move_to(120.0)
    world.run(until="idle")
    device.axis[2].move_to(40.0)
    world.run(until="idle")
    # The rear of the first one is at 120 mm, the front of the other comes to 98 mm.
    device.axis[1].move_to(140.0)
    world.run(until="idle")
    device.axis[2].move_to(5.0)
    world.run(until="idle")
    assert [text for _, text in happened(world)][-3:] == [
        "first.2 stands at 98 mm of first",
        "first.1 collides with first.2 on first",
        "first.2 goes on along first",
    ]
    assert [world.read(f"{name}.count") for name in ("first", "second")] == [1, 0]


def test_a_belt_knows_those_from_which_a_workpiece_may_reach_to_it() -> None:
    """Six belts of 100 mm in a ring; workpieces are 120 mm long."""
    text = '[[mic488]]\nname = "a"\n'
    for n in range(6):
        text += f'[[conveyor]]\nname = "b{n}"\nnext = "b{(n + 1) % 6}"\nlength = 100.0\nspeed = 50.0\nrun = "a.OUT1"\n'
        text += "workpiece = 120.0\n"
    belts = World.from_toml(text).objects.built(CONVEYOR)
    mm = 10**6
    assert [(near.belt.name, near.begin, near.joins, near.after) for near in belts["b3"].belt.near] == [
        ("b2", -100 * mm, None, None),
        ("b1", -200 * mm, None, None),
        ("b4", 100 * mm, 100 * mm, "b3"),
        ("b5", 200 * mm, 200 * mm, "b4"),
        ("b0", 300 * mm, 300 * mm, "b5"),
    ]
    # Short ones concern their neighbours only.
    belts = World.from_toml(text.replace("workpiece = 120.0", "workpiece = 30.0")).objects.built(CONVEYOR)
    assert [near.belt.name for near in belts["b3"].belt.near] == ["b2", "b4"]


# ---------------------------------------------------------------------- any line, sampled

NAMES = ("p", "q", "r")
WAYS = ({"p": "q", "q": "r"}, {"p": "r", "q": "r"}, {"p": "q", "q": "p"}, {"p": "q", "q": "r", "r": "p"})
DRIVES = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 20.0
acc = 400.0
dec = 400.0
[mic488.M2]
unit = "mm"
gear = 20.0
acc = 900.0
dec = 500.0
[[axis]]
name = "x"
drive = "a.M1"
unit = "mm"
pulses_per_unit = 20
[[axis]]
name = "y"
drive = "a.M2"
unit = "mm"
pulses_per_unit = 20
"""
OUTPUTS = ("OUT1", "OUT2", "OUT3", "OUT4", "OUT5", "OUT6", "OUT7", "OUT8", "M3_EN")
END_MS = 2000


class Plant:
    """Three belts by chance, with a gripper; what is written, and when, ms."""

    def __init__(self, seed: int) -> None:
        chance = Random(seed)
        self.ways = chance.choice(WAYS)
        self.lengths = {name: chance.choice((chance.randrange(15, 60), chance.randrange(60, 200))) for name in NAMES}
        self.sizes = {name: chance.choice((chance.randrange(5, 30), chance.randrange(20, 90))) for name in NAMES}
        self.sensors: dict[str, int] = {}
        """Where each belt has one, mm."""
        tables, speed = [DRIVES], chance.choice((40, 100, 250))
        for n, name in enumerate(NAMES):
            tables.append(f"[[conveyor]]\nname = '{name}'\nlength = {self.lengths[name]}\nworkpiece = {self.sizes[name]}\n")
            if seed % 2 and chance.random() < 0.6:
                tables.append(f"axis = '{chance.choice('xxy')}'\nmm_per_unit = {chance.choice((1, 1, 0.7, 2))}\n")
            else:
                its = chance.choice((speed, speed, chance.randrange(20, 300), speed * 1.001))
                tables.append(f"speed = {its}\nrun = 'a.OUT{n + 1}'\n")
                ramps = "ramp_up = '50 ms'\nramp_down = '30 ms'\n", "ramp_up = '120 ms'\n"
                tables += [chance.choice(ramps)] if seed % 3 == 0 and chance.random() < 0.8 else []
            tables += [f"next = '{self.ways[name]}'\n"] if name in self.ways else []
            tables += [f"feed_every = '{chance.choice((97, 211, 350))} ms'\n"] if n == 0 or chance.random() < 0.4 else []
            if chance.random() < 0.6:
                tables.append(f"[[conveyor.stop]]\nat = {chance.randrange(self.lengths[name] + 1)}\nhold = 'a.OUT{n + 4}'\n")
            self.sensors[name] = chance.randrange(1, self.lengths[name])
            tables.append(f"[[conveyor.sensor]]\nat = {self.sensors[name]}\nto = 'a.IN{n + 2}'\n")
        source, onto = chance.choice(NAMES), chance.choice(NAMES)
        pick_at, place_at = (chance.randrange(self.lengths[name] + 1) for name in (source, onto))
        tables.append(
            f"[[gripper]]\nname = 'jaws'\nclose = 'a.OUT7'\npick = 'a.OUT8'\nplace = 'a.M3_EN'\nfrom = '{source}'\n"
            f"pick_at = {pick_at}\nonto = '{onto}'\nplace_at = {place_at}\nclose_time = '20 ms'\nopen_time = '20 ms'\n"
            "[[wire]]\nfrom = 'jaws.held'\nto = 'a.IN1'\n"
        )
        self.text = "".join(tables)
        self.tolerance = 0.3 if "axis = " in self.text else 1e-5
        """mm: rounding to pulses, of up to 0.1 mm, or to nm."""
        writes = [(0, register, 1.0) for register in ("M1_EN", "M2_EN", "OUT1", "OUT2", "OUT3")]
        for _ in range(chance.randrange(4, 24)):
            motion = chance.choice(("M1", "M2")), chance.choice(("_POS_REL", "_VEL_ABS")), chance.randrange(-80, 150)
            output = chance.choice(OUTPUTS), "", chance.randrange(2)
            register, key, value = chance.choice((motion, output, output))
            writes.append((chance.randrange(1, END_MS), register + key, float(value)))
        self.writes = sorted(writes)

    def run(self, world: World, end_ms: float) -> None:
        """Up to a moment, with what is written meanwhile."""
        for at, register, value in self.writes:
            if world.now / MILLISECOND <= at < end_ms:
                world.run(until=at / 1000)
                world.mic488["a"].write(register, value)
        world.run(until=end_ms / 1000)

    def intervals(self, world: World) -> list[tuple[str, float, float, str]]:
        """What each workpiece covers: belt, from, to, and its name. In mm."""
        found = []
        for name, conveyor in world.objects.built(CONVEYOR).items():
            for n, one in enumerate(conveyor.belt.workpieces):
                front, size = conveyor.front(n, world.now), self.sizes[one.workpiece.name[0]]
                found += self._ahead(name, front, size, one.workpiece.name)
                found += self._behind(name, front - size, size, one.workpiece.name, one.came_from)
        return found

    def _ahead(self, belt: str | None, front: float, size: float, name: str) -> list[tuple[str, float, float, str]]:
        """On a belt and those after it."""
        found, known = [], set()
        while belt is not None and belt not in known and front > 0:
            known.add(belt)
            found.append((belt, max(front - size, 0.0), min(front, self.lengths[belt]), name))
            front, belt = front - self.lengths[belt], self.ways.get(belt)
        return found

    def _behind(self, belt: str, rear: float, size: float, name: str, came_from: str) -> list[tuple[str, float, float, str]]:
        """On those before a belt: on the one that it came from, or on all of them."""
        found = []
        for before in [came_from] if came_from else [one for one, other in self.ways.items() if other == belt]:
            its = rear + self.lengths[before]
            if rear < 0:
                found.append((before, max(its, 0.0), min(its + size, self.lengths[before]), name))
                found += self._behind(before, its, size, name, "")
        return found


@pytest.mark.parametrize("seed", range(12))
def test_no_two_workpieces_share_a_place_and_sensors_see_each(seed: int) -> None:
    plant = Plant(seed)
    world = World.from_toml(plant.text)
    for moment in range(0, END_MS, 7):
        plant.run(world, moment + 0.37)
        covered = sorted(plant.intervals(world))
        for (belt, _, end, name), (its, begin, its_end, other) in pairwise(covered):
            if belt == its and name != other:
                assert min(end, its_end) - begin <= plant.tolerance, (world.now, belt, name, other)
        for n, (belt, at) in enumerate(plant.sensors.items()):
            near = [min(at - begin, end - at) for its, begin, end, _ in covered if its == belt]
            if all(abs(one) > plant.tolerance for one in near):
                assert bool(world.read(f"a.IN{n + 2}")) is any(one > 0 for one in near), (world.now, belt, at)
    assert sum(world.read(f"{name}.fed") for name in NAMES) > 0


@pytest.mark.parametrize("seed", [*range(18, 24), 40, 56])
def test_it_goes_on_alike_from_anywhere(seed: int) -> None:
    plant = Plant(seed)
    whole, parts = World.from_toml(plant.text), World.from_toml(plant.text)
    plant.run(whole, END_MS)
    plant.run(parts, 300 + 25 * seed + 0.123)
    snapshot = parts.snapshot()
    branch = parts.branch(snapshot)
    other = World.from_toml(plant.text)
    other.restore(snapshot)
    for world in (parts, branch, other):
        plant.run(world, END_MS)
        assert world.trace.digest() == whole.trace.digest()
