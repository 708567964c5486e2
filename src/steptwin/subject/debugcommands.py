"""Commands of the debugger of a running world (`steptwin.live.debugging`): breakpoints, steps, stack, values, the past; and the
question why something is as it is (`steptwin.live.why`).

Time goes on with `Resume` and stands with `Pause`, as without a debugger; where it stops, subscribers receive ``stopped``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.fields import TIME, ControllerName, Meaning, choice, choices, whole
from steptwin.messages import NONE, Message
from steptwin.simulation.script.command import command

FORWARDS, BACKWARDS = "forwards", "backwards"
STEPS = ("in", "over", "out", "back")
EVENTS = ("program-error", "wrong-data", "position-error", "limit")
SCOPES = ("Variables", "Axes", "Pins", "Controller", "Registers", "World")
LONGEST_LINE_NUMBER = 1_000_000
MOST_BREAKPOINTS = 1000
_FIELDS_WITH: Mapping[str, tuple[Sequence[str], Sequence[str]]] = {
    "line": (("controller", "program"), ("condition", "hits", "log")),
    "label": ((), ("condition", "hits")),
    "value": (("controller",), ("condition",)),
}
"""Further needs and permitted values of a breakpoint."""


BREAKPOINT_GIVE_ONE = Message("subject.breakpoint-give-one", "breakpoint: give one of line, label and value; given are {given}")
BREAKPOINT_NEEDS = Message("subject.breakpoint-needs", "breakpoint: {one} needs {other}")
BREAKPOINT_TAKES_NO = Message("subject.breakpoint-takes-no", "breakpoint: {one} takes no {other}")


_PLACE = "time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on)"
_VALUE = "name, value (as text, with its unit), number (null where it is none), settable, expression (what evaluates to it)"
_BREAKPOINT = "number, problem (why it is nowhere; null), lines of the statements, and what was given"


@command(
    "debug",
    "What can be debugged: controllers with their programs, the lines in which breakpoints can be, labels.",
    f"controllers, events, scopes, {_PLACE}",
)
@dataclass(frozen=True, slots=True)
class Debug:
    pass


@command(
    "breakpoint",
    "Time stops before a line is executed, at a label or interrupt of any program, or when a value changes.",
    _BREAKPOINT,
)
@dataclass(frozen=True, slots=True, kw_only=True)
class SetBreakpoint:
    controller: Annotated[str | None, Meaning("The name of a controller.")] = None
    program: Annotated[str | None, Meaning("A program of it, such as program 0 (MIC488, by bank), program (M1486).")] = None
    line: Annotated[int | None, Meaning("The first statement in this line or after it.", whole(1, LONGEST_LINE_NUMBER))] = None
    label: Annotated[str | None, Meaning("A label or interrupt: MAIN, INT_IN3, label 2.")] = None
    value: Annotated[str | None, Meaning("A name in an expression.")] = None
    condition: Annotated[str | None, Meaning("An expression that must hold.")] = None
    hits: Annotated[str | None, Meaning("At which of the times that it holds: 5, >= 5, % 5.")] = None
    log: Annotated[
        str | None, Meaning("Instead of a stop, subscribers receive this text, with the values of what is in braces.")
    ] = None

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


@command("clear_breakpoint", "Remove a breakpoint.")
@dataclass(frozen=True, slots=True)
class ClearBreakpoint:
    number: Annotated[int, Meaning("Its number.", whole(1, 1 << 53), name="breakpoint")]


@command(
    "breakpoints",
    "What time stops at, and why the debugger has stopped.",
    f"breakpoints: a list of {_BREAKPOINT}; stop_on; stop: as the event stopped, null while time goes on",
)
@dataclass(frozen=True, slots=True)
class ListBreakpoints:
    pass


@command("stop_on", "Events of controllers at which time stops; those named before are replaced.")
@dataclass(frozen=True, slots=True)
class StopOn:
    events: Annotated[tuple[str, ...], Meaning("Which; none with an empty list.", choices(EVENTS, "event"))]


@command(
    "step_program",
    "Time goes on to the next statement, to the one after a call (over), or to the one after the call in which the program is"
    " (out); or the debugger goes to the statement before (back). The event stopped says where.",
    _PLACE,
)
@dataclass(frozen=True, slots=True)
class StepProgram:
    controller: ControllerName
    way: Annotated[str, Meaning("Which step.", choice(*STEPS))]


@command(
    "run",
    "Go on from the debugger's moment, through the past to the present and on, or back, to the next reason to stop.",
    _PLACE,
)
@dataclass(frozen=True, slots=True)
class RunProgram:
    way: Annotated[str, Meaning("Which way.", choice(FORWARDS, BACKWARDS))] = FORWARDS


@command("look_at", "Move the debugger to a moment of the past; the world stays at the present, paused.", _PLACE)
@dataclass(frozen=True, slots=True)
class LookAt:
    to: Annotated[Nanos, Meaning("Which moment.", TIME, unit="ns", name="to_ns")]


@command(
    "branch",
    "Take the world back to the debugger's moment of the past; what came later has not happened.",
    _PLACE,
)
@dataclass(frozen=True, slots=True)
class Branch:
    pass


@command(
    "stack",
    "The statement that comes next, or is waited in, then those to which it returns; empty where no program runs.",
    "a list of name (the label before it), program, source, line, column, end_line, end_column",
    is_list=True,
)
@dataclass(frozen=True, slots=True)
class Stack:
    controller: ControllerName


@command("values", "A group of values at the debugger's moment.", f"a list of {_VALUE}", is_list=True)
@dataclass(frozen=True, slots=True)
class Values:
    controller: ControllerName
    scope: Annotated[str, Meaning("Which group.", choice(*SCOPES))]


@command("evaluate", "The value of an expression at the debugger's moment.", _VALUE)
@dataclass(frozen=True, slots=True)
class Evaluate:
    controller: ControllerName
    expression: Annotated[str, Meaning("Names of the program and signals of the world, as in docs/debugger.md.")]


@command("set_value", "A variable, an input or a register takes a value, at the present only.", _VALUE)
@dataclass(frozen=True, slots=True)
class SetValue:
    controller: ControllerName
    name: Annotated[str, Meaning("Which.")]
    expression: Annotated[str, Meaning("Its value.")]


@command("program_source", "The text of a program.", "program, source (the name of its file), text")
@dataclass(frozen=True, slots=True)
class ProgramSource:
    controller: ControllerName
    program: Annotated[str, Meaning("Which, such as program 0.")]


@command(
    "why",
    "The chain of causes of a value, of a condition or of a wait, from the past that is kept.",
    "question, at_ns, state (what is true), since_ns (null: it has not changed), links: a list of time_ns, subject and text,"
    " from the effect to its causes; complete, known_from_ns, cut (whether the"
    " chain ends there), trials (with try_without: the links that the run was repeated without, each with effect: otherwise,"
    " other time, same or unknown, and without: what would be), text (all of it in lines)",
)
@dataclass(frozen=True, slots=True)
class AskWhy:
    question: Annotated[str, Meaning("A signal, a condition, or the name of a controller: what its program waits for.")] = ""
    at: Annotated[Nanos | None, Meaning("At which moment; now without.", TIME, unit="ns", name="at_ns")] = None
    everything: Annotated[bool, Meaning("All that is found, not only the first sixteen links.", name="all")] = False
    try_without: Annotated[
        bool, Meaning("Repeat the run without each root: input, script act, request or fault. Implies all.")
    ] = False


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
