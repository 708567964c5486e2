"""The parts of a scheduler, and everything that is kept by their numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Runaway
from steptwin.messages import Message
from steptwin.simulation.scheduler.deadlines import Deadlines
from steptwin.simulation.scheduler.order import successors, update_order
from steptwin.simulation.scheduler.runqueue import RunQueue
from steptwin.simulation.scheduler.scheduledpart import ScheduledPart
from steptwin.simulation.scheduler.wires import Wire

Depends: TypeAlias = "Iterable[str] | Callable[[], Iterable[str]] | None"
"""Names of controllers, lines and elements. A function gives them when all parts are there; None: everything."""

AT_ONCE_NS: Nanos = 10
"""Time in which a part of a machine changes nothing of importance twice."""
MOST_AT_ONCE = 1000
"""More changes of a part, each within `AT_ONCE_NS` of the one before, mean that what it does undoes its reason."""
CHANGES_AGAIN_AND_AGAIN = Message(
    "simulation.changes-again-and-again",
    "{name} changes again and again, {most} times within microseconds until {now} ns: what it switches switches it off again; "
    "a sensor needs a hysteresis for that, a level two limits, a relay a delay",
)


class ScheduledParts:
    """Parts with numbers in the order in which they are updated: what each depends on, computes and drives, and when it runs.

    All that is kept by number is here, and `arranged` makes it anew, so that nothing of one numbering gets into another.
    """

    __slots__ = (
        "_depends_on",
        "_drives",
        "_reads",
        "_runs",
        "all",
        "by_name",
        "computes",
        "deadlines",
        "parts",
        "queue",
        "readers",
        "visited",
    )

    def __init__(self) -> None:
        self.parts: list[ScheduledPart] = []
        self.by_name: dict[str, list[int]] = {}
        """The parts that depend on a controller, a line or an element, by its name."""
        self._depends_on: list[tuple[str, ...] | Callable[[], Iterable[str]] | None] = []
        """Names that each part depends on."""
        self.all: list[int] = []
        """Those that depend on everything; until `resolve` also those of which it is not known yet, and those that read."""
        self._reads: list[tuple[str, ...]] = []
        """Names whose signals each part reads."""
        self.readers: dict[int, list[int]] = {}
        """The parts that read the signals that a part computes, by its number."""
        self.computes: list[str | None] = []
        """The line or element whose signals each part computes."""
        self._drives: dict[int, str] = {}
        """The controller or element whose input a part drives."""
        self.queue = RunQueue()
        """Those that are updated when the signals settle."""
        self.deadlines = Deadlines()
        self._runs: dict[int, tuple[Nanos, int]] = {}
        """When a part was due last, and how often it was so again and again within `AT_ONCE_NS`, by its number."""
        self.visited: set[int] = set()
        """Those whose deadlines may have changed since the signals last settled."""

    def add(
        self, part: ScheduledPart, depends_on: Depends, computes: str | None, drives: str | None, reads: Iterable[str] = ()
    ) -> int:
        """The number of another part, the last one."""
        number = len(self.parts)
        self.parts.append(part)
        self.computes.append(computes)
        if drives is not None:
            self._drives[number] = drives
        known = depends_on if depends_on is None or callable(depends_on) else tuple(dict.fromkeys(depends_on))
        self._depends_on.append(known)
        self._reads.append(tuple(dict.fromkeys(reads)))
        if known is None or callable(known) or self._reads[number]:
            self.all.append(number)
        else:
            self._run_after(known, number)
        return number

    def run_due(self, now: Nanos) -> None:
        """Update those that are due when the signals settle. Raises `Runaway` for one that is due again and again."""
        for number in self.deadlines.take(now):
            self.queue.add(number)
            last, count = self._runs.get(number, (now, 0))
            count = count + 1 if 0 < now - last <= AT_ONCE_NS else 0  # a restored state may be earlier, or the same again
            self._runs[number] = now, count
            if count > MOST_AT_ONCE:
                self._runs.clear()
                raise Runaway(CHANGES_AGAIN_AND_AGAIN(name=self._name(number), most=MOST_AT_ONCE, now=now))

    def _name(self, number: int) -> str:
        """The element whose signals a part computes, or whose input it drives."""
        return self.computes[number] or self._drives.get(number, "") or type(self.parts[number]).__name__

    def _run_after(self, names: Iterable[str], number: int) -> None:
        for name in names:
            self.by_name.setdefault(name, []).append(number)

    def resolve(self) -> None:
        """All parts are there, in their order: find what those depend on of which that was not known, and who reads what."""
        readers: dict[str, list[int]] = {}
        for number in tuple(self.all):
            depends_on, reads = self._depends_on[number], self._reads[number]
            if depends_on is not None:
                self.all.remove(number)
                names = depends_on() if callable(depends_on) else depends_on
                self._run_after(dict.fromkeys((*names, *reads)), number)
                for name in reads:
                    readers.setdefault(name, []).append(number)
        self.readers = {
            number: readers[name] for number, name in enumerate(self.computes) if name is not None and name in readers
        }

    def order(self, wires: Iterable[Wire]) -> Sequence[int]:
        """Their numbers in the order in which they should be updated; empty if they are in that order."""
        found = update_order(successors(self.computes, self.by_name, self._drives, wires), self.all)
        return () if found == sorted(found) else found

    def arranged(self, order: Sequence[int]) -> ScheduledParts:
        """The same parts, added in another order; none waits to run yet. ``order``: their present numbers."""
        found = ScheduledParts()
        for old in order:
            found.add(self.parts[old], self._depends_on[old], self.computes[old], self._drives.get(old), self._reads[old])
        return found
