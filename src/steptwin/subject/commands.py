"""Commands as values: what can be asked of a subject. One table has their names, fields and answers.

The steps of scripts that are not only for scripts (`steptwin.simulation.script.steps`) are commands as they are; the others are
here. A message of the control endpoint is a command as JSON: ``{"do": NAME, FIELD: VALUE, ...}``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.plaintypes import shown
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControlProgram, Enable, Home, Jog, Move, StopAxes
from steptwin.simulation.world.inputs import Download, See
from steptwin.subject.commandrow import MACHINE, NOTHING, CommandRow
from steptwin.subject.debugcommands import ROWS as DEBUG_ROWS
from steptwin.subject.debugcommands import DebugCommand
from steptwin.subject.fields import (
    CHARACTERS,
    FAULT,
    FLAG,
    HEX,
    ID,
    LEVELS,
    NAMES,
    PROGRAM,
    SPEED,
    TEXT,
    TIME,
    Field,
    choice,
    choices,
    number,
    read_fields,
    whole,
)
from steptwin.subject.payloads import KINDS

VERSION = 1
"""Of the commands, their answers and the events; a request may name the one that it was written for."""

# ---------------------------------------------------------------------- looking


@dataclass(frozen=True, slots=True)
class Describe:
    """What there is: controllers, axes, pins, buttons, lines."""


@dataclass(frozen=True, slots=True)
class ReadPoints:
    """The present values of points."""

    points: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ReadPins:
    """The levels of all pins, of one machine where it is named."""

    machine: str | None = None


@dataclass(frozen=True, slots=True)
class ReadState:
    """The present state of a machine: status, program, axes, pins, details (`steptwin.controllerstate`), or some of it."""

    machine: str
    parts: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Encoders:
    """The encoders of a machine: counts, and what turns their shafts."""

    machine: str


@dataclass(frozen=True, slots=True)
class ListFaults:
    """The faults that are set."""


@dataclass(frozen=True, slots=True)
class ListFaultKinds:
    """What can go wrong, and what each kind of fault takes."""


@dataclass(frozen=True, slots=True)
class Time:
    """The present moment, and how time goes."""


@dataclass(frozen=True, slots=True)
class EndPoints:
    """Where the subject listens for programs outside."""


@dataclass(frozen=True, slots=True)
class Follow:
    """Be sent events from now on."""

    kinds: tuple[str, ...] | None = None
    machines: tuple[str, ...] | None = None
    axes: tuple[str, ...] | None = None
    bound: int = 1000


@dataclass(frozen=True, slots=True)
class Unfollow:
    """Be sent no more events for the request with this id."""

    id: object


# ---------------------------------------------------------------------- time and sessions


@dataclass(frozen=True, slots=True)
class StopAll:
    """Stop all controllers, with their programs, and scripts."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Time stands."""


@dataclass(frozen=True, slots=True)
class Resume:
    """Time goes on, at a speed where one is given."""

    speed: float | None = None


STEP_HAS_TWO_ENDS = Message("subject.step-has-two-ends", "step: for_ns and to_ns exclude each other")


@dataclass(frozen=True, slots=True)
class Advance:
    """Time goes on for a duration or to a moment, at most until a condition is true, and stands then."""

    duration: Nanos | None = None
    to: Nanos | None = None
    until: str | None = None

    def __post_init__(self) -> None:
        if self.duration is not None and self.to is not None:
            raise Misuse(STEP_HAS_TWO_ENDS())


@dataclass(frozen=True, slots=True)
class Save:
    """Write the session, or the last records, to a file."""

    file: str


@dataclass(frozen=True, slots=True)
class TakeSnapshot:
    """Keep the present state, to go back to it; None: under a number."""

    name: str | None = None


@dataclass(frozen=True, slots=True)
class ListSnapshots:
    """The states that are kept."""


@dataclass(frozen=True, slots=True)
class RestoreSnapshot:
    """Go back to a state that is kept; time stands there."""

    name: str


@dataclass(frozen=True, slots=True)
class DropSnapshot:
    """Keep a state no longer."""

    name: str


Command: TypeAlias = (
    do.Set
    | do.Press
    | do.Release
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
    | Download
    | Describe
    | ReadPoints
    | ReadPins
    | ReadState
    | Encoders
    | ListFaults
    | ListFaultKinds
    | Time
    | EndPoints
    | Follow
    | Unfollow
    | Enable
    | Move
    | Home
    | Jog
    | StopAxes
    | StopAll
    | ControlProgram
    | Pause
    | Resume
    | Advance
    | Save
    | TakeSnapshot
    | ListSnapshots
    | RestoreSnapshot
    | DropSnapshot
    | DebugCommand
)


# ---------------------------------------------------------------------- the table


STOPPED = "program: what the program does now: running (it goes on), paused, stopped; null where that is not known"


_AXIS = Field("axis", whole(1, 64), "The number of an axis.")
UNITS = "units of the data sheet"
"""Of fields that are in the unit of their axis."""


_ROWS = (
    CommandRow(
        "describe",
        Describe,
        "What there is.",
        "version, name, machines with the numbers of their datasheets, axes, buttons, elements, connections, lines, commands",
    ),
    CommandRow(
        "read",
        ReadPoints,
        "The present values of points.",
        "a list of point, value, unit, quality ('good', or 'unknown' with value null)",
        (Field("points", NAMES, "Points, such as table.M1.position, table.IN3, x.position, time."),),
        is_list=True,
    ),
    CommandRow(
        "pins",
        ReadPins,
        "The levels of all pins: 0, 1, volts.",
        '{"MACHINE.PIN": LEVEL, ...}',
        (Field("machine", TEXT, "The name of a machine; all of them without.", None),),
    ),
    CommandRow(
        "state",
        ReadState,
        "The present state of a machine.",
        "the state, alike for all kinds",
        (MACHINE, Field("parts", NAMES, "Only these parts: status, program, pins, details, names of axes.", None)),
    ),
    CommandRow("encoders", Encoders, "The encoders of a machine.", "a list of axis, counts, turned_by", (MACHINE,), is_list=True),
    CommandRow(
        "faults",
        ListFaults,
        "The faults that are set.",
        "a list of name, fault, seen (occasions), happened (how often)",
        is_list=True,
    ),
    CommandRow(
        "fault_kinds",
        ListFaultKinds,
        "The kinds of faults.",
        "a list of name, layer, occasion, meaning, lines, parameters: name, meaning, permitted, default, words, required",
        is_list=True,
    ),
    CommandRow("time", Time, "The present moment, and how time goes.", "world, time_ns, time_s, paused, speed, stopped"),
    CommandRow(
        "end_points",
        EndPoints,
        "Where programs can connect.",
        "name, pid, file, controllers, end_points: a list of kind, protocol and the address",
    ),
    CommandRow(
        "follow",
        Follow,
        "Events from now on, as messages with the id of this request.",
        "plans: the present plan of every axis that is followed, as events",
        (
            Field("kinds", choices(KINDS, "kind of event"), "Kinds of events; all but frames without.", None),
            Field("machines", NAMES, "Names of machines, lines, or 'world'; all without.", None),
            Field("axes", NAMES, "Numbers of axes as text; events of other axes are left out.", None),
            Field("bound", whole(1, 100_000), "Events that wait to be sent; beyond it the oldest are dropped and counted.", 1000),
        ),
    ),
    CommandRow(
        "unfollow", Unfollow, "No more events.", NOTHING, (Field("follow", ID, "The id of the request.", attribute="id"),)
    ),
    CommandRow("set", do.Set, "Inputs take levels, all of them or none.", NOTHING, (Field("levels", LEVELS, "0, 1, volts."),)),
    CommandRow(
        "press",
        do.Press,
        "Press a button.",
        NOTHING,
        (
            Field("button", TEXT, "The name of a button."),
            Field("for_ns", TIME, "How long; until it is released without.", None, "ns", "duration"),
        ),
    ),
    CommandRow("release", do.Release, "Release a button.", NOTHING, (Field("button", TEXT, "The name of a button."),)),
    CommandRow(
        "write",
        do.Write,
        "Registers take values by name, as a Modbus master writes them.",
        NOTHING,
        (Field("values", LEVELS, "Registers by MACHINE.REGISTER.", unit=UNITS),),
    ),
    CommandRow(
        "send",
        do.Send,
        "Characters go to a line.",
        NOTHING,
        (Field("line", TEXT, "The name of a line."), Field("text", CHARACTERS, "Characters, one byte each.", attribute="data")),
    ),
    CommandRow(
        "request",
        do.Request,
        "A Modbus request on a line.",
        "pdu: that of the answer, null where it has not come at once; a frame event has it then",
        (
            Field("line", TEXT, "The name of a line."),
            Field("unit", whole(0, 255), "The slave address."),
            Field("pdu", HEX, "Function code and data."),
            Field("within_ns", TIME, "How long the answer is waited for.", SECOND, "ns", "within"),
        ),
    ),
    CommandRow("power_cycle", do.PowerCycle, "Switch a machine off and on again.", NOTHING, (MACHINE,)),
    CommandRow(
        "turn",
        do.Turn,
        "Turn the encoder shaft of an axis.",
        NOTHING,
        (MACHINE, _AXIS, Field("counts", whole(-(2**31), 2**31 - 1), "By how much.", unit="encoder counts")),
    ),
    CommandRow(
        "couple",
        do.Couple,
        "What turns the encoder shaft of an axis without mechanics.",
        NOTHING,
        (MACHINE, _AXIS, Field("to", choice(*do.COUPLINGS), "What turns it.", attribute="coupling")),
    ),
    CommandRow("fault", do.SetFault, "Something goes wrong from now on.", "name", (Field("fault", FAULT, "Which."),)),
    CommandRow("clear_fault", do.ClearFault, "Remove a fault.", NOTHING, (Field("name", TEXT, "The name of a fault."),)),
    CommandRow(
        "expect", do.Expect, "A condition must hold; else that is reported.", "holds", (Field("condition", TEXT, "Which."),)
    ),
    CommandRow("note", do.Note, "A text for the record.", NOTHING, (Field("text", TEXT, "The text."),)),
    CommandRow(
        "see",
        See,
        "A record of a vision system comes to a controller.",
        NOTHING,
        (MACHINE, *(Field(name, number(), f"The {name} of the record.") for name in ("number", "x", "y", "angle"))),
    ),
    CommandRow(
        "enable",
        Enable,
        "Switch a drive on or off.",
        NOTHING,
        (MACHINE, _AXIS, Field("on", FLAG, "Whether it is to be on.", True)),
    ),
    CommandRow(
        "move",
        Move,
        "Begin to move.",
        NOTHING,
        (
            MACHINE,
            _AXIS,
            Field("to", number(), "To this position.", None, UNITS),
            Field("by", number(), "By this distance.", None, UNITS),
        ),
    ),
    CommandRow(
        "home",
        Home,
        "Begin to home.",
        NOTHING,
        (MACHINE, _AXIS, Field("velocity", number(), "Its sign chooses the switch.", unit=f"{UNITS}/s")),
    ),
    CommandRow(
        "jog",
        Jog,
        "Begin to move without end.",
        NOTHING,
        (MACHINE, _AXIS, Field("velocity", number(), "Velocity with its sign.", unit=f"{UNITS}/s")),
    ),
    CommandRow(
        "stop",
        StopAxes,
        "Stop as fast as the controller does, with a ramp or without. The program of a MIC488 goes on.",
        STOPPED,
        (MACHINE, Field("axis", whole(1, 64), "The number of an axis; all without.", None)),
    ),
    CommandRow(
        "stop_all",
        StopAll,
        "Stop everything: all axes and jogs, programs (paused where the controller can pause one, else ended), and scripts. "
        "Fails if a controller could not be stopped; the others are.",
        "machines: the controllers that were stopped; scripts: those that were ended",
    ),
    CommandRow(
        "program",
        ControlProgram,
        "Start, pause or stop the program of a machine.",
        NOTHING,
        (MACHINE, Field("action", choice("start", "pause", "stop"), "What to do.")),
    ),
    CommandRow(
        "download",
        Download,
        "Put a text into the program memory of a controller: a MIC488 has it at once, to an M1486 it is typed, and runs then.",
        NOTHING,
        (
            MACHINE,
            Field("place", TEXT, "Where, such as program 0, positions 0 (MIC488, by bank), program (M1486)."),
            Field("text", PROGRAM, "The text. One with errors is refused with what is wrong."),
        ),
    ),
    CommandRow("pause", Pause, "Time stands.", "as time"),
    CommandRow("resume", Resume, "Time goes on.", "as time", (Field("speed", SPEED, "Virtual seconds in a second.", None),)),
    CommandRow(
        "step",
        Advance,
        "Time goes on for a duration, to a moment, or to the next thing that happens by itself, and stands then.",
        "as time; events, missed, came (whether the condition ended it), idle, statements; to_ns where a request has to go on",
        (
            Field("for_ns", TIME, "How long.", None, "ns", "duration"),
            Field("to_ns", TIME, "To which moment.", None, "ns", "to"),
            Field("until", TEXT, "A condition that ends it.", None),
        ),
    ),
    CommandRow(
        "snapshot",
        TakeSnapshot,
        "Keep the present state in the process, to go back to it; one of the same name is replaced.",
        "name, time_ns",
        (Field("name", TEXT, "Its name; a number without.", None),),
    ),
    CommandRow("snapshots", ListSnapshots, "The states that are kept.", "a list of name, time_ns", is_list=True),
    CommandRow(
        "restore",
        RestoreSnapshot,
        "Go back to a state that is kept. Time stands there; what happened since is undone.",
        "as time",
        (Field("name", TEXT, "The name of a snapshot."),),
    ),
    CommandRow(
        "drop_snapshot", DropSnapshot, "Keep a state no longer.", NOTHING, (Field("name", TEXT, "The name of a snapshot."),)
    ),
    CommandRow(
        "save",
        Save,
        "Write the session, or the last records, to a file.",
        "as time; file, inputs, digest, or files, records for the last records",
        (Field("file", TEXT, "Absolute path."),),
    ),
    *DEBUG_ROWS,
)

COMMANDS: Mapping[str, CommandRow] = {row.name: row for row in _ROWS}
_BY_KIND: Mapping[object, CommandRow] = {row.kind: row for row in _ROWS}


UNKNOWN_COMMAND = Message("subject.unknown-command", "no command {name}{hint}; commands are {names}")


def read_command(name: object, given: Mapping[str, object]) -> Command:
    """The command called ``name`` with fields as in JSON. Raises `Misuse`."""
    row = COMMANDS.get(name) if isinstance(name, str) else None
    if row is None:
        hint = NearMiss().hint(name, COMMANDS) if isinstance(name, str) else ""
        raise Misuse(UNKNOWN_COMMAND(name=shown(name), hint=hint, names=list(COMMANDS)))
    return row.kind(**read_fields(row.name, row.fields, given))


def row_of(command: Command) -> CommandRow:
    return _BY_KIND[type(command)]


def name_of(kind: type[Command]) -> str:
    """Of a class of commands."""
    return _BY_KIND[kind].name


def plain_command(command: Command) -> dict[str, object]:
    """A command as JSON; what has its default is left out."""
    row = row_of(command)
    plain: dict[str, object] = {"do": row.name}
    for field in row.fields:
        value = getattr(command, field.key)
        if field.is_required or value != field.default:
            plain[field.name] = field.form.plain(value)
    return plain
