"""Control flow of a program: unreachable code, interrupt labels without RETURN, RETURN without JUMP.

JUMP is a call: it remembers the next line, which is reached when the code at the label can RETURN.
"""

from __future__ import annotations

from functools import cache

from steptwin.controlflow import ControlFlow
from steptwin.diagnostics import Diagnostic
from steptwin.messages import Message
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.conditions import outcome

END_THE_PROGRAM_ABOVE = Message(
    "wbc.end-the-program-above", "end the program above with END or JUMP; a RETURN without JUMP is a program error"
)
LABEL_HAS_NO_RETURN = Message("wbc.label-has-no-return", "the interrupt label of {name} has no RETURN")
EVERY_PATH_LEAVES = Message("wbc.every-path-leaves", "every path from the interrupt label of {name} leaves without RETURN")
RETURN_WITHOUT_A_JUMP = Message("wbc.return-without-a-jump", "RETURN without a JUMP")
END_WITH_RETURN = Message("wbc.end-with-return", "end it with RETURN, or leave it by JUMP")
INTERRUPTED_LINE_IS_NOT_CONTINUED = Message("wbc.interrupted-line-is-not-continued", "the interrupted line is not continued")
THIS_LINE_IS_NEVER_REACHED = Message("wbc.this-line-is-never-reached", "this line is never reached")
NO_LABEL_OR_INTERRUPT_LEADS_HERE = Message("wbc.no-label-or-interrupt-leads-here", "no label or interrupt leads here")

JUMP_OUT_OF_A_LOOP = Message("wbc.jump-out-of-a-loop", "a JUMP out of a loop is a call: the next RETURN comes back into the loop")
LEAVE_BY_ITS_CONDITION = Message("wbc.leave-by-its-condition", "give the condition of the WHILE another result")


def flow_of(steps: tuple[s.ProgramStep, ...]) -> ControlFlow:
    return ControlFlow(
        [_after(number, step) for number, step in enumerate(steps)],
        {number: (step.target,) for number, step in enumerate(steps) if isinstance(step, s.JumpStep)},
        frozenset(number for number, step in enumerate(steps) if isinstance(step, s.ReturnStep)),
        tuple(number for number, step in enumerate(steps) if isinstance(step, s.InterruptStep)),
    )


def reached(flow: ControlFlow, executable: s.Executable) -> set[int]:
    """The steps that can be executed, past the end included."""
    return flow.reached((0, *executable.entries.values()))


def _after(number: int, step: s.ProgramStep) -> tuple[int, ...]:
    ways = step.after(number)
    known = outcome(step.condition) if isinstance(step, s.IfStep | s.WhileStep) else None
    return ways if known is None else ways[:1] if known else ways[1:]


def interrupt_ends(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """Interrupt labels that never come to a RETURN of their own."""
    found: list[Diagnostic] = []
    steps = executable.steps
    entries = frozenset(executable.entries.values())
    for event, entry in executable.entries.items():
        numbers = [number for number in flow.level(entry, entries) if number != entry]
        ends = [steps[number] if number < len(steps) else None for number in numbers]
        if any(isinstance(step, s.ReturnStep) for step in ends):
            continue
        place = steps[entry]
        falls = any(step is None or isinstance(step, s.InterruptStep) for step in ends)
        if falls or not any(isinstance(step, s.JumpStep | s.EndStep | s.ProgResetStep) for step in ends):
            message = LABEL_HAS_NO_RETURN(name=event.name)
            beyond = [number for number in numbers if number == len(steps) or isinstance(steps[number], s.InterruptStep)]
            fix = f.after(steps[min(beyond) - 1], "\nRETURN") if beyond else None
            found.append(f.NO_RETURN.at(place, message, END_WITH_RETURN(), fix))
        else:
            message = EVERY_PATH_LEAVES(name=event.name)
            found.append(f.LEFT_BY_JUMP.at(place, message, INTERRUPTED_LINE_IS_NOT_CONTINUED()))
    return found


def unreached(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """The first line of every unreachable section of code. A single RETURN or END at the end of a section is not reported."""
    seen = reached(flow, executable)
    found: list[Diagnostic] = []
    reported = False
    for number, step in enumerate(executable.steps):
        if number in seen:
            reported = False
        elif not reported and not isinstance(step, s.ElseStep | s.EndIfStep | s.EndWhileStep | s.ReturnStep | s.EndStep):
            reported = True
            found.append(f.NEVER_REACHED.at(step, THIS_LINE_IS_NEVER_REACHED(), NO_LABEL_OR_INTERRUPT_LEADS_HERE()))
    return found


def stray_returns(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """Each RETURN that can be reached without a JUMP to return from."""
    steps = executable.steps
    if not steps or not flow.returns[0]:
        return []
    hint = END_THE_PROGRAM_ABOVE()
    strays = [steps[number] for number in flow.level(0) if number < len(steps)]
    return [f.STRAY_RETURN.at(step, RETURN_WITHOUT_A_JUMP(), hint) for step in strays if isinstance(step, s.ReturnStep)]


def left_by_calls(flow: ControlFlow, executable: s.Executable) -> list[Diagnostic]:
    """Each JUMP of a subroutine that would leave a loop under a condition, to what the loop itself goes on with."""
    steps, found = executable.steps, list[Diagnostic]()
    main = set(flow.level(0)) if steps else set()
    loops = [(begin, step.close) for begin, step in enumerate(steps) if isinstance(step, s.WhileStep) and begin not in main]
    branches = [(begin, step.close) for begin, step in enumerate(steps) if isinstance(step, s.IfStep)]
    behind = cache(lambda close: set(flow.level(close + 1)))
    for number, step in enumerate(steps):
        if not isinstance(step, s.JumpStep) or not flow.returns[step.target]:
            continue
        left = [(begin, close) for begin, close in loops if begin < number < close < step.target and step.target in behind(close)]
        if any(begin < branch < number < end for begin, _ in left for branch, end in branches):
            found.append(f.LEFT_BY_CALL.at(step, JUMP_OUT_OF_A_LOOP(), LEAVE_BY_ITS_CONDITION()))
    return found
