"""States of a world on the way through its past, from which parts of that are run again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from steptwin.machine import SECOND, Nanos
from steptwin.world.history import PastState
from steptwin.world.plant import Plant

MOST_KEPT = 64
FIRST_DISTANCE_NS: Nanos = SECOND // 2
"""Of states in time; twice as much whenever there would be too many."""


class Interval(NamedTuple):
    """From a state to the moment of the next one, or to the present."""

    state: PastState
    end: Nanos


class StatesOnTheWay:
    """Of ``world``, the first one where it is now."""

    def __init__(self, world: Plant) -> None:
        self._world = world
        self._distance: Nanos = FIRST_DISTANCE_NS
        self._states: list[PastState] = []
        self.pass_by(0)

    def pass_by(self, inputs: int) -> None:
        """Keep the present state, unless the last one is near. ``inputs``: how many have been applied."""
        if self._states and self._world.now < self._states[-1].snapshot.now + self._distance:
            return
        self._states.append(PastState(self._world.snapshot(with_inputs=False), inputs))
        if len(self._states) > MOST_KEPT:
            del self._states[1::2]
            self._distance *= 2

    def until(self, moment: Nanos) -> Iterator[PastState]:
        """The states by a moment, the last one first."""
        return (state for state in reversed(self._states) if state.snapshot.now <= moment)

    def intervals(self, moment: Nanos, present: Nanos) -> Iterator[Interval]:
        """From the one with a moment back to the first one."""
        end = next((state.snapshot.now for state in self._states if state.snapshot.now > moment), present)
        for state in self.until(moment):
            yield Interval(state, end)
            end = state.snapshot.now
