"""Where a WBC program can wait for ever: at statements and in loops that only something outside ends."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence

from steptwin.controlflow import ControlFlow
from steptwin.diagnostics import SourceText
from steptwin.explain import mic488_interrupts as interrupts
from steptwin.explain.loops import TextLoop, executed, text_loops
from steptwin.explain.model import LongWait
from steptwin.wbc import steps as s
from steptwin.wbc.conditions import outcome

_OUTSIDE = frozenset({"IN", "INPUTS", "AIN", "VISIONNEW", "VISIONNO", "VISIONX", "VISIONY", "VISIONA", "$I", "$D", "$R"})
"""Values that inputs, a vision system or a master change, and otherwise only the program."""
_TIMERS = frozenset({"TIMA", "TIMB"})
_STARTS = frozenset({"VABS", "VREL"})


def long_waits(source: SourceText, executable: s.Executable, flow: ControlFlow, there: Collection[int]) -> list[LongWait]:
    """Each place once, in the order of the text."""
    out = _way_out(executable, flow)
    set_by_interrupts = _changed(executable, flow.reached(executable.entries.values()))
    running, homing = _in_mode(executable, flow, _running_after), _in_mode(executable, flow, _homing_after)
    found: list[tuple[int, str | None]] = []
    for number in there:
        step = executable.steps[number] if number < len(executable.steps) else None
        if isinstance(step, s.WaitStep):
            found.append((number, _reason(step.condition, set_by_interrupts)))
        elif isinstance(step, s.WaitPosStep):
            found.append((number, _of_motion(running.get(number, ()), homing.get(number, ()))))
    for loop in text_loops(flow, there):
        reason = _of_loop(executable, flow, loop, set_by_interrupts)
        if reason is not None and not isinstance(executable.steps[loop.first], s.WhileStep):
            lines = [source.position(executable.steps[number].start)[0] for number in (loop.first, loop.last)]
            reason = f"lines {lines[0]} to {lines[1]}: {reason}"
        found.append((loop.first, reason))
    first = {number: reason for number, reason in reversed(found) if reason is not None}
    return [_wait(source, executable.steps[number], reason, out) for number, reason in sorted(first.items())]


def _wait(source: SourceText, step: s.ProgramStep, reason: str, out: str) -> LongWait:
    return LongWait(source.position(step.start)[0], " ".join(source.text[step.start : step.end].split()), reason, out)


def _of_motion(running: Collection[int], homing: Collection[int]) -> str | None:
    """Why WAITPOS can wait for ever for drives in velocity mode, and for those that home."""

    def named(axes: Collection[int]) -> str:
        return " and ".join(f"M{axis}" for axis in sorted(axes))

    if running:
        return f"{named(running)} can be in velocity mode here, which never counts as finished"
    return f"{named(homing)} can be homing here, which only a switch, a stop or channel C of the encoder ends" if homing else None


def _way_out(executable: s.Executable, flow: ControlFlow) -> str:
    """Interrupts after which the program need not come back."""
    names = interrupts.leaving(executable, flow, ())
    return f"{' or '.join(names)}, which can leave without RETURN" if names else ""


def _changed(executable: s.Executable, numbers: Collection[int]) -> set[s.ValueSource]:
    """Values that steps change."""
    steps = (executable.steps[number] for number in numbers if number < len(executable.steps))
    return {step.target for step in steps if isinstance(step, s.SetStep)}


def _reason(condition: s.StepCondition, changed: Collection[s.ValueSource]) -> str | None:
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


def _names(sides: Sequence[s.ValueSource]) -> str:
    return " and ".join(dict.fromkeys(side.name for side in sides if not isinstance(side, s.Literal)))


def _of_loop(executable: s.Executable, flow: ControlFlow, loop: TextLoop, by_interrupts: Collection[s.ValueSource]) -> str | None:
    """Why a loop can repeat for ever: every way out of it depends only on what it does not change by itself."""
    steps = executable.steps
    done = executed(flow, loop)
    if not loop.exits or any(_ends(executable, flow, number) for number in done.difference(loop.statements)):
        return None
    changed = _changed(executable, done)
    outside: dict[str, None] = {}
    own: list[s.ValueSource] = []
    for number in loop.exits:
        branch = steps[number]
        if not isinstance(branch, s.IfStep | s.WhileStep):
            return None
        sides = [side for side in branch.sources() if not isinstance(side, s.Literal)]
        if not sides or any(side in changed for side in sides):
            return None
        registers = [side for side in sides if isinstance(side, s.RegisterOperand)]
        if any(register.row.key not in _OUTSIDE for register in registers):
            return None
        outside.update(dict.fromkeys(register.name for register in registers))
        own += [side for side in sides if not isinstance(side, s.RegisterOperand)]
    if outside:
        return f"it repeats until something outside changes {' or '.join(outside)}"
    if any(side in by_interrupts for side in own):
        return f"it repeats until an interrupt changes {_names(own)}"
    return f"it repeats for ever unless it is left at once: nothing in it changes {_names(own)}"


def _ends(executable: s.Executable, flow: ControlFlow, number: int) -> bool:
    """Whether what a loop calls can end it."""
    if number >= len(executable.steps):
        return True
    step = executable.steps[number]
    return step.effect().everything or (isinstance(step, s.JumpStep) and not flow.comes_back(number))


def _in_mode(
    executable: s.Executable, flow: ControlFlow, after_step: Callable[[s.ProgramStep, set[int]], Iterator[int]]
) -> dict[int, set[int]]:
    """For each step the drives that, on some path of the graph to it, are in a mode."""
    running: dict[int, set[int]] = {}
    seen: set[int] = set()
    work = [0, *executable.entries.values()] if executable.steps else []
    while work:
        number = work.pop()
        if number >= len(executable.steps):
            continue
        seen.add(number)
        after = set(after_step(executable.steps[number], running.get(number, set())))
        for target in flow.next[number]:
            known = running.setdefault(target, set())
            if target not in seen or not after <= known:
                known |= after
                work.append(target)
    return running


def _homing_after(step: s.ProgramStep, homing: set[int]) -> Iterator[int]:
    match step:
        case s.MotionStep(keyword="HOME", axis=axis) if not (isinstance(step.value, s.Literal) and step.value.value == 0):
            yield from {*homing, axis}
        case _ if step.waits is not s.StepWait.MOTION:
            yield from _running_after(step, homing, starts=frozenset())


def _running_after(step: s.ProgramStep, running: set[int], starts: frozenset[str] = _STARTS) -> Iterator[int]:
    changed = None
    match step:
        case s.MotionStep(keyword=keyword, axis=axis):
            changed = axis
            if keyword in starts and not (isinstance(step.value, s.Literal) and step.value.value == 0 and keyword == "VABS"):
                yield axis
        case s.SetStep(target=s.RegisterOperand(row=row, number=number)) if row.key == "M":
            changed = number if isinstance(step.value, s.Literal) and step.value.value == 0 else None
        case _ if step.effect().any_drive or step.effect().everything:
            return
        case _:
            changed = step.effect().drive
    yield from (axis for axis in running if axis != changed)
