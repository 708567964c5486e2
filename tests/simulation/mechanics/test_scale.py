"""How far an axis goes with a pulse, whatever its description says of it and leaves out."""

from __future__ import annotations

import pytest

from steptwin.files.world import World
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.toml.reader import WorldError

CHIP = """
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "drum"
line = "chips"
address = 3
[[axis]]
name = "y"
drive = "drum.M1"
"""
TABLE = """
[[mic488]]
name = "table"
[mic488.M1]
acc = 1e6
dec = 1e6
vel = 1e5
"""
AXIS = """
[[axis]]
name = "y"
drive = "table.M1"
"""
MOTOR = "[axis.motor]\ntorque = [[0, 1.0], [600, 0.5]]\nstart_speed = 60\n"


def world_of(text: str) -> World:
    return World.from_toml(text, name="w.toml")


def wrong(text: str) -> str:
    with pytest.raises(WorldError) as caught:
        world_of(text)
    return str(caught.value)


def motor_of(world: World) -> StepperMotor:
    motor = world.axes["y"].mechanism.build.motor
    assert motor is not None
    return motor


@pytest.mark.parametrize(
    ("axis", "position", "unit"),
    [
        ('kind = "rotary"\n', 3600.0, "degree"),
        ('kind = "rotary"\nunit = "rev"\n', 10.0, "rev"),
        ('kind = "rotary"\nunit = "rev"\n[axis.motor]\nfull_steps = 400\ntorque = [[0, 9.0], [3000, 9.0]]\n', 5.0, "rev"),
        ('kind = "rotary"\nunit = "rev"\npulses_per_rev = 25600\n', 5.0, "rev"),
        ("pitch = 5.0\n", 50.0, "mm"),
        ('pitch = 0.5\nunit = "cm"\n', 5.0, "cm"),
        ("pulses_per_unit = 1280\n", 100.0, "mm"),
        ("", 128000.0, "imp"),
    ],
)
def test_an_m1486_turns_a_full_step_with_64_minimum_microsteps(axis: str, position: float, unit: str) -> None:
    """F128000 are 2000 full steps (manual, Forward), with 200 in a revolution ten revolutions."""
    world = world_of(CHIP + axis)
    world.line["chips"].send(b"x3\rf128000\rr\r")
    world.run(until="idle")
    assert world.read("drum.position") == 128000
    assert (world.axis["y"].position, world.axis["y"].unit) == (position, unit)


@pytest.mark.parametrize(
    ("config", "axis", "position", "unit"),
    [
        ("", 'kind = "rotary"\nunit = "rev"\npulses_per_rev = 1600\n', 4.0, "rev"),
        ("", 'kind = "rotary"\n', 720.0, "degree"),
        ("mot_resol = 6400\n", 'kind = "rotary"\n', 360.0, "degree"),
        ('unit = "rev"\ngear = 32000.0\n', 'kind = "rotary"\n', 72.0, "degree"),
        ('unit = "rev"\ngear = 32000.0\n', 'kind = "rotary"\npulses_per_rev = 3200\n', 720.0, "degree"),
        ('unit = "degree"\ngear = 100.0\n', 'kind = "rotary"\nunit = "rev"\n', 64 / 360, "rev"),
        ('unit = "mm"\ngear = 640.0\n', "", 10.0, "mm"),
        ('unit = "mm"\ngear = 640.0\n', 'unit = "cm"\n', 1.0, "cm"),
        ('unit = "mm"\ngear = 640.0\n', "pulses_per_rev = 6400\n", 10.0, "mm"),
        ('unit = "mm"\ngear = 640.0\n', "pitch = 5.0\npulses_per_rev = 6400\n", 5.0, "mm"),
        ("mot_resol = 6400\n", "pitch = 5.0\n", 5.0, "mm"),
        ("", "", 6400.0, "imp"),
    ],
)
def test_an_axis_of_a_mic488_goes_as_it_says_else_as_its_controller_is_told(
    config: str, axis: str, position: float, unit: str
) -> None:
    world = world_of(TABLE + config + AXIS + axis)
    device = world.mic488["table"]
    device.axis[1].enable()
    device.axis[1].move_to(6400 / device.device.axes[0].gear)
    world.run(until="idle")
    assert world.axis["y"].position == pytest.approx(position, rel=1e-12)
    assert world.axis["y"].unit == unit


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            CHIP + 'unit = "mm"\n',
            "w.toml:9:1: error D009: unit = 'mm': give pulses_per_unit or pitch, for drum counts minimum microsteps",
        ),
        (
            TABLE + AXIS + 'unit = "mm"\n',
            "w.toml:9:1: error D009: unit = 'mm': give pulses_per_unit or pitch, for table has axis 1 in",
        ),
        (TABLE + AXIS + 'kind = "rotary"\nunit = "tooth"\n', "unit = 'tooth': give pulses_per_unit or pitch"),
        (
            CHIP + "pulses_per_rev = 3210\npitch = 1.0\n",
            "pulses_per_rev = 3210: of an M1486 they are minimum microsteps, 64 for each",
        ),
        (
            CHIP + "pulses_per_rev = 3200\npitch = 1.0\n" + MOTOR + "full_steps = 200\n",
            "pulses_per_rev = 3200: of an M1486 they are minimum microsteps, 64 for each full step; full_steps = 200: 12800",
        ),
    ],
)
def test_a_scale_that_is_not_known_or_cannot_be_is_told(text: str, message: str) -> None:
    assert message in wrong(text)


@pytest.mark.parametrize(
    ("text", "per_rev"), [(CHIP + MOTOR, 12800), (TABLE + AXIS + MOTOR, 3200), (TABLE + "mot_resol = 400\n" + AXIS + MOTOR, 400)]
)
def test_torques_and_the_electrical_period_go_by_the_pulses_of_a_revolution(text: str, per_rev: int) -> None:
    """600 rev/min are ten revolutions a second; four of 200 full steps are a fiftieth of one."""
    world = world_of(text)
    motor = motor_of(world)
    assert motor.curve == ((0.0, 1.0), (10.0 * per_rev, 0.5))
    (axis,) = world.axes.values()
    assert axis.mechanism.build.period_p == per_rev // 50
    assert motor.start_p == per_rev


def test_an_m1486_that_stalls_loses_a_multiple_of_four_full_steps() -> None:
    world = world_of(CHIP + 'kind = "rotary"\n[axis.motor]\ntorque = [[0, 1.0], [150, 1.0]]\nstart_speed = 60\n')
    world.line["chips"].send(b"x3\rv800\rf128000\rr\r")  # 240 rev/min at its fastest
    world.run(until="idle")
    assert world.axis["y"].lost > 0
    assert world.axis["y"].lost % 256 == 0
