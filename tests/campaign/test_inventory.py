"""The faults that worlds can have, found from their descriptions."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.campaign.inventory import PossibleFault, occasions, possible_faults
from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.faults.table import FaultCategory

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
LINE = """
[[line]]
name = "bus"
kind = "modbus"

[[mic488]]
name = "table"
line = "bus"
unit = 3

[[script]]
name = "go"
steps = [{ set = { "table.IN4" = 1 } }, { write = { "table.M1_EN" = 1 } }]
"""


def of(file: str) -> list[PossibleFault]:
    return possible_faults(World.load(EXAMPLES / file))


def test_sensors_actuators_logic_and_power_of_the_press() -> None:
    found = of("press/press.toml")
    texts = {one.text for one in found}
    assert {"jam element=ram", "no-air element=ram", "open-coil element=safety", "supply-drop machine=cell"} <= texts
    assert {"stuck machine=cell pin=IN4 value=0", "stuck machine=cell pin=IN4 value=1"} <= texts
    assert {"stuck machine=cell pin=OUT1 value=0", "stuck machine=cell pin=OUT1 value=1"} <= texts
    assert not {"stuck machine=cell pin=OUT2 value=1", "bounce machine=cell pin=OUT1"} & texts  # leads nowhere; has no switch
    assert {one.part for one in found if one.place == "cell.OUT1"} == {FaultCategory.LOGIC}
    assert "stuck-output element=ram output=extended level=1" in texts
    assert {one.part for one in found if one.place == "ram"} == {FaultCategory.ACTUATOR}
    assert {one.part for one in found if one.place == "ram.extended"} == {FaultCategory.SENSOR}
    assert {one.part for one in found if one.place == "valve.out"} == {FaultCategory.LOGIC}
    assert {one.place for one in found if one.mode == "stuck-input level=1"} == {
        *("safety.coil", "left_hand.in1", "right_hand.in1")  # what wires drive is stuck at the output
    }
    assert not [one for one in found if "IN5" in one.text]  # nothing is connected to it
    assert not [one for one in found if one.fault.kind.name == "stall"]  # no axis
    assert not [one for one in found if one.place == "danger.hit"]  # leads nowhere


def test_only_axes_that_move_something() -> None:
    assert [one.text for one in of("labeller/labeller.toml") if one.fault.kind.name == "stall"] == ["stall machine=cell axis=1"]


def test_steps_are_lost_by_the_period_of_each_motor() -> None:
    """Four full steps, of which a motor loses multiples, and much."""
    world = """
[[mic488]]
name = "a"
M1 = { mot_resol = 6400 }
[[m1486]]
name = "b"
[[axis]]
name = "x"
drive = "a.M1"
motor = { torque = [[0, 1.0]], start_speed = 100, full_steps = 400 }
[[axis]]
name = "y"
drive = "b.M1"
pitch = 5.0
"""
    found = [one.text for one in possible_faults(World.from_toml(world)) if one.fault.kind.name == "lost-steps"]
    assert found == [
        *("lost-steps machine=a axis=1 pulses=64", "lost-steps machine=a axis=1 pulses=3200"),
        *("lost-steps machine=b axis=1 pulses=256", "lost-steps machine=b axis=1 pulses=12800"),
    ]


@pytest.mark.parametrize(
    "file", ["press/press.toml", "labeller/labeller.toml", "winder/winder.toml", "pick_and_place/pick_and_place.toml"]
)
def test_each_fault_can_be_set_and_is_there_once(file: str) -> None:
    found = of(file)
    assert len({one.text for one in found}) == len(found) > 10
    for one in found:
        assert str(read(one.text)) == one.text
        World.load(EXAMPLES / file).fault(one.text)


def test_occasions_are_every_byte_and_request_of_a_line() -> None:
    world = World.from_toml(LINE)
    found = possible_faults(World.from_toml(LINE))
    assert "stuck machine=table pin=IN4 value=0" in {one.text for one in found}  # a script sets it
    counts = occasions(world, found, SECOND)
    assert counts["flip line=bus direction=in"] == 8  # unit, function, address, value, CRC
    assert counts["flip line=bus direction=out"] == 8  # the same
    assert counts["noise line=bus direction=out"] == 1
    assert counts["crc line=bus"] == counts["busy line=bus"] == 1
    assert counts["bounce machine=table pin=IN4"] == 1


def test_a_fault_at_one_occasion_is_that_alone() -> None:
    possible = next(one for one in possible_faults(World.from_toml(LINE)) if one.text == "flip line=bus direction=in")
    for nth in (1, 8, 9):
        world = World.from_toml(LINE)
        world.fault(possible.once(nth))
        world.run(for_=1)
        assert len(list(world.trace.faults())) == (nth <= 8)
