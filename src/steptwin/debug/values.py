"""Plain values that a debugger takes and gives."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.kinds.programs import StatementLocation


class StopReason(enum.Enum):
    ENTRY = "entry"
    """Before the first statement."""
    STEP = "step"
    BREAKPOINT = "breakpoint"
    FUNCTION = "function breakpoint"
    """A breakpoint at a label or interrupt."""
    DATA = "data breakpoint"
    EXCEPTION = "exception"
    """An event that the user wants to stop at, such as a program error."""
    PAUSE = "pause"
    BEGIN = "begin"
    """Going back, the oldest moment that is kept was reached."""
    WORLD = "world"
    """A script of the world stopped it."""
    IDLE = "idle"
    """Nothing will happen any more by itself."""
    LIMIT = "limit"
    """The moment up to which it was to run was reached."""


@dataclass(frozen=True, slots=True)
class Stopped:
    """Where a run came to a stand: at ``time``, before whatever happens next. ``controller``: the controller because of which."""

    reason: StopReason
    time: Nanos
    controller: str | None = None
    text: str = ""
    points: tuple[int, ...] = ()
    """The breakpoints that were hit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinePoint:
    """A breakpoint in a line of a text of a controller. ``condition`` and ``log`` as in `steptwin.debug.calculation`.

    ``hits``: at which of the times that the condition holds: ``5``, ``>= 5``, ``% 5``. With ``log`` it does not stop, but writes
    the text with the values of what is in braces.
    """

    controller: str
    text: str
    line: int
    condition: str | None = None
    hits: str | None = None
    log: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelPoint:
    """A breakpoint at a label or interrupt of any program: ``MAIN``, ``INT_IN3``, ``label 2``."""

    label: str
    condition: str | None = None
    hits: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DataPoint:
    """A stop when a value changes, or when ``condition`` comes true. ``name`` is one in an expression of ``controller``."""

    controller: str
    name: str
    condition: str | None = None


class Events(enum.Enum):
    """Events at which a run stops on request, with the codes of controllers."""

    PROGRAM_ERROR = "program-error", "Program error", ("program-error",)
    WRONG_DATA = "wrong-data", "Wrong data (M1486)", ("wrong-data", "file-refused")
    POSITION_ERROR = "position-error", "Position error", ("position-error",)
    LIMIT = "limit", "Limit", ("limit", "overrun")

    def __init__(self, code: str, title: str, codes: tuple[str, ...]) -> None:
        self.code = code
        self.title = title
        self.codes = codes


class SetPoint(NamedTuple):
    """Result of setting a breakpoint: where it is, or why it is nowhere."""

    number: int
    locations: Sequence[StatementLocation] = ()
    line: int | None = None
    """Line of the statement, which may come after the line that was asked for."""
    problem: str = ""
    note: str = ""
    """Why it is set, but no run comes there."""

    @property
    def is_set(self) -> bool:
        return not self.problem


class Location(NamedTuple):
    """A statement in a text: lines and columns from 1, the end is exclusive."""

    controller: str
    text: str
    source: str
    """The name of the text's file."""
    line: int
    column: int
    end_line: int
    end_column: int


class StackFrame(NamedTuple):
    """``name``: the label before the statement."""

    name: str
    location: Location


class FormattedValue(NamedTuple):
    """``text`` is for people, with the unit. ``number`` None: it is no number, or not known."""

    name: str
    text: str
    number: float | None = None
    is_settable: bool = False
    expression: str = ""
    """Expression of it; empty where there is none."""


class Scope(NamedTuple):
    """A group of values of a controller."""

    name: str
    values: Sequence[FormattedValue]
