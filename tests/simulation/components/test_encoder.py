"""Encoders of axes: counts per revolution (3200 pulses), per millimetre (640 pulses), and as configured (400 per 3200 pulses)."""

from __future__ import annotations

import pytest

from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "m"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 100.0
dec = 100.0
vel = 50.0
[[axis]]
name = "x"
drive = "m.M1"
pitch = 5.0
travel = [-3.0, 103.0]
[axis.encoder]
"""


@pytest.mark.parametrize(
    ("encoder", "counts"),
    [
        ("counts_per_rev = 1000", 2000),
        ("counts_per_rev = -1000", -2000),
        ("counts_per_rev = 1000\nslip = 0.1", 1800),
        ("counts_per_unit = 50.0", 500),
        ("counts_per_unit = 50.0\nslip = 0.02", 490),
        ("slip = 0.0", 800),
        ("slip = 0.5", 400),
    ],
)
def test_counts_of_two_revolutions(encoder: str, counts: int) -> None:
    world = World.from_toml(TEXT + encoder + "\n")
    axis = world.mic488["m"].axis[1]
    axis.enable()
    axis.move_to(10.0)
    world.run(until="idle")
    assert (axis.position, axis.encoder) == (10.0, counts)


@pytest.mark.parametrize(("mount", "counts"), [("", 400), ('mount = "motor"', 400), ('mount = "load"', 440)])
def test_an_encoder_on_the_load_is_behind_the_play(mount: str, counts: int) -> None:
    """80 counts per mm; after a reversal the load is 0.5 mm behind the motor."""
    world = World.from_toml(TEXT.replace("[axis.encoder]", "backlash = 0.5\n[axis.encoder]") + mount + "\n")
    axis = world.mic488["m"].axis[1]
    axis.enable()
    for position in (10.0, 5.0):
        axis.move_to(position)
        world.run(until="idle")
    assert (axis.position, axis.encoder) == (5.0, counts)


def test_an_encoder_does_not_follow_its_own_axis() -> None:
    with pytest.raises(WorldError, match="follows = 'x' is its own axis: an encoder is on it anyway"):
        World.from_toml(TEXT + 'follows = "x"\n')
