"""Tools that two axes move together, against trapezoids that are calculated here, sampled and halved."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise, product
from math import sqrt
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from world_rig import check_it_can_be_restored

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import axis_views, write_trace
from steptwin.files.export.tracetracks import sort_out
from steptwin.files.world import World
from steptwin.motion.divisions import profile_of
from steptwin.simulation.components.coordinate import rests
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "mm"
gear = 320.0
acc = 900.0
dec = 700.0
vel = 90.0
[mic488.M2]
unit = "mm"
gear = 400.0
acc = 500.0
dec = 800.0
vel = 60.0
[[axis]]
name = "a"
drive = "c.M1"
[[axis]]
name = "b"
drive = "c.M2"
start = 10
[[tool]]
name = "head"
axis = "a"
other = "b"
x_travel = [-20, 120]
y_travel = [-60, 60]
[[tool.x_switch]]
above = 40
to = "c.IN1"
[[tool.y_switch]]
position = 8
width = 4
to = "c.IN2"
hysteresis = 0.5
"""
SCRIPT = """
[[script]]
name = "go"
steps = [
    {{ write = {{ "c.M1_EN" = 1, "c.M2_EN" = 1, "c.M1_POS_ABS" = {a} }} }}, {{ wait = "{later} ms" }},
    {{ write = {{ "c.M2_POS_ABS" = {b} }} }},
]
"""
OF_A, OF_B = (900.0, 700.0, 90.0), (500.0, 800.0, 60.0)
"""Acceleration, deceleration, velocity."""


def trapezoid(way: float, begin: float, acc: float, dec: float, vel: float) -> Callable[[float], float]:
    """Position at a moment, s."""
    length, sign = abs(way), 1.0 if way > 0.0 else -1.0
    top = min(vel, sqrt(2.0 * length * acc * dec / (acc + dec)))
    up, down = top / acc, top / dec
    cruise = (length - top * (up + down) / 2.0) / top if top else 0.0

    def at(now: float) -> float:
        t = now - begin
        if t <= 0.0:
            return 0.0
        if t <= up:
            return sign * acc * t * t / 2.0
        if t <= up + cruise:
            return sign * (top * up / 2.0 + top * (t - up))
        rest = max(up + cruise + down - t, 0.0)
        return sign * (length - dec * rest * rest / 2.0)

    return at


def crossings(of: Callable[[float], float], level: float, end: float) -> list[tuple[float, int]]:
    """Moments and directions, from samples every 2 ms that are halved."""
    found = []
    samples = [(n / 500, of(n / 500) >= level) for n in range(round(end * 500) + 1)]
    for (begin, before), (last, after) in pairwise(samples):
        if before is not after:
            low, high = begin, last
            while high - low > 1e-12:
                middle = (low + high) / 2.0
                low, high = (middle, high) if (of(middle) >= level) is before else (low, middle)
            found.append((high, 1 if after else -1))
    return found


def switched(of: Callable[[float], float], on: tuple[float, float], more: float, end: float) -> list[tuple[float, bool]]:
    """When a switch that is on between two places, and stays on ``more`` further, changes."""
    moments = sorted(
        (at, level, way) for level in (on[0], on[1], on[0] - more, on[1] + more) for at, way in crossings(of, level, end)
    )
    is_on, found = on[0] <= of(0.0) <= on[1], []
    for at, level, way in moments:
        goes_in = (level == on[0] and way > 0) or (level == on[1] and way < 0)
        goes_out = (level == on[0] - more and way < 0) or (level == on[1] + more and way > 0)
        if (goes_in and not is_on) or (goes_out and is_on):
            is_on = not is_on
            found.append((at, is_on))
    return found


WAYS = st.floats(-80, 120).filter(lambda way: abs(way) > 1)
NOTE = """
[[event]]
when = "head.y > 8.7"
steps = [{ note = "there" }]
"""


@settings(max_examples=15, deadline=None)
@given(WAYS, WAYS, st.integers(0, 900))
@example(100.0, 80.0, 200)
@example(100.0, -100.0, 0)
def test_switches_and_conditions_are_where_an_integration_has_them(a: float, b: float, later: int) -> None:
    a, b = round(a * 320) / 320, round(b * 400) / 400  # whole pulses
    world = World.from_toml(TEXT + SCRIPT.format(a=a, b=b, later=later) + NOTE)
    one, other = trapezoid(a, 0.0, *OF_A), trapezoid(b, later / 1000, *OF_B)
    world.run(until=6.0)

    def x(t: float) -> float:
        return (one(t) + other(t) + 10.0) / 2.0

    def y(t: float) -> float:
        return (one(t) - other(t) - 10.0) / 2.0

    def edges(channel: str) -> list[tuple[float, bool]]:
        return [(one.time / SECOND, bool(one.value)) for one in world.trace.edges() if one.subject == channel][1:]

    for channel, expected in (
        ("head.x_switch1", switched(x, (40.0 - 5e-7, 1e9), 0.0, 6.0)),
        ("head.y_switch1", switched(y, (6.0 - 5e-7, 10.0 + 5e-7), 0.5, 6.0)),
    ):
        found = edges(channel)
        assert [level for _, level in found] == [level for _, level in expected]
        # At 1 mm/s a nanometre takes 1 µs; at a turn it takes longer.
        assert [at for at, _ in found] == pytest.approx([at for at, _ in expected], abs=2e-5)
    noted = [one.time / SECOND for one in world.trace.of("event") if "there" in str(one.value)]
    assert noted == pytest.approx([at for at, way in crossings(y, 8.7, 6.0) if way > 0], abs=2e-5)
    assert world.read("head.x") == pytest.approx((a + b + 10.0) / 2.0, abs=1e-9)


def test_the_middle_of_a_switch_of_a_quick_tool_is_exact() -> None:
    """45 mm/s where nothing accelerates: a nanometre would take 22 ns."""
    world = World.from_toml(TEXT + SCRIPT.format(a=100.0, b=10.0, later=0).replace('"c.M2_POS_ABS" = 10.0', '"c.M2_EN" = 1'))
    world.run(until=3.0)
    # x = (a + 10) / 2 is 40 mm when a is 70 mm: 4.5 mm after 0.1 s, then 90 mm/s.
    (edge,) = [one.time for one in world.trace.edges() if one.subject == "head.x_switch1" and one.value]
    assert edge == pytest.approx((0.1 + (70.0 - 4.5) / 90.0) * SECOND, abs=2)


def test_a_belt_that_slips_stands_and_goes_on_behind() -> None:
    world = World.from_toml(TEXT + SCRIPT.format(a=100.0, b=10.0, later=0))
    world.fault("slipping-belt element=head from_s=0.6 until_s=0.7")
    world.run(until=3.0)
    # At 0.6 s a is at 4.5 + 0.5 · 90 = 49.5 mm; in 0.1 s it turns 9 mm: 4.5 of x and y. b stands at 20 mm.
    behind = [str(one.value) for one in world.trace.of("fault") if "grips" in str(one.value)]
    assert behind == ["the belt of axis of head grips, 9 mm behind"]
    assert world.read("head.x") == pytest.approx((100.0 - 9.0 + 20.0) / 2.0, abs=1e-9)
    assert world.read("head.y") == pytest.approx((100.0 - 9.0 - 20.0) / 2.0, abs=1e-9)
    assert [one.value for one in world.trace.edges() if one.subject == "head.axis.slips"] == [1.0, 0.0]


def test_it_has_channels_in_exports_that_are_where_it_is(tmp_path: object) -> None:
    world = World.from_toml(TEXT + SCRIPT.format(a=100.0, b=80.0, later=200))
    world.fault("slipping-belt element=head belt=other from_s=0.9 until_s=1.1")
    read: dict[int, tuple[float, float]] = {}
    for ms in range(0, 3000, 25):
        world.run(until=ms / 1000)
        read[ms] = world.read("head.x"), world.read("head.y")
    recording = sort_out(world.trace, axis_views(world), until=3 * SECOND)
    tracks = {track.view.name: track for track in recording.moved}
    assert sorted(tracks) == ["head x", "head y"]
    for ms, places in read.items():
        for name, place in zip(("head x", "head y"), places, strict=True):
            track = tracks[name]
            plan = track.plans[max(bisect_right(track.times, ms * MILLISECOND) - 1, 0)]
            assert profile_of(plan).position(ms * MILLISECOND) == pytest.approx(place, abs=0.001)
    target = Path(f"{tmp_path}/t.csv")
    write_trace(world.trace, target, views=axis_views(world))
    assert "head_x" in target.read_text(encoding="utf-8").splitlines()[0]


def test_it_hits_its_frame() -> None:
    """Both axes stand from the first nanosecond beyond."""
    world = World.from_toml(
        TEXT + SCRIPT.format(a=100.0, b=80.0, later=0) + '[[collision]]\nname = "frame"\nwhen = "head.x > 60"\neffect = "jam"\n'
    )
    world.run(until=5.0)
    # They stand at whole pulses, of which 320 and 400 are a millimetre.
    assert world.read("head.x") == pytest.approx(60.0, abs=1 / 640 + 1 / 800)
    assert world.read("frame.hit") == 1
    assert (world.read("a.lost") > 0, world.read("b.lost") > 0) == (True, True)


@pytest.mark.parametrize("moment_s", [0.0, 0.3, 0.65, 0.9, 1.5])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    found, other = (World.from_toml(TEXT + SCRIPT.format(a=100.0, b=-30.0, later=100)) for _ in range(2))
    found.fault("slipping-belt element=head from_s=0.6 until_s=0.7")
    check_it_can_be_restored(found, other, moment_s, 3.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('other = "b"', 'other = "a"', "other = 'a' is its axis already: a tool has two"),
        ('other = "b"', 'other = "bb"', r"nothing is called 'bb'|no axis is called 'bb'"),
        ('other = "b"', 'other = "b"\nx = [1, 1]\ny = [2, 2]', r"y = \[2.0, 2.0\] is a multiple of x = \[1.0, 1.0\]"),
        ('other = "b"', 'other = "b"\nx = [0, 0]', r"x: \[0, 0\]: one of the shares is not 0"),
        ('other = "b"', 'other = "b"\nx = 1', r"x: 1: expected \[share of axis, share of other\]"),
        ('other = "b"', 'othr = "b"', r"\[tool\] has no 'othr' \(did you mean 'other'\?\)"),
        ("above = 40", "abve = 40", r"\[tool.x_switch\] has no 'abve' \(did you mean 'above'\?\)"),
        ('name = "b"\ndrive = "c.M2"', 'name = "b"\ndrive = "c.M2"\nunit = "rev"\npitch = 1', "a tool has one unit"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{text}"):
        World.from_toml(TEXT.replace(old, new, 1), name="w.toml")


@pytest.mark.parametrize(("v", "a", "j"), [*product((-3.0, -1.0, 0.0, 0.5, 1.0), repeat=3)])
def test_when_a_velocity_of_constant_jerk_is_0(v: float, a: float, j: float) -> None:
    """By the formula of the quadratic equation."""
    if j == 0.0:
        expected = [] if a == 0.0 else [-v / a]
    elif a * a < 2.0 * j * v:
        expected = []
    else:
        expected = sorted((-a + sign * sqrt(a * a - 2.0 * j * v)) / j for sign in (1, -1))
    assert rests(v, a, j) == pytest.approx([root for root in expected if root > 0.0])
