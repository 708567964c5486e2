"""Two bodies that may touch."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.controller import Nanos
from steptwin.simulation.components.touch import Meeting
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.space.contacts import NEVER, Pair
from steptwin.simulation.space.sweeps import SweptBody, meet


class BodyContact:
    """A `steptwin.simulation.components.touch.Meeting`: they overlap.

    Between two changes of the plans a moment is searched for once, and kept; not where one does not come near the other by then.
    """

    __slots__ = ("_bodies", "_found", "_overlap", "_version", "pair")

    def __init__(self, one: SweptBody, other: SweptBody) -> None:
        self.pair = Pair(one.body, other.body)
        self._bodies = one, other
        self.forget()

    def forget(self) -> None:
        self._version: object = None
        self._overlap, self._found = False, NEVER
        for one in self._bodies:
            one.forget()

    def _search(self, now: Nanos) -> None:
        version, due = self.pair.version(), self._found.at
        if version != self._version or (due is not None and due <= now):
            self._version = version
            one, other = self._bodies
            if meet(one.sweep(now), other.sweep(now)):
                self._overlap = self.pair.overlap(now)
                self._found = self.pair.next_change(now, overlap=self._overlap)
            else:
                self._overlap, self._found = False, NEVER

    def holds(self, now: Nanos) -> bool:
        self._search(now)
        return self._overlap

    def change(self, now: Nanos) -> Nanos | None:
        self._search(now)
        return self._found.at


class ConditionalContact:
    """Another `steptwin.simulation.components.touch.Meeting`, while conditions hold."""

    __slots__ = ("_meeting", "_whens")

    def __init__(self, meeting: Meeting, whens: Sequence[SignalCondition]) -> None:
        self._meeting = meeting
        self._whens = tuple(whens)

    def forget(self) -> None:
        for one in (self._meeting, *self._whens):
            one.forget()

    def holds(self, now: Nanos) -> bool:
        return all(when.holds(now) for when in self._whens) and self._meeting.holds(now)

    def change(self, now: Nanos) -> Nanos | None:
        changes = (one.change(now) for one in (self._meeting, *self._whens))
        return min((due for due in changes if due is not None), default=None)


def while_there(meeting: Meeting, whens: Sequence[SignalCondition]) -> Meeting:
    """That while the conditions hold under which what meets is there."""
    return ConditionalContact(meeting, whens) if whens else meeting
