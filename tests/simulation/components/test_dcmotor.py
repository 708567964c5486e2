"""DC motors that run up and coast, and the encoders on them and on belts; against the equation of a motor, by scipy."""

from __future__ import annotations

from pathlib import Path

import pytest
from scipy.integrate import solve_ivp
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "c"
[mic488.M2]
unit = "rev"
gear = 3200.0
acc = 50.0
dec = 50.0
vel = 10.0
pos_ctrl_mode = "ENCFOLLOW"
[[dcmotor]]
name = "reel"
speed = 90
run = "c.OUT1"
run_up = "1 s"
coast = "2 s"
[[conveyor]]
name = "belt"
length = 500.0
speed = 123.4
run = "c.OUT1"
ramp_down = "400 ms"
[[axis]]
name = "x"
drive = "c.M1"
[axis.encoder]
follows = "belt"
counts_per_unit = 10
[[axis]]
name = "y"
drive = "c.M2"
kind = "rotary"
unit = "rev"
[axis.encoder]
follows = "reel"
counts_per_rev = 400
"""


def world(text: str = TEXT) -> World:
    return World.from_toml(text, name="w.toml")


def test_it_runs_up_and_coasts() -> None:
    here = world()
    here.mic488["c"].write("OUT1", 1)
    here.run(until="reel.speed == 45", for_="5 s")
    assert here.now == pytest.approx(0.5 * SECOND, abs=1.5)
    here.run(until=3.0)
    assert here.read("reel.angle") / 360 == pytest.approx(1.5 * 2.5, abs=1e-8)
    here.mic488["c"].write("OUT1", 0)
    here.run(until="reel.speed == 0", for_="5 s")
    assert here.now == pytest.approx(5.0 * SECOND, abs=1.5)
    assert here.read("reel.angle") / 360 == pytest.approx(1.5 * 3.5, abs=1e-8)


J, K, R, FRICTION, MOST_A, VOLTS = 0.02, 0.5, 0.4, 0.2, 2.0, 24.0
"""kg·m², N·m/A (V·s/rad), ohm, N·m, A, V: no current at 459 rev/min."""


def test_against_the_equation_of_a_motor() -> None:
    """A driver that limits the current gives a straight ramp; without current friction alone brakes. What the model leaves out is
    the end of the ramp, where the voltage is the limit."""

    def rates(t: float, state: list[float]) -> list[float]:
        speed, _ = state
        current = min((VOLTS - K * speed) / R, MOST_A) if t < 8.0 else 0.0
        return [(current * K - FRICTION) / J if t < 8.0 or speed > 0 else 0.0, speed]

    rad = (VOLTS - R * FRICTION / K) / K
    found = solve_ivp(rates, (0.0, 16.0), [0.0, 0.0], max_step=1e-3)
    run_up, coast = rad * J / (MOST_A * K - FRICTION), rad * J / FRICTION
    text = TEXT.replace("speed = 90", f"speed = {rad * 30 / 3.141592653589793}")
    here = world(text.replace('"1 s"', f'"{run_up * 1e6:.0f} us"').replace('"2 s"', f'"{coast * 1e6:.0f} us"'))
    here.mic488["c"].write("OUT1", 1)
    here.run(until=8.0)
    here.mic488["c"].write("OUT1", 0)
    here.run(until=16.0)
    assert here.read("reel.speed") == 0.0
    assert here.read("reel.angle") / 360 == pytest.approx(found.y[1][-1] / 6.283185307179586, abs=0.2)


def test_encoders_count_what_a_belt_and_a_motor_do() -> None:
    here = world()
    device = here.mic488["c"]
    device.write("M2_EN", 1)
    device.write("OUT1", 1)
    here.run(until=3.0)
    assert (device.axis[1].encoder, device.axis[2].encoder) == (3702, 1500)
    device.write("OUT1", 0)
    here.run(until=6.0)
    assert (device.axis[1].encoder, device.axis[2].encoder) == (3702 + 246, 2100), "both coast: 24.68 mm, 1.5 revolutions"
    assert here.read("y.position") == 5.25, "ENCFOLLOW goes as far"


def test_an_encoder_on_a_belt_of_an_axis_counts_its_load() -> None:
    text = TEXT.replace('speed = 123.4\nrun = "c.OUT1"\nramp_down = "400 ms"', 'axis = "z"\nmm_per_unit = 2')
    here = world(text + '[[axis]]\nname = "z"\ndrive = "c.M3"\npulses_per_unit = 100\n')
    device = here.mic488["c"]
    device.write("M3_EN", 1)
    device.write("M3_POS_ABS", 700.0)
    here.run(until="idle")
    assert device.axis[1].encoder == 140, "7 units are 14 mm"


def test_an_encoder_on_a_motor_slips() -> None:
    here = world()
    here.fault("slip machine=c axis=2 counts=-40 at_s=1")
    here.mic488["c"].write("OUT1", 1)
    here.run(until=3.0)
    assert here.mic488["c"].axis[2].encoder == 1460


def test_a_dead_motor_coasts() -> None:
    here = world()
    here.fault("dead-motor element=reel from_s=2 until_s=3")
    here.mic488["c"].write("OUT1", 1)
    here.run(until=3.0)
    assert here.read("reel.speed") == 45.0
    here.run(until=3.5)
    assert here.read("reel.speed") == 90.0


def test_it_can_be_restored(tmp_path: Path) -> None:
    text = TEXT + '[[event]]\nat = "20 ms"\nsteps = [{ write = { "c.M2_EN" = 1, "c.OUT1" = 1 } }]\n'
    check_it_can_be_restored(world(text), world(text), 0.3, 2.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"belt"\ncounts', '"bell"\ncounts', r"no|permitted are x, y, belt, reel"),
        ("counts_per_unit = 10", "counts_per_rev = 10", "follows = 'belt' needs counts_per_unit: counts per mm"),
        ("counts_per_rev = 400", "", "follows = 'reel' needs counts_per_rev: counts per revolution"),
        ("counts_per_rev = 400", "counts_per_rev = 400\nindex = true", "'reel' is no axis: an encoder on it has no index"),
        ('"reel"\ncounts', '"y"\ncounts', "is its own axis"),
    ],
)
def test_what_is_wrong(old: str, new: str, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        world(TEXT.replace(old, new))
