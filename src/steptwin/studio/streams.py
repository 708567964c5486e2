"""Events for viewers: followed once, encoded as JSON once, and shared by all viewers with the same filters.

A stream has the events for one set of filters, the last of them; each viewer has its place in it. What a slow viewer loses is
counted.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import NamedTuple, Protocol, TypeAlias

from steptwin.subject.events import Event
from steptwin.subject.subscriptions import Filter, Subscription

MOST_WAITING = 10_000
"""Limit of pending events of a stream, and of events that are not distributed to streams yet."""

Filters: TypeAlias = frozenset[Filter]


class Batch(NamedTuple):
    """Events as JSON, separated by commas; ``missed``: the number of events dropped before them."""

    text: str
    count: int
    missed: int


class Stream:
    """The newest events that pass a set of filters."""

    __slots__ = ("_begin", "_joined", "_missed", "_texts", "filters", "places")

    def __init__(self, filters: Filters) -> None:
        self.filters = filters
        self.places: set[StreamPosition] = set()
        self._texts: deque[str] = deque()
        self._begin = 0
        """The number of the first stored event."""
        self._missed = 0
        """Total number of events lost before they arrived here."""
        self._joined: tuple[int, int, str] = (0, 0, "")

    @property
    def end(self) -> int:
        return self._begin + len(self._texts)

    @property
    def missed(self) -> int:
        return self._missed

    def wants(self, event: Event) -> bool:
        return any(one.wants(event) for one in self.filters)

    def add(self, text: str) -> None:
        self._texts.append(text)
        if len(self._texts) > MOST_WAITING:
            self._texts.popleft()
            self._begin += 1

    def miss(self, count: int) -> None:
        self._missed += count

    def drop_read(self) -> None:
        """Delete events that all viewers have received."""
        first = min((place.next for place in self.places), default=self.end)
        while self._begin < first and self._texts:
            self._texts.popleft()
            self._begin += 1

    def between(self, first: int) -> str:
        """The stored events from number ``first`` on."""
        end = self.end
        if self._joined[:2] != (first, end):
            self._joined = first, end, ",".join(islice(self._texts, first - self._begin, None))
        return self._joined[2]

    @property
    def begin(self) -> int:
        return self._begin


class StreamPosition:
    """The position of a viewer in a stream. ``bound``: limit of its pending events."""

    __slots__ = ("_missed", "bound", "next", "stream")

    def __init__(self, stream: Stream, bound: int) -> None:
        self.stream = stream
        self.bound = bound
        self.next = stream.end
        self._missed = stream.missed

    @property
    def has_news(self) -> bool:
        return self.next < self.stream.end or self._missed < self.stream.missed

    def take(self) -> Batch:
        stream = self.stream
        first = max(self.next, stream.begin, stream.end - self.bound)
        missed = first - self.next + stream.missed - self._missed
        self.next, self._missed = stream.end, stream.missed
        return Batch(stream.between(first) if first < stream.end else "", stream.end - first, missed)


class Followed(Protocol):
    """The followed subject."""

    def subscribe(self, what: Filter, bound: int) -> Subscription: ...


class Streams:
    """All streams, over one subscription to ``subject`` with the kinds that viewers subscribe to."""

    def __init__(self, subject: Followed) -> None:
        self._subject = subject
        self._subscription: Subscription | None = None
        self._kinds: frozenset[str] = frozenset()
        self._streams: dict[Filters, Stream] = {}
        self.on_event: Callable[[], None] | None = None
        """Called when an event arrives in an empty queue."""

    def enter(self, filters: Iterable[Filter], bound: int) -> StreamPosition:
        """Join a stream with the events from now on."""
        wanted = frozenset(filters)
        self.flush()
        stream = self._streams.get(wanted)
        if stream is None:
            stream = self._streams[wanted] = Stream(wanted)
            self._subscribe()
        place = StreamPosition(stream, min(bound, MOST_WAITING))
        stream.places.add(place)
        return place

    def leave(self, place: StreamPosition) -> None:
        stream = place.stream
        stream.places.discard(place)
        if not stream.places and self._streams.pop(stream.filters, None) is not None:
            self._subscribe()

    def _subscribe(self) -> None:
        """Update the subscription to the kinds subscribed to now."""
        kinds = frozenset[str]().union(*(one.kinds for filters in self._streams for one in filters))
        if kinds == self._kinds:
            return
        before, self._kinds = self._subscription, kinds
        self._subscription = None
        if kinds:
            self._subscription = self._subject.subscribe(Filter(kinds), MOST_WAITING)
            self._subscription.on_event = self.on_event
        if before is not None:
            self._spread(before)
            before.close()

    def flush(self) -> None:
        """Distribute new events to the streams."""
        if self._subscription is not None:
            self._spread(self._subscription)

    def _spread(self, subscription: Subscription) -> None:
        missed, events = subscription.take()
        if not missed and not events:
            return
        streams: Sequence[Stream] = list(self._streams.values())
        for stream in streams:
            stream.miss(missed)
        for event in events:
            text = ""
            for stream in streams:
                if stream.wants(event):
                    text = text or json.dumps(event.to_json(), separators=(",", ":"))
                    stream.add(text)
        for stream in streams:
            stream.drop_read()
