"""The code of a program: what `steptwin.wbc.compile` makes and `steptwin.wbc.interpreter` executes.

The function of a step takes the execution and its cells (variables, then constants) and returns the number of the step that
follows; with all bits inverted (``~number``) if the machine must check for waits and interrupts before it continues.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

from steptwin.machine import Nanos
from steptwin.wbc.controller import ProgramController, Tendency

Cells: TypeAlias = "array[float]"
StepCode: TypeAlias = "Callable[[Execution, Cells], int]"
Seen: TypeAlias = Callable[[Any, Cells, Nanos], float]
"""(controller, cells, moment) → the value that a condition depends on at that moment."""


class Execution(Protocol):
    """The interface of a program's execution to its steps; see `steptwin.wbc.interpreter.Interpreter`."""

    controller: ProgramController
    now: Nanos
    stack: deque[tuple[int, Nanos]]
    effects: int
    forgotten: bool
    handling: bool
    waiting: bool
    not_before: Nanos

    def acting(self) -> ProgramController: ...
    def push(self, step: int, not_before: Nanos) -> None: ...


class WatchedValue(NamedTuple):
    """A value of a step that changes with time. ``tendency`` None: unknown."""

    seen: Seen
    tendency: Tendency | None


class InterruptEntry(NamedTuple):
    """An interrupt label: its step, and whether it waits for the end of the statement in progress."""

    step: int
    hard: bool


@dataclass(frozen=True, slots=True)
class Code:
    """``steps`` has one more than the program: the end. ``cells`` are variables (0) and constants at the start.

    ``watches`` of every step; ``entries`` by number of the event in `EVENTS`.
    """

    steps: tuple[StepCode, ...]
    watches: tuple[tuple[WatchedValue, ...], ...]
    cells: Cells
    entries: Mapping[int, InterruptEntry]
