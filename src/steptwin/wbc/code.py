"""The code of a program: what `steptwin.wbc.compile` makes and `steptwin.wbc.interpreter` executes.

The function of a step takes the execution and its cells (variables, then constants) and returns the number of the step that
follows; with all bits inverted (``~number``) if the controller must check for waits and interrupts before it continues.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.wbc.controller import ProgramController, Tendency
from steptwin.wbc.real import real

COMPILED_AFTER = 250
"""Executions of `StraightSteps` as calls: to compile a line takes as long as some hundred of them."""

Cells: TypeAlias = "array[float]"
StepCode: TypeAlias = "Callable[[Execution, Cells], int]"
Seen: TypeAlias = Callable[[Any, Cells, Nanos], float]
"""(controller, cells, moment) → the value that a condition depends on at that moment."""


class Execution(Protocol):
    """The interface of a program's execution to its steps; see `steptwin.wbc.interpreter.Interpreter`."""

    controller: ProgramController
    now: Nanos
    stack: deque[tuple[int, Nanos]]
    forgotten: bool
    handling: bool
    has_effect: bool
    waiting: bool
    began: tuple[int, Nanos] | None
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


class StraightSteps:
    """Steps that depend on cells only and cannot fail, each followed by the next one. ``run`` executes all of them.

    ``lines``: the same in Python, with cells ``c``; one that returns a number is the last one. ``following``: the number of the
    step after them.
    """

    __slots__ = ("_left", "_lines", "_steps", "further", "run")

    def __init__(self, steps: Sequence[StepCode], lines: Sequence[str], following: int) -> None:
        self.further = len(steps) - 1
        """Number of the steps after the first."""
        self.run: StepCode = self._call
        self._steps = steps
        self._lines = [*lines, f"return {following}"]
        self._left = COMPILED_AFTER

    def _call(self, m: Execution, cells: Cells) -> int:
        self._left -= 1
        if not self._left:
            self.run = self._compiled()
        *before, last = self._steps
        for step in before:
            step(m, cells)
        return last(m, cells)

    def _compiled(self) -> StepCode:
        names: dict[str, StepCode] = {}
        exec("\n    ".join(("def run(m, c):", *self._lines)), {"real": real}, names)
        return names["run"]


@dataclass(frozen=True, slots=True)
class Code:
    """``steps`` has one more than the program: the end. ``cells`` are variables (0) and constants at the start.

    ``straight``: what can be executed at once from each step on; ``watches`` of every step; ``entries`` by number of the event in
    `EVENTS`.
    """

    steps: tuple[StepCode, ...]
    straight: tuple[StraightSteps | None, ...]
    watches: tuple[tuple[WatchedValue, ...], ...]
    cells: Cells
    entries: Mapping[int, InterruptEntry]
