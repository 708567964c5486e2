"""Run queue and deadlines of a scheduler, by number: what has to run, and what is due when, without a scan of everything."""

from __future__ import annotations

from heapq import heapify, heappop, heappush

from steptwin.controller import Nanos

_FEW = 64
"""Number of outdated entries that a queue tolerates before it removes them."""


class RunQueue:
    """Numbers that wait to be run, each once, in passes of ascending order.

    A number that is added behind the present one waits for the next pass.
    """

    __slots__ = ("_last", "_next", "_present")

    def __init__(self) -> None:
        self._present = 0
        """A bit for each number: faster than a queue, because there are few or most of them wait."""
        self._next = 0
        self._last = -1
        """The present number."""

    def add(self, number: int) -> None:
        if number > self._last:
            self._present |= 1 << number
        else:
            self._next |= 1 << number

    def take(self) -> int | None:
        """Remove and return the next number of this pass; None at its end, after which the next pass begins."""
        present = self._present
        if present:
            lowest = present & -present
            self._present = present ^ lowest
            number = self._last = lowest.bit_length() - 1
            return number
        self._present, self._next = self._next, 0
        self._last = -1
        return None


class Deadlines:
    """The next deadline of each number."""

    __slots__ = ("_due", "_entries", "_room")

    def __init__(self) -> None:
        self._due: dict[int, Nanos] = {}
        self._entries: list[tuple[Nanos, int]] = []
        """By moment; those that are not the due moment of their number are outdated."""
        self._room = _FEW

    def put(self, number: int, due: Nanos | None) -> None:
        """Make a number due at ``due`` instead of before; None: never."""
        if due is None:
            self._due.pop(number, None)
        elif self._due.get(number) != due:
            self._due[number] = due
            heappush(self._entries, (due, number))
            if len(self._entries) > self._room:
                self._entries = [(moment, one) for one, moment in self._due.items()]
                heapify(self._entries)
                self._room = 2 * len(self._entries) + _FEW

    def first(self) -> Nanos | None:
        """The earliest due moment; None if nothing is due."""
        entries = self._entries
        while entries and self._due.get(entries[0][1]) != entries[0][0]:
            heappop(entries)
        return entries[0][0] if entries else None

    def take(self, now: Nanos) -> list[int]:
        """Remove and return the numbers that are due by ``now``, in ascending order."""
        entries, deadlines = self._entries, self._due
        found: list[int] = []
        while entries and entries[0][0] <= now:
            moment, number = heappop(entries)
            if deadlines.get(number) == moment:
                del deadlines[number]
                found.append(number)
        return found if len(found) < 2 else sorted(found)
