"""Things that move parts of a machine against each other at a moment: found while a world runs, because no record says it."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.controller import Nanos
from steptwin.simulation.space.frames import FLOOR, Frame, path
from steptwin.simulation.world.simulation import Simulation

PUSHED, FALLS, GOES_ON = "pushed", "falls", "goes on"
"""Events of a workpiece that moves from then on."""
TRAVEL = "travel"
"""The signal of a belt that moves."""


def movers(world: Simulation, one: str, other: str, now: Nanos, along: int | None = None) -> tuple[str, ...]:
    """Signals that change where an element, body or workpiece is, as seen from another one: ``x.position``, ``belt.travel``; with
    the events of workpieces, ``belt.1.pushed``. Those that move at a moment, if any do, and not ``along`` an axis only."""
    steps = [step for step in path(_frame(world, one), _frame(world, other)) if step.motion is not None]
    moving = [step.frame for step in steps if step.motion is not None and not step.motion.is_still]
    moving = [frame for frame in moving if _moves(frame, now)] or moving
    across = [frame for frame in moving if frame.joint is not None and (frame.joint.turns or frame.joint.along.axis != along)]
    return tuple(dict.fromkeys(signal for frame in across or moving for signal in _signals(world, frame)))


def _frame(world: Simulation, name: str) -> Frame:
    workpiece = world.objects.workpieces.bodies().get(name)
    if workpiece is not None:
        return workpiece.frame
    frames = world.objects.frames
    return frames[name].frame if name in frames else FLOOR


def _moves(frame: Frame, now: Nanos) -> bool:
    piece = None if frame.joint is None else next(frame.joint.motion.pieces(now), None)
    return piece is not None and piece.speed(now, now + 1) > 0.0


def _signals(world: Simulation, frame: Frame) -> Iterator[str]:
    frames = world.objects.frames
    movement = frames.movement(frame)
    if movement is not None:
        yield f"{frame.name.removesuffix(f'.{movement.signal}')}.{movement.signal}"
        return
    workpiece, _, way = frame.name.rpartition(".")
    match way:
        case "belt":
            yield from (f"{one.name}.{TRAVEL}" for one in frame.line()[1:] if one.name in frames and one.name != workpiece)
            yield f"{workpiece}.{GOES_ON}"
        case "push":
            yield f"{workpiece}.{PUSHED}"
        case "fall":
            yield f"{workpiece}.{FALLS}"
