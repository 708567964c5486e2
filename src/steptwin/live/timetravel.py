"""Time travel in a live world: its past is recorded from the start, and viewers visit moments of it while the world goes on."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any, TypeVar

from steptwin.controller import Nanos
from steptwin.errors import Refusal, SteptwinError
from steptwin.later import Later
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import LiveWorld
from steptwin.messages import Message
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.simulation.world.snapshotlog import PastWorld, SnapshotLog
from steptwin.simulation.world.worldprograms import WorldPrograms
from steptwin.subject.subscriptions import EventBatch, Filter
from steptwin.subject.world import WorldSubject

STATE_S = 1.0
"""A state is kept so often, in real time: what is replayed from it then took no longer when it happened."""
PART_S = 0.01
"""While a moment is computed, clients of the world wait at most so long, and are served as long. [real time]"""
MOST_VIEWS = 8
"""Worlds besides the one that goes on."""
T = TypeVar("T")
TOO_MANY_PAST_VIEWS = Message("live.too-many-past-views", "too many views of the past: at most {most} viewers")


class WorldTimeTravel:
    """Past of ``live``, from now on, or with ``snapshots`` from its beginning. A `Link` of its server."""

    def __init__(self, live: LiveWorld, realtime: RealTimeDriver, pace: Pace, snapshots: SnapshotLog | None = None) -> None:
        self._live = live
        self._realtime = realtime
        self._pace = pace
        self._views = 0
        self._snapshots = live.snapshots = snapshots or SnapshotLog(live.world)
        self._timer = asyncio.get_running_loop().call_later(STATE_S, self._keep)

    def _keep(self) -> None:
        self._realtime.enter()
        self._snapshots.take()
        self._live.is_dirty = True
        self._realtime.leave()
        self._timer = asyncio.get_running_loop().call_later(STATE_S, self._keep)

    async def close(self) -> None:
        self.end()

    def end(self) -> None:
        """Keep the past no longer."""
        self._timer.cancel()
        self._live.snapshots = None
        self._snapshots.close()

    @property
    def begin(self) -> Nanos:
        """The oldest moment that can be visited."""
        return self._snapshots.begin

    def events(
        self, begin: Nanos, end: Nanos, what: Filter, bound: int, at_begin: Callable[[WorldSubject], T]
    ) -> Later[tuple[T, EventBatch]]:
        """The last ``bound`` events between two moments, and what ``at_begin`` finds at the first one.

        Raises `Refusal` where there are too many viewers of the past, `Misuse` for moments that are not kept.
        """
        view = self.open()
        later = view.events(begin, end, what, bound, at_begin)
        later.then(view.close)
        return later

    def state_at(self, moment: Nanos) -> Later[SimulationSnapshot]:
        """The state of a moment, without inputs before it. Raises as `events`."""
        view = self.open()
        later = view.state_at(moment)
        later.then(view.close)
        return later

    def open(self) -> WorldPastView:
        """For another viewer of the past. Raises `Refusal` where there are too many."""
        if self._views >= MOST_VIEWS:
            raise Refusal(TOO_MANY_PAST_VIEWS(most=MOST_VIEWS))
        self._views += 1
        return WorldPastView(PastWorld(self._snapshots), partial(take_back, self._live, self._pace), self._closed)

    def _closed(self) -> None:
        self._views -= 1


def take_back(live: LiveWorld, pace: Pace, snapshot: SimulationSnapshot) -> None:
    """A world goes back to a state of its past; time stands there. Raises `Refusal`."""
    inputs = tuple(given for given in live.world.inputs if given.time <= snapshot.now)
    pace.go_back(replace(snapshot, inputs=inputs))


ANOTHER_MOMENT_IS_WANTED = Message("live.another-moment-is-wanted", "another moment was requested meanwhile")
VIEW_OF_THE_PAST_WAS_CLOSED = Message("live.view-of-the-past-was-closed", "the view of the past was closed")


class WorldPastView:
    """A view of the past: one moment, as `subject` and `programs` show it."""

    def __init__(self, past: PastWorld, go_back: Callable[[SimulationSnapshot], None], closed: Callable[[], None]) -> None:
        self._past = past
        self._go_back = go_back
        self._closed = closed
        self._parts: Iterator[None] = iter(())
        self._going: Later[Any] | None = None
        self.subject = WorldSubject(self._past.world)
        self.programs = WorldPrograms(self._past.world)

    @property
    def now(self) -> Nanos:
        return self._past.world.now

    def go(self, moment: Nanos) -> Later[None]:
        """To another moment, instead of one to which it goes still. Raises `Misuse` for one that is not kept."""
        return self._begin(self._past.go(moment))

    def events(
        self, begin: Nanos, end: Nanos, what: Filter, bound: int, at_begin: Callable[[WorldSubject], T]
    ) -> Later[tuple[T, EventBatch]]:
        """To ``end``; see `WorldTimeTravel.events`."""
        return self._begin(self._subscribe(begin, end, what, bound, at_begin))

    def state_at(self, moment: Nanos) -> Later[SimulationSnapshot]:
        """See `WorldTimeTravel.state_at`."""
        return self._begin(self._state_at(moment))

    def _state_at(self, moment: Nanos) -> Generator[None, None, SimulationSnapshot]:
        yield from self._past.go(moment)
        return self._past.world.snapshot()

    def _subscribe(
        self, begin: Nanos, end: Nanos, what: Filter, bound: int, at_begin: Callable[[WorldSubject], T]
    ) -> Generator[None, None, tuple[T, EventBatch]]:
        yield from self._past.go(begin)
        found = at_begin(self.subject)
        subscription = self.subject.subscribe(what, bound)
        try:
            yield from self._past.go_on(end)
        finally:
            subscription.close()
        return found, subscription.take()

    def _begin(self, parts: Iterator[None]) -> Later[Any]:
        if self._going is not None:
            self._going.fail(Refusal(ANOTHER_MOMENT_IS_WANTED()))
        self._going = later = Later[Any]()
        self._parts = parts
        self._part(later)
        return later

    def _part(self, later: Later[Any]) -> None:
        if later.is_done:
            return
        until = perf_counter() + PART_S
        try:
            next(self._parts)
            while perf_counter() < until:
                next(self._parts)
        except StopIteration as end:
            later.put(end.value)
        except SteptwinError as error:
            later.fail(error)
        else:
            asyncio.get_running_loop().call_later(PART_S, self._part, later)

    def go_back(self) -> None:
        """The world itself goes back to this moment; time stands there. Raises `Refusal`."""
        self._go_back(self._past.world.snapshot())

    def close(self) -> None:
        """Leave the past."""
        if self._going is not None:
            self._going.fail(Refusal(VIEW_OF_THE_PAST_WAS_CLOSED()))
        self._closed()
