"""The states of programs, whether they are executed, noted while a world runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.kinds.programs import Programs, ProgramState
from steptwin.simulation.world.simulation import Simulation

OVER = (ProgramState.STOPPED, ProgramState.SHUT_DOWN)
"""States after which a program begins anew."""


class StateChange(NamedTuple):
    """A program is in a state from a moment on. ``order``: as that of a `steptwin.why.log.Change`; negative at the beginning."""

    time: Nanos
    state: ProgramState
    order: int


class ProgramStates:
    """Notes the states of the programs of ``world`` from now on. ``order_of``: of a change of one of them."""

    def __init__(self, world: Simulation, order_of: Callable[[str, Nanos, ProgramState], int]) -> None:
        self._readers = {name: _Reader(programs, world.now, partial(order_of, name)) for name, programs in world.programs.items()}
        for name, reader in self._readers.items():
            world.objects.scheduler_of[name].subscribe(reader, (name,))

    def last(self, controller: str, until: Nanos, before: int) -> StateChange | None:
        """The last change by a moment, before an order; None for a controller without programs."""
        changes = reversed(self._readers[controller].changes if controller in self._readers else [])
        return next((one for one in changes if (one.time, one.order) < (until, before)), None)

    def starts(self, controller: str) -> Iterator[StateChange]:
        """Changes with which a program began anew."""
        for earlier, change in pairwise(self._readers[controller].changes if controller in self._readers else []):
            if change.state is ProgramState.RUNS and earlier.state in OVER:
                yield change


class _Reader:
    """Reader of one controller. As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, programs: Programs, begin: Nanos, order_of: Callable[[Nanos, ProgramState], int]) -> None:
        self._programs = programs
        self._order_of = order_of
        self.changes = [StateChange(begin, programs.state, -1)]

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        state = self._programs.state
        if state is not self.changes[-1].state:
            self.changes.append(StateChange(now, state, self._order_of(now, state)))
