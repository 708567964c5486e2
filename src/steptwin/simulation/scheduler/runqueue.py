"""Run queue of a scheduler, by number: what has to run, without a scan of everything."""

from __future__ import annotations


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
