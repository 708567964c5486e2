"""Scheduling of waiting scripts: at fixed moments, and when a controller, a line or an element changes on which their condition
depends.

A script with a condition is evaluated only at its due moment or when one of these may have changed; watched schedulers are
advanced event by event. The cost of a world therefore grows with the number of its events, not with the number of its scripts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from heapq import heapify, heappop, heappush
from itertools import count
from typing import Generic, TypeAlias, TypeVar

from steptwin.controller import Nanos
from steptwin.simulation.scheduler.deadlines import Deadlines
from steptwin.simulation.scheduler.scheduler import Scheduler, Source
from steptwin.simulation.scheduler.worldsubscriber import WorldSubscriber
from steptwin.simulation.world.running import Script

Waiter: TypeAlias = "Script | WorldSubscriber"
W = TypeVar("W", Script, WorldSubscriber)
_FEW = 64
"""Number of outdated entries that a queue tolerates before it removes them."""


class _Queue(Generic[W]):
    """A priority queue of scripts by due moment; scripts due at the same moment keep their order.

    Only the last entry of a script is valid. Entries are numbered by ``count``, which several queues share.
    """

    __slots__ = ("_count", "_room", "entries")

    def __init__(self, count: Iterator[int]) -> None:
        self._count = count
        self.entries: list[tuple[Nanos, int, int, W]] = []
        self._room = _FEW

    def put(self, script: W, due: Nanos) -> None:
        """Make a script due at ``due``, instead of at an earlier entry."""
        script.entry = next(self._count)
        heappush(self.entries, (due, script.number, script.entry, script))
        if len(self.entries) > self._room:
            self.entries = [entry for entry in self.entries if entry[3].entry == entry[2]]
            heapify(self.entries)
            self._room = 2 * len(self.entries) + _FEW

    def first(self) -> Nanos | None:
        """The earliest due moment; None if the queue is empty."""
        entries = self.entries
        while entries and entries[0][3].entry != entries[0][2]:
            heappop(entries)
        return entries[0][0] if entries else None

    def take(self, now: Nanos) -> W | None:
        """Remove and return a script that is due by ``now``; None if there is none."""
        first = self.first()
        if first is None or first > now:
            return None
        script = heappop(self.entries)[3]
        script.entry = 0
        return script


class Agenda(Generic[W]):
    """The waiting scripts: those that wait for a moment, and those that wait for a condition or an answer."""

    __slots__ = ("_timed", "_watching")

    def __init__(self) -> None:
        numbers = count(1)
        self._timed: _Queue[W] = _Queue(numbers)
        self._watching: _Queue[W] = _Queue(numbers)

    def wait(self, script: W, until: Nanos) -> None:
        """Let a script wait for a moment."""
        self._timed.put(script, until)

    def watch(self, script: W, due: Nanos | None) -> None:
        """Let a script be evaluated at ``due``; None: only when something has changed on which it depends."""
        script.entry = 0
        if due is not None:
            self._watching.put(script, due)

    def remove(self, script: W) -> None:
        """Remove a script: its entry becomes outdated."""
        script.entry = 0

    def first(self) -> Nanos | None:
        """The earliest moment at which a script is due."""
        timed = self._timed.first() if self._timed.entries else None
        watching = self._watching.first() if self._watching.entries else None
        return watching if timed is None else timed if watching is None else min(timed, watching)

    def take_timed(self, now: Nanos) -> W | None:
        """Remove and return a script whose moment has come; None if there is none."""
        return self._timed.take(now)

    def take_watching(self, now: Nanos) -> list[W]:
        """Remove and return the scripts that are due for evaluation."""
        taken = []
        while (script := self._watching.take(now)) is not None:
            taken.append(script)
        return taken


class Dependencies:
    """Which scripts depend on which controllers, lines and elements, when their schedulers are due, and what has changed since
    the last `take`."""

    __slots__ = ("_again", "_changed", "_deadlines", "_numbers", "_schedulers", "_scripts", "_watch")

    def __init__(self) -> None:
        self._watch: Callable[[Scheduler], None] | None = None
        """Called with every changed scheduler, including those on which no script depends."""
        self._scripts: dict[Scheduler, dict[str, dict[int, Waiter]]] = {}
        """By scheduler, name of the source, and number."""
        self._changed: dict[Scheduler, None] = {}
        self._again: dict[int, Waiter] = {}
        self._schedulers: list[Scheduler] = []
        """All that were watched ever, by number."""
        self._numbers: dict[Scheduler, int] = {}
        self._deadlines = Deadlines()
        """Deadlines of schedulers on which a script depends."""

    def set(self, script: Waiter, sources: tuple[Source, ...]) -> None:
        """Replace what a script depends on."""
        if sources == script.sources:
            return
        for source in script.sources:
            self._leave(source, script)
        script.sources = sources
        for scheduler, name in sources:
            if scheduler not in self._scripts:
                self._begin(scheduler)
            self._scripts[scheduler].setdefault(name, {})[script.number] = script

    def _leave(self, source: Source, script: Waiter) -> None:
        scheduler, name = source
        named = self._scripts[scheduler]
        scripts = named[name]
        del scripts[script.number]
        if scripts:
            return
        del named[name]
        if not named:
            del self._scripts[scheduler]
            self._deadlines.put(self._numbers[scheduler], None)
            scheduler.on_change = self._watch

    def _begin(self, scheduler: Scheduler) -> None:
        if scheduler not in self._numbers:
            self._numbers[scheduler] = len(self._schedulers)
            self._schedulers.append(scheduler)
        self._scripts[scheduler] = {}
        self._deadlines.put(self._numbers[scheduler], scheduler.deadline())
        scheduler.on_change = self.change

    def due(self) -> Nanos | None:
        """When a scheduler on which a script depends is due, as far as `take` has nothing to give."""
        return self._deadlines.first()

    def advance(self, now: Nanos, until: Nanos) -> Nanos:
        """Advance the schedulers that are due at ``now``; a single one to its event, which may be as late as ``until`` if no
        other is due before. Returns the moment of the event."""
        numbers = self._deadlines.take(now)
        if len(numbers) == 1 and until > now:
            other = self._deadlines.first()
            return max(now, self._schedulers[numbers[0]].advance_to_event(until if other is None else min(until, other - 1)))
        for number in numbers:
            self._schedulers[number].advance(now)
        return now

    def change(self, scheduler: Scheduler) -> None:
        """Register a change of ``scheduler``: the scripts that depend on what has changed there have to be evaluated."""
        self._changed[scheduler] = None
        if self._watch is not None:
            self._watch(scheduler)

    def subscribe_to_all(self, schedulers: Iterable[Scheduler], watch: Callable[[Scheduler], None]) -> None:
        """Call ``watch`` with every one of these schedulers that has changed."""
        self._watch = watch
        for scheduler in schedulers:
            if scheduler not in self._scripts:
                scheduler.on_change = watch

    def again(self, script: Waiter) -> None:
        """Evaluate a script again with the next `take`."""
        self._again[script.number] = script

    def forget(self, script: Waiter) -> None:
        """Do not evaluate it again."""
        self._again.pop(script.number, None)

    def take(self) -> list[Waiter]:
        """The scripts that have to be evaluated, in their order."""
        if not self._changed and not self._again:
            return []
        found, self._again = self._again, {}
        while self._changed:
            scheduler, _ = self._changed.popitem()
            named = self._scripts.get(scheduler)
            if named is not None:
                self._deadlines.put(self._numbers[scheduler], scheduler.deadline())  # signals settle
                for name in scheduler.take_changed():
                    found.update(named.get(name, ()))
        return [found[n] for n in sorted(found)]
