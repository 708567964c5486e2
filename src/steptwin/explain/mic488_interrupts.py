"""The interrupts of a WBC program: where they can lead, and how their events can be lost (WBC-2, WBC-3, WBC-19)."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator

from steptwin.controlflow import ControlFlow
from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.diagnostics import SourceText
from steptwin.explain.model import LostInterrupt
from steptwin.wbc import steps as s
from steptwin.wbc.events import BY_REGISTER, HARD_PREFIX, PREFIX

_ONE_WAITS = "one waits, the others are lost"
_LONG = frozenset({s.StepWait.TIME, s.StepWait.CONDITION, s.StepWait.MOTION})


def label(executable: s.Executable, entry: int) -> str:
    step = executable.steps[entry]
    if not isinstance(step, s.InterruptStep):
        return "interrupt"
    return (HARD_PREFIX if step.hard else PREFIX) + step.event.name


def leaving(executable: s.Executable, flow: ControlFlow, loop: Collection[int]) -> list[str]:
    """Interrupts after which the program can go on elsewhere than in ``loop``: they end the program, or come by JUMP to a place
    from which they need not return."""
    found: list[str] = []
    for entry in executable.entries.values():
        inside = flow.reached((entry,))
        if any(_leaves(executable, flow, number) for number in inside) and not inside <= {entry, *loop}:
            found.append(label(executable, entry))
    return found


def _leaves(executable: s.Executable, flow: ControlFlow, number: int) -> bool:
    if number >= len(executable.steps):
        return True
    step = executable.steps[number]
    return step.effect().everything or not flow.comes_back(number)


def lost(
    source: SourceText, executable: s.Executable, flow: ControlFlow, there: Collection[int], statement_time: Nanos
) -> list[LostInterrupt]:
    """Ways in which events can be lost: of each source one event waits, further ones are lost."""
    found: list[LostInterrupt] = []
    for event, entry in executable.entries.items():
        name, line = label(executable, entry), source.position(executable.steps[entry].start)[0]
        shortest = _shortest(executable, flow, entry, statement_time)
        held = next(_held(source, executable, flow, entry), None)
        if held is not None:
            reason = f"{held[1]} belongs to this interrupt: of further events that come until it is over, {_ONE_WAITS}"
            found.append(LostInterrupt(name, held[0], reason))
        if event.period and shortest is not None and shortest > event.period:
            reason = f"it takes at least {_ms(shortest)}, and there is a tick every {_ms(event.period)}: ticks are lost"
            found.append(LostInterrupt(name, line, reason))
        elif held is None and shortest is not None:
            reason = f"it takes {_ms(shortest)} or more: of further events that come in that time, {_ONE_WAITS}"
            found.append(LostInterrupt(name, line, reason))
    found += _switched_off(source, executable, there)
    found += _hard(source, executable, there)
    return found


def _handling(executable: s.Executable, flow: ControlFlow, entry: int) -> Iterator[int]:
    """Steps that are executed while no other interrupt is accepted: up to RETURN or the first JUMP."""
    seen: set[int] = set()
    work = [entry]
    while work:
        number = work.pop()
        if number not in seen and number < len(executable.steps):
            seen.add(number)
            yield number
            if number not in flow.calls:
                work += flow.after[number]


def _held(source: SourceText, executable: s.Executable, flow: ControlFlow, entry: int) -> Iterator[tuple[int, str]]:
    """Waits of unknown length, with their lines."""
    for number in sorted(_handling(executable, flow, entry)):
        step = executable.steps[number]
        if step.waits in _LONG:
            yield source.position(step.start)[0], " ".join(source.text[step.start : step.end].split())


def _shortest(executable: s.Executable, flow: ControlFlow, entry: int, statement_time: Nanos) -> Nanos | None:
    """The least time until other interrupts are accepted; None where that never comes."""
    work, seen = [(0, entry)], set()
    while work:
        passed, number = heapq.heappop(work)
        if number in seen or number >= len(executable.steps):
            continue
        seen.add(number)
        step = executable.steps[number]
        own = statement_time
        if isinstance(step, s.DelayStep) and isinstance(step.seconds, s.Literal):
            own = max(own, round(max(step.seconds.value, s.SHORTEST_DELAY_S) * 1000) * MILLISECOND)
        if isinstance(step, s.ReturnStep | s.JumpStep):
            return passed + own
        for following in flow.after[number]:
            heapq.heappush(work, (passed + own, following))
    return None


def _switched_off(source: SourceText, executable: s.Executable, there: Collection[int]) -> Iterator[LostInterrupt]:
    for number, step in enumerate(executable.steps):
        if number not in there or not isinstance(step, s.SetStep) or not isinstance(step.target, s.RegisterOperand):
            continue
        event = BY_REGISTER.get(step.target.name.upper())
        if event in executable.entries and not (isinstance(step.value, s.Literal) and step.value.value != 0):
            name = label(executable, executable.entries[event])
            can = "drops" if isinstance(step.value, s.Literal) else "can drop"
            yield LostInterrupt(name, source.position(step.start)[0], f"switching it off {can} an event that waits")


def _hard(source: SourceText, executable: s.Executable, there: Collection[int]) -> Iterator[LostInterrupt]:
    """HARDINT_ labels wait for the end of the statement in progress: the first long one."""
    hard = [entry for entry in executable.entries.values() if label(executable, entry).startswith(HARD_PREFIX)]
    longest = next((n for n in sorted(there) if n < len(executable.steps) and executable.steps[n].waits in _LONG), None)
    if longest is None:
        return
    step = executable.steps[longest]
    line, text = source.position(step.start)[0], " ".join(source.text[step.start : step.end].split())
    for entry in hard:
        yield LostInterrupt(
            label(executable, entry),
            line,
            f"it comes after the statement in progress: of the events that come during {text}, {_ONE_WAITS}",
        )


def _ms(duration: Nanos) -> str:
    return f"{duration / MILLISECOND:g} ms" if duration < SECOND else f"{duration / SECOND:g} s"
