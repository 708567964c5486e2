"""The values of the points of controllers that keep them between events, such as registers, noted while a world runs."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.points import LivePoint, MemoryCells
from steptwin.world.kernel import Kernel
from steptwin.world.plant import Plant

MOST_TURNS = 1_000_000
"""Limit of the changes that are noted, which are kept in memory."""
MOST_LOOKS = 100_000
"""Limit of the events after which the points are compared: a run takes some 2 s longer by it. Where there is more of either,
nothing is noted any more, and all is forgotten."""

PointTurn: TypeAlias = tuple[Nanos, float]
"""A moment, and the value from then on."""


class PointTurns:
    """Notes the changes of all such points of ``world`` from now on."""

    def __init__(self, world: Plant) -> None:
        self._world = world
        self._readers = {owner: _Reader(world, owner) for owner in world.machines}
        self._of_kernel: dict[Kernel, list[_Reader]] = {}
        self._noted = self._looks = 0
        for owner, reader in self._readers.items():
            kernel = world.parts.kernel_of[owner]
            self._of_kernel.setdefault(kernel, []).append(reader)
            kernel.is_attentive = True
        world.watch_kernels(self._look)

    def _look(self, kernel: Kernel) -> None:
        if kernel.stale or kernel not in self._of_kernel:
            return
        for reader in self._of_kernel[kernel]:
            self._noted += reader.look(kernel.now)
        self._looks += 1
        if self._noted > MOST_TURNS or self._looks > MOST_LOOKS:
            self._of_kernel.clear()
            self._readers.clear()

    def turns(self, name: str) -> Sequence[PointTurn] | None:
        """The values of a point, ``table.M1_ACC`` or ``table.USER_REGISTER[12]:real``, the first one from the beginning on; None
        for what is not noted."""
        owner, _, path = name.partition(".")
        reader = self._readers.get(owner)
        if reader is None:
            return None
        if path in reader.points:
            return reader.points[path]
        memory = _memory(self._world, owner, path)
        return None if memory is None or reader.cells is None else reader.cells.turns(memory)


class _Reader:
    """Of one controller. ``points``: the turns of each."""

    def __init__(self, world: Plant, owner: str) -> None:
        found = dict(_readable(world, owner))
        now = world.now
        self._reads = list(found.values())
        self._values = [float(read(now)) for read in self._reads]
        self.points = {path: [(now, value)] for path, value in zip(found, self._values, strict=True)}
        self._turns = list(self.points.values())
        sheet = world.kind(owner).datasheet(world.machine(owner))
        memories = [memory for point in sheet.points if (memory := _memory(world, owner, f"{point.path}[0]")) is not None]
        self.cells = _Cells(memories[0], now) if memories else None

    def look(self, now: Nanos) -> int:
        """Note what has another value at the present moment; how many changes that are."""
        noted = 0 if self.cells is None else self.cells.look(now)
        values = [read(now) for read in self._reads]
        if values == self._values:
            return noted
        for turns, value, before in zip(self._turns, values, self._values, strict=True):
            if value != before:
                _note(turns, now, float(value))
                noted += 1
        self._values = values
        return noted


class _Cells:
    """The words of the memory of a controller."""

    def __init__(self, memory: MemoryCells, now: Nanos) -> None:
        self._words = memory.words
        self._first = self._last = memory.words()[:]
        self._begin = now
        self._turns: dict[int, list[PointTurn]] = {}

    def look(self, now: Nanos) -> int:
        words = self._words()
        if words == self._last:
            return 0
        changed = [cell for cell, (word, before) in enumerate(zip(words, self._last, strict=True)) if word != before]
        for cell in changed:
            _note(self._of(cell), now, words[cell])
        self._last = words[:]
        return len(changed)

    def _of(self, cell: int) -> list[PointTurn]:
        return self._turns.setdefault(cell, [(self._begin, self._first[cell])])

    def turns(self, memory: MemoryCells) -> list[PointTurn]:
        """Of a value in it."""
        words = [int(self._first[cell]) for cell in memory.cells]
        found = [(self._begin, float(memory.value(words)))]
        changes = [(time, number, word) for number, cell in enumerate(memory.cells) for time, word in self._turns.get(cell, ())]
        for time, number, word in sorted(changes):
            words[number] = int(word)
            _note(found, time, float(memory.value(words)))
        return found


def _note(turns: list[PointTurn], now: Nanos, value: float) -> None:
    """What lasts for no time is no value."""
    if turns[-1][0] == now:
        turns.pop()
    if not turns or turns[-1][1] != value:
        turns.append((now, value))


def _readable(world: Plant, owner: str) -> Iterator[tuple[str, Callable[[Nanos], float]]]:
    """The points of a controller that keep their value between events; pins have their edges."""
    kind, machine = world.kind(owner), world.machine(owner)
    pins = machine.pins()
    for point in kind.datasheet(machine).points:
        found = _point(world, owner, point.path)
        if found is not None and found.read is not None and found.turns is None and point.path not in pins:
            yield point.path, found.read


def _point(world: Plant, owner: str, path: str) -> LivePoint | None:
    """None also for a row of registers, of which one must be chosen."""
    with suppress(Misuse):
        return world.kind(owner).point(world.machine(owner), path)
    return None


def _memory(world: Plant, owner: str, path: str) -> MemoryCells | None:
    found = _point(world, owner, path)
    return None if found is None else found.memory


def since(turns: Sequence[PointTurn], now: Nanos) -> Nanos | None:
    """Since when it has the value of a moment; None: from the beginning."""
    index = _index(turns, now)
    return turns[index][0] if index > 0 else None


def level(turns: Sequence[PointTurn], now: Nanos) -> float:
    """The value at a moment."""
    return turns[max(0, _index(turns, now))][1]


def changes(turns: Sequence[PointTurn], after: Nanos, until: Nanos) -> Iterator[Nanos]:
    """The moments of the changes after a moment until another."""
    return (turns[index][0] for index in range(max(_index(turns, after) + 1, 1), _index(turns, until) + 1))


def _index(turns: Sequence[PointTurn], now: Nanos) -> int:
    return bisect_right(turns, now, key=_moment) - 1


def _moment(turn: PointTurn) -> Nanos:
    return turn[0]
