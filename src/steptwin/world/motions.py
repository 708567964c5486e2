"""Motions that scripts command as the master of a controller does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from steptwin.errors import Misuse
from steptwin.world.kind import MotionEnds, lacks

if TYPE_CHECKING:
    from steptwin.world.control import ControllerCommand
    from steptwin.world.plant import Plant
    from steptwin.world.script import Step


def ordered(plant: Plant, command: ControllerCommand) -> Step:
    """The step by which the master of a controller does a command now. Raises `Misuse` and `Refusal`."""
    name = command.machine
    kind, machine = plant.kind(name), plant.machine(name)
    make = kind.control.get(type(command))
    if make is None:
        raise lacks(name, kind, f"command {type(command).__name__.lower()}")
    plant.touch(name)
    machine.advance(plant.now)
    on = plant.parts.line_of.get(name)
    return make(machine, None if on is None else on[0].name, command)


def motion_ends(plant: Plant, name: str, axis: int) -> MotionEnds:
    """The conditions on an axis (from 1). Raises `Misuse` for one that is not there, or does not show how its motions end."""
    kind = plant.kind(name)
    if kind.motion_ends is None:
        raise lacks(name, kind, "status of motions: send its commands, and wait for a condition")
    axes = len(plant.machine(name).axes)
    if not 1 <= axis <= axes:
        raise Misuse(f"{name}.M{axis}: {name} has {', '.join(f'M{number}' for number in range(1, axes + 1))}")
    on = plant.parts.line_of.get(name)
    return kind.motion_ends(f"{name}.M{axis}", None if on is None else on[0].name)
