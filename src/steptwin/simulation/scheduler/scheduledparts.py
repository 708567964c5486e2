"""The parts of a scheduler, and everything that is kept by their numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from steptwin.simulation.scheduler.deadlines import Deadlines
from steptwin.simulation.scheduler.order import successors, update_order
from steptwin.simulation.scheduler.runqueue import RunQueue
from steptwin.simulation.scheduler.scheduledpart import ScheduledPart
from steptwin.simulation.scheduler.wires import Wire


class ScheduledParts:
    """Parts with numbers in the order in which they are updated: what each depends on, computes and drives, and when it runs.

    All that is kept by number is here, and `arranged` makes it anew, so that nothing of one numbering gets into another.
    """

    __slots__ = ("_depends_on", "_drives", "all", "by_name", "computes", "deadlines", "parts", "queue", "visited")

    def __init__(self) -> None:
        self.parts: list[ScheduledPart] = []
        self.by_name: dict[str, list[int]] = {}
        """The parts that depend on a controller, a line or an element, by its name."""
        self._depends_on: list[tuple[str, ...] | None] = []
        """The names on which each part depends; None: everything."""
        self.all: list[int] = []
        """Those that depend on everything."""
        self.computes: list[str | None] = []
        """The line or element whose signals each part computes."""
        self._drives: dict[int, str] = {}
        """The controller or element whose input a part drives."""
        self.queue = RunQueue()
        """Those that are updated when the signals settle."""
        self.deadlines = Deadlines()
        self.visited: set[int] = set()
        """Those whose deadlines may have changed since the signals last settled."""

    def add(self, part: ScheduledPart, depends_on: Iterable[str] | None, computes: str | None, drives: str | None) -> int:
        """The number of another part, the last one. ``depends_on``: None is everything."""
        number = len(self.parts)
        self.parts.append(part)
        self.computes.append(computes)
        if drives is not None:
            self._drives[number] = drives
        dependencies = None if depends_on is None else tuple(dict.fromkeys(depends_on))
        self._depends_on.append(dependencies)
        if dependencies is None:
            self.all.append(number)
        else:
            for name in dependencies:
                self.by_name.setdefault(name, []).append(number)
        return number

    def order(self, wires: Iterable[Wire]) -> Sequence[int]:
        """Their numbers in the order in which they should be updated; empty if they are in that order."""
        found = update_order(successors(self.computes, self.by_name, self._drives, wires), self.all)
        return () if found == sorted(found) else found

    def arranged(self, order: Sequence[int]) -> ScheduledParts:
        """The same parts, added in another order; none waits to run yet. ``order``: their present numbers."""
        found = ScheduledParts()
        for old in order:
            found.add(self.parts[old], self._depends_on[old], self.computes[old], self._drives.get(old))
        return found
