"""Rotors that have lost their field and may move: they fall, and are caught, against an integration by SciPy of

J·θ″ = −T(field)·sin(50·(θ − field)) − friction·sign(θ′) − load.
"""

from __future__ import annotations

from math import asin
from pathlib import Path

import pytest
from free_rotors import coasted, in_field, turns
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World

TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 900.0
vel = 90.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0], [600, 0.8], [1200, 0.2]]
inertia = 0.00005
load = {load}
friction = {friction}
when_off = "{when_off}"
[[script]]
name = "s"
steps = [{{ write = {{ "c.M1_EN" = 1 }} }}, {{ wait = "100 ms" }}, {{ write = {{ "c.M1_POS_ABS" = {to} }} }}]
"""
INERTIA = 5e-5
BEGINS = 0.1


def world(load: float = 0.4, friction: float = 0.05, to: float = 20.0, when_off: str = "free", more: str = "") -> World:
    text = TEXT.format(load=load, friction=friction, to=to, when_off=when_off)
    return World.from_toml(text.replace("[axis.motor]", f"{more}\n[axis.motor]"))


def events(found: World, code: str) -> list[tuple[float, str]]:
    return [(one.time / SECOND, str(one.value)) for one in found.trace.of("event") if one.subject == code and one.time]


def field(t: float) -> tuple[float, float]:
    """mm and mm/s of 20 mm at 90 mm/s and 900 mm/s²."""
    left = 20 / 90 + 0.1 - t
    if t < 0.1:
        return 450 * t * t, 900 * t
    if left > 0.1:
        return 4.5 + 90 * (t - 0.1), 90.0
    return (20 - 450 * left * left, 900 * left) if left > 0 else (20.0, 0.0)


def torque(speed: float) -> float:
    rpm = speed / 5 * 60
    return 1.0 - 0.2 * rpm / 600 if rpm < 600 else 0.8 - 0.6 * (rpm - 600) / 600


def integrated(load: float, friction: float, seconds: float) -> list[tuple[float, float, float]]:
    return in_field(
        -asin(load) / 50,
        0.0,
        seconds,
        inertia=INERTIA,
        load=load,
        friction=friction,
        field=lambda t: turns(field(t)[0], 5.0),
        torque=lambda t: torque(field(t)[1]),
        points=20,
    )


def test_a_load_that_stalls_falls_as_in_the_equation() -> None:
    found = world()
    found.run(until=0.25)
    assert [what for _, what in events(found, "fall")] == ["x moves as its load has it: it has lost its field"]
    ((stalls, _),) = events(found, "stall")
    # The torque of the curve at the speed of the field is no longer what the ramp takes.
    rate = turns(900.0, 5.0)
    assert torque(900 * (stalls - BEGINS)) == pytest.approx(INERTIA * rate + 0.45, abs=1e-4)
    # From there it moves as without current, with the speed that it has.
    begin, speed = turns(450 * (stalls - BEGINS) ** 2, 5.0), turns(900 * (stalls - BEGINS), 5.0)
    for moment in (0.3, 0.4, 0.6):
        found.run(until=moment)
        place, _ = coasted(begin, speed, moment - stalls, inertia=INERTIA, load=0.4, friction=0.05)
        assert turns(found.axis["x"].position, 5.0) == pytest.approx(place, abs=0.02 + abs(place) * 1e-5)
    # The rotor of the equation lags by up to half a period before it slips: it falls some milliseconds later.
    for t, place, speed in integrated(0.4, 0.05, 0.24)[12::3]:
        other = world()
        other.run(until=BEGINS + t)
        late = (turns(other.axis["x"].position, 5.0) - place) / speed
        assert 0.0 < late < 0.0085, t


def test_it_is_caught_where_the_field_is_slow_enough() -> None:
    found = World.from_toml(TEXT.format(load=0.3, friction=0.35, to=20.0, when_off="free"))
    found.run(until=1.0)
    (_, _), (caught, text) = events(found, "stall")
    # √(2·T·λ/2π·√(1 − r²)/J), r = 0.65.
    limit = (2 * 1.0 / 50 * (1 - 0.65**2) ** 0.5 / INERTIA) ** 0.5
    assert turns(field(caught - BEGINS)[1], 5.0) == pytest.approx(limit, rel=1e-4)
    lost = round(found.axis["x"].lost)
    assert text == f"x is caught, {lost} pulses behind"
    assert lost % 64 == 0
    # In the equation it is caught a few periods (0.1 mm) away.
    _, place, _ = integrated(0.3, 0.35, 0.36)[-1]
    assert found.axis["x"].position == pytest.approx(place / turns(1.0, 5.0), abs=0.45)


def test_with_a_start_speed_it_is_caught_there() -> None:
    text = TEXT.format(load=0.3, friction=0.35, to=20.0, when_off="free").replace("when_off", "start_speed = 120\nwhen_off")
    found = World.from_toml(text)
    found.run(until=1.0)
    assert field(events(found, "stall")[1][0] - BEGINS)[1] == pytest.approx(120 / 60 * 5, abs=1e-4)


def test_a_field_that_stops_catches_it_before_it_falls() -> None:
    """It rises when it loses the field, and that stops: on its way up it becomes slow enough for it."""
    found = world(load=0.4, friction=0.05, to=20.0)
    found.run(until=0.185)
    assert found.read("x.stalled") == 1
    found.mic488["c"].write("M_STOP", 1)
    found.run(until=0.6)
    (_, _), (caught, _) = events(found, "stall")
    (_, _), (_, text) = events(found, "fall")
    assert text == f"x stands, {round(found.axis['x'].lost)} pulses behind"
    assert 0.185 < caught < 0.2
    assert found.axis["x"].position > 3.0


def test_at_its_stop_it_is_caught_when_the_field_stands() -> None:
    found = world(more="travel = [-8.0, 30.0]")
    found.run(until=1.0)
    falls, stands = (seconds for seconds, _ in events(found, "fall"))
    assert falls < stands < 0.4
    assert found.axis["x"].position == pytest.approx(-8.0, abs=0.4)
    assert [text for _, text in events(found, "stall")][1] == f"x is caught, {round(found.axis['x'].lost)} pulses behind"


@pytest.mark.parametrize("when_off", ["holds", "free"])
def test_only_what_may_move_without_current_falls(when_off: str) -> None:
    found = world(when_off=when_off)
    found.run(until=0.25)
    place = found.axis["x"].position
    found.run(until=0.3)
    assert (found.axis["x"].position < place - 5.0) is (when_off == "free")


def test_a_switch_sees_the_fall() -> None:
    text = TEXT.format(load=0.4, friction=0.05, to=20.0, when_off="free")
    text = text.replace("[axis.motor]", '[[axis.switch]]\nbelow = -5.0\nto = "c.IN1"\n[axis.motor]')
    found = World.from_toml(text)
    found.run(until="c.IN1")
    assert found.axis["x"].position == -5.0


@pytest.mark.parametrize("moment_s", [0.1, 0.182, 0.19, 0.3, 0.7])
def test_snapshots_and_recordings_have_it(moment_s: float, tmp_path: Path) -> None:
    def made() -> World:
        return world(more="travel = [-8.0, 30.0]")

    check_it_can_be_restored(made(), made(), moment_s, 1.2, tmp_path)
