"""Followers of the signals of one scheduler, which are notified of each of its events."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from steptwin.controller import Nanos


class SchedulerFollower(Protocol):
    """It reads signals of one scheduler only, and changes nothing."""

    def leave(self, moment: Nanos) -> None:
        """Before anything happens at ``moment``: what moves still has the trajectory from before."""
        ...

    def look(self, now: Nanos) -> None:
        """After an event at ``now`` by which one of its sources may have changed, once the signals have settled."""
        ...


class SchedulerFollowers:
    """Followers of one scheduler."""

    __slots__ = ("by_name", "leaving", "news")

    def __init__(self) -> None:
        self.by_name: dict[str, dict[SchedulerFollower, None]] = {}
        """By the controllers, lines and elements on which they depend."""
        self.leaving: list[SchedulerFollower] = []
        """Those that are notified before each event."""
        self.news: dict[SchedulerFollower, None] = {}
        """Those that will be notified."""

    def add(self, follower: SchedulerFollower, names: Iterable[str], *, leaves: bool) -> None:
        """Tell it of events at controllers, lines and elements with these names; ``leaves``: and before each event."""
        for name in names:
            self.by_name.setdefault(name, {})[follower] = None
        if leaves:
            self.leaving.append(follower)

    def remove(self, follower: SchedulerFollower) -> None:
        for there in (*self.by_name.values(), self.news):
            there.pop(follower, None)
        if follower in self.leaving:
            self.leaving.remove(follower)

    def leave(self, moment: Nanos) -> None:
        for follower in self.leaving:
            follower.leave(moment)

    def tell(self, now: Nanos) -> None:
        """The signals have settled."""
        while self.news:
            self.news.popitem()[0].look(now)
