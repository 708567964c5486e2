"""Commands for controllers, in the units of their data sheets. Each kind of controller determines what a master sends for
them (`steptwin.simulation.kinds.kind.ControllerKind.step_of`)."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from steptwin.errors import Misuse
from steptwin.fields import AxisNumber, ControllerName, Meaning, choice, whole
from steptwin.messages import Message
from steptwin.simulation.script.command import UNITS, command

STOPPED = "program: what the program does now: running (it goes on), paused, stopped; null where that is not known"


@command("enable", "Switch a drive on or off.")
@dataclass(frozen=True, slots=True)
class Enable:
    """Switch a drive on or off."""

    controller: ControllerName
    axis: AxisNumber
    on: Annotated[bool, Meaning("Whether it is to be on.")] = True


EITHER_TO_OR_BY = Message("simulation.either-to-or-by", "move: give either to (a position) or by (a distance)")


@command("move", "Begin to move.")
@dataclass(frozen=True, slots=True)
class Move:
    """Begin to move to a position, or by a distance."""

    controller: ControllerName
    axis: AxisNumber
    to: Annotated[float | None, Meaning("To this position.", unit=UNITS)] = None
    by: Annotated[float | None, Meaning("By this distance.", unit=UNITS)] = None

    def __post_init__(self) -> None:
        if (self.to is None) is (self.by is None):
            raise Misuse(EITHER_TO_OR_BY())


@command("home", "Begin to home.")
@dataclass(frozen=True, slots=True)
class Home:
    """Begin to home; the sign of the velocity chooses the switch."""

    controller: ControllerName
    axis: AxisNumber
    velocity: Annotated[float, Meaning("Its sign chooses the switch.", unit=f"{UNITS}/s")]


@dataclass(frozen=True, slots=True)
class Seek:
    """Begin to home a controller that does not know its switch: move in ``direction`` (1 or -1) until the input ``pin`` ends it,
    which is then the position 0."""

    controller: str
    axis: int
    direction: int
    pin: str


@command("jog", "Begin to move without end.")
@dataclass(frozen=True, slots=True)
class Jog:
    """Begin to move at a velocity, without end."""

    controller: ControllerName
    axis: AxisNumber
    velocity: Annotated[float, Meaning("Velocity with its sign.", unit=f"{UNITS}/s")]


@command("stop", "Stop as fast as the controller does, with a ramp or without. The program of a MIC488 goes on.", STOPPED)
@dataclass(frozen=True, slots=True)
class StopAxes:
    """Stop an axis as fast as the controller does; without one, all axes of the controller."""

    controller: ControllerName
    axis: Annotated[int | None, Meaning("The number of an axis; all without.", whole(1, 64))] = None


@command("program", "Start, pause or stop the program of a controller.")
@dataclass(frozen=True, slots=True)
class ControlProgram:
    """Start, pause or stop the program of a controller."""

    controller: ControllerName
    action: Annotated[str, Meaning("What to do.", choice("start", "pause", "stop"))]


@dataclass(frozen=True, slots=True)
class Halt:
    """Stop a controller at the controller itself, whatever its line does: an axis (None: all of them), or with ``program``
    ("pause" or "stop") its program and no axis. What scripts and commands have sent it over its line before is dropped."""

    controller: str
    axis: int | None = None
    program: str | None = None

    @property
    def scope(self) -> str:
        """Text of what it stops, in the words of records and events (`steptwin.subject.payloads.InputPayload`)."""
        if self.program is not None:
            return "program, paused" if self.program == "pause" else "program"
        return "all axes" if self.axis is None else f"axis {self.axis}"


def ended(controller: str, numbers: Iterable[int]) -> list[Halt]:
    """Halts that a write of registers means, by the numbers of axes, and 0 for the program."""
    return [Halt(controller, number) if number else Halt(controller, program="stop") for number in sorted(numbers)]


def standstill(controller: str, program_actions: Collection[str]) -> tuple[Halt, ...]:
    """Stop everything of a controller whose program takes these actions. A program is paused where that can be done, because its
    end may switch drives off (MIC-31), and a load would fall; axes are stopped again, because it may have begun a motion."""
    if not program_actions:
        return (Halt(controller),)
    return Halt(controller), Halt(controller, program="pause" if "pause" in program_actions else "stop"), Halt(controller)


ControllerCommand: TypeAlias = Enable | Move | Home | Jog | StopAxes | ControlProgram
