"""Subscribers of a running world: they see its signals at every moment at which these change, and change nothing.

A `SchedulerSubscriber` is notified by one scheduler, event by event, however far that runs at once. A `WorldSubscriber` is for
what depends on several schedulers: the world brings them to each moment together.
"""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import Nanos
from steptwin.simulation.scheduler.scheduler import Source


class WorldSubscriber(Protocol):
    number: int
    """Below 0, given by `steptwin.simulation.world.scripts.Scripts.subscribe`."""
    entry: int
    """The number of its valid entry in an agenda."""
    sources: tuple[Source, ...]
    """The controllers, lines and elements on which what it sees depends."""

    def leave(self, moment: Nanos) -> None:
        """Before anything happens at ``moment``: what moves still has the trajectory from before."""
        ...

    def look(self, now: Nanos) -> tuple[Source, ...]:
        """After everything of ``now`` so far. Returns what it depends on: it looks again when one of these changes."""
        ...

    def rewind(self, now: Nanos) -> None:
        """A snapshot was restored: what was seen from ``now`` on did not happen."""
        ...
