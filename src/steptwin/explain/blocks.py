"""Blocks: statements that are always executed one after the other, and the ways between them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from steptwin.controlflow import ControlFlow
from steptwin.controller import Nanos
from steptwin.explain.model import FlowBlock, FlowWay, StraightPiece


class Timing(NamedTuple):
    """How long a statement takes, None where that is not known; ``wait``: what it waits for."""

    duration: Nanos | None
    wait: str = ""


def blocks_of(
    flow: ControlFlow,
    reached: Collection[int],
    names: Mapping[int, Sequence[str]],
    entries: Collection[int],
    when: Callable[[int, int], str],
    timing: Sequence[Timing],
) -> list[FlowBlock]:
    """Blocks of the statements that can be reached. ``when(number, target)`` is the condition of a way out of a branch."""
    count = len(flow.after)
    begins = {*entries, *names} & set(reached)
    for number in sorted(reached):
        if number < count and (number in flow.calls or number in flow.ends or flow.after[number] != (number + 1,)):
            begins.update((*flow.after[number], *flow.calls.get(number, ()), number + 1))
    for number in reached:
        if number < count and not any(before in reached for before in (number - 1,)):
            begins.add(number)
    firsts = sorted(number for number in begins if number < count and number in reached)
    index = {first: at for at, first in enumerate(firsts)}
    found: list[FlowBlock] = []
    for at, first in enumerate(firsts):
        end = firsts[at + 1] if at + 1 < len(firsts) else count
        last = first
        while last + 1 < end and last + 1 in reached:
            last += 1
        ways = _ways(flow, last, index, when)
        pieces = tuple(_pieces(first, last, timing))
        found.append(FlowBlock(first, last, tuple(names.get(first, ())), ways, pieces, first in entries))
    return found


def _ways(flow: ControlFlow, last: int, index: Mapping[int, int], when: Callable[[int, int], str]) -> tuple[FlowWay, ...]:
    targets = flow.calls.get(last)
    if targets is None:
        return tuple(FlowWay(index.get(target), when(last, target)) for target in flow.after[last])
    comes_back = flow.comes_back(last)
    calls = [FlowWay(index.get(target), when(last, target), is_call=comes_back) for target in targets]
    back = [FlowWay(index.get(target), is_back=True) for target in flow.after[last] if comes_back]
    return (*calls, *back)


def _pieces(first: int, last: int, timing: Sequence[Timing]) -> list[StraightPiece]:
    found: list[StraightPiece] = []
    begin, total = first, 0
    for number in range(first, last + 1):
        duration, wait = timing[number]
        if duration is not None and not wait:
            total += duration
            continue
        found.append(StraightPiece(begin, number, total, wait or "not known before"))
        begin, total = number + 1, 0
    if begin <= last:
        found.append(StraightPiece(begin, last, total))
    return found
