"""Deadlines of a scheduler by number: what is due when, without a scan of everything."""

from __future__ import annotations

from heapq import heapify, heappop, heappush

from steptwin.controller import Nanos

_FEW = 64
"""Number of outdated entries that a queue tolerates before it removes them."""


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
