"""Loops of a program as they stand in its text, each with the statements at which it can be left."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from steptwin.controlflow import ControlFlow


class TextLoop(NamedTuple):
    """From ``first`` to ``last``. ``statements`` are those between that lead back to the first one, ``exits`` those of them from
    which a way leads to where nothing leads back."""

    first: int
    last: int
    statements: Collection[int]
    exits: Sequence[int]


def text_loops(flow: ControlFlow, there: Collection[int]) -> Iterator[TextLoop]:
    """The loops of what is reached, in the order of their beginnings: of those with the same one the shortest and the longest.
    Calls that return are statements of the caller."""
    backs: dict[int, list[int]] = {}
    for number in sorted(there):
        for target in _ways(flow, number):
            if target <= number:
                backs.setdefault(target, []).append(number)
    for first, lasts in sorted(backs.items()):
        for last in dict.fromkeys((lasts[0], lasts[-1])):
            staying = _leading_back(flow, first, last)
            exits = [number for number in sorted(staying) if not staying.issuperset(_ways(flow, number))]
            yield TextLoop(first, last, staying, exits)


def executed(flow: ControlFlow, loop: TextLoop) -> set[int]:
    """The statements of a loop, and of what they call and come back from."""
    calls = [number for number in loop.statements if number in flow.calls and flow.comes_back(number)]
    return {*loop.statements, *flow.reached(target for number in calls for target in flow.calls[number])}


def _ways(flow: ControlFlow, number: int) -> Sequence[int]:
    """Where the execution goes on within the level of a statement, or leaves it for good."""
    return flow.within(number) or (flow.calls.get(number, ()) if number < len(flow.after) else ())


def _leading_back(flow: ControlFlow, first: int, last: int) -> set[int]:
    before: dict[int, list[int]] = {}
    for number in range(first, last + 1):
        for after in _ways(flow, number):
            before.setdefault(after, []).append(number)
    found: set[int] = set()
    work = [first]
    while work:
        number = work.pop()
        if number not in found:
            found.add(number)
            work += before.get(number, ())
    return found
