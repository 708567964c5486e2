"""Motion between two ends with a constant speed in each direction, such as of a pneumatic cylinder, exact in whole numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.state import Stateful


class Travel(Stateful):
    """A position from 0 to `full`, which can actuate switches (`steptwin.simulation.logic.contacts.MovingPart`).

    The full travel takes ``forth`` ns to the upper end and ``back`` ns to the lower one. Its grid has forth × back steps, so
    that both speeds are whole numbers of steps per nanosecond.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_back", "_forth", "full")
    __slots__ = (*FIXED, "_begin", "_direction", "_place")

    def __init__(self, forth: Nanos, back: Nanos, *, is_forth: bool, now: Nanos) -> None:
        self.full = forth * back
        self._forth = forth
        self._back = back
        self._place = self.full if is_forth else 0
        """At `_begin`."""
        self._begin = now
        self._direction = 0

    @property
    def direction(self) -> int:
        """The direction that was commanded last: +1, −1, or 0 (stopped)."""
        return self._direction

    @property
    def since(self) -> Nanos:
        """When that was."""
        return self._begin

    def send(self, direction: int, now: Nanos) -> None:
        """Move to the upper end (+1), to the lower one (−1), or stop (0)."""
        if direction == self._direction:
            return
        self._place = self.grid_position(now)
        self._begin = now
        self._direction = direction

    def speed(self, direction: int) -> int:
        """Steps of the grid per nanosecond."""
        return self._back if direction > 0 else self._forth

    def grid_position(self, now: Nanos) -> int:
        """As `MovingPart.grid_position`."""
        moved = self._direction * self.speed(self._direction) * (now - self._begin)
        return min(max(self._place + moved, 0), self.full)

    def version(self) -> object:
        """As `MovingPart.version`."""
        return self._begin, self._direction

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """As `MovingPart.reaches`."""
        distance = (position - self._place) * direction
        if (
            direction != self._direction
            or (position - self.grid_position(after)) * direction <= 0
            or not 0 <= position <= self.full
        ):
            return None
        return self._begin - (-distance // self.speed(direction))

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """The moments, ns, at which it has left the end where it stands and at which it arrives at the other end."""
        if self._direction == 0:
            return
        near, far = (0, self.full) if self._direction > 0 else (self.full, 0)
        if self.grid_position(now) == near:
            yield now + 1
        arrival = self.reaches(far, now, self._direction)
        if arrival is not None:
            yield arrival
