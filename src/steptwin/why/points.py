"""The values of the points of controllers that keep them between events, such as registers, noted while a world runs."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.points import LivePoint, MemoryCells
from steptwin.simulation.world.eventpoints import EventPoints, points_of, stays_between_events
from steptwin.simulation.world.simulation import Simulation

MOST_CHANGES = 1_000_000
"""Limit of the changes that are noted, which are kept in memory."""
MOST_LOOKS = 100_000
"""Limit of the events and statements after which the points are compared: a run takes some 2 s longer by it. Where there is
more of either, nothing is noted any more, and all is forgotten."""

TimedValue: TypeAlias = tuple[Nanos, float]
"""A moment, and the value from then on. The first one is that of a nanosecond before the beginning, at which something may be
written at once."""


class NotedPoints:
    """Notes the changes of all such points of ``world`` from now on: after each event of their controller, and after each
    statement of which `executes` is notified."""

    def __init__(self, world: Simulation, order: Callable[[], int]) -> None:
        """``order``: that of a change after what was noted last (`steptwin.why.log.Change`)."""
        self._world = world
        self.order = order
        self._readers = {owner: _Reader(self, world, owner) for owner in world.controllers}
        self._noted = self._looks = 0
        for owner, reader in self._readers.items():
            scheduler = world.objects.scheduler_of[owner]
            scheduler.hears_requests = True
            scheduler.subscribe(reader, (owner,))

    def executes(self, owner: str, now: Nanos, *, keeps: bool) -> None:
        """A controller executes a statement next, which may change points without an event if it ``keeps``."""
        reader = self._readers.get(owner)
        if reader is not None:
            reader.executes(now, keeps=keeps)

    def looked(self, noted: int) -> None:
        """A reader has noted so many changes."""
        self._noted += noted
        self._looks += 1
        if self._noted > MOST_CHANGES or self._looks > MOST_LOOKS:
            for owner, reader in self._readers.items():
                self._world.objects.scheduler_of[owner].unsubscribe(reader)
            self._readers.clear()

    def order_of(self, name: str, time: Nanos) -> int | None:
        """The order of the event after which a point took the value of a moment; None where that is not known."""
        owner, _, path = name.partition(".")
        return self._readers[owner].orders.get((path, time)) if owner in self._readers else None

    def series(self, name: str) -> Sequence[TimedValue] | None:
        """The values of a point, ``table.M1_ACC`` or ``table.USER_REGISTER[12]:real``, the first one from the beginning on; None
        for what is not noted."""
        owner, _, path = name.partition(".")
        reader = self._readers.get(owner)
        if reader is None:
            return None
        if path in reader.points:
            return reader.points[path]
        memory = _memory(self._world, owner, path)
        return None if memory is None or reader.cells is None else reader.cells.series(memory)


class _Reader:
    """Reader of the points of one controller. ``points``: the series of each.

    As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`.
    """

    def __init__(self, noted: NotedPoints, world: Simulation, owner: str) -> None:
        self._all = noted
        points = dict(points_of(world, owner))
        found = {path: point for path, point in points.items() if point is not None and stays_between_events(point)}
        now = world.now
        self._kept = _Compared({path: point for path, point in found.items() if point.is_kept}, now)
        self._others = EventPoints(world, owner, {path: point for path, point in found.items() if not point.is_kept})
        self.points = self._kept.series | {path: [(now - 1, float(value))] for path, value in self._others.read(now).items()}
        rows = (_memory(world, owner, f"{path}[0]") for path, point in points.items() if point is None)
        memory = next((row for row in rows if row is not None), None)
        self.cells = None if memory is None else _Cells(memory, now)
        self.orders: dict[tuple[str, Nanos], int] = {}
        """Those of the changes after events, by point and moment."""
        self._keeping: Nanos | None = None
        """Time of the last statement that may have changed a kept value and after which the values were not read."""

    def executes(self, now: Nanos, *, keeps: bool) -> None:
        if self._keeping is not None:
            self._all.looked(self._look_at_kept(self._keeping))
        self._keeping = now if keeps else None

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        """Note what has another value after an event."""
        noted = self._look_at_kept(now if self._keeping is None else self._keeping)
        self._keeping = None
        changed = self._others.changed(now)
        for path, value in changed.items():
            note_value(self.points[path], now, float(value))
            self.orders[path, now] = self._all.order()
        self._all.looked(noted + len(changed))

    def _look_at_kept(self, now: Nanos) -> int:
        return self._kept.look(now) + (0 if self.cells is None else self.cells.look(now))


class _Compared:
    """Points that are only kept, compared together."""

    def __init__(self, found: Mapping[str, LivePoint], now: Nanos) -> None:
        self._reads = [point.read for point in found.values() if point.read is not None]
        self._values = [float(read(now)) for read in self._reads]
        self.series: dict[str, list[TimedValue]] = {
            path: [(now - 1, value)] for path, value in zip(found, self._values, strict=True)
        }

    def look(self, now: Nanos) -> int:
        """Note what has another value at the present moment; how many changes that are."""
        values = [read(now) for read in self._reads]
        if values == self._values:
            return 0
        noted = 0
        for series, value, before in zip(self.series.values(), values, self._values, strict=True):
            if value != before:
                note_value(series, now, float(value))
                noted += 1
        self._values = values
        return noted


class _Cells:
    """The words of the memory of a controller."""

    def __init__(self, memory: MemoryCells, now: Nanos) -> None:
        self._words = memory.words
        self._first = self._last = memory.words()[:]
        self._begin = now - 1
        self._series: dict[int, list[TimedValue]] = {}

    def look(self, now: Nanos) -> int:
        words = self._words()
        if words == self._last:
            return 0
        changed = [cell for cell, (word, before) in enumerate(zip(words, self._last, strict=True)) if word != before]
        for cell in changed:
            note_value(self._of(cell), now, words[cell])
        self._last = words[:]
        return len(changed)

    def _of(self, cell: int) -> list[TimedValue]:
        return self._series.setdefault(cell, [(self._begin, self._first[cell])])

    def series(self, memory: MemoryCells) -> list[TimedValue]:
        """Series of a value in it."""
        words = [int(self._first[cell]) for cell in memory.cells]
        found = [(self._begin, float(memory.value(words)))]
        changes = [(time, number, word) for number, cell in enumerate(memory.cells) for time, word in self._series.get(cell, ())]
        for time, number, word in sorted(changes):
            words[number] = int(word)
            note_value(found, time, float(memory.value(words)))
        return found


def note_value(series: list[TimedValue], now: Nanos, value: float) -> None:
    """Add a value. What lasts for no time is no value."""
    if series[-1][0] == now:
        series.pop()
    if not series or series[-1][1] != value:
        series.append((now, value))


def _point(world: Simulation, owner: str, path: str) -> LivePoint | None:
    """None also for a row of registers, of which one must be chosen."""
    with suppress(Misuse):
        return world.kind(owner).point(world.controller(owner), path)
    return None


def _memory(world: Simulation, owner: str, path: str) -> MemoryCells | None:
    found = _point(world, owner, path)
    return None if found is None else found.memory


def since(series: Sequence[TimedValue], now: Nanos) -> Nanos | None:
    """Since when it has the value of a moment; None: from the beginning."""
    index = _index(series, now)
    return series[index][0] if index > 0 else None


def level(series: Sequence[TimedValue], now: Nanos) -> float:
    """The value at a moment."""
    return series[max(0, _index(series, now))][1]


def changes(series: Sequence[TimedValue], after: Nanos, until: Nanos) -> Iterator[Nanos]:
    """The moments of the changes after a moment until another."""
    return (series[index][0] for index in range(max(_index(series, after) + 1, 1), _index(series, until) + 1))


def _index(series: Sequence[TimedValue], now: Nanos) -> int:
    return bisect_right(series, now, key=_moment) - 1


def _moment(one: TimedValue) -> Nanos:
    return one[0]
