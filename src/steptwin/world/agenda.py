"""What scripts wait for: moments, in order, and conditions and answers, which are looked at in the order of the scripts."""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heapify, heappop, heappush

from steptwin.machine import Nanos
from steptwin.world.running import Script, Waiting


class Agenda:
    """The scripts that wait, each in one of two ways."""

    __slots__ = ("_timed", "watching")

    def __init__(self) -> None:
        self._timed: list[tuple[Nanos, int, Script]] = []
        self.watching: list[Script] = []
        """Those that wait for more than a moment, in their order."""

    def add(self, script: Script, waiting: Waiting) -> None:
        """A script waits."""
        script.waiting = waiting
        if waiting.is_timed and waiting.until is not None:
            heappush(self._timed, (waiting.until, script.number, script))
        else:
            self.watching.append(script)
            self.watching.sort(key=lambda one: one.number)

    def remove(self, script: Script) -> None:
        """A script waits no longer."""
        script.waiting = None
        self.watching = [one for one in self.watching if one is not script]
        self._timed = [entry for entry in self._timed if entry[2] is not script]
        heapify(self._timed)

    def called(self, name: str) -> list[Script]:
        """Those of this name that wait for a moment."""
        return [entry[2] for entry in self._timed if entry[2].name == name]

    def moment(self) -> Nanos | None:
        """The first moment that is waited for."""
        return self._timed[0][0] if self._timed else None

    def take(self, now: Nanos) -> Iterator[Script]:
        """Those whose moment has come, also while more of them are added."""
        while self._timed and self._timed[0][0] <= now:
            yield heappop(self._timed)[2]
