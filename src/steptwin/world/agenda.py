"""When waiting scripts are evaluated: at fixed moments, and when a kernel has changed on which their condition depends.

A watching script is evaluated when its due moment has come or one of its kernels has changed, never because of other scripts. So
the cost of a world grows with the number of its events only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from heapq import heapify, heappop, heappush
from itertools import count

from steptwin.machine import Nanos
from steptwin.world.kernel import Kernel
from steptwin.world.running import Script

_FEW = 64
"""Outdated entries of a queue that are not worth removing."""


class _Queue:
    """Scripts by the moments at which they are due, those of one moment in their order.

    A script has one entry in all queues that share ``count``, which gives each entry a number: the last one made for it.
    """

    __slots__ = ("_count", "_entries", "_room")

    def __init__(self, count: Iterator[int]) -> None:
        self._count = count
        self._entries: list[tuple[Nanos, int, int, Script]] = []
        self._room = _FEW

    def put(self, script: Script, due: Nanos) -> None:
        """A script is due at ``due``, and at no other moment."""
        script.entry = next(self._count)
        heappush(self._entries, (due, script.number, script.entry, script))
        if len(self._entries) > self._room:
            self._entries = [entry for entry in self._entries if entry[3].entry == entry[2]]
            heapify(self._entries)
            self._room = 2 * len(self._entries) + _FEW

    def first(self) -> Nanos | None:
        """The first moment at which one is due."""
        entries = self._entries
        while entries and entries[0][3].entry != entries[0][2]:
            heappop(entries)
        return entries[0][0] if entries else None

    def take(self, now: Nanos) -> Script | None:
        """One that is due by ``now``, which is then due no more."""
        first = self.first()
        if first is None or first > now:
            return None
        script = heappop(self._entries)[3]
        script.entry = 0
        return script


class Agenda:
    """The scripts that wait, each in one of two ways."""

    __slots__ = ("_timed", "_watching")

    def __init__(self) -> None:
        numbers = count(1)
        self._timed = _Queue(numbers)
        self._watching = _Queue(numbers)

    def wait(self, script: Script, until: Nanos) -> None:
        """A script waits for a moment."""
        self._timed.put(script, until)

    def watch(self, script: Script, due: Nanos | None) -> None:
        """A watching script is evaluated at ``due``; None: only when a kernel has changed."""
        script.entry = 0
        if due is not None:
            self._watching.put(script, due)

    def remove(self, script: Script) -> None:
        """A script waits no longer: its entry is outdated."""
        script.entry = 0

    def first(self) -> Nanos | None:
        """The first moment at which a script is due."""
        timed, watching = self._timed.first(), self._watching.first()
        return watching if timed is None else timed if watching is None else min(timed, watching)

    def take_timed(self, now: Nanos) -> Script | None:
        """One whose moment has come, which then waits no longer."""
        return self._timed.take(now)

    def take_watching(self, now: Nanos) -> list[Script]:
        """Those that watch and are due."""
        taken = []
        while (script := self._watching.take(now)) is not None:
            taken.append(script)
        return taken


class Watchers:
    """Which scripts depend on which kernels, and which kernels have changed since the last `take`."""

    __slots__ = ("_again", "_changed", "_scripts", "_watch")

    def __init__(self) -> None:
        self._watch: Callable[[Kernel], None] | None = None
        """Called with every kernel that has changed, also those on which no script depends."""
        self._scripts: dict[Kernel, dict[int, Script]] = {}
        self._changed: dict[Kernel, None] = {}
        self._again: dict[int, Script] = {}

    def set(self, script: Script, kernels: tuple[Kernel, ...]) -> None:
        """A script depends on these kernels, and on no others any more."""
        if kernels == script.kernels:
            return
        for kernel in script.kernels:
            scripts = self._scripts[kernel]
            del scripts[script.number]
            if not scripts:
                del self._scripts[kernel]
                kernel.on_change = self._watch
        script.kernels = kernels
        for kernel in kernels:
            self._scripts.setdefault(kernel, {})[script.number] = script
            kernel.on_change = self.change

    def change(self, kernel: Kernel) -> None:
        """Scripts that depend on ``kernel`` have to be evaluated."""
        self._changed[kernel] = None
        if self._watch is not None:
            self._watch(kernel)

    def watch_all(self, kernels: Iterable[Kernel], watch: Callable[[Kernel], None]) -> None:
        """Call ``watch`` with every one of these kernels that has changed."""
        self._watch = watch
        for kernel in kernels:
            if kernel not in self._scripts:
                kernel.on_change = watch

    def again(self, script: Script) -> None:
        """A script was evaluated and has to wait on."""
        self._again[script.number] = script

    def take(self) -> list[Script]:
        """The scripts for which something has changed, in their order."""
        if not self._changed and not self._again:
            return []
        found, self._again = self._again, {}
        for kernel in self._changed:
            found.update(self._scripts.get(kernel, {}))
        self._changed.clear()
        return [found[n] for n in sorted(found)]
