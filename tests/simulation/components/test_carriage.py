"""Carriages on elastic belts: what their switches see, against an integration of the differential equation."""

from __future__ import annotations

from itertools import pairwise
from math import pi
from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 1000.0
dec = 1000.0
vel = 80.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "a.M1"
pitch = 5.0
{axis}
[[carriage]]
name = "tool"
axis = "x"
frequency = 10.0
damping = 0.1
[[carriage.switch]]
above = 20.05
to = "a.IN3"
{more}
"""


def world(more: str = "", axis: str = "", **overrides: object) -> World:
    return World.from_toml(TEXT.format(more=more, axis=axis), name="w.toml", overrides=overrides)


def start(found: World, to: float = 20.0) -> None:
    found.mic488["a"].write("M1_EN", 1)
    found.mic488["a"].write("M1_POS_ABS", to)


def drive(t: float) -> tuple[float, float]:
    """20 mm at 80 mm/s with 1000 mm/s²: ramps of 0.08 s, 3.2 mm; 0.17 s between them."""
    if t < 0.08:
        return 500 * t * t, 1000 * t
    if t < 0.25:
        return 3.2 + 80 * (t - 0.08), 80.0
    if t < 0.33:
        return 20 - 500 * (0.33 - t) ** 2, 1000 * (0.33 - t)
    return 20.0, 0.0


def integrated(end_s: float, frequency: float = 10.0, x: float = 0.0, v: float = 0.0) -> list[tuple[float, float]]:
    """(time, position) of the carriage every 10 us, by Runge and Kutta."""
    w, z, h = 2 * pi * frequency, 0.1, 1e-5

    def rate(t: float, x: float, v: float) -> tuple[float, float]:
        u, du = drive(t)
        return v, w * w * (u - x) + 2 * z * w * (du - v)

    found = []
    for n in range(round(end_s / h)):
        t = n * h
        found.append((t, x))
        a = rate(t, x, v)
        b = rate(t + h / 2, x + h / 2 * a[0], v + h / 2 * a[1])
        c = rate(t + h / 2, x + h / 2 * b[0], v + h / 2 * b[1])
        d = rate(t + h, x + h * c[0], v + h * c[1])
        x += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    return found


def edges(found: World, subject: str) -> list[tuple[float, object]]:
    return [(record.time / SECOND, record.value) for record in found.trace.of("edge") if record.subject == subject]


def test_it_is_where_the_differential_equation_says() -> None:
    found = world()
    start(found)
    way = integrated(0.6)
    for t, x in way[5000::5000]:
        found.run(until=t)
        assert found.read("tool.position") == pytest.approx(x, abs=1e-4)
        assert found.read("tool.deflection") == pytest.approx(x - drive(t)[0], abs=2e-4)


@pytest.mark.parametrize("sign", [1, -1])
def test_its_switch_sees_it_swing(sign: int) -> None:
    """The axis never comes to 20.05 mm."""
    zone = "" if sign > 0 else '[[carriage.switch]]\nbelow = -20.05\nto = "a.IN4"'
    found = world(zone)
    start(found, 20.0 * sign)
    found.run(for_=2.0)
    way = integrated(2.0)
    half = 0.5 / 640  # the whole pulse nearest to it
    passed = [b[0] for a, b in pairwise(way) if (a[1] >= 20.05 - half) is not (b[1] >= 20.05 - half)]
    assert len(passed) >= 4
    first, *rest = edges(found, "tool.switch1" if sign > 0 else "tool.switch2")
    assert first == (0.0, 0.0)
    assert [moment for moment, _ in rest] == pytest.approx(passed, abs=2.1e-5)
    assert [level for _, level in rest] == [1.0, 0.0] * (len(rest) // 2)


def test_conditions_see_it_in_the_first_nanosecond() -> None:
    found = world()
    start(found)
    found.run(until="tool.position > 20.25", for_=2)
    after = found.now
    assert found.read("tool.position") > 20.25
    again = world()
    start(again)
    again.run(until=(after - 1) / SECOND)
    assert again.now == after - 1
    assert again.read("tool.position") <= 20.25
    found.run(until="tool.settled", for_=5)
    swing = max(abs(x - 20.0) for t, x in integrated(found.time) if t > found.time - 0.1)
    assert swing < 2 / 1024 / 640
    assert found.read("tool.position") == 20.0


def test_a_stop_on_the_way_and_power_off_go_on_from_where_it_is() -> None:
    found = world()
    start(found)
    found.run(for_=0.2)
    place = found.read("tool.position")
    found.mic488["a"].write("M1_STOP", 1)
    assert found.read("tool.position") == pytest.approx(place, abs=1e-6)
    found.run(until="tool.settled", for_=5)
    assert found.read("tool.position") == found.axis["x"].position


def test_it_follows_the_load_behind_backlash_and_stops() -> None:
    found = world(axis="travel = [-1.0, 15.0]\nbacklash = 0.5")
    start(found)
    found.run(until="tool.settled and time > 1", for_=9)
    assert found.read("tool.position") == found.axis["x"].position == 15.0
    found.mic488["a"].axis[1].move_to(3.0)
    found.run(for_=9)
    assert found.read("tool.position") == pytest.approx(found.axis["x"].position, abs=1e-9)


def test_a_slack_belt_swings_slower() -> None:
    found = world()
    found.fault("slack-belt element=tool share=0.3")
    start(found)
    for t, x in integrated(0.5, frequency=3.0)[9000::9000]:
        found.run(until=t)
        assert found.read("tool.position") == pytest.approx(x, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("frequency = 10.0", "frequncy = 10.0"), r"\[carriage\] has no 'frequncy' \(did you mean 'frequency'\?\)"),
        (("frequency = 10.0", "frequency = 0"), "permitted are numbers from 0.1 to 10000"),
        (("damping = 0.1", "damping = 1"), "permitted are numbers from 0.001 to 0.99"),
        (('axis = "x"', 'axis = "y"'), "no axis is called 'y'"),
        (("above = 20.05", "abov = 20.05"), r"has no 'abov' \(did you mean 'above'\?\)"),
        (('to = "a.IN3"', 'to = "a.IN33"'), "IN33"),
        (
            ('to = "a.IN3"', 'to = "a.IN3"\n[[event]]\nwhen = "tool.deflection > 1"\nsteps = []'),
            r"write tool\.position - x\.position",
        ),
    ],
)
def test_mistakes_have_their_places(change: tuple[str, str], message: str) -> None:
    text = TEXT.format(more="", axis="")
    assert change[0] in text
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{message}"):
        World.from_toml(text.replace(*change), name="w.toml")


@pytest.mark.parametrize("moment_s", [0.0, 0.05, 0.2, 0.34, 0.6, 3.0])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    found, other = world(), world()
    start(found)
    found.fault("slack-belt element=tool share=0.6 from_s=0.3 until_s=0.5")
    check_it_can_be_restored(found, other, moment_s, 4.0, tmp_path)
    assert len(edges(found, "tool.switch1")) > 4


def test_collisions_and_sensors_can_be_of_a_carriage() -> None:
    """The axis never comes to 20.05 mm."""
    found = world(
        '[[collision]]\nname = "frame"\nwhen = "tool.position > 20.05"\n'
        '[[transducer]]\nname = "gauge"\nof = "tool.position"\nto = "a.AIN1"\npoints = [[0, 0], [30, 3]]\n'
    )
    start(found)
    found.run(until=2.0)
    touched = [record.time / SECOND for record in found.trace.of("event") if record.subject == "collision"]
    assert touched[0] == pytest.approx(next(t for t, x in integrated(1.0) if x > 20.05), abs=2.1e-5)
    assert found.read("a.AIN1") == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_collision_of_a_carriage_jams_its_axis(direction: int) -> None:
    sign = ">" if direction > 0 else "<"
    found = world(f'[[collision]]\nname = "frame"\nwhen = "tool.position {sign} {10 * direction}"\neffect = "jam"\n')
    start(found, 20.0 * direction)
    found.run(until=2.0)
    touched = next(t for t, x in integrated(1.0) if x > 10.0)
    assert found.axis["x"].position * direction == pytest.approx(drive(touched)[0], abs=2 / 640)
    assert found.read("x.lost") != 0


def test_the_moments_at_which_it_may_settle_are_after_the_present_one() -> None:
    found = world()
    start(found)
    found.run(until=0.1)
    settled = found.signal("tool.settled")
    settled.sync(found.now)
    moments = sorted(settled.turning_points(found.now))
    assert moments
    assert moments[0] > found.now
    for n, moment in enumerate(moments):
        assert sorted(settled.turning_points(moment - 1)) == moments[n:]
        assert sorted(settled.turning_points(moment)) == moments[n + 1 :]
    found.advance(moments[-1] - 1)
    settled.sync(found.now)
    assert settled.value(found.now) == 0.0
    found.advance(moments[-1])
    settled.sync(found.now)
    assert settled.value(found.now) == 1.0


def test_a_stiff_belt_is_settled_while_its_axis_stands() -> None:
    """At 10 kHz it lags by less than what counts as swinging, in ramps and between them."""
    found = world(**{"carriage.tool.frequency": 10_000.0})
    settled = found.signal("tool.settled")
    start(found)

    def at(t: float) -> float:
        found.run(until=t)
        settled.sync(found.now)
        return settled.value(found.now)

    assert [at(t) for t in (0.0, 0.04, 0.08, 0.1, 0.25, 0.3, 0.34)] == [0.0] * 6 + [1.0]
    assert found.read("tool.position") == 20.0


@pytest.mark.parametrize("place", [0.0, 12.5])
def test_it_stands_where_its_axis_does_at_the_beginning(place: float) -> None:
    found = world(axis=f"start = {place}")
    assert [found.read(f"tool.{name}") for name in ("position", "deflection", "settled")] == [place, 0.0, 1.0]
    found.run(for_=1.0)
    assert found.read("tool.position") == place
