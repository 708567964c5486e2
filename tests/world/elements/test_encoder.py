"""Encoders of axes: counts per revolution (3200 pulses), per millimetre (640 pulses), and as configured (400 per 3200 pulses)."""

from __future__ import annotations

import pytest

from steptwin.files.world import World

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
