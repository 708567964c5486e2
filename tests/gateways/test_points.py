"""The values of controllers that gateways show."""

from __future__ import annotations

import asyncio

import pytest
from gateway_rig import GatewayWorld

from steptwin.errors import Misuse
from steptwin.gateways.points import GatewayPoint, PointType, PointValue, points_of, registers_by_controller, values_of
from steptwin.gateways.sampling import Sampler
from steptwin.simulation.script.steps import Set, Write
from steptwin.subject import commands as command

TEXT = """
    [[mic488]]
    name = "table"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    vel = 40.0
    acc = 400.0
    dec = 400.0
    [[m1486]]
    name = "drum"
"""
REGISTERS = ["USER_REGISTER[5]", "M1_VMAX", "M1_POS_ABS"]


def values(world: GatewayWorld, controller: str, registers: list[str] | None = None) -> dict[str, PointValue]:
    part = next(part for part in world.description.controllers if part.name == controller)
    sample = asyncio.run(Sampler(world.samples, {controller: registers or []}).take(controller))
    assert sample.state is not None
    return {point.name: point.read(sample.state) for point in points_of(part, world.description, registers or [])}


def test_a_controller_at_rest() -> None:
    world = GatewayWorld(TEXT)
    found = values(world, "table")
    assert (found["status"], found["status_code"], found["status_level"]) == ("ok", 0, "ok")
    assert (found["program.state"], found["program.line"]) == ("stopped", None)
    assert (found["M1.position"], found["M1.moving"], found["M1.enabled"], found["M1.encoder"]) == (0.0, False, False, 0)
    assert (found["pins.IN3"], found["details.data_type"]) == (0.0, "REAL")
    assert (values(world, "drum")["M1.enabled"], values(world, "drum")["details.baud"]) == (None, 4800)


def test_a_controller_in_motion() -> None:
    world = GatewayWorld(TEXT)
    world.inner.do(command.Enable("table", 1))
    world.inner.do(command.Move("table", 1, to=40.0))
    world.inner.do(command.Advance(duration=600_000_000))
    found = values(world, "table")
    # 40 mm/s after 0.1 s with 400 mm/s²: 2 mm, then 20 mm in 0.5 s
    assert found["M1.position"] == pytest.approx(22.0, abs=0.01)
    assert (found["M1.velocity"], found["M1.moving"], found["M1.enabled"]) == (40.0, True, True)


@pytest.mark.parametrize(("controller", "registers"), [("table", REGISTERS), ("table", REGISTERS[:1]), ("drum", [])])
def test_the_points_of_a_group_are_read_at_once(controller: str, registers: list[str]) -> None:
    world = GatewayWorld(TEXT)
    world.inner.do(command.Enable("table", 1))
    world.inner.do(command.Move("table", 1, to=40.0))
    world.inner.do(command.Advance(duration=600_000_000))
    part = next(part for part in world.description.controllers if part.name == controller)
    state = asyncio.run(Sampler(world.samples, {controller: registers}).take(controller)).state
    assert state is not None
    groups: dict[str, list[GatewayPoint]] = {}
    for point in points_of(part, world.description, registers):
        groups.setdefault(point.group, []).append(point)
    assert {"", "program", "pins", "details"} < set(groups)
    for points in groups.values():
        assert values_of(points)(points[0].part(state)) == tuple(point.read(state) for point in points)


def test_points_have_type_unit_and_range() -> None:
    world = GatewayWorld(TEXT)
    part = world.description.controllers[0]
    points = {point.name: point for point in points_of(part, world.description, REGISTERS)}
    position = points["M1.position"]
    assert (position.type, position.unit, points["M1.velocity"].unit) == (PointType.NUMBER, "mm", "mm/s")
    assert position.limits == part.datasheet.axes[0].positions
    assert (points["pins.AIN1"].type, points["pins.AIN1"].unit) == (PointType.NUMBER, "V")
    assert points["pins.IN3"].type is PointType.TRUTH
    assert len(points) == len(points_of(part, world.description, REGISTERS)), "two have one name"


def test_inputs_are_set_outputs_and_registers_are_written() -> None:
    world = GatewayWorld(TEXT)
    part = world.description.controllers[0]
    points = {point.name: point for point in points_of(part, world.description, REGISTERS)}

    def written(name: str) -> object:
        write = points[name].write
        return None if write is None else write(1.0)

    assert written("pins.IN3") == Set((("table", "IN3", 1.0),))
    assert written("pins.OUT2") == Write((("table", "OUT2", 1.0),))
    assert written("registers.USER_REGISTER[5]") == Write((("table", "USER_REGISTER[5]", 1.0),))
    assert written("M1.position") is written("pins.ERR") is None


def test_registers_are_read_and_what_is_only_written_is_unknown() -> None:
    world = GatewayWorld(TEXT)
    world.inner.do(Write((("table", "USER_REGISTER[5]", 77.0),)))
    found = values(world, "table", REGISTERS)
    assert [found[f"registers.{name}"] for name in REGISTERS] == [77.0, 40.0, None]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("tabel.M1_VMAX", "[x]: registers: no controller is called 'tabel' (did you mean 'table'?); expected CONTROLLER.POINT"),
        ("table.M1_VMAXX", "[x]: registers: no point is called 'table.M1_VMAXX' (did you mean 'M1_VMAX'?)"),
        ("table.USER_REGISTR[5]", "[x]: registers: no point is called 'table.USER_REGISTR[5]' (did you mean 'USER_REGISTER'?)"),
        ("table", "[x]: registers: no point is called 'table'"),
        ("M1_VMAX", "[x]: registers: no controller is called 'M1_VMAX'; expected CONTROLLER.POINT"),
    ],
)
def test_a_register_that_is_not_there(wrong: str, message: str) -> None:
    with pytest.raises(Misuse) as found:
        registers_by_controller("[x]", [wrong], GatewayWorld(TEXT).description)
    assert str(found.value) == message


def test_registers_by_controller() -> None:
    found = registers_by_controller("[x]", ["table.M1_VMAX", "drum.variable"], GatewayWorld(TEXT).description)
    assert found == {"table": ["M1_VMAX"], "drum": ["variable"]}
