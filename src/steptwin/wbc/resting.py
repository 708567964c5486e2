"""Loops of a program whose statements need not be executed until one of their conditions can change (WBC-18)."""

from __future__ import annotations

from array import array
from functools import partial
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.wbc.code import Cells, Code
from steptwin.wbc.controller import ProgramController
from steptwin.wbc.looks import first_change

HORIZON: Nanos = 3600 * SECOND
"""Changes are foreseen for so long; at its end the statement is executed, which changes nothing."""

NEVER: Nanos = -1
"""No condition changes by itself."""


class Visit(NamedTuple):
    """A statement of a loop, and the state in which it is executed.

    ``offset`` from the beginning of the loop; ``held``: by a DELAY before it, until that moment.
    """

    step: int
    offset: Nanos
    held: bool
    handling: bool
    stack: tuple[tuple[int, Nanos], ...]
    cells: bytes

    def values(self) -> Cells:
        """Variables, then constants."""
        cells = array("f")
        cells.frombytes(self.cells)
        return cells


class RestingLoop(NamedTuple):
    """A loop without effects, or a WAIT: from ``base`` on its statements are repeated every ``period``."""

    visits: tuple[Visit, ...]
    base: Nanos
    period: Nanos

    def next_visit(self, first: Nanos) -> tuple[Nanos, Visit]:
        """The first statement at or after ``first``, and its moment."""
        rounds, into = divmod(max(first - self.base, 0), self.period)
        for visit in self.visits:
            if visit.offset >= into:
                break
        else:
            rounds, visit = rounds + 1, self.visits[0]
        return self.base + rounds * self.period + visit.offset, visit

    def next_change(self, code: Code, controller: ProgramController) -> Nanos | None:
        """When a condition of the loop first has another result; `NEVER`, or None if that is not known."""
        soonest = NEVER
        for visit in self.visits:
            watches = code.watches[visit.step]
            if not watches:
                continue
            cells = visit.values()
            at = self.base + visit.offset
            for seen, tendency in watches:
                intervals = None if tendency is None else tendency(controller, at)
                if intervals is None:
                    return None
                change = first_change(partial(seen, controller, cells), at, self.period, intervals, at + HORIZON)
                if change is not None and (soonest == NEVER or change < soonest):
                    soonest = change
        return soonest
