"""The description of a world."""

from __future__ import annotations

from steptwin.subject.commands import COMMANDS
from steptwin.subject.contract import Description, LinePart, MachinePart, MechanicsPart, SwitchPart
from steptwin.subject.controls import controls_of
from steptwin.world.elements.axis import MECHANICS
from steptwin.world.elements.switch import SwitchSpec
from steptwin.world.plant import Plant


def describe(world: Plant) -> Description:
    """What is in a world."""
    return Description(
        world.spec.name,
        tuple(_machine(world, name) for name in world.machines),
        tuple(_mechanics(world, name) for name in world.axes),
        tuple(world.plan.buttons),
        tuple(LinePart(line.name, line.kind, world.lines[line.name].baud) for line in world.spec.lines),
        tuple(COMMANDS),
    )


def _machine(world: Plant, name: str) -> MachinePart:
    on = world.plan.line_of.get(name)
    line, unit = (None, None) if on is None else (on[0].name, on[1])
    kind = world.kind(name)
    sheet = kind.datasheet(world.machines[name])
    return MachinePart(name, sheet, line, unit, controls_of(sheet, kind.control))


def _mechanics(world: Plant, name: str) -> MechanicsPart:
    fitted = world.axes[name]
    place = fitted.mechanism.machine, str(fitted.mechanism.number)
    points = tuple(f"{name}.{what}" for what in MECHANICS)
    spec = fitted.spec
    switches = tuple(_switch(one) for one in spec.switches)
    return MechanicsPart(name, *place, fitted.scale.unit, points, spec.kind, spec.travel, switches)


def _switch(spec: SwitchSpec) -> SwitchPart:
    pin = ".".join(spec.target)
    if spec.position is None:
        return SwitchPart(pin, spec.above, spec.below)
    half = spec.width / 2
    return SwitchPart(pin, spec.position - half, spec.position + half, spec.period)
