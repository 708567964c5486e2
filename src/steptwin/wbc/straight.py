"""Calculations that come one after the other: as lines of one function Python executes them faster than as calls, and between
them a controller has nothing else to do. The lines have numbers and signs only, no text of the program."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import TypeAlias

from steptwin.wbc import steps as s
from steptwin.wbc.code import StepCode, StraightSteps
from steptwin.wbc.flow import flow_of
from steptwin.wbc.registers import REAL_MAX

CellOf: TypeAlias = Callable[[s.ValueSource], int | None]
"""None for a register."""

_CANNOT_FAIL = frozenset("+-*")
_RETURN = "return "


def straight_of(codes: Sequence[StepCode], steps: Sequence[s.ProgramStep], cell_of: CellOf) -> Iterator[StraightSteps | None]:
    """Straight code that begins at each step, of two or more steps. ``codes``: those of the steps."""
    lines = [_line(step, number, cell_of) for number, step in enumerate(steps)]
    entered = _entered(steps)
    first = 0
    while first < len(steps):
        end = first
        while end < len(steps) and (line := lines[end]) is not None:
            end += 1
            if end in entered or line.startswith(_RETURN):
                break
        count = end - first
        yield StraightSteps(codes[first:end], [line or "" for line in lines[first:end]], end) if count > 1 else None
        yield from [None] * (count - 1)
        first = max(end, first + 1)


def _entered(steps: Sequence[s.ProgramStep]) -> Collection[int]:
    """The steps to which others go than the one before."""
    flow = flow_of(tuple(steps))
    branches = (after for number, after in enumerate(flow.after) if after != (number + 1,))
    return {number for targets in (*branches, *flow.calls.values(), flow.interrupts) for number in targets}


def _line(step: s.ProgramStep, number: int, cell_of: CellOf) -> str | None:
    """A step in Python, whose cells are ``c``; the next one follows, unless it returns another. None for what depends on more
    than cells, or can fail."""
    cells = [cell_of(source) for source in step.sources()]
    if None in cells:
        return None
    operands = [f"c[{cell}]" for cell in cells]
    match step:
        case s.EndIfStep() | s.InterruptStep():
            return "pass"
        case s.ElseStep(close=following) | s.EndWhileStep(open=following):
            return f"{_RETURN}{following}"
        case s.IfStep(condition=condition) | s.WhileStep(condition=condition):
            sign = "==" if condition.sign == "=" else condition.sign
            outside = step.otherwise if isinstance(step, s.IfStep) else step.close + 1
            return f"{_RETURN}{number + 1} if {f' {sign} '.join(operands)} else {outside}"
        case s.SetStep(target=s.Variable(target), value=s.Operation(operator=operator)) if operator in _CANNOT_FAIL:
            result = f" {operator} ".join(operands)
            return f"c[{target}] = x if {-REAL_MAX} <= (x := {result}) <= {REAL_MAX} else real(x)"
        case s.SetStep(target=s.Variable(target), value=s.Variable() | s.Literal()):
            return f"c[{target}] = {operands[0]}"
    return None
