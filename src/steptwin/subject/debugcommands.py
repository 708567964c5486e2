"""Commands of the debugger of a running world (`steptwin.live.debugging`): breakpoints, steps, stack, values, the past; and the
question why something is as it is (`steptwin.live.why`).

Time goes on with `Resume` and stands with `Pause`, as without a debugger; where it stops, followers receive ``stopped``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.messages import NONE, Message
from steptwin.subject.commandrow import MACHINE, NOTHING, CommandRow
from steptwin.subject.fields import TEXT, TIME, Field, choice, choices, whole

FORWARDS, BACKWARDS = "forwards", "backwards"
STEPS = ("in", "over", "out", "back")
EVENTS = ("program-error", "wrong-data", "position-error", "limit")
SCOPES = ("Variables", "Axes", "Pins", "Controller", "Registers", "World")
LONGEST_LINE_NUMBER = 1_000_000
MOST_BREAKPOINTS = 1000
_FIELDS_WITH: Mapping[str, tuple[Sequence[str], Sequence[str]]] = {
    "line": (("machine", "program"), ("condition", "hits", "log")),
    "label": ((), ("condition", "hits")),
    "value": (("machine",), ("condition",)),
}
"""Of a breakpoint: what else is needed and what is permitted."""


@dataclass(frozen=True, slots=True)
class Debug:
    """What can be debugged, and where the debugger stands."""


BREAKPOINT_GIVE_ONE = Message("subject.breakpoint-give-one", "breakpoint: give one of line, label and value; given are {given}")
BREAKPOINT_NEEDS = Message("subject.breakpoint-needs", "breakpoint: {one} needs {other}")
BREAKPOINT_TAKES_NO = Message("subject.breakpoint-takes-no", "breakpoint: {one} takes no {other}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SetBreakpoint:
    """Time stops at a line, at a label, or when a value changes: one of ``line``, ``label`` and ``value``."""

    machine: str | None = None
    program: str | None = None
    line: int | None = None
    label: str | None = None
    value: str | None = None
    condition: str | None = None
    hits: str | None = None
    log: str | None = None

    def __post_init__(self) -> None:
        fields = {name: value for name, value in asdict(self).items() if value is not None}
        given = [name for name in _FIELDS_WITH if name in fields]
        if len(given) != 1:
            raise Misuse(BREAKPOINT_GIVE_ONE(given=" and ".join(given) or NONE()))
        needed, permitted = _FIELDS_WITH[given[0]]
        for name in needed:
            if name not in fields:
                raise Misuse(BREAKPOINT_NEEDS(one=given[0], other=name))
        for name in fields:
            if name not in (*given, *needed, *permitted):
                raise Misuse(BREAKPOINT_TAKES_NO(one=given[0], other=name))


@dataclass(frozen=True, slots=True)
class ClearBreakpoint:
    """Remove a breakpoint."""

    number: int


@dataclass(frozen=True, slots=True)
class ListBreakpoints:
    """The breakpoints that are set."""


@dataclass(frozen=True, slots=True)
class StopOn:
    """Time stops at these events of controllers, and at no others."""

    events: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StepProgram:
    """Time goes on to another statement of a controller; ``back``: the debugger goes to the one before."""

    machine: str
    way: str


@dataclass(frozen=True, slots=True)
class RunProgram:
    """Go on from where the debugger stands, or back, to the next reason to stop."""

    way: str = FORWARDS


@dataclass(frozen=True, slots=True)
class LookAt:
    """The debugger goes to a moment of the past."""

    to: Nanos


@dataclass(frozen=True, slots=True)
class Branch:
    """The world goes back to the moment of the past at which the debugger stands."""


@dataclass(frozen=True, slots=True)
class Stack:
    """The statement of a controller that comes next, and those to which it returns."""

    machine: str


@dataclass(frozen=True, slots=True)
class Values:
    """A group of values of a controller."""

    machine: str
    scope: str


@dataclass(frozen=True, slots=True)
class Evaluate:
    """The value of an expression."""

    machine: str
    expression: str


@dataclass(frozen=True, slots=True)
class SetValue:
    """A variable, an input or a register takes the value of an expression."""

    machine: str
    name: str
    expression: str


@dataclass(frozen=True, slots=True)
class ProgramSource:
    """The text of a program."""

    machine: str
    program: str


@dataclass(frozen=True, slots=True)
class AskWhy:
    """Why a signal has its value, a condition its truth, or a program waits."""

    question: str = ""
    at: Nanos | None = None


DebugCommand: TypeAlias = (
    Debug
    | SetBreakpoint
    | ClearBreakpoint
    | ListBreakpoints
    | StopOn
    | StepProgram
    | RunProgram
    | LookAt
    | Branch
    | Stack
    | Values
    | Evaluate
    | SetValue
    | ProgramSource
    | AskWhy
)

_PLACE = "time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on)"
_VALUE = "name, value (as text, with its unit), number (null where it is none), settable, expression (what evaluates to it)"
_BREAKPOINT = "number, problem (why it is nowhere; null), lines of the statements, and what was given"

ROWS = (
    CommandRow(
        "debug",
        Debug,
        "What can be debugged: controllers with their programs, the lines in which breakpoints can be, labels.",
        f"machines, events, scopes, {_PLACE}",
    ),
    CommandRow(
        "breakpoint",
        SetBreakpoint,
        "Time stops before a line is executed, at a label or interrupt of any program, or when a value changes.",
        _BREAKPOINT,
        (
            Field("machine", TEXT, "The name of a machine.", None),
            Field("program", TEXT, "A program of it, such as program 0 (MIC488, by bank), program (M1486).", None),
            Field("line", whole(1, LONGEST_LINE_NUMBER), "The first statement in this line or after it.", None),
            Field("label", TEXT, "A label or interrupt: MAIN, INT_IN3, label 2.", None),
            Field("value", TEXT, "A name in an expression.", None),
            Field("condition", TEXT, "An expression that must hold.", None),
            Field("hits", TEXT, "At which of the times that it holds: 5, >= 5, % 5.", None),
            Field("log", TEXT, "Instead of a stop, followers receive this text, with the values of what is in braces.", None),
        ),
    ),
    CommandRow(
        "clear_breakpoint",
        ClearBreakpoint,
        "Remove a breakpoint.",
        NOTHING,
        (Field("breakpoint", whole(1, 1 << 53), "Its number.", attribute="number"),),
    ),
    CommandRow(
        "breakpoints",
        ListBreakpoints,
        "What time stops at, and why the debugger stands.",
        f"breakpoints: a list of {_BREAKPOINT}; stop_on; stop: as the event stopped, null while time goes on",
    ),
    CommandRow(
        "stop_on",
        StopOn,
        "Events of controllers at which time stops; those named before are replaced.",
        NOTHING,
        (Field("events", choices(EVENTS, "event"), "Which; none with an empty list."),),
    ),
    CommandRow(
        "step_program",
        StepProgram,
        "Time goes on to the next statement, to the one after a call (over), or to the one after the call in which the program is"
        " (out); or the debugger goes to the statement before (back). The event stopped says where.",
        _PLACE,
        (MACHINE, Field("way", choice(*STEPS), "Which step.")),
    ),
    CommandRow(
        "run",
        RunProgram,
        "Go on from where the debugger stands, through the past to the present and on, or back, to the next reason to stop.",
        _PLACE,
        (Field("way", choice(FORWARDS, BACKWARDS), "Which way.", FORWARDS),),
    ),
    CommandRow(
        "look_at",
        LookAt,
        "The debugger goes to a moment of the past; the world stands at the present.",
        _PLACE,
        (Field("to_ns", TIME, "Which moment.", unit="ns", attribute="to"),),
    ),
    CommandRow(
        "branch",
        Branch,
        "The world goes back to the moment of the past at which the debugger stands; what came later has not happened.",
        _PLACE,
    ),
    CommandRow(
        "stack",
        Stack,
        "The statement that comes next, or is waited in, then those to which it returns; empty where no program runs.",
        "a list of name (the label before it), program, source, line, column, end_line, end_column",
        (MACHINE,),
        is_list=True,
    ),
    CommandRow(
        "values",
        Values,
        "A group of values where the debugger stands.",
        f"a list of {_VALUE}",
        (MACHINE, Field("scope", choice(*SCOPES), "Which group.")),
        is_list=True,
    ),
    CommandRow(
        "evaluate",
        Evaluate,
        "The value of an expression where the debugger stands.",
        _VALUE,
        (MACHINE, Field("expression", TEXT, "Names of the program and signals of the world, as in docs/debugger.md.")),
    ),
    CommandRow(
        "set_value",
        SetValue,
        "A variable, an input or a register takes a value, at the present only.",
        _VALUE,
        (MACHINE, Field("name", TEXT, "Which."), Field("expression", TEXT, "Its value.")),
    ),
    CommandRow(
        "program_source",
        ProgramSource,
        "The text of a program.",
        "program, source (the name of its file), text",
        (MACHINE, Field("program", TEXT, "Which, such as program 0.")),
    ),
    CommandRow(
        "why",
        AskWhy,
        "The chain of causes of a value, of a condition or of a wait, from the past that is kept.",
        "question, at_ns, state (what is true), since_ns (null: it has not changed), links: a list of time_ns, subject and text,"
        " from the effect to its causes; complete, known_from_ns, cut (whether the"
        " chain ends there), text (all of it in lines)",
        (
            Field("question", TEXT, "A signal, a condition, or the name of a controller: what its program waits for.", ""),
            Field("at_ns", TIME, "At which moment; now without.", None, "ns", "at"),
        ),
    ),
)
