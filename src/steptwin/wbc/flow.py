"""Control flow: unreachable code, interrupt labels without RETURN, RETURN without JUMP.

JUMP remembers the next line, so that line is reached when the code at the label can RETURN. "Can return" means: a RETURN is
reached that takes back the JUMP which led here, every JUMP on the way having been taken back itself. Every question is answered
in time linear in the number of steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.diagnostics import Diagnostic
from steptwin.tables import complete
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.conditions import outcome


@dataclass(frozen=True, slots=True)
class ControlFlow:
    """Per step: where it goes on within its level (``after``, past the end is ``len(steps)``) and whether it can return."""

    steps: tuple[s.ProgramStep, ...]
    after: list[tuple[int, ...]]
    returns: list[bool]


def flow_of(executable: s.Executable) -> ControlFlow:
    steps = executable.steps
    after = successors(steps)
    return ControlFlow(steps, after, _returns(steps, after))


def successors(steps: tuple[s.ProgramStep, ...]) -> list[tuple[int, ...]]:
    """Where each step goes on within its level, as `ControlFlow.after`; a branch has several."""
    return [_after(number, step) for number, step in enumerate(steps)]


def returning(steps: tuple[s.ProgramStep, ...]) -> list[bool]:
    """Whether each step, and last the end, can reach a RETURN for the JUMP that led to it."""
    return _returns(steps, successors(steps))


def _after(number: int, step: s.ProgramStep) -> tuple[int, ...]:
    """The successors of a step. For JUMP: the next line, which is reached only if the target can return."""
    return _AFTER[type(step)](number, step)


def _branch(number: int, step: s.IfStep | s.WhileStep) -> tuple[int, ...]:
    failed = step.otherwise if isinstance(step, s.IfStep) else step.close + 1
    known = outcome(step.condition)
    if known is None:
        return number + 1, failed
    return (number + 1,) if known else (failed,)


_AFTER: Mapping[type[s.ProgramStep], Callable[[int, Any], tuple[int, ...]]] = complete(
    "step",
    s.STEPS,
    "successors",
    {
        **dict.fromkeys((s.IfStep, s.WhileStep), _branch),
        s.ElseStep: lambda number, step: (step.close,),
        s.EndWhileStep: lambda number, step: (step.open,),
        **dict.fromkeys((s.ReturnStep, s.EndStep, s.ProgResetStep), lambda number, step: ()),
        **dict.fromkeys(
            (s.SetStep, s.EndIfStep, s.WaitStep, s.WaitPosStep, s.DelayStep, s.JumpStep), lambda number, step: (number + 1,)
        ),
        **dict.fromkeys((s.MotionStep, s.HaltStep, s.RowMotionStep, s.PulseStep), lambda number, step: (number + 1,)),
        **dict.fromkeys((s.InterruptStep, s.IllegalStep), lambda number, step: (number + 1,)),
    },
)


def _returns(steps: tuple[s.ProgramStep, ...], after: list[tuple[int, ...]]) -> list[bool]:
    """The steps that can return, found backwards from every RETURN. A JUMP can if both its target and the line after it can."""
    count = len(steps)
    before: list[list[int]] = [[] for _ in range(count + 1)]
    callers: list[list[int]] = [[] for _ in range(count + 1)]
    for number, step in enumerate(steps):
        if isinstance(step, s.JumpStep):
            callers[step.target].append(number)
        else:
            for following in after[number]:
                before[following].append(number)
    can = [False] * (count + 1)
    work = [number for number, step in enumerate(steps) if isinstance(step, s.ReturnStep)]
    while work:
        number = work.pop()
        if can[number]:
            continue
        can[number] = True
        work += before[number]
        work += [caller for caller in callers[number] if can[caller + 1]]
        if number:
            previous = steps[number - 1]
            if isinstance(previous, s.JumpStep) and can[previous.target]:
                work.append(number - 1)
    return can


def _level(flow: ControlFlow, start: int, barriers: frozenset[int] = frozenset()) -> Iterator[int]:
    """The steps reached from one without following JUMPs, past the end included, but not beyond other ``barriers``."""
    seen: set[int] = set()
    work = [start]
    while work:
        number = work.pop()
        if number in seen:
            continue
        seen.add(number)
        yield number
        if number < len(flow.steps) and (number == start or number not in barriers):
            step = flow.steps[number]
            if not isinstance(step, s.JumpStep) or flow.returns[step.target]:
                work += flow.after[number]


def interrupt_ends(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """Interrupt labels that never come to a RETURN of their own."""
    found: list[Diagnostic] = []
    entries = frozenset(executable.entries.values())
    for event, entry in executable.entries.items():
        numbers = [number for number in _level(flow, entry, entries) if number != entry]
        ends = [flow.steps[number] if number < len(flow.steps) else None for number in numbers]
        if any(isinstance(step, s.ReturnStep) for step in ends):
            continue
        place = flow.steps[entry]
        falls = any(step is None or isinstance(step, s.InterruptStep) for step in ends)
        if falls or not any(isinstance(step, s.JumpStep | s.EndStep | s.ProgResetStep) for step in ends):
            message = f"the interrupt label of {event.name} has no RETURN"
            found.append(f.NO_RETURN.at(place, message, "end it with RETURN, or leave it by JUMP"))
        else:
            message = f"every path from the interrupt label of {event.name} leaves without RETURN"
            found.append(f.LEFT_BY_JUMP.at(place, message, "the interrupted line is not continued"))
    return found


def unreached(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """The first line of every unreachable stretch of code. A single RETURN or END at the end of a stretch is not reported."""
    steps, count = flow.steps, len(flow.steps)
    seen = [False] * (count + 1)
    work = [0, *executable.entries.values()]
    while work:
        number = work.pop()
        if seen[number]:
            continue
        seen[number] = True
        if number == count:
            continue
        step = steps[number]
        if isinstance(step, s.JumpStep):
            work.append(step.target)
            if not flow.returns[step.target]:
                continue
        work += flow.after[number]
    found: list[Diagnostic] = []
    reported = False
    for number, step in enumerate(steps):
        if seen[number]:
            reported = False
        elif not reported and not isinstance(step, s.ElseStep | s.EndIfStep | s.EndWhileStep | s.ReturnStep | s.EndStep):
            reported = True
            found.append(f.NEVER_REACHED.at(step, "this line is never reached", "no label or interrupt leads here"))
    return found


def stray_returns(flow: ControlFlow) -> list[Diagnostic]:
    """Each RETURN that can be reached without a JUMP to return from."""
    if not flow.steps or not flow.returns[0]:
        return []
    hint = "end the program above with END or JUMP; a RETURN without JUMP is a program error"
    strays = [flow.steps[number] for number in _level(flow, 0) if number < len(flow.steps)]
    return [f.STRAY_RETURN.at(step, "RETURN without a JUMP", hint) for step in strays if isinstance(step, s.ReturnStep)]
