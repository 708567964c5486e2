"""The newest events that people read, whether or not anybody looks: a page shows what happened before it was opened."""

from __future__ import annotations

from collections import deque

from steptwin.controller import Nanos
from steptwin.subject.contract import AsyncSubject
from steptwin.subject.events import Event
from steptwin.subject.payloads import SHOWN_KINDS
from steptwin.subject.subscriptions import filter_of

MOST_KEPT = 200


class EventLog:
    """The newest events of ``subject``, from ``now`` on."""

    def __init__(self, subject: AsyncSubject, now: Nanos) -> None:
        self._begin = now
        self._kept = deque[Event](maxlen=MOST_KEPT)
        self._subscription = subject.subscribe(filter_of(SHOWN_KINDS), MOST_KEPT)
        self._subscription.on_event = self._take

    def _take(self) -> None:
        self._kept.extend(event for event in self._subscription.take().events if event.is_shown)

    def to_json(self) -> dict[str, object]:
        """``events``, and ``events_from_ns``, from when on they are all that there were."""
        begin = self._kept[0].time if len(self._kept) == MOST_KEPT else self._begin
        return {"events": [event.to_json() for event in self._kept], "events_from_ns": str(begin)}
