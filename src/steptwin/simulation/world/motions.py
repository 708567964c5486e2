"""Motions that scripts command as the master of a controller does."""

from __future__ import annotations

from typing import overload

from steptwin.errors import Misuse
from steptwin.simulation.kinds.kind import MotionEnds
from steptwin.simulation.script.control import ControllerCommand, Halt, Home, Move, Seek
from steptwin.simulation.script.steps import Step, Write
from steptwin.simulation.world.model import Model


@overload
def ordered(model: Model, command: Move | Home | Seek) -> Step: ...
@overload
def ordered(model: Model, command: ControllerCommand) -> Step | Halt: ...
def ordered(model: Model, command: ControllerCommand | Seek) -> Step | Halt:
    """The step by which the master of a controller does a command now; a stop is done at the controller itself.

    Raises `Misuse` and `Refusal`.
    """
    name = command.controller
    kind, controller = model.kind(name), model.objects.controllers[name]
    model.sync(name)
    controller.advance(model.now)
    on = model.objects.line_of.get(name)
    step = kind.step_of(controller, None if on is None else on[0].name, command)
    if isinstance(step, Write):
        model.requests(step, is_command=True)  # they are kept there for its execution
    return step


def motion_ends(model: Model, name: str, axis: int, seek: Seek | None = None) -> MotionEnds:
    """The conditions on an axis (from 1), or at the end of a seek of it.

    Raises `Misuse` for one that is not there, or does not show how its motions end.
    """
    kind = model.kind(name)
    axes = len(model.controller(name).axes)
    if not 1 <= axis <= axes:
        raise Misuse(f"{name}.M{axis}: {name} has {', '.join(f'M{number}' for number in range(1, axes + 1))}")
    on = model.objects.line_of.get(name)
    return kind.motion_ends(name, axis, None if on is None else on[0].name, seek)
