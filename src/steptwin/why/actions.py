"""Moments at which elements began to act in another way, noted while a world runs: a cylinder to move, a vacuum to build up."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection

from steptwin.controller import Nanos
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.world.simulation import Simulation


class NotedActions:
    """Notes when the signals of elements of ``world`` that change by themselves take another way, from now on."""

    def __init__(self, world: Simulation) -> None:
        self._of: dict[str, _OfElement] = {}
        for kind, parts in world.objects.elements.items():
            signals = ELEMENTS[kind].signals
            if signals is None or ELEMENTS[kind].terminals is None:
                continue
            for name, part in parts.items():
                moving = [one for one in signals(part).values() if one.continuous and one.versions is not None]
                if moving:
                    self._of[name] = _OfElement(moving)
                    world.objects.scheduler_of[name].subscribe(self._of[name], (name,))

    def begun(self, name: str, before: Nanos) -> Nanos | None:
        """When an element began to act as it did just before a moment; None if that is not noted."""
        times = self._of[name].times if name in self._of else []
        number = bisect_left(times, before)
        return times[number - 1] if number else None

    def has(self, name: str) -> bool:
        """Whether an element acts by itself."""
        return name in self._of


class _OfElement:
    """As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, signals: Collection[SignalOf]) -> None:
        self._signals = signals
        self._versions = [one.version() for one in signals]
        self.times: list[Nanos] = []

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        versions = [one.version() for one in self._signals]
        if versions != self._versions:
            self._versions = versions
            self.times.append(now)
