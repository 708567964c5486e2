"""Speed, torque, reserve, force and power of axes, against differences of positions and the curve of the motor."""

from __future__ import annotations

from itertools import islice, pairwise
from math import pi
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import check_it_can_be_restored

from steptwin.campaign.properties import read_property
from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

np = pytest.importorskip("numpy")
TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 500.0
vel = 90.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
{axis}
[axis.motor]
torque = [[0, 1.0], [600, 0.8], [1500, 0.3]]
inertia = 0.00005
load = 0.2
friction = 0.05
{motor}
"""
CURVE = ((0.0, 600.0, 1500.0), (1.0, 0.8, 0.3))
PER_MM = 2 * pi / 5
"""Radians of the motor."""
NAMES = ("speed", "torque", "reserve", "force")


def world(motor: str = "", axis: str = "", more: str = "") -> World:
    found = World.from_toml(TEXT.format(axis=axis, motor=motor) + more, name="w.toml")
    found.mic488["c"].write("M1_EN", 1)
    return found


def go(found: World, to: float = 40.0) -> World:
    found.mic488["c"].write("M1_POS_ABS", to)
    return found


def read(found: World, *names: str) -> list[float]:
    return [found.read(f"x.{name}") for name in names or NAMES]


def speed_at(t: float, to: float = 40.0) -> float:
    """mm/s of a move to 40 mm."""
    down = 90 / 500
    cruise = (to - 90 * 90 / 1800 - 90 * down / 2) / 90
    if t < 0.1:
        return 900 * t
    return 90.0 if t < 0.1 + cruise else max(90 - 500 * (t - 0.1 - cruise), 0.0)


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 700))
def test_they_are_those_of_a_difference_of_positions(at_ms: int) -> None:
    found, t = go(world()), at_ms / 1000
    found.run(until=t)
    speed, rate = speed_at(t), (speed_at(t + 1e-6) - speed_at(t)) / 1e-6
    moves = speed > 0
    torque = 5e-5 * rate * PER_MM + (0.25 if moves else 0.15)
    has = float(np.interp(speed / 5 * 60, *CURVE))
    assert read(found) == [pytest.approx(one, abs=1e-5) for one in (speed, torque, has - abs(torque), torque * PER_MM * 1000)]
    before, step = found.axis["x"].position, 0.002
    found.run(for_=step)
    if moves:
        assert (found.axis["x"].position - before) / step == pytest.approx((speed + speed_at(t + step)) / 2, abs=1.0)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 300), st.sampled_from(["", 'when_off = "free"\nhold_current = 0.4\nhold_delay = "50 ms"']), st.booleans())
def test_between_turning_points_each_goes_one_way(at_ms: int, motor: str, stalls: bool) -> None:
    found = go(world(motor + ("\nstart_speed = 10" if stalls else "")), 40.0)
    found.run(until=at_ms / 1000)
    for name in NAMES:
        signal = found.objects.element_signals("x")[name]  # type: ignore[index]
        turns = [found.now, *islice(signal.turning_points(found.now), 30), found.now + SECOND]
        frozen = signal.freeze(found.now)  # type: ignore[misc]
        for begin, end in pairwise(turns):
            if end - begin > 2:
                values = [frozen(begin + (end - begin) * n // 40) for n in range(41)]
                steps = np.diff(values)
                assert np.all(steps >= -1e-9) or np.all(steps <= 1e-9), (name, begin, end)


def test_without_mean_torque_there_is_none() -> None:
    found = go(world(axis='power = "c.OUT1"'))
    found.run(until=0.3)
    assert [*read(found), found.read("x.power"), found.read("x.position")] == [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    found.mic488["c"].write("OUT1", 1)
    found.run(until=1.0)
    assert read(found, "speed", "torque", "reserve", "power") == [0.0, pytest.approx(0.15), pytest.approx(0.85), 1.0]
    found.mic488["c"].write("M1_EN", 0)
    assert read(found, "torque", "reserve", "power") == [0.0, 0.0, 0.0]


def test_a_rotor_that_has_lost_its_field_takes_none() -> None:
    found = go(world("start_speed = 300", more='[[load]]\nname = "l"\naxis = "x"\nload = 0.6\nwhen = "c.OUT1"\n'))
    found.run(until=0.15)
    assert read(found, "torque", "stalled") == [pytest.approx(0.25), 0.0]
    found.mic488["c"].write("OUT1", 1)
    found.run(until=0.2)
    assert read(found, "speed", "torque", "reserve", "stalled") == [0.0, 0.0, 0.0, 1.0]
    found.run(until="idle")
    found.run(for_=0.1)
    assert read(found, "torque", "reserve") == [pytest.approx(0.75), pytest.approx(0.25)]


def test_a_rotor_at_its_stop_takes_none() -> None:
    found = go(world(axis="travel = [-5, 20]"))
    found.run(until=0.35)
    assert read(found, "speed", "torque", "reserve", "power") == [0.0, 0.0, 0.0, 1.0]


def test_what_falls_has_its_speed() -> None:
    found = world('when_off = "free"')
    found.run(until=0.1)
    found.mic488["c"].write("M1_EN", 0)
    found.run(until=0.11)
    speed, torque, reserve, _ = read(found)
    assert speed == pytest.approx(-0.15 / 5e-5 * 0.01 / PER_MM)
    assert (torque, reserve) == (0.0, 0.0)


def test_the_reduced_current_of_rest_leaves_less() -> None:
    found = go(world('when_off = "free"\nhold_current = 0.4\nhold_delay = "50 ms"'))
    found.run(until="idle")
    found.run(for_=0.0499)
    assert found.read("x.reserve") == pytest.approx(0.85)
    found.run(for_=0.001)
    assert found.read("x.reserve") == pytest.approx(0.25)
    found.mic488["c"].write("M1_POS_ABS", 0.0)
    found.run(for_=0.001)
    assert found.read("x.reserve") > 0.5


def test_conditions_have_their_exact_moments() -> None:
    found = go(world())
    found.run(until="x.reserve < 0.55")
    # 0.9 N·m at 300 rev/min, 25 mm/s, less the torque of the ramp.
    torque = 5e-5 * 900 * PER_MM + 0.25
    rpm = (1.0 - torque - 0.55) / (0.2 / 600)
    assert found.now == pytest.approx(rpm / 60 * 5 / 900 * SECOND, abs=2)
    found.run(until="x.torque < 0.3")
    assert found.now == SECOND // 10
    found.run(until="x.speed < 45 and x.force > 0")
    assert found.now == pytest.approx((0.1 + (40 - 4.5 - 8.1) / 90 + 0.09) * SECOND, abs=2)


def test_transducers_and_properties_take_them(tmp_path: Path) -> None:
    text = TEXT.format(axis="", motor="")
    text += '[[transducer]]\nname = "t"\nof = "x.torque"\nto = "c.AIN1"\npoints = [[0, 0], [1, 10]]\n'
    text += '[[script]]\nname = "s"\nsteps = [{ write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = 20.0 } }]\n'
    found = World.from_toml(text)
    reserve, moves = (read_property(one).watch(found) for one in ("never x.reserve < 0.4", "never x.speed > 90"))
    found.run(until=0.05)
    assert found.read("t.volts") == pytest.approx(3.07, abs=0.006)
    found.run(until=0.15)
    assert found.read("t.volts") == pytest.approx(2.5, abs=0.006)
    assert moves.verdict().holds
    # 90 mm/s are 1080 rev/min, with the torque of the ramp until then.
    least = float(np.interp(1080, *CURVE)) - (5e-5 * 900 * PER_MM + 0.25)
    assert not reserve.verdict().holds
    assert reserve.verdict().robustness == pytest.approx((least - 0.4) / max(CURVE[1]), abs=1e-4)
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), 0.07, 1.0, tmp_path)


def test_the_torque_at_a_rotary_load_is_that_behind_its_gear() -> None:
    found = World.from_toml(
        TEXT.format(axis='kind = "rotary"\nunit = "degree"', motor="").replace("pitch = 5.0", "pulses_per_unit = 80.0")
    )
    found.mic488["c"].write("M1_EN", 1)
    assert read(found, "torque", "force") == [pytest.approx(0.15), pytest.approx(0.15 * 9)]
    assert found.objects.element_signals("x")["force"].unit == "N·m"  # type: ignore[index]


def test_what_it_has_not_says_why() -> None:
    found = World.from_toml(TEXT.format(axis="", motor="").partition("[axis.motor]")[0])
    for name in ("torque", "reserve", "force"):
        with pytest.raises(Misuse, match=f"^no signal 'x.{name}': axis 'x' has no \\[axis.motor\\]$"):
            found.read(f"x.{name}")
    assert found.read("x.speed") == 0.0
    imp = TEXT.format(axis="", motor="").replace("pitch = 5.0", "pulses_per_unit = 2\nunit = 'step'")
    found = World.from_toml(imp)
    with pytest.raises(Misuse, match=r"no signal 'x.force': 'x' counts in step: what is on it needs its mm_per_unit"):
        found.read("x.force")
    assert found.read("x.torque") == 0.0
    with pytest.raises(WorldError, match=r"no signal 'x\.force'"):
        World.from_toml(imp + "[[collision]]\nname = 'k'\nwhen = 'x.force > 3'\n")


def test_the_force_of_an_axis_in_other_units_needs_their_length() -> None:
    found = World.from_toml(TEXT.format(axis="", motor="").replace("pitch = 5.0", "pulses_per_unit = 6400\nunit = 'cm'"))
    found.mic488["c"].write("M1_EN", 1)
    assert found.read("x.force") == pytest.approx(0.15 * PER_MM * 1000)
