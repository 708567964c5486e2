"""The methods of axes, programs and controllers: each is one command of the subject."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from steptwin.gateways.leases import LEASE_S
from steptwin.gateways.points import PointType
from steptwin.subject import commands as command
from steptwin.subject.commands import Command
from steptwin.subject.contract import ControllerDescription


@dataclass(frozen=True, slots=True)
class MethodArgument:
    """``of``: the argument of the command, whose range it has (`steptwin.subject.controls`); of a lease empty."""

    name: str
    meaning: str
    type: PointType
    of: str


@dataclass(frozen=True, slots=True)
class MethodRow:
    """A method. ``make`` makes its command from the name of the controller, the number of the axis or None, and arguments."""

    name: str
    meaning: str
    command: str
    """The name of the command; a controller that does not take it does not have the method."""
    make: Callable[..., Command]
    arguments: tuple[MethodArgument, ...] = ()


_POSITION = MethodArgument("Position", "In the unit of the axis.", PointType.NUMBER, "to")
_DISTANCE = MethodArgument("Distance", "In the unit of the axis.", PointType.NUMBER, "by")
_VELOCITY = MethodArgument("Velocity", "In the unit of the axis per second, with its sign.", PointType.NUMBER, "velocity")
_LEASE = MethodArgument("Lease", f"How long, s: {LEASE_S[0]:g} to {LEASE_S[1]:g}.", PointType.NUMBER, "")
_ON = MethodArgument("On", "Whether the drive is to be on.", PointType.TRUTH, "on")

AXIS_METHODS = (
    MethodRow("Enable", "Switches its drive on or off.", "enable", lambda m, a, on: command.Enable(m, a, on=bool(on)), (_ON,)),
    MethodRow("MoveTo", "Begins to move to a position.", "move", lambda m, a, to: command.Move(m, a, to=to), (_POSITION,)),
    MethodRow("MoveBy", "Begins to move by a distance.", "move", lambda m, a, by: command.Move(m, a, by=by), (_DISTANCE,)),
    MethodRow("Home", "Begins to home; the sign chooses the switch.", "home", command.Home, (_VELOCITY,)),
    MethodRow(
        "Jog",
        "Moves at a velocity until the lease ends; another call in time makes it go on.",
        "jog",
        command.Jog,
        (_VELOCITY, _LEASE),
    ),
    MethodRow("Stop", "Stops it as fast as the controller does.", "stop", command.StopAxes),
)
PROGRAM_METHODS = (
    MethodRow("Start", "Starts the program.", "program", lambda m, _: command.ControlProgram(m, "start")),
    MethodRow("Pause", "Pauses it.", "program", lambda m, _: command.ControlProgram(m, "pause")),
    MethodRow("Stop", "Ends it.", "program", lambda m, _: command.ControlProgram(m, "stop")),
)
CONTROLLER_METHODS = (MethodRow("Stop", "Stops all axes.", "stop", lambda m, _: command.StopAxes(m)),)

METHODS: Mapping[str, tuple[MethodRow, ...]] = {
    "Axis": AXIS_METHODS,
    "Program": PROGRAM_METHODS,
    "Controller": CONTROLLER_METHODS,
}
"""By the type of object that has them."""


def methods_of(part: ControllerDescription, rows: tuple[MethodRow, ...], axis: int | None) -> tuple[MethodRow, ...]:
    """Those among ``rows`` that the controller takes, for its axis where one is named."""
    taken = {one.command for one in part.takes if one.axis == axis}
    return tuple(row for row in rows if row.command in taken)
