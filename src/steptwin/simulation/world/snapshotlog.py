"""The past of a running world: snapshots at intervals and the external inputs since, from which the world at any moment since the
oldest snapshot is computed again.

Memory is bounded (`SnapshotsByAge`). With the oldest snapshot, the inputs before the next one are removed.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.durations import duration_text
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.eventpoints import EventPoints, points_of, stays_between_events
from steptwin.simulation.world.inputs import ExternalInput, size_of
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot

MOST_SNAPSHOTS = 256
MOST_CONTROLLER_STATES = 4096
"""Limit of the states of controllers in all snapshots: a world of more than 16 controllers keeps fewer snapshots."""
LEAST_SNAPSHOTS = 16
MOST_NEAR = 128
MOST_INPUTS = 100_000
MOST_INPUT_BYTES = 16 << 20
SLICE_NS: Nanos = SECOND // 4
"""Interval of virtual time after which a replay can be interrupted, ns."""


def replay(world: Simulation, inputs: Iterable[RecordedInput], end: Nanos, slice_ns: Nanos | None = None) -> Iterator[bool]:
    """Advance a world to ``end``, ns, and apply the inputs until then; stops of scripts do not end it.

    Yields after each input (True) and after each slice of time (False), so that the caller can interrupt it. Raises `Misuse` for
    an input that does not fit the world.
    """
    for time, what, settled in inputs:
        if time > end:
            break
        for _ in _run_to(world, time, slice_ns):
            yield False
        if settled:
            world.advance(time)
        world.apply_input(what)
        yield True
    for _ in _run_to(world, end, slice_ns):
        yield False
    world.advance(world.now)
    world.sync_all()


def _run_to(world: Simulation, moment: Nanos, slice_ns: Nanos | None) -> Iterator[None]:
    while world.now < moment:
        world.go_on()
        world.advance(moment if slice_ns is None else min(moment, world.now + slice_ns))
        if slice_ns is not None:
            world.sync_all()
        yield


def outside_past(moment: Nanos, begin: Nanos, end: Nanos) -> str:
    """The message about a moment of which nothing is known, ns."""
    return f"{duration_text(moment)}: the past is kept from {duration_text(begin)} to {duration_text(end)}"


MOVED = ""
"""Instead of a subject: an axis got another plan or position, or a fault began or ended."""
_MOTIONS = frozenset({"plan", "load", "free", "coordinate", "fault", "input"})

Changed: TypeAlias = tuple[str, str]
"""Controller and subject of the records of what has edges, controller and path of a point, or controller and `MOVED`."""

ACTED: Changed = ("", "")
"""A script acted, or something came from outside."""


def happenings(record: TraceRecord) -> Iterator[str]:
    """Names of what happened by a record: the subject of an event, its axis, and what happened to a workpiece; a fault; another
    coordinate of an axis."""
    if record.kind == "fault":
        yield f"fault {record.subject}"
    elif record.kind == "coordinate":
        yield f"coordinate of axis {record.subject}"
    elif record.kind == "event":
        facts = dict(record.facts)
        yield f"event {facts.get('what', record.subject)}"
        yield f"event of axis {facts.get('axis')}"


class LoggedSnapshot(NamedTuple):
    snapshot: SimulationSnapshot
    inputs: int
    """Number of inputs before it."""
    changed: frozenset[Changed] = frozenset()
    """Things that have changed since the state before, or may have."""


class SnapshotsByAge:
    """States of a world in the order of their moments, at most ``most`` (3 or more).

    If there are too many, those whose neighbours are close for their age are removed first, so that the distance between two
    states grows with their age; never the oldest or the newest.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._states: list[LoggedSnapshot] = []

    def __len__(self) -> int:
        return len(self._states)

    @property
    def oldest(self) -> LoggedSnapshot | None:
        return self._states[0] if self._states else None

    @property
    def newest(self) -> LoggedSnapshot | None:
        return self._states[-1] if self._states else None

    def add(self, state: LoggedSnapshot) -> LoggedSnapshot | None:
        """Add a state, unless there is one of its moment; the state that was removed for it."""
        index = self._count_until(state.snapshot.now)
        if index and self._states[index - 1].snapshot.now == state.snapshot.now:
            return None
        self._states.insert(index, state)
        if len(self._states) <= self._most:
            return None
        times = [state.snapshot.now for state in self._states]
        now = times[-1]
        index = min(range(1, len(times) - 1), key=lambda i: (times[i + 1] - times[i - 1]) / (now - times[i]))
        removed = self._states.pop(index)
        after = self._states[index]
        self._states[index] = after._replace(changed=after.changed | removed.changed)
        return removed

    def at(self, moment: Nanos) -> LoggedSnapshot | None:
        """The newest state at or before a moment, ns."""
        index = self._count_until(moment)
        return self._states[index - 1] if index else None

    def after(self, moment: Nanos) -> LoggedSnapshot | None:
        """The oldest state after a moment, ns."""
        index = self._count_until(moment)
        return self._states[index] if index < len(self._states) else None

    def back_from(self, moment: Nanos) -> Iterator[LoggedSnapshot]:
        """The states at or before a moment (ns), the newest first."""
        return reversed(self._states[: self._count_until(moment)])

    def _count_until(self, moment: Nanos) -> int:
        return bisect_right(self._states, moment, key=lambda state: state.snapshot.now)

    def remove_oldest(self) -> None:
        del self._states[:1]

    def remove_from(self, moment: Nanos) -> frozenset[Changed]:
        """Remove the states of a moment (ns) and later; what had changed by them."""
        changed: frozenset[Changed] = frozenset()
        while self._states and self._states[-1].snapshot.now >= moment:
            changed |= self._states.pop().changed
        return changed

    def clear(self) -> None:
        self._states.clear()


class ChangedSince:
    """Notes what changes in ``world``, from one state to the next."""

    def __init__(self, world: Simulation) -> None:
        self._world = world
        self._names: set[Changed] = set()
        world.trace.subscribers.append(self._take)
        world.act_subscribers.append(self._act)
        self._points = [_ChangedPoints(world, owner, self._names.add) for owner in world.controllers]

    def close(self) -> None:
        self._world.trace.subscribers.remove(self._take)
        self._world.act_subscribers.remove(self._act)
        for points in self._points:
            points.close()

    def _take(self, record: TraceRecord) -> None:
        if record.kind == "edge":
            self._names.add((record.controller, record.subject))
        elif record.kind in _MOTIONS:
            self._names.add((record.controller, MOVED))
        self._names.update((record.controller, name) for name in happenings(record))

    def _act(self, script: str, what: ExternalInput) -> None:
        self._names.add(ACTED)

    def gone_back(self, names: Iterable[Changed]) -> None:
        """The world has another state; ``names``: what had changed since the last one that is kept."""
        self._names.update(names)
        for points in self._points:
            points.read()

    @property
    def names(self) -> frozenset[Changed]:
        """Those since the last `take`."""
        return frozenset(self._names)

    def take(self) -> frozenset[Changed]:
        """The names since the last call."""
        names = self.names
        self._names.clear()
        return names


class _ChangedPoints:
    """Those of one controller that have the same value between events, and are not only kept (`LivePoint.is_kept`). As
    `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, world: Simulation, owner: str, note: Callable[[Changed], None]) -> None:
        self._world, self._owner, self._note = world, owner, note
        found = {path: point for path, point in points_of(world, owner) if point is not None and not point.is_kept}
        self._points = EventPoints(world, owner, {path: point for path, point in found.items() if stays_between_events(point)})
        world.objects.scheduler_of[owner].subscribe(self, (owner,))

    def close(self) -> None:
        self._world.objects.scheduler_of[self._owner].unsubscribe(self)

    def read(self) -> None:
        """The present values, whatever they were before."""
        self._points.read(self._world.now)

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        for path in self._points.changed(now):
            self._note((self._owner, path))


PAST_IS_KEPT_FROM = Message("simulation.past-is-kept-from", "the past is kept from {begin} to {now}")


class SnapshotLog:
    """Snapshots of ``world`` and its inputs, from the present on. Inputs are recorded automatically, snapshots by `take`.

    Each snapshot has all records of a trace that is kept: for a long run, drop them before (`Trace.let_go`).
    """

    def __init__(self, world: Simulation) -> None:
        self.world = world
        self.branch = 0
        """Counts how often the world has gone back; each time, the past after that moment is replaced."""
        most = max(LEAST_SNAPSHOTS, min(MOST_SNAPSHOTS, MOST_CONTROLLER_STATES // max(1, len(world.controllers))))
        self._states = SnapshotsByAge(most)
        self._inputs: deque[RecordedInput] = deque()
        self._bytes = 0
        self._dropped = 0
        """Number of inputs that were removed."""
        self._changed = ChangedSince(world)
        world.input_subscribers.append(self._input_came)
        self.take()

    def close(self) -> None:
        """End the recording."""
        self.world.input_subscribers.remove(self._input_came)
        self._changed.close()

    def __len__(self) -> int:
        """The number of snapshots."""
        return len(self._states)

    @property
    def kept_inputs(self) -> int:
        """The number of inputs, at most `MOST_INPUTS`."""
        return len(self._inputs)

    @property
    def begin(self) -> Nanos:
        """The oldest moment that can be restored, ns; the present if there is no snapshot."""
        oldest = self._states.oldest
        return self.world.now if oldest is None else oldest.snapshot.now

    def take(self) -> None:
        """Take a snapshot, unless there is one of this moment."""
        newest = self._states.newest
        if newest is None or newest.snapshot.now != self.world.now:
            self._states.add(LoggedSnapshot(self.world.snapshot(with_inputs=False), self.inputs_so_far, self._changed.take()))

    def _input_came(self, given: RecordedInput) -> None:
        self._inputs.append(given)
        self._bytes += size_of(given.what)
        while len(self._inputs) > MOST_INPUTS or self._bytes > MOST_INPUT_BYTES:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        self._states.remove_oldest()
        oldest = self._states.oldest
        until = self.inputs_so_far if oldest is None else oldest.inputs
        while self._dropped < until:
            self._bytes -= size_of(self._inputs.popleft().what)
            self._dropped += 1

    def gone_back(self) -> None:
        """Must be called after the world has gone back: snapshots and inputs of its present moment and later are removed."""
        now = self.world.now
        self._changed.gone_back(self._states.remove_from(now))
        while self._inputs and self._inputs[-1].time >= now:
            self._bytes -= size_of(self._inputs.pop().what)
        self.branch += 1
        self.take()

    def state_at(self, moment: Nanos) -> LoggedSnapshot:
        """The newest snapshot at or before a moment, and the number of inputs before it. Raises `Misuse` if there is none."""
        state = self._states.at(moment)
        if state is None:
            raise Misuse(outside_past(moment, self.begin, self.world.now))
        return state

    @property
    def inputs_so_far(self) -> int:
        """How many there have been."""
        return self._dropped + len(self._inputs)

    def keeps_inputs_from(self, number: int) -> bool:
        """Whether the inputs after the first ``number`` are still kept."""
        return number >= self._dropped

    def inputs_from(self, number: int) -> list[RecordedInput]:
        """The inputs after the first ``number``. Raises `Misuse` if they are no longer kept."""
        if not self.keeps_inputs_from(number):
            raise Misuse(PAST_IS_KEPT_FROM(begin=duration_text(self.begin), now=duration_text(self.world.now)))
        newest = list(islice(reversed(self._inputs), self.inputs_so_far - number))
        newest.reverse()
        return newest


class PastWorld:
    """A second world without ports, which shows a moment of the past of the first. It takes as much memory as the first."""

    def __init__(self, snapshots: SnapshotLog) -> None:
        self._snapshots = snapshots
        world = snapshots.world
        self.world = Simulation(world.blueprint, keep_trace=world.trace.is_kept, keep_inputs=False)
        if not world.trace.is_recorded:
            self.world.stop_recording()
        self._branch: int | None = None
        """Number of the branch of the snapshot log, when it was brought there."""
        self._inputs = 0
        """Number of inputs applied to it."""
        self._near = SnapshotsByAge(MOST_NEAR)
        """States on the way to the last moment, because those of the log may be far apart."""

    def forget(self) -> None:
        """Let the next `go` begin with a snapshot, because the world was used for something else."""
        self._branch = None

    @property
    def is_in_step(self) -> bool:
        """Whether it is at the present moment and has been brought there; inputs of this moment may be missing still."""
        snapshots = self._snapshots
        return self._branch == snapshots.branch and self.world.now == snapshots.world.now

    @property
    def lacks_inputs(self) -> bool:
        """Whether inputs have come since."""
        return self._inputs != self._snapshots.inputs_so_far

    @property
    def can_go_on(self) -> bool:
        """Whether the inputs since are still kept."""
        return self._snapshots.keeps_inputs_from(self._inputs)

    def go(self, moment: Nanos) -> Iterator[None]:
        """Go to a moment, in parts: it yields after each.

        Raises `Misuse` for a moment before the oldest snapshot or after the present.
        """
        snapshots = self._snapshots
        if moment > snapshots.world.now:
            raise Misuse(outside_past(moment, snapshots.begin, snapshots.world.now))
        state = near = self._nearest(moment) if self._branch == snapshots.branch else None
        if state is None:
            state = snapshots.state_at(moment)
        if not self.can_go_on or self._branch != snapshots.branch or not state.snapshot.now <= self.world.now <= moment:
            if near is None:
                self._near.clear()
            self.world.restore(state.snapshot)
            self._branch, self._inputs = snapshots.branch, state.inputs
        kept = state.snapshot.now
        for _ in self.go_on(moment):
            if kept + SLICE_NS <= self.world.now < moment:
                kept = self.world.now
                self._near.add(LoggedSnapshot(self.world.snapshot(), self._inputs))
            yield

    def go_on(self, moment: Nanos) -> Iterator[None]:
        """Go on from its present moment to a later one, without using snapshots."""
        for is_input in replay(self.world, self._snapshots.inputs_from(self._inputs), moment, SLICE_NS):
            self._inputs += is_input
            yield

    def _nearest(self, moment: Nanos) -> LoggedSnapshot | None:
        """The newest state on the way at or before a moment; None where the log has a newer one or its inputs are gone."""
        kept, near = self._snapshots.state_at(moment), self._near.at(moment)
        if near is None or near.snapshot.now <= kept.snapshot.now or not self._snapshots.keeps_inputs_from(near.inputs):
            return None
        return near
