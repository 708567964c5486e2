"""The course of one comparison in a running world, exact at every event, turn and crossing."""

from __future__ import annotations

from math import isnan

from steptwin.campaign.properties.evaluate import forced
from steptwin.campaign.properties.slopes import Shape, Slope
from steptwin.campaign.properties.tree import Atom
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.points import FARTHEST_NS
from steptwin.world.condition import SignalCondition
from steptwin.world.expression import COMPARE, value_of
from steptwin.world.kernel import Source
from steptwin.world.plant import Plant
from steptwin.world.quantities import Absolute, NumberLiteral, Product, Quantity, Remainder, Sum
from steptwin.world.signals import SignalOf

FINEST_NS: Nanos = 1000
"""Stretches are not divided further."""
DEVIATION = 0.001
"""By how much of the scale a straight stretch may deviate from what moves, where its shape counts."""
SHARES = (0.25, 0.5, 0.75)


class ComparisonRecord:
    """``is_fine``: between its turns its shape counts, too, because it meets others or a window."""

    def __init__(self, world: Plant, atom: Atom, *, is_fine: bool) -> None:
        """Raises `Misuse` for unknown signals, and for a number in a unit that its signals do not have."""
        signals = {name: world.watched(name) for name in atom.comparison.names()}
        self.node = atom.comparison.in_unit("", lambda name: signals[name].unit)
        self._condition = SignalCondition(repr(atom), signals.__getitem__, self.node)
        self._signals = signals
        self._moving = [one for one in signals.values() if one.continuous]
        reads = {name: signal.value for name, signal in signals.items()}
        self._left, self._right = value_of(self.node.left, reads), value_of(self.node.right, reads)
        self._compare = COMPARE[self.node.sign]
        self.scale = _scale(world, self.node.left, self.node.right)
        self._is_fine = is_fine or len(self._moving) > 1
        self._closed: Shape = []
        self._begin: Nanos | None = None
        self._first = self._last = 0.0
        self._due: Nanos | None = None
        self._is_still = True
        self._known: object = None

    # ------------------------------------------------------------------ values

    def _value(self, now: Nanos) -> float:
        left, right = self._left(now), self._right(now)
        holds = bool(self._compare(left, right))
        away = (left - right) / self.scale
        match self.node.sign:
            case "==":
                value = 1.0 if holds else -abs(away)
            case "!=":
                value = abs(away) if holds else -1.0
            case "<" | "<=":
                value = -away
            case _:
                value = away
        return forced(0.0 if isnan(value) else value, holds=holds)

    # ------------------------------------------------------------------ following

    def leave(self, moment: Nanos) -> None:
        if not self._is_still and self._begin is not None and moment - 1 > self._begin:
            self._last = self._value(moment - 1)

    def look(self, now: Nanos) -> tuple[tuple[Source, ...], Nanos | None]:
        sources = self._condition.bring(now)
        known = self._version(now)
        if known is not None and known == self._known and self._begin is not None and (self._due is None or now < self._due):
            return sources, self._due
        self._known = known
        value = self._value(now)
        is_still, due = (True, None) if not self._moving else self._ahead(now, value)
        if self._begin is None or now > self._begin:
            if self._begin is not None:
                if is_still and self._is_still and value == self._first:
                    return sources, None
                self._closed.append(Slope(self._begin, now - 1, self._first, self._last))
            self._begin = now
        self._first = self._last = value
        self._is_still, self._due = is_still, due
        return sources, due

    def _version(self, now: Nanos) -> object:
        """What the course depends on; None if that is unknown, or nothing moves."""
        if not self._moving:
            return None
        versions = [one.version() for one in self._moving]
        if None in versions:
            return None
        return (*versions, *(one.value(now) for one in self._signals.values() if not one.continuous))

    def _ahead(self, now: Nanos, value: float) -> tuple[bool, Nanos | None]:
        """Whether it stands still, and the end of the stretch that begins now."""
        turns = [turn for one in self._moving if (turn := next(iter(one.turns(now)), None)) is not None]
        if not turns and self._value(now + FARTHEST_NS) == value:
            return True, None
        change = self._condition.change(now)
        dues = turns if change is None else [*turns, change]
        due = min(dues, default=None)
        if self._is_fine:
            due = self._straight(now, value, now + FARTHEST_NS if due is None else due)
        return False, due

    def _straight(self, begin: Nanos, first: float, end: Nanos) -> Nanos:
        """The end of a stretch that is as good as straight."""
        while end - begin > FINEST_NS:
            last = self._value(end - 1)
            length = end - 1 - begin
            at = [(share, self._value(begin + int(length * share))) for share in SHARES]
            if all(abs(value - first - (last - first) * share) <= DEVIATION for share, value in at):
                break
            end = begin + (end - begin) // 2
        return end

    def course(self, now: Nanos) -> Shape:
        """Up to ``now``, to which the world has come."""
        if self._begin is None:
            raise Misuse("nothing was watched yet")
        last = self._first if self._is_still or now == self._begin else self._value(now)
        return [*self._closed, Slope(self._begin, now, self._first, last)]

    # ------------------------------------------------------------------ the past

    def rewind(self, now: Nanos) -> None:
        """Forget everything from ``now`` on."""
        self._condition.forget()
        self._known = None
        while self._closed and self._closed[-1].begin >= now:
            self._closed.pop()
        if self._begin is not None and self._begin < now:
            if not self._is_still:
                self._closed.append(Slope(self._begin, now - 1, self._first, self._here(now, self._first)))
                self._begin = None
            return
        self._begin = None
        if self._closed:
            begin, _, first, last = self._closed[-1]
            self._closed[-1] = Slope(begin, now - 1, first, last if first == last else self._here(now, first))

    def _here(self, now: Nanos, first: float) -> float:
        """The end of a stretch that now goes no further."""
        self._condition.bring(now)
        return forced(self._value(now), holds=first > 0.0)

    def state(self, now: Nanos) -> Shape:
        """All before ``now``."""
        course = self.course(now)
        return [one.cut(one.begin, min(one.end, now - 1)) for one in course if one.begin < now]

    def begin_after(self, course: Shape) -> None:
        """Go on after what another one has recorded."""
        self._closed = list(course)


def _scale(world: Plant, left: Quantity, right: Quantity) -> float:
    """The range of the signals in a comparison, otherwise the greatest number in it, otherwise 1."""
    spans = [span for name in (*left.names(), *right.names()) if (span := _span(world, name)) is not None]
    if spans:
        return max(spans)
    return max((*_numbers(left), *_numbers(right)), default=0.0) or 1.0


def _span(world: Plant, name: str) -> float | None:
    owner, _, rest = name.partition(".")
    axis = world.axes.get(owner)
    if axis is not None and rest == "position" and axis.spec.travel is not None:
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
