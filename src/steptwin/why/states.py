"""States of a world on the way through its past, from which parts of that are run again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.points import FARTHEST_NS
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshotlog import LoggedSnapshot, SnapshotsByAge

MOST_KEPT = 64
LEAST_DISTANCE_NS: Nanos = SECOND // 2
"""Least distance of states in time; longer in a long run, of which about `MOST_KEPT` states are taken while it doubles."""


class Interval(NamedTuple):
    """From a state to the moment of the next one, or to the present."""

    state: LoggedSnapshot
    end: Nanos


class Standing(NamedTuple):
    """A moving quantity that stands. ``version``: it stands as long as this stays the same."""

    value: float
    version: object


class StatesOnTheWay:
    """States of ``world``, the first one where it is now."""

    def __init__(self, world: Simulation) -> None:
        self._world = world
        self._moving = dict(_moving(world))
        self._begin = world.now
        self._states = SnapshotsByAge(MOST_KEPT)
        self._rests: dict[Nanos, Mapping[str, Standing]] = {}
        """Signals that stand at the moments of the states."""
        self.pass_by(0)

    def pass_by(self, inputs: int) -> None:
        """Keep the present state, unless the last one is near. ``inputs``: how many have been applied."""
        now, newest = self._world.now, self._states.newest
        distance = max(LEAST_DISTANCE_NS, (now - self._begin) // MOST_KEPT)
        if newest is not None and now < newest.snapshot.now + distance:
            return
        removed = self._states.add(LoggedSnapshot(self._world.snapshot(with_inputs=False), inputs))
        if removed is not None:
            del self._rests[removed.snapshot.now]
        self._rests[now] = {name: rest for name, signal in self._moving.items() if (rest := rest_of(signal, now)) is not None}

    def rest(self, name: str, interval: Interval) -> float | None:
        """The value of a moving quantity that stands during an interval; None where it does not, or that is not known."""
        begin, end = self._rests[interval.state.snapshot.now].get(name), self._rests.get(interval.end, {}).get(name)
        if interval.end == self._world.now and name in self._moving:
            end = rest_of(self._moving[name], self._world.now)
        return begin.value if begin is not None and begin == end else None

    def until(self, moment: Nanos) -> Iterator[LoggedSnapshot]:
        """The states by a moment, the last one first."""
        return self._states.back_from(moment)

    def intervals(self, moment: Nanos, present: Nanos) -> Iterator[Interval]:
        """From the one with a moment back to the first one."""
        after = self._states.after(moment)
        end = present if after is None else after.snapshot.now
        for state in self.until(moment):
            yield Interval(state, end)
            end = state.snapshot.now


def _moving(world: Simulation) -> Iterator[tuple[str, SignalOf]]:
    """The quantities that move, and can tell when their trajectory is another one."""
    elements = (name for built in world.objects.elements.values() for name in built)
    names = [f"{name}.{signal}" for name in elements for signal in world.objects.element_signals(name) or ()]
    for owner, controller in world.controllers.items():
        kind = world.kind(owner)
        for point in kind.datasheet(controller).points:
            with suppress(Misuse):  # of a row of registers one must be chosen
                live = kind.point(controller, point.path)
                if live is not None and live.turning_points is not None and live.version is not None:
                    names.append(f"{owner}.{point.path}")
    for name in names:
        found = world.signal(name)
        if isinstance(found, SignalOf) and found.continuous and found.read is not None and found.version() is not None:
            yield name, found


def rest_of(signal: SignalOf, now: Nanos) -> Standing | None:
    """Value at which it stands; None while it moves."""
    if next(signal.turning_points(now), None) is not None:
        return None
    value = signal.value(now)
    return Standing(value, signal.version()) if signal.value(now + FARTHEST_NS) == value else None


def is_constant(signal: SignalOf, now: Nanos) -> bool:
    """Whether it keeps its value up to its next turning point, such as the velocity between two ramps."""
    end = next(signal.turning_points(now), None)
    return end is not None and all(signal.value(moment) == signal.value(now) for moment in ((now + end) // 2, end - 1))
