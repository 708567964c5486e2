"""Where a WBC program can wait for ever: at statements and in loops that only something outside ends."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from steptwin.controlflow import ControlFlow
from steptwin.diagnostics import SourceText
from steptwin.explain import mic488_interrupts as interrupts
from steptwin.explain.model import LongWait
from steptwin.wbc import steps as s
from steptwin.wbc.conditions import outcome
from steptwin.wbc.usage import sources

_OUTSIDE = frozenset({"IN", "INPUTS", "AIN", "VISIONNEW", "VISIONNO", "VISIONX", "VISIONY", "VISIONA", "$I", "$D", "$R"})
"""What inputs, a vision system or a master change, and otherwise only the program."""
_TIMERS = frozenset({"TIMA", "TIMB"})
_STARTS = frozenset({"VABS", "VREL"})


def long_waits(source: SourceText, executable: s.Executable, flow: ControlFlow, there: Collection[int]) -> list[LongWait]:
    """Each place once, in the order of the text."""
    out = _way_out(executable, flow)
    set_by_interrupts = _changed(executable, flow.reached(executable.entries.values()))
    running = _in_velocity_mode(executable, flow)
    found: list[LongWait] = []
    for number, step in enumerate(executable.steps):
        if number not in there:
            continue
        reason = None
        if isinstance(step, s.WaitStep):
            reason = _reason(step.condition, set_by_interrupts)
        elif isinstance(step, s.WaitPosStep):
            axes = [f"M{axis}" for axis in sorted(running.get(number, ()))]
            reason = f"{' and '.join(axes)} can be in velocity mode here, which never counts as finished" if axes else None
        elif isinstance(step, s.WhileStep):
            reason = _of_loop(executable, flow, number, step)
        if reason is not None:
            line = source.position(step.start)[0]
            found.append(LongWait(line, " ".join(source.text[step.start : step.end].split()), reason, out))
    return found


def _way_out(executable: s.Executable, flow: ControlFlow) -> str:
    """Interrupts after which the program need not come back."""
    names = interrupts.leaving(executable, flow, ())
    return f"{' or '.join(names)}, which can leave without RETURN" if names else ""


def _changed(executable: s.Executable, numbers: Collection[int]) -> set[s.Source]:
    """What steps give a value to."""
    steps = (executable.steps[number] for number in numbers if number < len(executable.steps))
    return {step.target for step in steps if isinstance(step, s.SetStep)}


def _reason(condition: s.StepCondition, changed: Collection[s.Source]) -> str | None:
    """Why the condition can stay false; None where something that goes on by itself can make it true."""
    if outcome(condition) is True:
        return None
    if outcome(condition) is False:
        return "the condition is never true"
    sides = [side for side in (condition.left, condition.right) if not isinstance(side, s.Literal)]
    registers = [side for side in sides if isinstance(side, s.RegisterOperand)]
    if not registers:
        if any(side in changed for side in sides):
            return f"only an interrupt changes {_names(sides)}"
        return f"nothing changes {_names(sides)} while it waits"
    if all(register.row.key in _OUTSIDE for register in registers):
        return f"only something outside changes {_names(registers)}"
    timer = next((register for register in registers if register.row.key in _TIMERS), None)
    if timer is not None and len(sides) == 1:
        rises = condition.sign if condition.left is timer else _MIRRORED.get(condition.sign, condition.sign)
        if rises in ("<", "<=", "="):
            return f"{timer.name} only counts up: if it is beyond the number already, the condition stays false"
    return None


_MIRRORED = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}


def _names(sides: Sequence[s.Source]) -> str:
    return " and ".join(dict.fromkeys(side.name for side in sides if not isinstance(side, s.Literal)))


def _of_loop(executable: s.Executable, flow: ControlFlow, number: int, step: s.WhileStep) -> str | None:
    """Why a WHILE can repeat for ever: every way out of it depends only on what is outside."""
    inside = set(range(number, step.close + 1))
    names: dict[str, None] = {}
    changed = _changed(executable, _executed(flow, inside))
    is_conditional = False
    for one in inside:
        if not any(after not in inside for after in _ways(flow, one)):
            continue
        branch = executable.steps[one]
        if not isinstance(branch, s.IfStep | s.WhileStep):
            # A JUMP, RETURN or END: it is the conditions around it that decide.
            continue
        is_conditional = True
        names.update(dict.fromkeys(_outside_only(branch, changed)))
        if not _outside_only(branch, changed):
            return None
    if not is_conditional or any(_ends(executable, flow, one, inside) for one in inside):
        return None
    return f"it repeats until something outside changes {' and '.join(names)}"


def _ways(flow: ControlFlow, number: int) -> Sequence[int]:
    return flow.next[number] if number not in flow.calls else flow.within(number) or flow.calls[number]


def _ends(executable: s.Executable, flow: ControlFlow, number: int, inside: Collection[int]) -> bool:
    """Whether the loop can be left otherwise than by a condition of its own."""
    step = executable.steps[number]
    if isinstance(step, s.EndStep | s.ProgResetStep | s.ReturnStep):
        return True
    return isinstance(step, s.JumpStep) and not flow.comes_back(number) and step.target not in inside


def _executed(flow: ControlFlow, inside: Collection[int]) -> set[int]:
    calls = {target for number in inside for target in flow.calls.get(number, ())}
    return {*inside, *flow.reached(calls)}


def _outside_only(step: s.IfStep | s.WhileStep, changed: Collection[s.Source]) -> list[str]:
    """What is outside of which the condition depends; empty if it also depends on something else, or is always the same."""
    sides = [side for side in sources(step) if not isinstance(side, s.Literal)]
    registers = [side for side in sides if isinstance(side, s.RegisterOperand)]
    if not sides or len(registers) != len(sides):
        return []
    if any(register.row.key not in _OUTSIDE or register in changed for register in registers):
        return []
    return [register.name for register in registers]


def _in_velocity_mode(executable: s.Executable, flow: ControlFlow) -> dict[int, set[int]]:
    """For each step the drives that, on some path of the graph to it, run in velocity mode."""
    running: dict[int, set[int]] = {}
    seen: set[int] = set()
    work = [0, *executable.entries.values()] if executable.steps else []
    while work:
        number = work.pop()
        if number >= len(executable.steps):
            continue
        seen.add(number)
        after = set(_after(executable.steps[number], running.get(number, set())))
        for target in flow.next[number]:
            known = running.setdefault(target, set())
            if target not in seen or not after <= known:
                known |= after
                work.append(target)
    return running


def _after(step: s.ProgramStep, running: set[int]) -> Iterator[int]:
    changed = None
    match step:
        case s.MotionStep(keyword=keyword, axis=axis):
            changed = axis
            if keyword in _STARTS and not (isinstance(step.value, s.Literal) and step.value.value == 0 and keyword == "VABS"):
                yield axis
        case s.HaltStep(axis=axis):
            changed = axis
        case s.SetStep(target=s.RegisterOperand(row=row, number=number)) if row.key == "M":
            changed = number if isinstance(step.value, s.Literal) and step.value.value == 0 else None
        case s.RowMotionStep() | s.EndStep() | s.ProgResetStep():
            return
    yield from (axis for axis in running if axis != changed)
