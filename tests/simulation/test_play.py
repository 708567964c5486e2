"""Backlash under a constant load, which takes the play up on one side, against a load that is moved pulse by pulse."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
backlash = 0.4
[axis.motor]
torque = [[0, 2.0], [1500, 2.0]]
inertia = 0.00005
"""
PLAY = 256


def world(motor: str, axis: str = "") -> World:
    found = World.from_toml(TEXT.replace("[axis.motor]", f"{axis}\n[axis.motor]\n{motor}"))
    found.mic488["c"].write("M1_EN", 1)
    return found


def go(found: World, to: float) -> float:
    found.mic488["c"].write("M1_POS_ABS", to)
    found.run(until="idle")
    return found.axis["x"].position


def followed(rotors: list[int], load: int, pull: int, low: int, high: int) -> int:
    """The load after its rotor has been at each of these places, one pulse from the other."""
    for rotor in rotors:
        load = min(max(load, rotor), rotor + PLAY)
        if pull:
            load = min(max(rotor if pull > 0 else rotor + PLAY, low), high)
    return load


@pytest.mark.parametrize(
    ("motor", "up", "down"),
    [
        ("force = 98.1", 20.0, 10.0),
        ("load = 0.3\nfriction = 0.29", 20.0, 10.0),
        ("force = -98.1", 20.0, 10.0),
        ("", 20.0, 10.4),
        ("load = 0.3\nfriction = 0.3", 20.0, 10.4),  # what friction holds stays where motion has left it
    ],
)
def test_a_constant_load_takes_the_play_up_on_one_side(motor: str, up: float, down: float) -> None:
    found = world(motor)
    assert [go(found, 20.0), go(found, 10.0)] == [up, down]
    assert [go(found, 20.0), go(found, 10.0), found.axis["x"].lost] == [up, down, 0]


def test_a_load_that_is_put_on_goes_through_the_play_at_once() -> None:
    text = TEXT + '[[load]]\nname = "part"\naxis = "x"\nforce = 98.1\nwhen = "c.OUT1"\n'
    found = World.from_toml(text)
    found.mic488["c"].write("M1_EN", 1)
    assert [go(found, 20.0), go(found, 10.0)] == [20.0, 10.4]
    found.mic488["c"].write("OUT1", 1)
    found.run(for_=0.01)
    assert found.axis["x"].position == 10.0
    found.mic488["c"].write("OUT1", 0)
    assert [go(found, 5.0), go(found, 6.0)] == [5.4, 6.0]


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from([0.6, -0.6, 0.0]), st.lists(st.integers(-8_000, 8_000), min_size=1, max_size=5), st.booleans(), st.booleans()
)
def test_it_is_where_one_has_it_that_goes_pulse_by_pulse(load: float, targets: list[int], inverted: bool, stops: bool) -> None:
    stops = stops and load != 0.0  # without a pull it depends on how far it has been beyond its stop
    low, high = (-3_200, 3_840) if stops else (-(10**6), 10**6)
    axis = f"inverted = {str(inverted).lower()}\n" + ("travel = [-5.0, 6.0]" if stops else "")
    found = world(f"load = {load}", axis)
    pull = (load > 0) - (load < 0)
    begin = min(pull, 0) * PLAY  # the load is at its start, the rotor below it
    rotor, place = begin, followed([begin], 0, pull, low, high)
    assert found.axis["x"].position == place == 0
    for target in targets:
        go(found, target / 640)
        behind = round(found.axis["x"].lost)
        to = begin + (-target if inverted else target) - behind
        step = 1 if to >= rotor else -1
        place = followed([*range(rotor, to, step), to], place, pull, low, high)
        rotor = to
        assert found.axis["x"].position == place / 640, (target, behind)


@pytest.mark.parametrize("force", [98.1, -98.1])
def test_a_switch_and_the_trace_see_where_it_lies(force: float) -> None:
    text = TEXT.replace("[axis.motor]", f'[[axis.switch]]\nbelow = 12.0\nto = "c.IN1"\n[axis.motor]\nforce = {force}')
    found = World.from_toml(text)
    found.mic488["c"].write("M1_EN", 1)
    go(found, 20.0)
    found.mic488["c"].write("M1_POS_ABS", 0.0)
    begin = found.now / SECOND
    found.run(until="c.IN1")
    assert found.axis["x"].position == 12.0
    # 8 mm from rest: 4.5 mm on the ramp, then at 90 mm/s.
    assert found.now / SECOND - begin == pytest.approx(0.1 + (8.0 - 4.5) / 90, abs=2e-4)
    assert found.read("x.position") == 12.0


@pytest.mark.parametrize("force", [98.1, -98.1])
def test_at_its_stop_the_load_stands_while_the_rotor_goes_through_the_play(force: float) -> None:
    found = world(f"force = {force}", "travel = [0.0, 30.0]")
    assert go(found, -5.0) == 0.0
    there, lost = go(found, 20.0), found.axis["x"].lost
    assert there == 20.0 - lost / 640
    assert lost % 64 == 0
    # A rotor below its load has gone through the play when that is at its stop, as at the beginning.
    assert -5.0 * 640 - lost == pytest.approx(-PLAY if force > 0 else 0, abs=33)
    assert go(found, 40.0) == 30.0
