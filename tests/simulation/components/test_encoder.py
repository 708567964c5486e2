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


Y = '[[axis]]\nname = "y"\ndrive = "m.M2"\n'
BELT = '[[conveyor]]\nname = "belt"\nspeed = 100.0\nlength = 1000.0\n'
REEL = '[[dcmotor]]\nname = "reel"\nspeed = 100.0\n'


@pytest.mark.parametrize(
    ("encoder", "turned"),
    [
        (None, ""),
        ("counts_per_rev = 1000", ""),
        ('follows = "y"', Y),
        ('follows = "belt"\ncounts_per_unit = 10', BELT),
        ('follows = "reel"\ncounts_per_rev = 400', REEL),
    ],
)
def test_whatever_turns_an_encoder_it_slips_at_the_input_that_reads_it(encoder: str | None, turned: str) -> None:
    text = TEXT.replace("[axis.encoder]\n", "" if encoder is None else f"[axis.encoder]\n{encoder}\n") + turned
    counts: list[list[float]] = []
    for fault in ("", '[[fault]]\nkind = "slip"\nmachine = "m"\ncounts = 40\nat_s = 1.0\n'):
        world = World.from_toml(text + fault)
        world.run(until=3.0)
        counts.append([world.mic488["m"].axis[number].encoder for number in (1, 2)])
    sound, slipped = counts
    assert slipped == [sound[0] + 40, sound[1]]
