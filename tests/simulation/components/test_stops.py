"""Workpieces that are held back on a belt, against an integration in steps; marks on workpieces and their mass."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[[conveyor]]
name = "belt"
length = 400.0
speed = 125.0
run = "a.OUT1"
feed_every = "500 ms"
workpiece = 40.0
mass = 1.5
next = "out"
[[conveyor.stop]]
at = 100.0
hold = "a.OUT2"
[[conveyor.stop]]
at = 300.0
hold = "a.OUT3"
[[conveyor.sensor]]
at = 280.0
to = "a.IN1"
[[conveyor]]
name = "out"
length = 100.0
speed = 62.5
run = "a.OUT4"
"""


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels."""
    return [(record.time / MILLISECOND, record.value) for record in world.trace.edges() if record.subject == channel]


def happened(world: World, name: str) -> list[tuple[float, str]]:
    """What became of a workpiece, and when, ms."""
    return [
        (record.time / MILLISECOND, str(record.value).removeprefix(f"{name} "))
        for record in world.trace.of("event")
        if record.subject == "workpiece" and str(record.value).startswith(f"{name} ")
    ]


def test_a_stop_holds_a_queue_that_goes_on_together() -> None:
    world = World.from_toml(TEXT)
    for output in ("OUT1", "OUT3", "OUT4"):
        world.mic488["a"].write(output, 1)
    world.at(5.0, lambda: world.mic488["a"].write("OUT3", 0))
    world.run(until=10.0)
    # 300 mm at 125 mm/s from 0.5 s on; the second one, 62.5 mm behind, comes to the rear of the first at 260 mm.
    # The next belt moves it from 420 mm on.
    assert happened(world, "belt.1")[1:5] == [
        (2900, "stands at 300 mm of belt"),
        (5000, "goes on along belt"),
        (5960, "leaves belt"),
        (5960, "is on out"),
    ]
    assert happened(world, "belt.2")[1:3] == [(3080, "stands at 260 mm of belt"), (5000, "goes on along belt")]
    # The next conveyor is half as fast: the second one touches the first at once, at 380 mm, and waits for 20 mm of room. Then it
    # makes 40 mm while the first one makes 20.
    assert happened(world, "belt.2")[3:6] == [
        (pytest.approx(5960, abs=1e-5), "stands at 380 mm of belt"),
        (pytest.approx(6280, abs=1e-4), "goes on along belt"),
        (pytest.approx(6600, abs=1e-4), "leaves belt"),
    ]


def integrated(changes: list[tuple[int, int]], end: int) -> tuple[list[tuple[int, bool]], list[float], int]:
    """Edges of the sensor in ms, the fronts at the end in mm, and how many have left, in steps of 1/8 mm."""
    stops, edges, delivered, was_seen, waits = [False, False], [], 0, False, False  # type: ignore[var-annotated]
    fronts: list[float] = []
    out: list[float] = []
    for step in range(end + 1):
        for at, stop in changes:
            if at == step:
                stops[stop] = not stops[stop]
        if step and step % 500 == 0 and not any(front <= 40 for front in fronts):
            fronts.append(0)
        seen = any(280 <= front <= 320 for front in fronts)
        if seen is not was_seen:
            edges.append((step, seen))
            was_seen = seen
        rear = 400 + out[-1] - 40 if out else 1000.0
        moved: list[float] = []
        for front in fronts:
            blocked = any(on and front == place for on, place in zip(stops, (100, 300), strict=True))
            blocked |= bool(moved) and moved[-1] - front <= 40
            if not moved and not blocked:
                waits = front >= rear if not waits else rear < min(front + 20, 420)
                blocked = waits
            moved.append(front if blocked else front + 1 / 8)
        out = [front + 1 / 16 for front in out]
        fronts = moved
        if fronts and fronts[0] >= 420:
            fronts, delivered, out = fronts[1:], delivered + 1, [*out, 20.0]
    return edges, fronts, delivered


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 1)), max_size=6, unique=True))
@example([(1, 0), (4, 0)])
@example([(1, 1), (7, 1), (3, 0), (5, 0)])
def test_it_is_where_an_integration_has_it(moments: list[tuple[int, int]]) -> None:
    changes = [(997 * at + 3, stop) for at, stop in moments]
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("OUT1", 1)
    device.write("OUT4", 1)
    for at, stop in changes:
        output = f"OUT{stop + 2}"
        world.at(at / 1000, lambda output=output: device.write(output, 1 - world.read(f"a.{output}")))  # type: ignore[misc]
    world.run(until=9.9)
    expected, fronts, delivered = integrated(changes, 9900)
    found = edges(world, "belt.sensor1")[1:]
    assert [bool(level) for _, level in found] == [level for _, level in expected]
    assert [time for time, _ in found] == pytest.approx([time for time, _ in expected], abs=30)
    assert world.read("belt.delivered") == delivered
    places = [world.read(f"belt.place{n + 1}") for n in range(len(fronts))]
    assert places == pytest.approx(fronts, abs=3)
    assert all(one - other >= 40 for one, other in pairwise(places))


def test_the_mass_is_that_of_all_on_it() -> None:
    world = World.from_toml(TEXT.replace('feed_every = "500 ms"\n', 'feed_every = "500 ms"\nmarks = [5]\n'))
    world.mic488["a"].write("OUT1", 1)
    world.run(until=1.6)
    assert world.read("belt.mass") == 4.5


MARKS = """
[[mic488]]
name = "a"
[[conveyor]]
name = "belt"
length = 200.0
speed = 100.0
run = "a.OUT1"
feed_every = "1 s"
workpiece = 60.0
marks = [10, 40]
mark_width = 5
next = "second"
[[conveyor.sensor]]
at = 100.0
sees = "mark"
to = "a.IN1"
[[conveyor]]
name = "second"
length = 200.0
speed = 50.0
run = "a.OUT1"
[[conveyor.sensor]]
at = 20.0
sees = "mark"
to = "a.IN2"
"""


def test_a_sensor_sees_the_marks_on_both_belts() -> None:
    world = World.from_toml(MARKS)
    world.mic488["a"].write("OUT1", 1)
    world.run(until=4.9)
    # The mark from 10 to 15 mm behind the front is at 100 mm when the front is at 110 to 115 mm: 1.1 s after it came at 1 s.
    first = [time for time, _ in edges(world, "belt.sensor1")[1:5]]
    assert first == pytest.approx([2100, 2150, 2400, 2450], abs=2e-6)
    # Its centre comes to the second belt, with the front at 30 mm, at 3.3 s.
    second = [time for time, _ in edges(world, "second.sensor1")[1:5]]
    assert second == pytest.approx([3300, 3400, 3900, 4000], abs=2e-5)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("at = 100.0\nhold", "at = 500.0\nhold", "at = 500 is beyond length = 400"),
        ('hold = "a.OUT2"', 'hold = "a.IN2"', "a.IN2 is not an output"),
        ('hold = "a.OUT2"', 'holt = "a.OUT2"', r"\[conveyor.stop\] has no 'holt' \(did you mean 'hold'\?\)"),
        ("mass = 1.5", "marks = [39]", "a mark from 39 to 41 mm is beyond workpiece = 40"),
        ("mass = 1.5", "marks = 39", "marks: 39: expected a list of numbers, mm from the front"),
        ("at = 280.0", 'at = 280.0\nsees = "marks"', r"sees: 'marks' \(did you mean 'mark'\?\): permitted are workpiece, mark"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(TEXT.replace(old, new, 1))


@pytest.mark.parametrize("moment_s", [2.899, 2.9, 3.0, 5.0, 6.2])
def test_snapshots_have_what_stands(moment_s: float) -> None:
    def go_on(world: World) -> str:
        world.at(5.0, lambda: world.mic488["a"].write("OUT3", 0)) if world.now < 5e9 else None
        world.run(until=9.0)
        return world.trace.digest()

    world = World.from_toml(TEXT)
    for output in ("OUT1", "OUT3", "OUT4"):
        world.mic488["a"].write(output, 1)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    digest = go_on(world)
    other = World.from_toml(TEXT)
    other.restore(snapshot)
    assert go_on(other) == digest
