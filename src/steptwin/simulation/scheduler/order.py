"""The order in which the parts of a scheduler are updated at one moment: what drives an input comes before what reads it, so that
logic without delay has no glitches that depend on the order of a description."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from heapq import heapify, heappop, heappush

from steptwin.simulation.scheduler.wires import Wire


def successors(
    names: Sequence[str | None], watching: Mapping[str, Iterable[int]], drives: Mapping[int, str], wires: Iterable[Wire]
) -> list[set[int]]:
    """The parts that an update of each part may concern at the same moment.

    ``names``: the element of each part; ``watching``: the parts that depend on a name; ``drives``: the name whose input a part
    drives (a contact is notified with it, too).
    """
    reached: dict[str, set[str]] = {}
    for wire in wires:
        if not wire.delay:
            reached.setdefault(wire.source.controller, set()).add(wire.target.controller)
    found: list[set[int]] = []
    for number, name in enumerate(names):
        concerned = {drives[number]} if number in drives else set()
        if name is not None:
            concerned |= {name, *reached.get(name, ())}
        found.append({one for of in concerned for one in watching.get(of, ()) if one != number and drives.get(one) != of})
    return found


def update_order(after: Sequence[set[int]], late: Iterable[int]) -> list[int]:
    """Numbers of parts in the order in which they are updated: each before those that it concerns, ``late`` ones when no other is
    ready, else as they are numbered. A loop comes when all before it have come, and begins with its lowest number."""
    before: list[set[int]] = [set() for _ in after]
    for number, concerned in enumerate(after):
        for one in concerned:
            before[one].add(number)
    are_late = set(late)
    ready = [(number in are_late, number) for number in range(len(after)) if not before[number]]
    heapify(ready)
    left = dict.fromkeys(range(len(after)))
    found: list[int] = []
    while left:
        number = heappop(ready)[1] if ready else _first_of_loop(next(iter(left)), before, after)
        del left[number]
        found.append(number)
        for one in after[number]:
            before[one].discard(number)
            if not before[one] and one in left:
                heappush(ready, (one in are_late, one))
    return found


def _first_of_loop(number: int, before: Sequence[set[int]], after: Sequence[set[int]]) -> int:
    """The lowest number of a loop that waits for nothing but itself; ``number`` is in it or waits for it."""
    while True:
        waits_for, waiting = _reached(number, before), _reached(number, after)
        if waits_for <= waiting:
            return min(waits_for)
        number = min(waits_for - waiting)


def _reached(number: int, next_ones: Sequence[set[int]]) -> set[int]:
    """All that come after a number, itself only if it is in a loop."""
    found: set[int] = set()
    left = [number]
    while left:
        new = next_ones[left.pop()] - found
        found |= new
        left += new
    return found
