"""Time travel of one viewer: it sees a moment of the past, while the world goes on for the others."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.devices.worldmember import NOTHING_KNOWN, present_of
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.later import Later
from steptwin.messages import Message
from steptwin.studio.programs import ProgramTexts
from steptwin.studio.requests import KeptMoment, PastEvents
from steptwin.studio.watches import Watched
from steptwin.subject.commands import Command, Encoders, ListFaults, ReadPins, ReadPoints, ReadState
from steptwin.subject.contract import PlannedSubject, Result
from steptwin.subject.subscriptions import EventBatch, Filter, filter_of

T = TypeVar("T")
MOST_PAST_EVENTS = 10_000
LONGEST_PAST: Nanos = 60 * SECOND
"""Limits of an answer to `past_events`: events, ns."""
OF_A_MOMENT = frozenset({ReadPoints, ReadPins, ReadState, Encoders, ListFaults})
"""Commands whose answer is about a moment."""


class PastView(Protocol):
    """A moment of the past, in a world whose time advances only on request."""

    @property
    def subject(self) -> PlannedSubject: ...
    @property
    def programs(self) -> ProgramTexts: ...
    @property
    def now(self) -> Nanos: ...

    def go(self, moment: Nanos) -> Later[None]:
        """To another moment. Raises `Misuse` for one that is not kept, `Refusal` when yet another one is wanted meanwhile."""
        ...

    def go_back(self) -> None:
        """Return the world itself to this moment, and pause it. Raises `Refusal`."""
        ...

    def close(self) -> None: ...


class TimeTravel(Protocol):
    """The past of a world that is kept."""

    @property
    def begin(self) -> Nanos: ...

    def open(self) -> PastView:
        """For one more viewer. Raises `Refusal` where there are too many."""
        ...

    def events(
        self, begin: Nanos, end: Nanos, what: Filter, bound: int, at_begin: Callable[[PlannedSubject], T]
    ) -> Later[tuple[T, EventBatch]]:
        """The last ``bound`` events between two moments, and what ``at_begin`` finds at the first one.

        Raises `Refusal` where there are too many viewers of the past, `Misuse` for moments that are not kept.
        """
        ...


NO_PAST_TO_SHOW = Message("studio.no-past-to-show", "show_moment: no past is kept here")
VIEWER_IS_AT_PRESENT = Message("studio.viewer-is-at-present", "this viewer is at the present")
NO_PAST_EVENTS = Message("studio.no-past-events", "past_events: no past is kept here")
PAST_TOO_LONG = Message(
    "studio.past-too-long", "past_events from {from_s:g} s to {to_s:g} s: permitted is up to {most_s} s in one answer"
)


class ShownMoment:
    """The shown moment of one viewer: the present until `go`."""

    def __init__(self, time_travel: TimeTravel | None) -> None:
        self._time_travel = time_travel
        self._view: PastView | None = None
        self._going: Later[None] | None = None
        self.is_changed = False
        """Whether the viewer has to be sent `message`."""
        self.unsent: set[int] = set()
        """Numbers of the watches whose values of the moment have to be sent."""

    @property
    def is_past(self) -> bool:
        """Whether it is the past."""
        return self._view is not None

    async def go(self, moment: Nanos, watches: Mapping[int, Watched]) -> KeptMoment:
        """Show a moment. Raises `Misuse`, and `Refusal` if no past is kept."""
        if self._time_travel is None:
            raise Refusal(NO_PAST_TO_SHOW())
        view = self._view or self._time_travel.open()
        try:
            self._going = view.go(moment)
            await self._going
        except SteptwinError:
            if self._view is None:
                view.close()
            raise
        self._view = view
        self.is_changed = True
        self.unsent = set(watches)
        return KeptMoment(view.now, self._time_travel.begin)

    def leave(self) -> None:
        """Back to the present."""
        if self._view is not None:
            self._view.close()
            self._view = None
            self.is_changed = True
            self.unsent.clear()

    async def _there(self) -> PastView:
        """The moment requested last, when it has been computed."""
        while self._going is not None and not self._going.is_done:
            try:
                await self._going
            except SteptwinError:
                continue  # another moment was requested meanwhile
        if self._view is None:
            raise Refusal(VIEWER_IS_AT_PRESENT())
        return self._view

    async def do(self, wanted: Command) -> Result:
        """The answer to one of `OF_A_MOMENT`."""
        view = await self._there()
        return view.subject.do(wanted)

    async def programs(self) -> ProgramTexts:
        return (await self._there()).programs

    async def go_back(self) -> None:
        """Return the world itself to the moment. Raises `Refusal`."""
        (await self._there()).go_back()
        self.leave()

    async def events(self, begin: Nanos, end: Nanos, kinds: tuple[str, ...] | None) -> PastEvents:
        """Events between two moments, whichever is shown. Raises `Misuse`, and `Refusal` if no past is kept."""
        time_travel = self._time_travel
        if time_travel is None:
            raise Refusal(NO_PAST_EVENTS())
        begin = max(begin, time_travel.begin)
        if not begin <= end <= begin + LONGEST_PAST:
            raise Misuse(PAST_TOO_LONG(from_s=begin / SECOND, to_s=end / SECOND, most_s=LONGEST_PAST // SECOND))
        present, batch = await time_travel.events(begin, end, filter_of(kinds), MOST_PAST_EVENTS, _present)
        if batch.missed:  # what held at the begin says nothing of the first event that is left
            begin, present = batch.events[0].time, dict[str, Any](NOTHING_KNOWN, plans=[])
        events = [event.to_json() for event in batch.events]
        return PastEvents(begin, end, **present, events=events)

    # ------------------------------------------------------------------ what the viewer is sent

    def message(self, may: list[str]) -> dict[str, object] | None:
        """Message of the moment that is shown; None for the present."""
        self.is_changed = False
        view, time_travel = self._view, self._time_travel
        if view is None or time_travel is None:
            return None
        moments = {"time_ns": str(view.now), "from_ns": str(time_travel.begin)}
        return {**moments, "may": may, **_present(view.subject)}

    def take(self, watches: Mapping[int, Watched]) -> dict[int, str]:
        """Values of the moment by watch, as JSON."""
        numbers, self.unsent = self.unsent & set(watches), set()
        return {number: self._values(watches[number]) for number in sorted(numbers)}

    def _values(self, watched: Watched) -> str:
        view = self._view
        points = () if view is None else watched.values.points
        return json.dumps([[index, _value(view, point)] for index, point in enumerate(points)], separators=(",", ":"))


def _present(subject: PlannedSubject) -> dict[str, Any]:
    plans = [plan.to_json() for plan in subject.plans(filter_of(["plan"]))]
    return {**present_of(subject), "plans": plans}


def _value(view: PastView | None, point: str) -> float | None:
    """The value at a moment; None if unknown, as for a device, of which no past is kept."""
    try:
        return None if view is None else view.subject.read(point)[0].value
    except Misuse:
        return None
