"""Contacts of a body of a sensor or a tool with bodies of the machine, and with workpieces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.simulation.components.bodycontact import BodyContact
from steptwin.simulation.components.touch import Meeting
from steptwin.simulation.components.workpieces import Workpieces
from steptwin.simulation.space.bodies import Body
from steptwin.simulation.space.frames import Frame
from steptwin.simulation.space.sweeps import SweptBody, sweep


def whole(body: Body) -> Body | None:
    """All of a workpiece."""
    return body


def unless_on(frames: Collection[Frame], body: Body) -> Body | None:
    """A workpiece that none of these frames carries."""
    return None if any(map(body.is_on, frames)) else body


_Contacts: TypeAlias = dict[str, tuple[Body, BodyContact | None]]
"""With workpieces by name: the body it is with, None where there is nothing to meet."""


class Probe:
    """A `steptwin.simulation.components.touch.Meeting` of one body with parts of the machine, or with workpieces.

    What it has found holds while no workpiece comes or goes and no plan changes, up to the moment that it has found. A workpiece
    that does not come near before its plan changes is not searched for; nor one that comes later than what was found.
    """

    __slots__ = (
        "_contacts",
        "_due",
        "_inner",
        "_lasting",
        "_met",
        "_state",
        "_swept",
        "_workpieces",
        "body",
    )

    def __init__(
        self,
        body: Body,
        lasting: Mapping[str, Meeting],
        workpieces: Workpieces | None = None,
        inner: Callable[[Body], Body | None] = whole,
    ) -> None:
        """``lasting``: with parts of the machine. ``inner``: what it has to meet of a workpiece."""
        self.body = body
        self._swept = SweptBody(body)
        self._lasting = lasting
        self._workpieces = workpieces
        self._inner = inner
        self.forget()

    def forget(self) -> None:
        self._contacts: _Contacts = {}
        self._state: object = None
        self._met: tuple[str, ...] = ()
        self._due: Nanos | None = None
        self._swept.forget()
        for contact in self._lasting.values():
            contact.forget()
        if self._workpieces is not None:
            self._workpieces.forget()

    def _search(self, workpieces: Workpieces, now: Nanos) -> None:
        """Find which workpieces it meets, and when that changes, unless it is known."""
        state = workpieces.follow(now), [version() for version in self._swept.versions]
        if state == self._state and (self._due is None or self._due > now):
            return
        self._state = state
        bodies, known, self._contacts = workpieces.bodies(), self._contacts, {}
        self._due = None
        soon, until = workpieces.near_soon(self._swept.sweep(now), now)
        self._met = tuple(self._look(soon, known, workpieces, now))
        if until is None:
            return
        if self._due is None or self._due > until:
            later = workpieces.near(sweep(self.body, now, since=until))
            self._look(set(later).difference(soon), known, workpieces, now)
        kept = {name: one for name, one in known.items() if bodies.get(name) is one[0]}
        self._contacts = {**kept, **self._contacts}

    def _look(self, names: Iterable[str], known: _Contacts, workpieces: Workpieces, now: Nanos) -> list[str]:
        """Those of some workpieces that it meets; find when that changes."""
        bodies, met = workpieces.bodies(), list[str]()
        for name in names:
            body = bodies[name]
            its, contact = known.get(name, (None, None))
            if its is not body:
                inner, swept = self._inner(body), workpieces.swept(name)
                contact = None if inner is None else BodyContact(self._swept, swept if inner is body else SweptBody(inner))
            self._contacts[name] = body, contact
            if contact is None:
                continue
            if contact.holds(now):
                met.append(name)
            due = contact.change(now)
            if due is not None and (self._due is None or due < self._due):
                self._due = due
        return met

    def met(self, now: Nanos) -> tuple[str, ...]:
        """The names of what it overlaps: parts of the machine, then workpieces, each in their order."""
        there = tuple(name for name, contact in self._lasting.items() if contact.holds(now))
        if self._workpieces is None:
            return there
        self._search(self._workpieces, now)
        return there + self._met

    def holds(self, now: Nanos) -> bool:
        return bool(self.met(now))

    def change(self, now: Nanos) -> Nanos | None:
        changes = [contact.change(now) for contact in self._lasting.values()]
        if self._workpieces is not None:
            self._search(self._workpieces, now)
            changes.append(self._due)
        return min((due for due in changes if due is not None), default=None)
