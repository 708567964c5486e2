"""When what is asked about changed last, looked for in the past at full speed: only that is noted, and parts of the past without
an edge of it are passed over."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from typing import NamedTuple, Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.points import MemoryCells
from steptwin.simulation.kinds.programs import Programs, Resource, ResourceKind, StatementLocation
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.inputs import Bytes, Download
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot
from steptwin.simulation.world.snapshotlog import ACTED, MOVED, LoggedSnapshot, happenings
from steptwin.statements import StatementHook
from steptwin.why import points
from steptwin.why.lacking import EXECUTED, HAPPENED, Found
from steptwin.why.log import in_parts, levels_of, on_timed_lines
from steptwin.why.replayed import TimeSeries, watch_truth
from steptwin.why.states import rest_of

MOST_PARTS = 20_000
"""Limit of the parts of a past that are run again for one question: over an hour of virtual time, or 40 million statements."""


class Asked(NamedTuple):
    """A signal or condition. ``flip``: since when it is what it is at a moment, by the series of its signals; None: in all of
    them."""

    text: str
    signals: frozenset[str]
    edges: frozenset[str]
    """Those of the signals that change by edges only."""
    moving: frozenset[str]
    """Those that also change between events."""
    flip: Callable[[Mapping[str, TimeSeries], Nanos], Nanos | None]
    happenings: frozenset[str] = frozenset()
    """Those that are asked about, by their names in `steptwin.simulation.world.snapshotlog.happenings`, instead of a signal."""
    statements: tuple[str, frozenset[StatementLocation]] | None = None
    """The controller and its statements that are asked about, instead of a signal."""


def happened(text: str) -> Asked:
    """When one of some happenings was last; they are written with commas."""
    names = frozenset(text.removeprefix(HAPPENED).split(", "))
    return Asked(text, frozenset(), frozenset(), frozenset(), lambda noted, at: points.since(noted[text], at), names)


def executed(text: str) -> Asked:
    """When one of some statements was last executed."""
    controller, *locations = json.loads(text.removeprefix(EXECUTED))
    statements = controller, frozenset(StatementLocation(*one) for one in locations)
    nothing = frozenset[str]()
    return Asked(text, nothing, nothing, nothing, lambda noted, at: points.since(noted[text], at), nothing, statements)


class Snapshots(Protocol):
    """The past of a world as a search needs it; see `steptwin.simulation.world.snapshotlog.SnapshotLog`."""

    @property
    def world(self) -> Simulation: ...
    @property
    def begin(self) -> Nanos: ...
    @property
    def branch(self) -> int: ...
    def state_at(self, moment: Nanos) -> LoggedSnapshot: ...
    def inputs_from(self, number: int) -> Collection[RecordedInput]: ...


Searching: TypeAlias = Generator[None, None, Mapping[str, Found]]


class LastChanges:
    """Search in the past in ``snapshots``. ``second_world`` makes one like it, at a snapshot."""

    def __init__(self, snapshots: Snapshots, second_world: Callable[[Simulation, SimulationSnapshot], Simulation]) -> None:
        self._snapshots = snapshots
        self._make = second_world
        self._branch = snapshots.branch
        self._known: dict[str, tuple[Nanos, Found]] = {}
        """Results of searches before a moment, by question."""
        self._world: Simulation | None = None
        self._values: dict[tuple[str, Nanos], float] = {}
        """At states, while a search goes on."""
        self._written: dict[tuple[str, str, tuple[str, ...]], bool] = {}
        """Whether statements may write a point, by controller, point and the texts of its programs."""

    def before(self, asked: Collection[Asked], moment: Nanos) -> Searching:
        """The last changes before ``moment``, in parts; by text. Those searched together are run again once."""
        snapshots = self._snapshots
        if snapshots.branch != self._branch:
            self._branch = snapshots.branch
            self._known.clear()
        unknown: dict[Nanos, dict[str, Asked]] = defaultdict(dict)
        for one in asked:
            until, found = self._known.get(one.text, (snapshots.begin, Found(None, snapshots.begin)))
            if found.since is not None and not snapshots.begin <= found.since <= moment:
                until, found = snapshots.begin, Found(None, snapshots.begin)
            self._known[one.text] = until, found
            if until < moment:
                unknown[until][one.text] = one
        try:
            for until, ones in unknown.items():
                yield from self._search(ones, until, moment)
        finally:
            self._world = None
            self._values.clear()
        return {one.text: self._known[one.text][1] for one in asked}

    def _search(self, asked: dict[str, Asked], lower: Nanos, upper: Nanos) -> Generator[None, None, None]:
        """Between two moments, from the later one back."""
        snapshots, after, end = self._snapshots, self._snapshots.state_at(upper), upper
        tried, parts = 0, 0
        while asked and end > lower:
            first, changes = after, after.snapshot.now < end
            for _ in range(0 if changes else max(1, tried)):
                before_it = snapshots.state_at(first.snapshot.now - 1)
                if not changes and any(self._may_change(one, before_it, first) for one in asked.values()):
                    if first is not after:
                        break  # what is after it does not change
                    changes = True
                first = before_it
                if first.snapshot.now <= lower:
                    break
            tried += 1
            if changes:
                found: dict[str, Nanos] = {}
                for _ in self._run(asked.values(), first, end, found):
                    parts += 1
                    if parts > MOST_PARTS:
                        self._known |= {text: (upper, Found(None, end)) for text in asked}
                        return
                    yield
                self._known |= {text: (upper, Found(since, since)) for text, since in found.items()}
                asked = {text: one for text, one in asked.items() if text not in found}
            after, end = first, first.snapshot.now
        self._known |= {text: (upper, self._known[text][1]) for text in asked}

    def _may_change(self, asked: Asked, state: LoggedSnapshot, after: LoggedSnapshot) -> bool:
        """Whether something that is asked about may change between two states, one after the other."""
        if asked.statements is not None or any(name in asked.happenings for _, name in after.changed):
            return True
        if any(name in asked.edges for controller, subject in after.changed for name in (subject, f"{controller}.{subject}")):
            return True
        if any(self._may_take_another(name, state, after) for name in asked.signals - asked.edges - asked.moving):
            return True
        return bool(asked.moving) and not self._stands(asked, state, after)

    def _may_take_another(self, name: str, state: LoggedSnapshot, after: LoggedSnapshot) -> bool:
        """The same for a signal without edges, which does not move."""
        owner, _, path = name.partition(".")
        if (owner, path) in after.changed:
            return True
        present = self._snapshots.world
        point = present.kind(owner).point(present.controller(owner), path) if owner in present.controllers else None
        if point is None or point.read is None or point.turning_points is not None:
            return True
        if not point.is_kept:
            return all(one.path != path for one in present.kind(owner).datasheet(present.controller(owner)).points)
        on = present.objects.line_of.get(owner)
        if on is not None and on[0].is_timed:
            return True  # a request is executed later than it was made
        if ACTED in after.changed or self._value_at(after, name) != self._value_at(state, name):
            return True
        return self._writes(self._at(state), owner, path, point.memory)

    def _value_at(self, state: LoggedSnapshot, name: str) -> float:
        key = name, state.snapshot.now
        if key not in self._values:
            world = self._at(state)
            self._values[key] = world.signal(name).value(world.now)
        return self._values[key]

    def _writes(self, world: Simulation, owner: str, path: str, memory: MemoryCells | None) -> bool:
        """Whether a statement of a controller may write a point that is kept."""
        programs = world.programs.get(owner)
        if programs is None:
            return False
        key = owner, path, tuple(source.text for source in programs.texts.values())
        if key not in self._written:
            written = {programs.use(location).writes for location, keeps in _acting(programs) if keeps}
            self._written[key] = any(self._are_in(world, owner, path, memory, resources) for resources in written)
        return self._written[key]

    @staticmethod
    def _are_in(world: Simulation, owner: str, path: str, memory: MemoryCells | None, written: Collection[Resource]) -> bool:
        """Whether a point may have another value after a statement that keeps what it writes."""
        values = [one.name for one in written if one.kind is ResourceKind.VALUE]
        for name in filter(None, map(world.programs[owner].point, values)):
            other = world.kind(owner).point(world.controller(owner), name)
            if other is None or other.point.path == path:
                return True
            cells = None if other.memory is None else other.memory.cells
            if memory is not None and cells is not None and cells.start < memory.cells.stop and memory.cells.start < cells.stop:
                return True
        return not values

    def _stands(self, asked: Asked, state: LoggedSnapshot, after: LoggedSnapshot) -> bool:
        """Whether all that may move stands at the moment of a state, and nothing begins to move until the next one."""
        world = self._at(state)
        signals = [signal for name in asked.moving if isinstance(signal := world.signal(name), SignalOf)]
        schedulers = {source.scheduler for signal in signals for source in signal.sync(world.now)}
        moved = {controller for controller, subject in after.changed if subject == MOVED}
        if (
            len(signals) < len(asked.moving)
            or not schedulers
            or any(not moved.isdisjoint(scheduler.controllers) for scheduler in schedulers)
        ):
            return False
        return all(rest_of(signal, world.now) is not None for signal in signals)

    def _at(self, state: LoggedSnapshot) -> Simulation:
        """The second world at a state."""
        world = self._world = self._world or self._make(self._snapshots.world, state.snapshot)
        world.restore(state.snapshot)
        return world

    def _run(
        self, asked: Collection[Asked], state: LoggedSnapshot, end: Nanos, found: dict[str, Nanos]
    ) -> Generator[None, None, None]:
        """Run from a state to a moment, and add the last changes to ``found``."""
        world = self._at(state)
        inputs = list(self._snapshots.inputs_from(state.inputs))
        is_replaced = any(isinstance(one.what, Download | Bytes) for one in inputs)
        with ExitStack() as stack:
            flips: dict[str, Callable[[], Nanos | None]] = {}
            noted: list[_Noted] = []
            for one in asked:
                if one.moving:
                    series: TimeSeries = []
                    world.start("why", partial(watch_truth, world, one.text, series), is_external=True)
                    flips[one.text] = lambda series=series: series[-1][0] if len(series) > 1 else None
                else:
                    noted.append(_Noted(world, one, stack, is_replaced=is_replaced))
                    flips[one.text] = partial(one.flip, noted[-1].series, end)
            for _ in in_parts(world, inputs, end):
                yield
            for each in noted:
                each.look(end)
        found |= {text: since for text, flip in flips.items() if (since := flip()) is not None}


class _Noted:
    """The series of some signals of ``world`` from now on, until ``stack`` is closed."""

    def __init__(self, world: Simulation, asked: Asked, stack: ExitStack, *, is_replaced: bool) -> None:
        levels = levels_of(world) if asked.edges else {}
        self._subscribers: dict[str, list[_Subscriber]] = defaultdict(list)
        self.series: dict[str, TimeSeries] = {name: [(world.now, levels.get(name, 0.0))] for name in asked.edges}
        self._asked = asked
        if asked.happenings or asked.statements is not None:
            self.series[asked.text] = [(world.now, 0.0)]
        if asked.statements is not None:
            controller, statements = asked.statements
            programs = world.programs[controller]
            hook = self._hook(programs, statements)
            is_given = controller in world.objects.line_of
            programs.add_hook(hook, None if is_replaced or is_given else statements)
            stack.callback(programs.remove_hook, hook)
            if any(programs.location(number) in statements for number in programs.begun(world.now)):
                self.series[asked.text].append((world.now, 1.0))
        if asked.edges or asked.happenings:
            world.trace.subscribers.append(self._take)
            stack.callback(world.trace.subscribers.remove, self._take)
        for name in asked.signals:
            if name not in self.series:
                subscriber = _Subscriber(world, name)
                self.series[name] = subscriber.series
                subscriber.subscribe(stack, is_replaced=is_replaced)
                self._subscribers[name.partition(".")[0]].append(subscriber)
        self._timed = on_timed_lines(world)
        if self._timed and self._subscribers and not asked.edges:
            world.trace.subscribers.append(self._take)
            stack.callback(world.trace.subscribers.remove, self._take)

    def _hook(self, programs: Programs, statements: Collection[StatementLocation]) -> StatementHook:
        """Notes when they are executed, or a command that came over a line, which may do the same."""
        series = self.series[self._asked.text]

        def hook(now: Nanos, number: int) -> None:
            location = programs.location(number)
            if location in statements or (location is None and programs.given(number) is not None):
                series.append((now, len(series)))

        return hook

    def look(self, now: Nanos) -> None:
        """Note what the last statement before a moment has changed."""
        for subscribers in self._subscribers.values():
            for one in subscribers:
                one.look(now)

    def _take(self, record: TraceRecord) -> None:
        if self._asked.happenings and not self._asked.happenings.isdisjoint(happenings(record)):
            series = self.series[self._asked.text]
            points.note_value(series, record.time, len(series))
        if record.kind == "edge":
            series = self.series.get(record.subject) or self.series.get(f"{record.controller}.{record.subject}")
            if series is not None:
                points.note_value(series, record.time, record.level())
        elif record.kind == "frame":
            for owner in self._timed.get(record.controller, ()):
                for subscriber in self._subscribers.get(owner, ()):
                    subscriber.executes(record.time, keeps=True)


class _Subscriber:
    """Notes the series of a signal that has no edges. As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, world: Simulation, name: str) -> None:
        signal = world.signal(name)
        self._world, self._read = world, signal.value
        self._sources = signal.sync(world.now)
        self._owner, _, rest = name.partition(".")
        self._value = self._read(world.now)
        self.series: TimeSeries = [(world.now, self._value)]
        controller = world.controllers.get(self._owner)
        point = None if controller is None else world.kind(self._owner).point(controller, rest)
        self._is_kept = point is not None and point.is_kept
        self._keeping: Nanos | None = None
        """Time of the last statement that may have changed the signal; it was not read after that."""

    def subscribe(self, stack: ExitStack, *, is_replaced: bool) -> None:
        """``is_replaced``: whether programs may get other statements meanwhile."""
        for scheduler, name in self._sources:
            scheduler.subscribe(self, (name,))
            stack.callback(scheduler.unsubscribe, self)
            scheduler.hears_requests |= self._is_kept
        programs = self._world.programs.get(self._owner)
        if self._is_kept and programs is not None:
            keeping = {} if is_replaced else dict(_acting(programs))
            hook = self._hook(programs, keeping)
            programs.add_hook(hook, None if is_replaced else frozenset(keeping))
            stack.callback(programs.remove_hook, hook)

    def _hook(self, programs: Programs, keeping: Mapping[StatementLocation, bool]) -> StatementHook:
        """``keeping``: whether a statement keeps something, as far as that is known."""

        def hook(now: Nanos, number: int) -> None:
            location = programs.location(number)
            self.executes(
                now, keeps=location is None or (keeping[location] if location in keeping else programs.use(location).keeps)
            )

        return hook

    def executes(self, now: Nanos, *, keeps: bool) -> None:
        """A statement or request is executed next, which may change the signal without an event if it ``keeps``."""
        if self._keeping is not None:
            self._compare(self._keeping)
        self._keeping = now if keeps else None

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        self._compare(now if self._keeping is None else self._keeping)
        self._keeping = None

    def _compare(self, now: Nanos) -> None:
        value = self._read(now)
        if value != self._value:
            self._value = value
            points.note_value(self.series, now, value)


def _acting(programs: Programs) -> Iterator[tuple[StatementLocation, bool]]:
    """The statements that may change more than variables, and whether they keep something."""
    for text in programs.texts:
        for number in range(len(programs.statements(text))):
            location = StatementLocation(text, number)
            use = programs.use(location)
            if use.keeps or use.waits or any(one.kind is not ResourceKind.VALUE for one in use.writes):
                yield location, use.keeps
