"""Motions that scripts command as the master of a controller does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, overload

from steptwin.errors import Misuse
from steptwin.simulation.kinds.kind import AnyKind, MotionEnds, lacks
from steptwin.simulation.script.control import ControllerCommand, Halt, Home, Move, Seek
from steptwin.simulation.script.steps import Step
from steptwin.simulation.world.model import Model

Maker: TypeAlias = Callable[[Any, str | None, Any], Step | Halt]
"""The step for a command, of a machine and the name of its line."""


@overload
def ordered(model: Model, command: Move | Home | Seek) -> Step: ...
@overload
def ordered(model: Model, command: ControllerCommand) -> Step | Halt: ...
def ordered(model: Model, command: ControllerCommand | Seek) -> Step | Halt:
    """The step by which the master of a controller does a command now; a stop is done at the controller itself.

    Raises `Misuse` and `Refusal`.
    """
    name = command.machine
    kind, machine = model.kind(name), model.machine(name)
    make: Maker | None = kind.seek if isinstance(command, Seek) else kind.control.get(type(command))
    if make is None:
        raise _lacks(name, kind, command)
    model.touch(name)
    machine.advance(model.now)
    on = model.parts.line_of.get(name)
    return make(machine, None if on is None else on[0].name, command)


def _lacks(name: str, kind: AnyKind, command: ControllerCommand | Seek) -> Misuse:
    if isinstance(command, Seek):
        return Misuse(f"{name!r} is {kind.title}, which knows its switches: home it with a velocity, not with seek")
    if isinstance(command, Home) and kind.seek is not None:
        what = f"{name!r} is {kind.title}, which does not know its switch"
        return Misuse(f"{what}: home it with seek, such as '-B8', not with a velocity")
    return lacks(name, kind, f"command {type(command).__name__.lower()}")


def motion_ends(model: Model, name: str, axis: int, seek: Seek | None = None) -> MotionEnds:
    """The conditions on an axis (from 1), or at the end of a seek of it.

    Raises `Misuse` for one that is not there, or does not show how its motions end.
    """
    kind = model.kind(name)
    if kind.motion_ends is None:
        raise lacks(name, kind, "status of motions: send its commands, and wait for a condition")
    axes = len(model.machine(name).axes)
    if not 1 <= axis <= axes:
        raise Misuse(f"{name}.M{axis}: {name} has {', '.join(f'M{number}' for number in range(1, axes + 1))}")
    on = model.parts.line_of.get(name)
    return kind.motion_ends(f"{name}.M{axis}", None if on is None else on[0].name, seek)
