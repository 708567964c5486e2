"""States of a world that are kept while it runs, so that a question about its past need not run it again from the beginning."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshotlog import (
    MOST_SNAPSHOTS,
    Changed,
    ChangedSince,
    LoggedSnapshot,
    SnapshotsByAge,
    outside_past,
)
from steptwin.why.pastquestions import first_span

STATES_OF_A_SPAN = 10
"""So many are kept in the time that is searched first."""


class KeptStates:
    """States of ``world`` from its present moment on. ``distance``: time between two of them, ns."""

    def __init__(self, world: Simulation) -> None:
        self.world = world
        self.begin = world.now
        self.distance: Nanos = first_span(world) // STATES_OF_A_SPAN
        self._states = SnapshotsByAge(MOST_SNAPSHOTS)
        self._states.add(LoggedSnapshot(world.snapshot(with_inputs=False), 0))
        self._changed = ChangedSince(world)

    def take(self, inputs: int) -> None:
        """Keep the present one, unless there is one of this moment. ``inputs``: how many there have been."""
        newest = self._states.newest
        if newest is None or newest.snapshot.now != self.world.now:
            self._states.add(LoggedSnapshot(self.world.snapshot(with_inputs=False), inputs, self._changed.take()))

    def close(self) -> None:
        """Keep no further ones."""
        self._changed.close()

    def at(self, moment: Nanos) -> LoggedSnapshot:
        """The newest one at or before a moment. Raises `Misuse` if there is none."""
        state = self._states.at(moment)
        if state is None:
            raise Misuse(outside_past(moment, self.begin, self.world.now))
        return state

    def changed(self, after: Nanos, until: Nanos) -> frozenset[Changed]:
        """Names of all that has changed between two moments, or at most a state later."""
        found, state = set[Changed](), self._states.after(after)
        while state is not None:
            found |= state.changed
            if state.snapshot.now >= until:
                return frozenset(found)
            state = self._states.after(state.snapshot.now)
        return frozenset(found | self._changed.names)
