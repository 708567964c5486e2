"""Values of a controller of a running twin, without polling it.

Positions and velocities are computed from its plans; other points are read again only when something has happened there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TypeAlias

from steptwin.controller import MILLISECOND, Nanos
from steptwin.datasheet import Point
from steptwin.errors import Misuse
from steptwin.live.remote import RemoteSubject
from steptwin.simulation.world.model import WORLD
from steptwin.subject import commands as command
from steptwin.subject.contract import ControllerDescription
from steptwin.subject.events import Event
from steptwin.subject.motion import Motions
from steptwin.subject.payloads import PacePayload
from steptwin.subject.subscriptions import USUAL, filter_of

BOUND = 10_000
SETTLING_NS: Nanos = 100 * MILLISECOND
"""Time after an event within which its consequences, such as through the filter of an input, have happened, ns."""
TwinValue: TypeAlias = bool | int | float | None


class TwinWatch:
    """The points ``paths`` of the controller ``controller``. ``subject`` must not be used by others meanwhile."""

    def __init__(
        self, subject: RemoteSubject, controller: str, paths: Sequence[str], wall_ns: Callable[[], Nanos] = time.monotonic_ns
    ) -> None:
        found = next((part for part in subject.description.controllers if part.name == controller), None)
        if found is None:
            raise Misuse(f"{subject.name} has no controller {controller!r}")
        self._subject = subject
        self._wall_ns = wall_ns
        self._part: ControllerDescription = found
        points = {point.path.upper(): point for point in found.datasheet.points}
        self._points = {path: points.get(path.upper()) for path in paths}
        self._computed = {path: at for path, point in self._points.items() if (at := _computed(point, found)) is not None}
        self._encoders = any(any(mark in path.upper() for mark in ("ENC_", ".ENCODER")) for path in self._points)
        self._values: dict[str, tuple[TwinValue, str]] = {}
        self._was_moving = False
        self._due: Nanos | None = None
        """The moment of the twin until which points are read every time; None: no more."""
        self._begin()

    def _begin(self) -> None:
        # What a master writes shows in the frames of the line alone.
        places = (self._part.name, WORLD, *(() if self._part.line is None else (self._part.line,)))
        what = filter_of(USUAL - {"load"} | {"frame"}, places)
        self._subscription, plans = self._subject.subscribe_from_now(what, BOUND)
        self._motions = Motions(self._part, plans)
        self._ask_time()
        self._due = self.now()

    def close(self) -> None:
        """Follow no more; ``subject`` stays open."""
        self._subscription.close()

    # ------------------------------------------------------------------ time

    def _ask_time(self) -> None:
        there = self._subject.do(command.Time()).value
        self._set_clock(int(there["time_ns"]), 0.0 if there["paused"] else there["speed"])

    def _set_clock(self, now: Nanos, speed: float | str | None) -> None:
        """Set the speed of the twin's time. If it is paused, or runs as fast as possible, the moment is read every time."""
        self._at, self._speed, self._wall = now, speed if isinstance(speed, float | int) else 0.0, self._wall_ns()

    def now(self) -> Nanos:
        """The present moment of the twin."""
        return self._at + round((self._wall_ns() - self._wall) * self._speed)

    # ------------------------------------------------------------------ values

    def look(self) -> dict[str, tuple[TwinValue, str]]:
        """Values and units, by path."""
        if not self._speed:
            self._ask_time()  # first, so that what has happened by then is among the events
        missed, events = self._subscription.take()
        if missed:
            self._subscription.close()
            self._begin()
        for event in events:
            self._take(event)
        now = self.now()
        was_moving, moving = self._was_moving, self._motions.is_moving(now)
        self._was_moving = moving
        if events or was_moving is not moving:
            self._due = now + SETTLING_NS
        if self._due is not None or (moving and self._encoders):
            if self._due is not None and now >= self._due:
                self._due = None
            self._read()
        for path, (axis, of) in self._computed.items():
            self._values[path] = of(self._motions, axis, now), self._values[path][1]
        return {path: self._values[path] for path in self._points}

    def _take(self, event: Event) -> None:
        self._motions.take(event)
        if isinstance(event.payload, PacePayload):
            self._set_clock(event.time, 0.0 if event.payload.paused else event.payload.speed)
        elif event.time > self.now():
            self._set_clock(event.time, self._speed)

    def _read(self) -> None:
        for path, reading in zip(
            self._points, self._subject.read(*(f"{self._part.name}.{path}" for path in self._points)), strict=True
        ):
            self._values[path] = _typed(self._points[path], reading.value), reading.unit


def _position(motions: Motions, axis: str, now: Nanos) -> float:
    return motions.position(axis, now)


def _velocity(motions: Motions, axis: str, now: Nanos) -> float:
    return motions.velocity(axis, now)


_COMPUTED = {"POS_ACT": _position, "POSITION": _position, "VEL_ACT": _velocity, "VELOCITY": _velocity}


def _computed(point: Point | None, part: ControllerDescription) -> tuple[str, Callable[[Motions, str, Nanos], float]] | None:
    """The axis of a point that is computed from a plan, and the function."""
    if point is None:
        return None
    path, axes = point.path.upper(), part.datasheet.axes
    if path in _COMPUTED and len(axes) == 1:
        return str(axes[0].number), _COMPUTED[path]
    for axis in axes:
        of = _COMPUTED.get(path.removeprefix(axis.name)[1:])
        if of is not None and path.startswith(axis.name):
            return str(axis.number), of
    return None


def _typed(point: Point | None, value: float | None) -> TwinValue:
    """A value as bool or int if the point is of that type."""
    if value is None or point is None or not point.addresses:
        return value
    kind = point.addresses[0].type
    return bool(value) if kind == "BIT" else int(value) if kind == "WORD" else value
