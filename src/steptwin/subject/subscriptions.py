"""Subscriptions to events: each subscriber has a bounded queue, and dropped events are counted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.subject.events import Event
from steptwin.subject.payloads import KINDS

USUAL = frozenset(KINDS) - {"frame", "write", "statement", "stopped", "log", "breakpoints"}
"""Kinds that are subscribed to where none are named: frames and writes are as frequent as requests, statements as milliseconds; a
debugger is there for subscribers that name its events."""


@dataclass(frozen=True, slots=True)
class Filter:
    """Selects events. ``controllers`` None: all; ``axes`` None: all. Events without an axis always pass."""

    kinds: frozenset[str] = USUAL
    controllers: frozenset[str] | None = None
    axes: frozenset[str] | None = None

    @property
    def is_of_kinds(self) -> bool:
        """Whether it selects by kinds alone."""
        return self.controllers is None and self.axes is None

    def wants(self, event: Event) -> bool:
        if event.kind not in self.kinds or (self.controllers is not None and event.controller not in self.controllers):
            return False
        return self.axes is None or event.axis is None or event.axis in self.axes


def filter_of(
    kinds: Iterable[str] | None = None, controllers: Iterable[str] | None = None, axes: Iterable[str] | None = None
) -> Filter:
    return Filter(
        USUAL if kinds is None else frozenset(kinds),
        None if controllers is None else frozenset(controllers),
        None if axes is None else frozenset(axes),
    )


class EventBatch(NamedTuple):
    """Events in order. ``missed``: the number of events dropped before them, since the previous batch."""

    missed: int
    events: list[Event]


class Subscription:
    """The pending events of one subscriber; if there are more than ``bound``, the oldest are dropped."""

    __slots__ = ("_close", "_missed", "_waiting", "filter", "on_event")

    def __init__(self, what: Filter, bound: int, close: Callable[[Subscription], None]) -> None:
        self.filter = what
        self.on_event: Callable[[], None] | None = None
        """Called when an event arrives in an empty queue."""
        self._waiting: deque[Event] = deque(maxlen=bound)
        self._missed = 0
        self._close = close

    def add(self, event: Event) -> None:
        waiting = self._waiting
        if len(waiting) == waiting.maxlen:
            self._missed += 1
        waiting.append(event)
        if len(waiting) == 1 and self.on_event is not None:
            self.on_event()

    def miss(self, count: int) -> None:
        """Count events that were lost before they arrived here."""
        self._missed += count

    def take(self, most: int | None = None) -> EventBatch:
        """Remove and return the pending events, at most the oldest ``most``."""
        missed, self._missed = self._missed, 0
        count = len(self._waiting) if most is None else min(most, len(self._waiting))
        return EventBatch(missed, [self._waiting.popleft() for _ in range(count)])

    def __len__(self) -> int:
        return len(self._waiting)

    def close(self) -> None:
        """End the subscription. Pending events can still be taken."""
        self._close(self)


class Subscriptions:
    """All subscribers of a subject. ``on_change`` is called when the set of subscribed kinds has changed."""

    def __init__(self, on_change: Callable[[], None] = lambda: None) -> None:
        self.all: list[Subscription] = []
        self._on_change = on_change
        self.kinds: frozenset[str] = frozenset()
        """Kinds that at least one subscriber selects."""
        self._by_kind: dict[str, list[Subscription]] = {}
        """Who selects them."""

    def __bool__(self) -> bool:
        return bool(self.all)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        subscription = Subscription(what, bound, self.remove)
        self.add(subscription)
        return subscription

    def add(self, subscription: Subscription) -> None:
        self.all.append(subscription)
        self._changed()

    def publish(self, event: Event) -> None:
        for subscription in self._by_kind.get(event.payload.kind, ()):
            if subscription.filter.is_of_kinds or subscription.filter.wants(event):
                subscription.add(event)

    def remove(self, subscription: Subscription) -> None:
        if subscription in self.all:
            self.all.remove(subscription)
            self._changed()

    def _changed(self) -> None:
        self.kinds = frozenset().union(*(subscription.filter.kinds for subscription in self.all))
        self._by_kind = {kind: [one for one in self.all if kind in one.filter.kinds] for kind in self.kinds}
        self._on_change()
