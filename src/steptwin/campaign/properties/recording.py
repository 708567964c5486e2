"""The values of one comparison in a running world over time, exact at every event, turn and crossing.

While signals go on as they did, nothing is computed: a trajectory is read as a whole once another one follows. Signals of one
scheduler are followed by that scheduler (`steptwin.simulation.scheduler.subscribers`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from heapq import merge
from math import isnan
from typing import TypeGuard

from steptwin.campaign.properties.evaluate import forced
from steptwin.campaign.properties.slopes import TINY, Shape, Slope
from steptwin.campaign.properties.tree import Atom
from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.signals import Idle
from steptwin.simulation.logic.expression import COMPARE, value_of
from steptwin.simulation.logic.quantities import (
    NO_NUMBER,
    Absolute,
    NumberLiteral,
    Product,
    Quantity,
    Remainder,
    SignalName,
    Sum,
    change_between,
    unit_of_all,
)
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler, Source
from steptwin.simulation.world.simulation import Simulation

_SIGNS = {"<": -1.0, "<=": -1.0, ">": 1.0, ">=": 1.0, "==": 0.0, "!=": 0.0}
"""Whether more of the left side is nearer to the truth, or less; 0: neither."""
FINEST_NS: Nanos = 1000
"""Intervals are not divided further."""
DEVIATION = 0.001
"""By how much of the scale a straight interval may deviate from what moves, where its shape counts."""
SHARES = (0.25, 0.5, 0.75)
PROBES = (0.0625, *SHARES, 0.9375)
"""Shares of an interval at which it is searched for a turning point; one that these miss is less than a hundredth of
`DEVIATION`."""


class ComparisonRecord:
    """``is_fine``: between its turns its shape counts, too, because it meets others or a window.

    It is notified of events by `leave` and `look`, as a `SchedulerSubscriber`: by its ``scheduler``, or, where that is None
    because its signals have several, by who observes the world.
    """

    def __init__(self, world: Simulation, atom: Atom, *, is_fine: bool) -> None:
        """Raises `Misuse` for unknown signals, and for a number in a unit that its signals do not have."""
        self._signals = {name: world.watched(name) for name in dict.fromkeys(atom.comparison.names())}
        self.node = atom.comparison.in_unit("", lambda name: self._signals[name].unit)
        self._reads: dict[str, Callable[[Nanos], float]] = {name: signal.value for name, signal in self._signals.items()}
        self._compare = COMPARE[self.node.sign]
        self._sign = _SIGNS[self.node.sign]
        is_simple = isinstance(self.node.left, SignalName) and isinstance(self.node.right, NumberLiteral)
        self._limit = self.node.right.number if is_simple and isinstance(self.node.right, NumberLiteral) else None
        """The number, where it is beside a signal alone."""
        self._read()
        self.unit = unit_of_all(self.node, lambda name: self._signals[name].unit)
        self.scale = _scale(world, self.node.left, self.node.right)
        self._moving = {name: signal for name, signal in self._signals.items() if _moves(signal)}
        self._standing = {name: signal for name, signal in self._signals.items() if name not in self._moving}
        self._only = next(iter(self._moving.values())).versions if len(self._signals) == len(self._moving) == 1 else None
        """The version of all, where that is one signal."""
        self._stays = all(signal.freeze is not None for signal in self._moving.values())
        """Whether a trajectory can be read after another one has followed."""
        self._is_monotonic = len(self._moving) == 1 and _is_alone(self.node.left, self.node.right, *self._moving)
        """Whether it is monotonic between turning points, so that its extremes are there."""
        self._is_fine = is_fine or not self._is_monotonic
        self.scheduler, self.names = self._subscribed()
        self._closed: Shape = []
        self._known: object = None
        """Version of the sources of the present trajectory."""
        self._begin: Nanos | None = None
        """Begin of the interval that is not closed."""
        self._first = 0.0
        """The value at `_begin`."""
        self._seen: Nanos = 0
        """Up to here the trajectory has been read since `_begin`: it has crossed nothing, nor turned back."""
        self._there, self._side = 0.0, 0
        """The value at `_seen`, and on which side of its limit that is."""
        self._left: Nanos = -1
        """The moment before which `_last` was read."""
        self._last = 0.0
        self._turning_points: Iterator[Nanos] = iter(())
        self._turning_point: Nanos | None = None

    def _subscribed(self) -> tuple[Scheduler | None, tuple[str, ...]]:
        """The only scheduler on which it depends, and the names there."""
        sources: set[Source] = set()
        for signal in self._signals.values():
            if isinstance(signal, Idle):
                return None, ()
            sources.update(signal.sources)
        schedulers = {source.scheduler for source in sources}
        return (schedulers.pop(), tuple(sorted(source.name for source in sources))) if len(schedulers) == 1 else (None, ())

    def subscribe(self, world: Simulation) -> None:
        """From now on its scheduler notifies it."""
        scheduler = self.scheduler
        if scheduler is None:
            return
        if scheduler.now < world.now:
            scheduler.advance(world.now)
        if not all(_is_event(world, name, signal) for name, signal in self._signals.items()):
            scheduler.is_step_exact = True
        scheduler.subscribe(self, self.names, leaves=not self._stays)

    def unsubscribe(self) -> None:
        if self.scheduler is not None and self.scheduler.subscribers is not None:
            self.scheduler.subscribers.remove(self)

    def sync(self, now: Nanos) -> tuple[Source, ...]:
        """Advance its schedulers to ``now`` and return what it depends on."""
        return tuple(dict.fromkeys(source for signal in self._signals.values() for source in signal.sync(now)))

    # ------------------------------------------------------------------ values

    def _read(self) -> None:
        """Take `_reads` for all values from now on."""
        self._left_at, self._right_at = value_of(self.node.left, self._reads), value_of(self.node.right, self._reads)

    def _value(self, now: Nanos) -> float:
        return self._look_at(now)[0]

    def _look_at(self, now: Nanos) -> tuple[float, int]:
        """The value, and the side of 0 on which the difference is."""
        left = self._left_at(now)
        right = self._right_at(now) if self._limit is None else self._limit
        holds = bool(self._compare(left, right))
        difference = left - right
        if isnan(difference):
            return (TINY if holds else -TINY), NO_NUMBER
        if self._sign:
            value = difference / self.scale * self._sign
        elif holds is (self.node.sign == "=="):
            value = 1.0 if holds else -1.0
        else:
            value = abs(difference) / self.scale * (1.0 if holds else -1.0)
        if holds:  # as `forced`, without calls: this is read most
            if value < TINY:
                value = TINY
            elif value > 1.0:
                value = 1.0
        elif value > -TINY:
            value = -TINY
        elif value < -1.0:
            value = -1.0
        return value, (difference > 0.0) - (difference < 0.0)

    # ------------------------------------------------------------------ following

    def leave(self, moment: Nanos) -> None:
        if not self._stays and self._begin is not None and moment > self._begin:
            self._last, self._left = self._go_to(moment - 1), moment

    def look(self, now: Nanos) -> None:
        begin = self._begin
        if begin is not None and now < begin:
            return  # a snapshot was restored: `rewind` comes next
        if not self._moving:
            self._note(now)
            return
        known = self._version(now) if self._only is None else self._only()
        if begin is not None and known is not None and known == self._known:
            return
        if begin is not None and now > begin:
            last = self._last if self._left == now else self._go_to(now - 1)
            self._closed += self._interval(now - 1, last)
        self._known = known
        self._go_on(now)

    def _note(self, now: Nanos) -> None:
        """Note the values that change with events only."""
        sides = self._left_at(now), self._right_at(now) if self._limit is None else self._limit
        if self._begin is not None:
            if sides == self._known:
                return
            if now > self._begin:
                self._closed.append(Slope(self._begin, now - 1, self._first, self._first))
        self._begin, self._first, self._known = now, self._value(now), sides

    def _version(self, now: Nanos) -> object:
        """Version of the sources of the trajectory; None if it is unknown."""
        versions = [one.version() for one in self._moving.values()]
        if None in versions:
            return None
        return (*versions, *(one.value(now) for one in self._standing.values()))

    def _go_on(self, now: Nanos) -> None:
        """Begin another trajectory."""
        for name, signal in self._standing.items():
            self._reads[name] = _constant(signal.value(now))
        turning_points: Iterator[Nanos] | None = None
        for name, signal in self._moving.items():
            if signal.freeze is not None:
                self._reads[name] = signal.freeze(now)
            ahead = signal.turning_points(now)
            turning_points = ahead if turning_points is None else merge(turning_points, ahead)
        if self._limit is not None:
            (self._left_at,) = self._reads.values()
        else:
            self._read()
        if turning_points is not None:
            self._turning_points = iter(tuple(turning_points)) if self._stays else turning_points
        self._turning_point = next(self._turning_points, None)
        self._begin_at(now)

    def _begin_at(self, now: Nanos) -> None:
        self._begin = self._seen = now
        self._there, self._side = self._look_at(now)
        self._first = self._there

    def _go_to(self, last: Nanos) -> float:
        """Close all intervals that end before ``last`` on the present trajectory. Returns the value there, to which it has come
        or further."""
        if last < self._seen:
            return self._value(last)
        while self._seen < last:
            while self._turning_point is not None and self._turning_point <= self._seen:
                self._turning_point = next(self._turning_points, None)
            end = last if self._turning_point is None else min(self._turning_point, last)
            there, side = self._look_at(end)
            change = None if side == self._side and self._is_monotonic else self._change(end, side)
            if change is not None:
                self._closed += self._interval(change - 1, self._value(change - 1))
                self._begin_at(change)
            elif self._is_fine and end == self._turning_point:
                self._closed += self._interval(end - 1, self._value(end - 1))
                self._begin_at(end)
            else:
                if (there - self._there) * (self._there - self._first) < 0.0:  # it turned back where it was seen last
                    self._closed += self._interval(self._seen, self._there)
                    self._begin_at(self._seen + 1)
                self._seen, self._there, self._side = end, there, side
        return self._there

    def _change(self, end: Nanos, side: int) -> Nanos | None:
        """The first moment after `_seen`, up to ``end``, at which it is on another side of its limit; it does not turn before."""
        if not self._is_monotonic:
            return change_between(Sum(self.node.left, -1, self.node.right), self._reads, self._seen, end)
        low, high = self._seen, end
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._look_at(middle)[1] == self._side else (low, middle)
        return high

    def _interval(self, end: Nanos, last: float) -> Shape:
        """The interval that is not closed, up to ``end``."""
        begin, first = self._begin or 0, self._first
        if not self._is_fine or end - begin < FINEST_NS or (self._is_monotonic and abs(first - last) <= DEVIATION):
            return [Slope(begin, end, first, last)]
        found: Shape = []
        while True:
            until, there = self._straight(begin, first, end, last)
            found.append(Slope(begin, until, first, there))
            if until == end:
                break
            begin, first = until + 1, self._value(until + 1)
        return found if self._is_monotonic else list(self._with_extremes(found))

    def _straight(self, begin: Nanos, first: float, end: Nanos, last: float) -> tuple[Nanos, float]:
        """The end of an interval that is as good as straight, and the value there."""
        while end - begin > FINEST_NS:
            length = end - begin
            at = [(share, self._value(begin + int(length * share))) for share in SHARES]
            if all(abs(value - first - (last - first) * share) <= DEVIATION for share, value in at):
                break
            end = begin + length // 2
            last = self._value(end)
        return end, last

    def _with_extremes(self, shape: Shape) -> Iterator[Slope]:
        """With joints where it turns back within an interval."""
        for slope in shape:
            begin, end, first, last = slope
            length = end - begin
            if length > FINEST_NS:
                moments = [begin, *(begin + int(length * share) for share in PROBES), end]
                values = [first, *map(self._value, moments[1:-1]), last]
                for n in sorted({values.index(max(values)), values.index(min(values))} - {0, len(values) - 1}):
                    top = self._top(moments[n - 1], moments[n + 1], values[n] > first)
                    if top > begin:
                        yield Slope(begin, top - 1, first, self._value(top - 1))
                        begin, first = top, self._value(top)
            yield Slope(begin, end, first, last)

    def _top(self, low: Nanos, high: Nanos, is_highest: bool) -> Nanos:
        """Where it is highest, or lowest, between two moments between which it goes up, then down, or down, then up."""
        while high - low > 2:
            third = (high - low) // 3
            one, other = self._value(low + third), self._value(high - third)
            low, high = (low + third, high) if (one < other) is is_highest else (low, high - third)
        return (low + high) // 2

    def shape(self, now: Nanos) -> Shape:
        """Up to ``now``, to which the world has come."""
        if self._begin is None:
            raise Misuse("nothing was watched yet")
        if not self._moving:
            return [*self._closed, Slope(self._begin, now, self._first, self._first)]
        here = self._value(now)
        if now == self._begin:
            return [*self._closed, Slope(now, now, here, here)]
        last = self._go_to(now - 1)
        return [*self._closed, *self._interval(now - 1, last), Slope(now, now, here, here)]

    # ------------------------------------------------------------------ the past

    def rewind(self, now: Nanos) -> None:
        """Forget everything from ``now`` on."""
        self._known, self._left = None, -1
        while self._closed and self._closed[-1].begin >= now:
            self._closed.pop()
        if self._begin is not None and self._begin < now:
            last = self._go_to(now - 1)
            self._closed += self._interval(now - 1, forced(last, holds=self._first > 0.0))
        elif self._closed and self._closed[-1].end >= now:
            begin, _, first, last = self._closed[-1]
            self._closed[-1] = Slope(begin, now - 1, first, last if first == last else self._here(now, first))
        self._begin = None

    def _here(self, now: Nanos, first: float) -> float:
        """The end of an interval that now goes no further."""
        self._reads |= {name: signal.value for name, signal in self._signals.items()}
        self._read()
        self.sync(now)
        return forced(self._value(now), holds=first > 0.0)

    def state(self, now: Nanos) -> Shape:
        """All before ``now``."""
        return [one.cut(one.begin, min(one.end, now - 1)) for one in self.shape(now) if one.begin < now]

    def begin_after(self, shape: Shape) -> None:
        """Go on after what another one has recorded."""
        self._closed = list(shape)


def _moves(signal: SignalOf | Idle) -> TypeGuard[SignalOf]:
    return signal.continuous


def _constant(value: float) -> Callable[[Nanos], float]:
    return lambda now: value


def _is_alone(left: Quantity, right: Quantity, name: str) -> bool:
    """Whether one side is this signal, with which the other has nothing to do."""
    sides = ((left, right), (right, left))
    return any(side == SignalName(name) and name not in other.names() for side, other in sides)


def _is_event(world: Simulation, name: str, signal: SignalOf | Idle) -> bool:
    """Whether its changes are seen from outside of programs, so that a program may calculate ahead of it."""
    owner, _, rest = name.partition(".")
    controller = world.controllers.get(owner)
    return signal.freeze is not None or (not signal.continuous and (controller is None or rest.upper() in controller.pins()))


def _scale(world: Simulation, left: Quantity, right: Quantity) -> float:
    """The range of the signals in a comparison, otherwise the greatest number in it, otherwise 1."""
    spans = [span for name in (*left.names(), *right.names()) if (span := _span(world, name)) is not None]
    if spans:
        return max(spans)
    return max((*_numbers(left), *_numbers(right)), default=0.0) or 1.0


def _span(world: Simulation, name: str) -> float | None:
    owner, _, rest = name.partition(".")
    axis = world.axes.get(owner) if rest == "position" else None
    if axis is not None and axis.spec.travel is not None:
        return axis.spec.travel[1] - axis.spec.travel[0]
    signal = world.signal(name)
    bounds = signal.bounds if isinstance(signal, SignalOf) else None
    return bounds[1] - bounds[0] if bounds is not None and bounds[1] > bounds[0] else None


def _numbers(quantity: Quantity) -> list[float]:
    match quantity:
        case NumberLiteral(number):
            return [abs(number)]
        case Sum(left, _, right) | Product(left, right) | Remainder(left, right):
            return _numbers(left) + _numbers(right)
        case Absolute(inner):
            return _numbers(inner)
    return []
