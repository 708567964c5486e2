"""The points of one controller that have one value between its events, read again after an event that may have changed them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.points import LivePoint
from steptwin.simulation.world.simulation import Simulation


def points_of(world: Simulation, owner: str) -> Iterator[tuple[str, LivePoint | None]]:
    """Those of a data sheet that are no pins, by path; None for a row of registers, of which one must be chosen."""
    controller, kind = world.controller(owner), world.kind(owner)
    pins = controller.pins()
    for point in kind.datasheet(controller).points:
        if point.path not in pins:
            live = None
            with suppress(Misuse):
                live = kind.point(controller, point.path)
            yield point.path, live


def stays_between_events(point: LivePoint) -> bool:
    return point.read is not None and point.turning_points is None


class EventPoints:
    """``points`` of a controller. Those whose mark (`steptwin.simulation.kinds.kind.ControllerKind.marks`) is what it was are
    not read."""

    def __init__(self, world: Simulation, owner: str, points: Mapping[str, LivePoint]) -> None:
        controller, kind = world.controller(owner), world.kind(owner)
        groups: defaultdict[int, dict[str, Callable[[Nanos], float]]] = defaultdict(dict)
        for path, point in points.items():
            if point.read is not None:
                groups[kind.mark_of(path)][path] = point.read
        self._marks_of = kind.marks
        self._controller = controller
        self._groups = dict(groups)
        self.read(world.now)

    def read(self, now: Nanos) -> Mapping[str, float]:
        """The present values, whatever they were before."""
        self._marks: tuple[object, ...] = self._marks_of(self._controller)
        self._values: dict[int, list[float]] = {
            group: [read(now) for read in reads.values()] for group, reads in self._groups.items()
        }
        return {
            path: value for group, reads in self._groups.items() for path, value in zip(reads, self._values[group], strict=True)
        }

    def changed(self, now: Nanos) -> dict[str, float]:
        """The values that are others than at the last call."""
        marks, before = self._marks_of(self._controller), self._marks
        if marks == before:
            return {}
        self._marks = marks
        found: dict[str, float] = {}
        for group, reads in self._groups.items():
            if marks[group] != before[group]:
                values, old = [read(now) for read in reads.values()], self._values[group]
                if values != old:
                    self._values[group] = values
                    found |= {path: new for path, new, last in zip(reads, values, old, strict=True) if new != last}
        return found
