"""Values over time of what is in no trace, such as registers: found by running parts of the past again, and remembered."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from itertools import takewhile
from typing import NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.why.log import in_parts
from steptwin.why.states import Interval

MOST_REMEMBERED = 200_000
"""Values after which all are forgotten before the next question."""

TimeSeries: TypeAlias = list[tuple[Nanos, float]]
"""The values from the beginning of an interval on, each with its moment."""
SeriesWatch: TypeAlias = Callable[[Simulation, str, TimeSeries], do.Steps]
"""A script that notes the series of what has a name."""


class _KnownSeries(NamedTuple):
    end: Nanos
    series: TimeSeries


NOTHING_IS_KNOWN = Message("why.nothing-is-known", "{name}: nothing is known of it at {end:g} s")


class ReplayedSignals:
    """``make`` gives the world at its beginning, ``inputs`` are what came from outside since, more and more."""

    def __init__(self, make: Callable[[], Simulation], inputs: Sequence[RecordedInput]) -> None:
        self._make = make
        self._inputs = inputs
        self._second: Simulation | None = None
        self._known: dict[tuple[str, Nanos], _KnownSeries] = {}
        self._remembered = 0

    def begin(self) -> None:
        """A question begins."""
        self._second = None
        if self._remembered > MOST_REMEMBERED:
            self._known.clear()
            self._remembered = 0

    def prepare(self, wanted: Collection[str], watch: SeriesWatch, intervals: Sequence[Interval], at: Nanos) -> Iterator[None]:
        """Have the values in the first of ``intervals``, at least until a moment in it, in parts.

        The others are those before it, the last one first; as far as nothing is known of them, they are run again with it, so
        that one state is restored for all. Raises `Misuse` for what cannot be watched.
        """
        if self._has(wanted, intervals[0], at):
            return
        lacking = [intervals[0], *takewhile(lambda interval: not self._has(wanted, interval, at), intervals[1:])]
        state, end = lacking[-1].state, lacking[0].end
        world = self._second = self._second or self._make()
        world.restore(state.snapshot)
        found: dict[str, TimeSeries] = {name: [] for name in wanted}
        for name, series in found.items():
            world.start("why", partial(watch, world, name, series), is_external=True)
        for _ in in_parts(world, self._inputs[state.inputs :], end):
            yield
        for name, series in found.items():
            if not series:
                raise Misuse(NOTHING_IS_KNOWN(name=name, end=end / SECOND))
            for interval in lacking:
                self._known[name, interval.state.snapshot.now] = _KnownSeries(interval.end, list(_within(series, interval)))
            self._remembered += len(series) + len(lacking)

    def remember(self, name: str, interval: Interval, value: float) -> None:
        """Note that a signal has one value in a whole interval."""
        self._known.setdefault(
            (name, interval.state.snapshot.now), _KnownSeries(interval.end, [(interval.state.snapshot.now, value)])
        )

    def _has(self, wanted: Collection[str], interval: Interval, at: Nanos) -> bool:
        begin, needed = interval.state.snapshot.now, min(at, interval.end)
        return all((known := self._known.get((name, begin))) is not None and known.end >= needed for name in wanted)

    def level(self, name: str, interval: Interval, at: Nanos) -> float:
        """The value at a moment in an interval; at its beginning, if the moment is before."""
        series = self._series(name, interval)
        return series[max(0, bisect_right(series, at, key=_moment) - 1)][1]

    def changes(self, name: str, interval: Interval, until: Nanos) -> Iterator[Nanos]:
        """The moments of the changes in an interval by a moment, the last one first."""
        series = self._series(name, interval)
        return (series[index][0] for index in range(bisect_right(series, min(until, interval.end), key=_moment) - 1, 0, -1))

    def _series(self, name: str, interval: Interval) -> TimeSeries:
        return self._known[name, interval.state.snapshot.now].series


def _within(series: TimeSeries, interval: Interval) -> Iterator[tuple[Nanos, float]]:
    """The values in an interval, the first one at its beginning: what came from outside at this moment came after the state."""
    begin = interval.state.snapshot.now
    first = max(1, bisect_left(series, begin, key=_moment))
    yield begin, series[first - 1][1]
    yield from series[first : bisect_right(series, interval.end, key=_moment)]


def _moment(one: tuple[Nanos, float]) -> Nanos:
    return one[0]


def watch_truth(world: Simulation, text: str, series: TimeSeries) -> do.Steps:
    """Notes when a condition becomes true and false."""
    negated = f"not ({text})"
    is_true = world.holds(world.condition(text))
    series.append((world.now, float(is_true)))
    while True:
        yield do.Until(negated if is_true else text)
        is_true = not is_true
        series.append((world.now, float(is_true)))


def watch_value(world: Simulation, name: str, series: TimeSeries) -> do.Steps:
    """Notes when a signal takes another value."""
    value = world.read(name)
    series.append((world.now, value))
    while True:
        yield do.Until(f"{name} != {value!r}")
        value = world.read(name)
        series.append((world.now, value))
