"""The state of a twin, held by what its events say: each names what has changed, and only that is read again.

An edge brings the level of its pin; another event names an axis, or the controller. What changes without events, an axis that
moves, or whose encoder others turn, a program that runs, is read whenever a sample is taken. Which further parts may change with
a pin or an axis is in the data sheet (`steptwin.datasheet.Datasheet.also_change`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import PARTS
from steptwin.gateways.points import State
from steptwin.subject.contract import ControllerDescription
from steptwin.subject.events import Event
from steptwin.subject.payloads import (
    ButtonPayload,
    CoordinatePayload,
    EdgePayload,
    FreePayload,
    LoadPayload,
    NotePayload,
    PacePayload,
    PlanPayload,
    ReportPayload,
    StatusPayload,
    WritePayload,
)

BUSY = ("running", "waiting")
"""Programs in these states change what they show without an event."""
EFFECT_NS: Nanos = SECOND
"""Longest time from what is sent without an answer to its effect, or between two effects: characters take their time."""
_OF_PROGRAM = ("program", "status", "details")
_SILENT = (NotePayload, PacePayload, ReportPayload, ButtonPayload)
"""These change nothing of a controller by themselves."""


class HeldState:
    """The state of the twin ``part``; ``state`` is None before the first one has been read."""

    __slots__ = ("_active", "_also", "_axes", "_levels", "_moved", "_others", "_stale", "_unsettled", "state")

    def __init__(self, part: ControllerDescription) -> None:
        axes = part.datasheet.axes
        names = [axis.name for axis in axes]
        self._axes = {str(axis.number): axis.name for axis in axes}
        also = part.datasheet.also_change
        has_edges = also is not None and not any("pins" in of for of in also.values())
        self._others = (*(name for name in PARTS if name != "pins" or not has_edges), *names)
        """All parts, without pins where each has edges."""
        everything = (*PARTS, *names)
        pins = [pin.name for pin in part.datasheet.pins]
        self._also: Mapping[str, tuple[str, ...]] = (
            dict.fromkeys((*pins, *names), everything) if also is None else {name: also.get(name, ()) for name in (*pins, *names)}
        )
        self.state: State | None = None
        self._levels: dict[str, float] = {}
        """New ones of pins."""
        self._stale: set[str] = set()
        """Parts that have to be read again."""
        self._moved = tuple(names) if part.is_moved else ()
        """Axes whose encoders may turn without an event of this controller."""
        self._active: tuple[str, ...] = self._moved
        """Parts that change without events."""
        self._unsettled: Nanos = 0
        """Until when what was sent to it may have effects."""

    # ------------------------------------------------------------------ what events say

    def take(self, event: Event) -> bool:
        """Whether it may have changed something."""
        match event.payload:
            case EdgePayload(pin, level):
                if pin not in self._also:
                    return False
                self._levels[pin] = level
                self._stale.update(self._also[pin])
            case PlanPayload(axis) | CoordinatePayload(axis) | LoadPayload(axis) | FreePayload(axis):
                self._take_axis(axis)
            case StatusPayload() as payload if payload.axis is not None:
                self._take_axis(payload.axis)
                self._stale.update(_OF_PROGRAM)
            case payload if isinstance(payload, _SILENT):
                return False
            case WritePayload(outcome=""):
                self._unsettled = event.time + EFFECT_NS
                self._stale.update(self._others)
            case _:
                self._stale.update(self._others)
        return True

    def _take_axis(self, axis: str) -> None:
        name = self._axes.get(axis)
        if name is None:
            self._stale.update(self._others)
        else:
            self._stale.add(name)
            self._stale.update(self._also[name])

    # ------------------------------------------------------------------ what is read

    @property
    def is_active(self) -> bool:
        """Whether it changes without events."""
        return bool(self._active)

    def wanted(self, *, is_due: bool) -> tuple[str, ...]:
        """Parts that have to be read again; ``is_due``: also those that change without events."""
        return tuple({*self._stale, *self._active} if is_due else self._stale)

    @property
    def has_news(self) -> bool:
        return bool(self._levels or self._stale)

    def put_all(self, state: State, now: Nanos) -> State:
        """All of it has been read."""
        self.state = state if self.state is None else merged(self.state, state)
        self._levels.clear()
        self._unsettled = min(self._unsettled, now + EFFECT_NS)  # time may have gone back
        self._settle(now)
        return self.state

    def put(self, parts: Mapping[str, Any], now: Nanos | None) -> State:
        """Take the parts that were ``wanted`` and read at ``now``; None: no part was read. What has not changed is the same
        object as before."""
        if self.state is None:
            raise AssertionError
        before = self.state
        found = {name: part for name, part in parts.items() if name != "axes" and part != before[name]}
        if parts.get("axes"):
            fresh = {axis["number"]: axis for axis in parts["axes"]}
            axes = [old if fresh.get(old["number"], old) == old else fresh[old["number"]] for old in before["axes"]]
            if any(old is not new for old, new in zip(before["axes"], axes, strict=True)):
                found["axes"] = axes
        if self._levels:
            pins = before["pins"]
            levels = {pin: level for pin, level in self._levels.items() if pins[pin] != level}
            if levels and "pins" not in parts:
                found["pins"] = {**pins, **levels}
            self._levels.clear()
        if found:
            self.state = {**before, **found}
        if now is not None:
            if found and now < self._unsettled:
                self._unsettled = now + EFFECT_NS
            self._settle(now)
        return self.state

    def _settle(self, now: Nanos) -> None:
        """Find what changes without events from now on."""
        if self.state is None:
            raise AssertionError
        self._stale.clear()
        active = set(self._moved)
        for axis in self.state["axes"]:
            if axis["moving"]:
                active.update((axis["name"], *self._also[axis["name"]]))
        if self.state["program"]["state"] in BUSY:
            active.update(_OF_PROGRAM)
        if now < self._unsettled:
            active.update(self._others)
        self._active = tuple(active)


def merged(before: State, after: State) -> State:
    """``after``, with those parts of ``before`` in which nothing has changed."""
    axes = [old if old == new else new for old, new in zip(before["axes"], after["axes"], strict=True)]
    return {**{name: before[name] if before[name] == part else part for name, part in after.items()}, "axes": axes}


def is_resting(state: State) -> bool:
    return state["program"]["state"] not in BUSY and not any(axis["moving"] for axis in state["axes"])


def parts_only(state: Mapping[str, Any], registers: Mapping[str, float | None]) -> State:
    """Changing parts of a state that has been read, and the registers that gateways name."""
    return {**{name: state[name] for name in (*PARTS, "axes")}, "registers": registers}
