"""Workpieces that are held back on a belt that an axis moves to and fro, against every one of its pulses."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import ceil, sqrt

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.controller import SECOND
from steptwin.files.world import World

PULSES = 8
"""Per mm."""
V, A = 100.0, 400.0
"""mm/s, mm/s²."""
LENGTH, WORKPIECE, SENSOR, STOPS = 400, 40, 280, (100, 300)
TEXT = f"""
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = {PULSES}
acc = {A}
dec = {A}
vel = {V}
[[axis]]
name = "x"
drive = "a.M1"
[[conveyor]]
name = "belt"
length = {LENGTH}
axis = "x"
feed_every = "500 ms"
workpiece = {WORKPIECE}
[[conveyor.stop]]
at = {STOPS[0]}
hold = "a.OUT2"
[[conveyor.stop]]
at = {STOPS[1]}
hold = "a.OUT3"
[[conveyor.sensor]]
at = {SENSOR}
to = "a.IN1"
"""
EVERY = 4.0
"""Seconds from one motion to the next."""


def pulses(moves: list[int]) -> Iterator[tuple[int, int]]:
    """Moment (ns) and direction of each pulse of symmetric trapezoids from one target (mm) to the next."""
    for n, (begin, end) in enumerate(pairwise([0, *moves])):
        way = abs(end - begin)
        ramp = min(V * V / (2 * A), way / 2)
        top = sqrt(2 * A * ramp)
        for k in range(1, way * PULSES + 1):
            x = k / PULSES
            whole = 2 * top / A + (way - 2 * ramp) / V
            t = sqrt(2 * x / A) if x <= ramp else top / A + (x - ramp) / V
            if x > way - ramp:
                t = whole - sqrt(max(2 * (way - x) / A, 0.0))
            yield ceil((n * EVERY + t) * SECOND), 1 if end > begin else -1


class Integrated:
    """The belt, pulse by pulse. Places in pulses."""

    def __init__(self) -> None:
        self.fronts: list[int] = []
        """Of the first one first."""
        self.stops = [False, False]
        self.edges: list[tuple[int, bool]] = []
        self.delivered = 0

    def look(self, now: int) -> None:
        self.fronts, before = [one for one in self.fronts if 0 <= one < LENGTH * PULSES], self.fronts
        self.delivered += sum(one >= LENGTH * PULSES for one in before)
        seen = any(SENSOR * PULSES <= one <= (SENSOR + WORKPIECE) * PULSES for one in self.fronts)
        if seen is not bool(self.edges and self.edges[-1][1]):
            self.edges.append((now, seen))

    def feed(self, now: int) -> None:
        if all(one > WORKPIECE * PULSES for one in self.fronts):
            self.fronts.append(0)
            self.look(now)

    def pulse(self, now: int, way: int) -> None:
        moved: list[int] = []
        for front in self.fronts:
            held = any(on and front == place * PULSES for on, place in zip(self.stops, STOPS, strict=True))
            held |= bool(moved) and front + 1 >= moved[-1] - WORKPIECE * PULSES
            moved.append(front + way if way < 0 or not held else front)
        self.fronts = moved
        self.look(now)


def integrated(moves: list[int], changes: list[tuple[int, int]], end: int) -> Integrated:
    belt = Integrated()
    happens = [(at, 1, way) for at, way in pulses(moves)]
    happens += [(at * SECOND // 1_000_000, 0, 2 + stop) for at, stop in changes]
    happens += [(n * SECOND // 2, 2, 0) for n in range(1, 2 * end + 1)]
    for now, _, what in sorted(happens):
        if now > end * SECOND:
            break
        if what == 0:
            belt.feed(now)
        elif what >= 2:
            belt.stops[what - 2] = not belt.stops[what - 2]
        else:
            belt.pulse(now, what)
    return belt


def twin(moves: list[int], changes: list[tuple[int, int]]) -> World:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    for n, target in enumerate(moves):
        world.at(n * EVERY, lambda target=target: device.write("M1_POS_ABS", float(target)))  # type: ignore[misc]
    for at, stop in changes:
        output = f"OUT{stop + 2}"
        world.at(at / 1_000_000, lambda output=output: device.write(output, 1 - world.read(f"a.{output}")))  # type: ignore[misc]
    return world


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.integers(-100, 600), min_size=3, max_size=4, unique=True).filter(
        lambda moves: all(1 <= abs(b - a) <= 350 for a, b in pairwise([0, *moves]))
    ),
    st.lists(st.tuples(st.integers(1, 15), st.integers(0, 1)), max_size=6, unique=True),
)
@example([350, 250, 450, 330], [(0, 1)])
@example([150, 100, 160, 10], [(0, 0), (9, 0)])
@example([342, 541, 249], [(1, 1), (6, 1)])
def test_it_is_where_each_pulse_has_it(moves: list[int], moments: list[tuple[int, int]]) -> None:
    changes = sorted((997_000 * at + 3_300, stop) for at, stop in moments)  # µs, never at a pulse of constant speed, each 1250 µs
    end = round(len(moves) * EVERY)
    world, expected = twin(moves, changes), integrated(moves, changes, end)
    world.run(until=end)
    found = [(record.time, bool(record.value)) for record in world.trace.edges() if record.subject == "belt.sensor1"][1:]
    assert [level for _, level in found] == [level for _, level in expected.edges]
    assert all(abs(at - other) <= 2 for (at, _), (other, _) in zip(found, expected.edges, strict=True))
    assert world.read("belt.delivered") == expected.delivered
    fronts = [world.read(f"belt.place{n + 1}") for n in range(int(world.read("belt.count")))]
    assert sorted(fronts) == sorted(front / PULSES for front in expected.fronts)


def test_what_stands_goes_back_with_the_belt_and_stands_again() -> None:
    world = twin([350, 250, 450], [(0, 1)])
    world.run(until=12.0)
    mine = [str(one.value) for one in world.trace.of("event") if str(one.value).startswith("belt.1 ")]
    assert mine == [
        "belt.1 is on belt",
        "belt.1 stands at 300 mm of belt",
        "belt.1 goes back on belt",
        "belt.1 stands at 300 mm of belt",
    ]


SCRIPTED = (
    TEXT
    + """
[[script]]
name = "to_and_fro"
steps = [
    { write = { "a.M1_EN" = 1, "a.OUT3" = 1, "a.M1_POS_ABS" = 350.0 } }, { wait = "4 s" },
    { write = { "a.M1_POS_ABS" = 250.0 } }, { wait = "4 s" }, { write = { "a.M1_POS_ABS" = 450.0 } }, { wait = "2 s" },
    { write = { "a.OUT3" = 0 } },
]
"""
)


@pytest.mark.parametrize("moment_s", [3.4, 4.5, 5.5, 9.0])
def test_it_can_be_restored_anywhere(moment_s: float) -> None:
    found, other = (World.from_toml(SCRIPTED) for _ in range(2))
    found.run(until=moment_s)
    snapshot = found.snapshot()
    found.run(until=12.0)
    other.restore(snapshot)
    other.run(until=12.0)
    assert [str(one.value) for one in found.trace.of("event") if "goes back" in str(one.value)] != []
    assert other.trace.digest() == found.trace.digest()
