"""Subscribers of the signals of one scheduler, which are notified of each of its events."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from steptwin.controller import Nanos


class SchedulerSubscriber(Protocol):
    """It reads signals of one scheduler only, and changes nothing."""

    def leave(self, moment: Nanos) -> None:
        """Before anything happens at ``moment``: what moves still has the trajectory from before."""
        ...

    def look(self, now: Nanos) -> None:
        """After an event at ``now`` by which one of its sources may have changed, once the signals have settled."""
        ...


class SchedulerSubscribers:
    """Subscribers of one scheduler."""

    __slots__ = ("by_name", "leaving", "news")

    def __init__(self) -> None:
        self.by_name: dict[str, dict[SchedulerSubscriber, None]] = {}
        """By the controllers, lines and elements on which they depend."""
        self.leaving: list[SchedulerSubscriber] = []
        """Those that are notified before each event."""
        self.news: dict[SchedulerSubscriber, None] = {}
        """Those that will be notified."""

    def add(self, subscriber: SchedulerSubscriber, names: Iterable[str], *, leaves: bool) -> None:
        """Tell it of events at controllers, lines and elements with these names; ``leaves``: and before each event."""
        for name in names:
            self.by_name.setdefault(name, {})[subscriber] = None
        if leaves:
            self.leaving.append(subscriber)

    def remove(self, subscriber: SchedulerSubscriber) -> None:
        for there in (*self.by_name.values(), self.news):
            there.pop(subscriber, None)
        if subscriber in self.leaving:
            self.leaving.remove(subscriber)

    def leave(self, moment: Nanos) -> None:
        for subscriber in self.leaving:
            subscriber.leave(moment)

    def notify(self, now: Nanos) -> None:
        """The signals have settled."""
        while self.news:
            self.news.popitem()[0].look(now)
