"""The programs of controllers while they are executed: their statements, where they stand, their variables.

One contract for all languages: traces, subscribers and the debugger ask for no more. A location is a statement of a text; texts
are named as in `steptwin.simulation.kinds.programtexts`.
"""

from __future__ import annotations

import enum
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText
from steptwin.messages import MessageText
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.statements import StatementHook


class StatementLocation(NamedTuple):
    """A statement of a text. ``number`` counts the statements of the text from 0."""

    text: str
    number: int


@dataclass(frozen=True, slots=True)
class Statement:
    """``start`` and ``end`` are its characters in the text, ``line`` counts from 1."""

    start: int
    end: int
    line: int


class Frame(NamedTuple):
    """A location to which the execution has come, or to which it returns; ``name``: the label or interrupt before it."""

    name: str
    location: StatementLocation


class ResourceKind(enum.Enum):
    """Kind of a thing that a statement reads or changes."""

    PIN = "pin"
    AXIS = "axis"
    """By its number; empty: any axis."""
    ORIGIN = "origin"
    """The zero of the coordinate of an axis, by its number."""
    ENCODER = "encoder"
    """The counter of an encoder, by the number of its axis, which something else may turn."""
    VALUE = "value"
    """A variable or register of the program."""
    REQUEST = "request"
    """A request of a client, by the registers that it writes."""
    PROGRAM = "program"
    """The program itself: whether it is executed."""


class Resource(NamedTuple):
    kind: ResourceKind
    name: str


class StatementUse(NamedTuple):
    """Reads and changes of a statement, and the statements that depend on it."""

    reads: tuple[Resource, ...] = ()
    writes: tuple[Resource, ...] = ()
    waits: bool = False
    """Whether the program goes on only when what it reads permits it, or, if it reads nothing, after a time."""
    lasts: bool = False
    """Whether what it began changes something once more when the program has gone on."""
    governs: range = range(0)
    """Numbers of the statements of which it decides whether they are executed."""
    is_loop: bool = False
    """Whether it also decides when those after them are executed."""
    jumps: int | None = None
    """Where the program goes on, if that depends on nothing."""
    acts_by: tuple[Resource, ...] = ()
    """Values by which it acts, besides those that it reads, such as the distance of a move."""
    made_by: tuple[Resource, ...] = ()
    """Values by which the motion that it begins is made, such as a velocity."""
    keeps: bool = False
    """Whether it may change a point of the controller without an event of that (`steptwin.points.LivePoint.is_kept`)."""
    edges: tuple[tuple[float, float], ...] = ()
    """Levels that the pin which it reads has to take, by values of what it acts by; with another value it may be either."""
    sets: float | None = None
    """Level that it gives to the outputs which it writes, where that is always the same."""


class WriteUse(NamedTuple):
    """Things by which a written register of a controller acts, besides its value."""

    acts_by: tuple[Resource, ...] = ()
    """Registers have their names in the data sheet."""
    mode: str = ""
    """The register that is not 0 while a written value is only kept, until `trigger` is written; empty if it never is."""
    trigger: str = ""
    bit: int = 0
    """The bit of the value of `trigger` that chooses this register."""


class GivenCommand(NamedTuple):
    """A command that came over a line by itself, in no text."""

    code: str
    use: StatementUse
    is_filed: bool = False
    """Whether it is in a file that is still open."""


class ProgramState(enum.Enum):
    """States of a program, of which one lasts until something from outside the program, or its end."""

    RUNS = "runs"
    STOPPED = "stopped"
    PAUSED = "paused"
    KILLED = "stopped by Kill"
    LIMITED = "stopped by LIMIT"
    SHUT_DOWN = "shut down"


class ProgramStand(NamedTuple):
    """A program that does not go on. One that `ProgramState.RUNS` waits: for a condition, the end of a motion, or a moment."""

    state: ProgramState
    location: StatementLocation | None = None
    """Where it waits or is held, or the statement that failed; None where that is not known, and where it has ended."""
    since: Nanos | None = None
    error: MessageText | None = None
    """The error that has stopped it."""


class Programs(Protocol):
    """The programs of one controller."""

    @property
    def statement_time(self) -> Nanos:
        """Time that a statement takes."""
        ...

    @property
    def texts(self) -> Mapping[str, SourceText]:
        """The present ones: a download replaces them."""
        ...

    def statements(self, text: str) -> Sequence[Statement]:
        """All statements of a text, in its order."""
        ...

    def after(self, text: str) -> Mapping[int, Sequence[int]]:
        """The statements that do something, by number, with the numbers of those that can come next in the text, of which a
        branch has several; the number after the last statement is the end. What calls come to does not count, nor do words that
        only close a block."""
        ...

    def reached(self, text: str, starts: Collection[int]) -> Collection[int]:
        """The statements of a text, by number, that can be executed after those at ``starts``, by any way, behind the calls that
        can have led there, and in interrupts; these included."""
        ...

    def labels(self, text: str) -> Mapping[str, int]:
        """Numbers of the statements at labels and interrupts, by name."""
        ...

    def add_hook(self, hook: StatementHook, locations: Collection[StatementLocation] | None = None) -> None:
        """Call ``hook`` before each statement (`steptwin.statements`), or before those at ``locations``, and at others by
        chance."""
        ...

    def remove_hook(self, hook: StatementHook) -> None: ...

    def begun(self, now: Nanos) -> Sequence[int]:
        """The numbers of statements that were executed at power-on, before there could be a hook; empty after 0 s, and where
        statements take no time."""
        ...

    def location(self, number: int) -> StatementLocation | None:
        """Location of a statement for which a hook was called, at that moment; None where it comes from no text."""
        ...

    @property
    def state(self) -> ProgramState: ...

    @property
    def holding(self) -> Mapping[ProgramState, Sequence[Resource]]:
        """The inputs whose level, and values by which, a program is held in a state."""
        ...

    def given(self, number: int) -> GivenCommand | None:
        """Command for which a hook was called, at that moment, where `location` knows none; None where nothing is given so."""
        ...

    def queued(self) -> Sequence[GivenCommand]:
        """Commands that came over a line by itself, and wait for the end of what is in execution, or of their file."""
        ...

    def commands(self, data: bytes) -> Sequence[GivenCommand]:
        """Commands in characters of a line; none where they give none by themselves."""
        ...

    def depth(self) -> int:
        """How many calls and interrupts have not returned yet."""
        ...

    def deferred(self) -> Sequence[StatementLocation]:
        """The labels of interrupts that have come while a program runs, and wait for the end of what is in execution."""
        ...

    def comes_back(self, location: StatementLocation) -> bool:
        """Whether what the statement calls returns to the one after it; True for what calls nothing."""
        ...

    def use(self, location: StatementLocation) -> StatementUse: ...

    def stack(self, now: Nanos) -> Sequence[Frame]:
        """The statement that is executed, or comes next, then those to which it returns; empty where no program runs."""
        ...

    def stand(self, now: Nanos) -> ProgramStand | None:
        """Reason that keeps it from going on; None while it goes on, and where there is no program."""
        ...

    def variables(self, now: Nanos) -> Mapping[str, float]: ...

    def read(self, name: str, now: Nanos) -> float | None:
        """Value of a name of the program for the statement of this moment; None where it means nothing."""
        ...

    def has_name(self, name: str) -> bool:
        """Whether a name means something in one of the texts, whether or not the program runs."""
        ...

    def point(self, name: str) -> str | None:
        """The point of the controller that a name of the language means, such as ``USER_REGISTER[10]:real`` for ``$R10``; None
        for others."""
        ...

    def set_variable(self, name: str, value: float, now: Nanos) -> None:
        """Raises `Misuse` for a name or value that is not permitted."""
        ...

    def execute_all(self, on: bool, now: Nanos) -> None:
        """Whether every statement of a loop is executed even where nothing can change by it: a debugger stops at each."""
        ...


class StatementSubscription:
    """Reports each statement that a program of the world executes as a record of kind ``statement``, until `close`."""

    def __init__(self, programs_of: Mapping[str, Programs], report: RecordSink) -> None:
        """``programs_of``: by controller."""
        self._hooks: list[tuple[Programs, StatementHook]] = []
        for name, programs in programs_of.items():
            hook = _reporting(name, programs, report)
            programs.add_hook(hook)
            self._hooks.append((programs, hook))

    def close(self) -> None:
        for programs, hook in self._hooks:
            programs.remove_hook(hook)
        self._hooks.clear()


def _reporting(name: str, programs: Programs, report: RecordSink) -> StatementHook:
    def hook(now: Nanos, number: int) -> None:
        location = programs.location(number)
        if location is not None:
            report(TraceRecord(now, name, "statement", location.text, programs.statements(location.text)[location.number].line))

    return hook
