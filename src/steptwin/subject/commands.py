"""Commands as values: what can be asked of a subject. Each is a class that declares its name, fields and answer.

The steps of scripts that are not only for scripts (`steptwin.simulation.script.steps`) are commands as they are; the others are
here. A message of the control endpoint is a command as JSON: ``{"do": NAME, FIELD: VALUE, ...}``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, TypeAlias, get_args

from steptwin.controller import Nanos
from steptwin.datatypes import format_short
from steptwin.errors import Misuse
from steptwin.fields import ID, SPEED, TIME, ControllerName, Meaning, choices, whole
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.command import CommandType, command, declared
from steptwin.simulation.script.control import ControlProgram, Enable, Home, Jog, Move, StopAxes
from steptwin.simulation.world.inputs import Download, See
from steptwin.subject.debugcommands import DebugCommand
from steptwin.subject.payloads import KINDS

VERSION = 2
"""Version of the commands, their answers and the events, and of the messages of the studio. A request may name the version for
which it was written; the hello of the studio must."""

STEP_HAS_TWO_ENDS = Message("subject.step-has-two-ends", "step: for_ns and to_ns exclude each other")


@command(
    "describe",
    "What there is.",
    "version, name, controllers with the numbers of their datasheets, axes, buttons, elements, connections, lines, commands",
)
@dataclass(frozen=True, slots=True)
class Describe:
    pass


@command(
    "read",
    "The present values of points.",
    "a list of point, value, unit, quality ('good', or 'unknown' with value null)",
    is_list=True,
)
@dataclass(frozen=True, slots=True)
class ReadPoints:
    points: Annotated[tuple[str, ...], Meaning("Points, such as table.M1.position, table.IN3, x.position, time.")]


@command("pins", "The levels of all pins: 0, 1, volts.", '{"CONTROLLER.PIN": LEVEL, ...}')
@dataclass(frozen=True, slots=True)
class ReadPins:
    controller: Annotated[str | None, Meaning("The name of a controller; all of them without.")] = None


@command("state", "The present state of a controller.", "the state, alike for all kinds")
@dataclass(frozen=True, slots=True)
class ReadState:
    controller: ControllerName
    parts: Annotated[tuple[str, ...] | None, Meaning("Only these parts: status, program, pins, details, names of axes.")] = None


@command("encoders", "The encoders of a controller.", "a list of axis, counts, turned_by", is_list=True)
@dataclass(frozen=True, slots=True)
class Encoders:
    controller: ControllerName


@command(
    "faults",
    "The faults that are set.",
    "a list of name, fault, seen (occasions), acted (how often it made a difference)",
    is_list=True,
)
@dataclass(frozen=True, slots=True)
class ListFaults:
    pass


@command(
    "fault_kinds",
    "The kinds of faults.",
    "a list of name, layer, occasion, meaning, lines, parameters: name, meaning, permitted, default, words, required",
    is_list=True,
)
@dataclass(frozen=True, slots=True)
class ListFaultKinds:
    pass


@command("time", "The present moment, and how time goes.", "world, time_ns, time_s, paused, speed, stopped")
@dataclass(frozen=True, slots=True)
class Time:
    pass


@command(
    "end_points",
    "Where programs can connect.",
    "name, pid, file, controllers, end_points: a list of kind, protocol and the address",
)
@dataclass(frozen=True, slots=True)
class EndPoints:
    pass


@command(
    "subscribe",
    "Events from now on, as messages with the id of this request.",
    "plans: the present plan of every axis that is subscribed to, as events",
)
@dataclass(frozen=True, slots=True)
class Subscribe:
    kinds: Annotated[
        tuple[str, ...] | None, Meaning("Kinds of events; all but frames without.", choices(KINDS, "kind of event"))
    ] = None
    controllers: Annotated[tuple[str, ...] | None, Meaning("Names of controllers, lines, or 'world'; all without.")] = None
    axes: Annotated[tuple[str, ...] | None, Meaning("Numbers of axes as text; events of other axes are left out.")] = None
    bound: Annotated[
        int, Meaning("Events that wait to be sent; beyond it the oldest are dropped and counted.", whole(1, 100_000))
    ] = 1000


@command("unsubscribe", "End a subscription.")
@dataclass(frozen=True, slots=True)
class Unsubscribe:
    id: Annotated[object, Meaning("The id of the request.", ID, name="subscription")]


@command(
    "stop_all",
    "Stop everything: all axes and jogs, programs (paused where the controller can pause one, else ended), and scripts. "
    "Fails if a controller could not be stopped; the others are.",
    "controllers: the controllers that were stopped; scripts: those that were ended",
)
@dataclass(frozen=True, slots=True)
class StopAll:
    pass


@command("pause", "Pause time.", "as time")
@dataclass(frozen=True, slots=True)
class Pause:
    pass


@command("resume", "Resume time.", "as time")
@dataclass(frozen=True, slots=True)
class Resume:
    speed: Annotated[float | None, Meaning("Virtual seconds in a second.", SPEED)] = None


@command(
    "step",
    "Run for a duration, to a moment, or to the next thing that happens by itself, then pause.",
    "as time; events, missed, came (whether the condition ended it), idle, statements; to_ns where a request has to go on",
)
@dataclass(frozen=True, slots=True)
class Advance:
    duration: Annotated[Nanos | None, Meaning("How long.", TIME, unit="ns", name="for_ns")] = None
    to: Annotated[Nanos | None, Meaning("To which moment.", TIME, unit="ns", name="to_ns")] = None
    until: Annotated[str | None, Meaning("A condition that ends it.")] = None

    def __post_init__(self) -> None:
        if self.duration is not None and self.to is not None:
            raise Misuse(STEP_HAS_TWO_ENDS())


@command(
    "snapshot", "Keep the present state in the process, to go back to it; one of the same name is replaced.", "name, time_ns"
)
@dataclass(frozen=True, slots=True)
class TakeSnapshot:
    name: Annotated[str | None, Meaning("Its name; a number without.")] = None


@command("snapshots", "The states that are kept.", "a list of name, time_ns", is_list=True)
@dataclass(frozen=True, slots=True)
class ListSnapshots:
    pass


@command("restore", "Go back to a kept state and pause there; what happened since is undone.", "as time")
@dataclass(frozen=True, slots=True)
class RestoreSnapshot:
    name: Annotated[str, Meaning("The name of a snapshot.")]


@command("drop_snapshot", "Keep a state no longer.")
@dataclass(frozen=True, slots=True)
class DropSnapshot:
    name: Annotated[str, Meaning("The name of a snapshot.")]


@command(
    "save",
    "Write the recording, or the last records, to a file.",
    "as time; file, inputs, digest, or files, records for the last records",
)
@dataclass(frozen=True, slots=True)
class Save:
    file: Annotated[str, Meaning("Absolute path.")]


Command: TypeAlias = (
    Describe
    | ReadPoints
    | ReadPins
    | ReadState
    | Encoders
    | ListFaults
    | ListFaultKinds
    | Time
    | EndPoints
    | Subscribe
    | Unsubscribe
    | do.Set
    | do.Press
    | do.Release
    | do.Put
    | do.Remove
    | do.Write
    | do.Send
    | do.Request
    | do.PowerCycle
    | do.Turn
    | do.Couple
    | do.SetFault
    | do.ClearFault
    | do.Expect
    | do.Note
    | See
    | Enable
    | Move
    | Home
    | Jog
    | StopAxes
    | StopAll
    | ControlProgram
    | Download
    | Pause
    | Resume
    | Advance
    | TakeSnapshot
    | ListSnapshots
    | RestoreSnapshot
    | DropSnapshot
    | Save
    | DebugCommand
)
"""In the order in which they are listed. Another command is a class and its place here."""

COMMANDS: Mapping[str, CommandType] = {one.name: one for one in map(declared, get_args(Command))}


UNKNOWN_COMMAND = Message("subject.unknown-command", "no command {name}{hint}; commands are {names}")


def read_command(name: object, given: Mapping[str, object]) -> Command:
    """The command called ``name`` with fields as in JSON. Raises `Misuse`."""
    found = COMMANDS.get(name) if isinstance(name, str) else None
    if found is None:
        hint = NearMiss().hint(name, COMMANDS) if isinstance(name, str) else ""
        raise Misuse(UNKNOWN_COMMAND(name=format_short(name), hint=hint, names=list(COMMANDS)))
    return found.read(given)


def type_of(command: Command) -> CommandType:
    return declared(type(command))


def command_to_json(command: Command) -> dict[str, object]:
    """A command as JSON; what has its default is left out."""
    kind = type_of(command)
    data: dict[str, object] = {"do": kind.name}
    for field in kind.fields:
        value = getattr(command, field.key)
        if field.is_required or value != field.default:
            data[field.name] = field.form.to_json(value)
    return data
