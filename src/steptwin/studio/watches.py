"""Values of points for viewers: each point is read once for all of them, at the highest requested rate.

Viewers that watch the same points share a list of values. Each is sent what has changed since it was sent something last, so a
slow one loses moments, never the present.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.subject.contract import Reading

Points: TypeAlias = tuple[str, ...]


class SharedValues:
    """The present values of a list of points. ``version`` counts the readings in which something has changed."""

    __slots__ = ("_changed", "_texts", "points", "users", "values", "version")

    def __init__(self, points: Points) -> None:
        self.points = points
        self.users = 0
        self.version = 0
        self.values: list[float | None] = [None] * len(points)
        self._changed = [0] * len(points)
        self._texts: dict[int, str] = {}

    def put(self, readings: Mapping[str, float | None]) -> None:
        fresh = [readings[point] for point in self.points]
        if fresh == self.values and self.version:
            return
        self.version += 1
        self._texts.clear()
        for index, (value, before) in enumerate(zip(fresh, self.values, strict=True)):
            if value != before or self.version == 1:
                self._changed[index] = self.version
        self.values = fresh

    def since(self, version: int) -> str:
        """``[[index, value], …]`` of what has changed after ``version``, as JSON."""
        text = self._texts.get(version)
        if text is None:
            pairs = [[index, self.values[index]] for index, changed in enumerate(self._changed) if changed > version]
            text = self._texts[version] = json.dumps(pairs, separators=(",", ":"))
        return text


class Watched:
    """Watches of one viewer. Times are of the wall clock."""

    __slots__ = ("_due", "_sent", "interval_ns", "number", "values")

    def __init__(self, number: int, values: SharedValues, rate: float) -> None:
        self.number = number
        self.values = values
        self.interval_ns: Nanos = round(SECOND / rate)
        self._due: Nanos = 0
        self._sent = 0

    def is_due(self, now: Nanos) -> bool:
        return self._sent < self.values.version and now >= self._due

    def take(self, now: Nanos) -> str:
        """The values changed since the last call."""
        text = self.values.since(self._sent)
        self._sent = self.values.version
        # What is taken a little later than it was due is due again with the next tick, not with the one after it.
        self._due = max(self._due + self.interval_ns, now + self.interval_ns // 2)
        return text

    def forget(self) -> None:
        """Treat all values as changed."""
        self._sent = 0
        self._due = 0


class Watches:
    """The watches of all viewers."""

    def __init__(self) -> None:
        self._values: dict[Points, SharedValues] = {}
        self._watched: set[Watched] = set()
        self._due: Nanos = 0

    def add(self, number: int, readings: Sequence[Reading], rate: float) -> Watched:
        """Watch points from now on, whose present values are ``readings``."""
        points = tuple(reading.point for reading in readings)
        values = self._values.get(points)
        if values is None:
            values = self._values[points] = SharedValues(points)
        values.users += 1
        values.put({reading.point: reading.value for reading in readings})
        watched = Watched(number, values, rate)
        self._watched.add(watched)
        return watched

    def remove(self, watched: Watched) -> None:
        self._watched.discard(watched)
        values = watched.values
        values.users -= 1
        if not values.users:
            del self._values[values.points]

    def due(self, now: Nanos) -> Points:
        """The points that are due for reading."""
        if now < self._due or not self._watched:
            return ()
        fastest = min(watched.interval_ns for watched in self._watched)
        self._due = max(self._due + fastest, now + fastest // 2)
        return tuple(dict.fromkeys(point for points in self._values for point in points))

    def put(self, readings: Iterable[Reading]) -> None:
        """The values of the points that were due."""
        found = {reading.point: reading.value for reading in readings}
        for values in self._values.values():
            if all(point in found for point in values.points):
                values.put(found)
