"""The courses of what is in no trace, such as registers: found by running parts of the past again, and remembered."""

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

CourseTurns: TypeAlias = list[tuple[Nanos, float]]
"""The values from the beginning of an interval on, each with its moment."""
CourseWatch: TypeAlias = Callable[[Simulation, str, CourseTurns], do.Steps]
"""A script that notes the turns of what has a name."""


class _Course(NamedTuple):
    end: Nanos
    turns: CourseTurns


NOTHING_IS_KNOWN = Message("why.nothing-is-known", "{name}: nothing is known of it at {end:g} s")


class Courses:
    """``make`` gives the world at its beginning, ``inputs`` are what came from outside since, more and more."""

    def __init__(self, make: Callable[[], Simulation], inputs: Sequence[RecordedInput]) -> None:
        self._make = make
        self._inputs = inputs
        self._second: Simulation | None = None
        self._known: dict[tuple[str, Nanos], _Course] = {}
        self._remembered = 0

    def begin(self) -> None:
        """A question begins."""
        self._second = None
        if self._remembered > MOST_REMEMBERED:
            self._known.clear()
            self._remembered = 0

    def bring(self, wanted: Collection[str], watch: CourseWatch, intervals: Sequence[Interval], at: Nanos) -> Iterator[None]:
        """Have the courses in the first of ``intervals``, at least until a moment in it, in parts.

        The others are those before it, the last one first; as far as nothing is known of them, they are run again with it, so
        that one state is restored for all. Raises `Misuse` for what cannot be watched.
        """
        if self._has(wanted, intervals[0], at):
            return
        lacking = [intervals[0], *takewhile(lambda interval: not self._has(wanted, interval, at), intervals[1:])]
        state, end = lacking[-1].state, lacking[0].end
        world = self._second = self._second or self._make()
        world.restore(state.snapshot)
        found: dict[str, CourseTurns] = {name: [] for name in wanted}
        for name, turns in found.items():
            world.start("why", partial(watch, world, name, turns), is_external=True)
        for _ in in_parts(world, self._inputs[state.inputs :], end):
            yield
        for name, turns in found.items():
            if not turns:
                raise Misuse(NOTHING_IS_KNOWN(name=name, end=end / SECOND))
            for interval in lacking:
                self._known[name, interval.state.snapshot.now] = _Course(interval.end, list(_within(turns, interval)))
            self._remembered += len(turns) + len(lacking)

    def remember(self, name: str, interval: Interval, value: float) -> None:
        """Note that a signal has one value in a whole interval."""
        self._known.setdefault((name, interval.state.snapshot.now), _Course(interval.end, [(interval.state.snapshot.now, value)]))

    def _has(self, wanted: Collection[str], interval: Interval, at: Nanos) -> bool:
        begin, needed = interval.state.snapshot.now, min(at, interval.end)
        return all((known := self._known.get((name, begin))) is not None and known.end >= needed for name in wanted)

    def level(self, name: str, interval: Interval, at: Nanos) -> float:
        """The value at a moment in an interval; at its beginning, if the moment is before."""
        turns = self._turns(name, interval)
        return turns[max(0, bisect_right(turns, at, key=_moment) - 1)][1]

    def changes(self, name: str, interval: Interval, until: Nanos) -> Iterator[Nanos]:
        """The moments of the changes in an interval by a moment, the last one first."""
        turns = self._turns(name, interval)
        return (turns[index][0] for index in range(bisect_right(turns, min(until, interval.end), key=_moment) - 1, 0, -1))

    def _turns(self, name: str, interval: Interval) -> CourseTurns:
        return self._known[name, interval.state.snapshot.now].turns


def _within(turns: CourseTurns, interval: Interval) -> Iterator[tuple[Nanos, float]]:
    """The turns in an interval, the first one at its beginning: what came from outside at this moment came after the state."""
    begin = interval.state.snapshot.now
    first = max(1, bisect_left(turns, begin, key=_moment))
    yield begin, turns[first - 1][1]
    yield from turns[first : bisect_right(turns, interval.end, key=_moment)]


def _moment(turn: tuple[Nanos, float]) -> Nanos:
    return turn[0]


def watch_truth(world: Simulation, text: str, turns: CourseTurns) -> do.Steps:
    """Notes when a condition becomes true and false."""
    negated = f"not ({text})"
    is_true = world.holds(world.condition(text))
    turns.append((world.now, float(is_true)))
    while True:
        yield do.Until(negated if is_true else text)
        is_true = not is_true
        turns.append((world.now, float(is_true)))


def watch_value(world: Simulation, name: str, turns: CourseTurns) -> do.Steps:
    """Notes when a signal takes another value."""
    value = world.read(name)
    turns.append((world.now, value))
    while True:
        yield do.Until(f"{name} != {value!r}")
        value = world.read(name)
        turns.append((world.now, value))
