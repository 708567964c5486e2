"""Inputs from outside a world: steps, and what programs on lines, debuggers and vision systems do."""

from __future__ import annotations

from typing import Annotated, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.fields import PROGRAM, ControllerName, Meaning
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.command import command
from steptwin.simulation.script.control import Halt


class Bytes(NamedTuple):
    """Bytes that an external program sends at its place on a line."""

    line: str
    place: str
    kind: str
    data: bytes


@command("see", "A record of a vision system comes to a controller.")
class See(NamedTuple):
    """A record of a vision system arrives at a controller."""

    controller: ControllerName
    number: Annotated[float, Meaning("The number of the record.")]
    x: Annotated[float, Meaning("The x of the record.")]
    y: Annotated[float, Meaning("The y of the record.")]
    angle: Annotated[float, Meaning("The angle of the record.")]


@command(
    "download",
    "Put a text into the program memory of a controller: a MIC488 has it at once, to an M1486 it is typed, and runs then.",
)
class Download(NamedTuple):
    """A text goes into the program memory of a controller."""

    controller: ControllerName
    place: Annotated[str, Meaning("Where, such as program 0, positions 0 (MIC488, by bank), program (M1486).")]

    """One of the places of `steptwin.simulation.world.worldprograms.program_texts`."""
    text: Annotated[str, Meaning("The text. One with errors is refused with what is wrong.", PROGRAM)]


class SetVariable(NamedTuple):
    """A debugger sets a variable of a controller's program."""

    controller: str
    name: str
    value: float


class Leave(NamedTuple):
    """An external program has disconnected."""

    line: str
    place: str


class EndScripts(NamedTuple):
    """Scripts of the description, and texts that are being typed into controllers, end. Buttons that are held are released when
    their time is over."""


class Refused(NamedTuple):
    """A command of a script from outside that could not be done; a replay has the command no more."""

    text: str


ExternalInput: TypeAlias = do.Step | Bytes | See | SetVariable | Download | Leave | Refused | Halt | EndScripts
"""An input from outside a world. Recorded with its moment, it can be replayed."""


class PastAct(NamedTuple):
    """An action at a moment. ``script``: the one that did it; empty: it came from outside."""

    time: Nanos
    script: str
    what: ExternalInput


MOST_ACTS = 8
"""Number of the last actions that a world remembers."""
NO_ACTS = (Bytes, Refused, Leave, do.Expect, do.Note, do.SetFault, do.ClearFault)
"""Inputs that are not among them: they change nothing, are too many (`Bytes`), or noted elsewhere (faults)."""


def size_of(what: ExternalInput) -> int:
    """Bytes of a program outside in it, which have no bound of their own."""
    if isinstance(what, Download):
        return len(what.text)
    return len(what.data) if isinstance(what, Bytes) else 0


FOR_SCRIPTS = frozenset(
    {do.Wait, do.At, do.Until, do.Stop, do.Read, do.Call, do.Order, do.UntilOver, do.ExpectReached, do.Repeat}
)
"""Steps that only scripts can execute; all others have an action (`steptwin.simulation.world.actions`)."""
