"""Conditions over signals of a world: whether they hold, and when that may change.

Names such as ``table.M1.position``, ``table.hr:10020`` and ``table.USER_REGISTER[12]:real`` are resolved by `Signals`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import chain
from math import inf, nextafter
from typing import Any, NamedTuple, Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.points import FARTHEST_NS
from steptwin.simulation.logic.expression import REMEMBERED, Comparison, Truth, comparisons, parse_condition, truth_of
from steptwin.simulation.logic.quantities import Quantity, SignalName, Sum, next_change

INSTEAD = "; "
"""Between a condition that does not hold and what its signals are."""
MOST_TOLD = 6
"""Number of signals whose values a message gives."""


class Signal(Protocol):
    """A quantity of a world. ``continuous``: it also changes between events."""

    @property
    def continuous(self) -> bool: ...
    @property
    def unit(self) -> str: ...
    def sync(self, now: Nanos) -> tuple[Any, ...]:
        """Prepare the value at ``now``. Returns what it depends on: until one of these changes, it follows its trajectory."""
        ...

    def value(self, now: Nanos) -> float: ...
    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after ``now``, in order, between which (and after the last of which) the value is monotonic."""
        ...

    def version(self) -> object:
        """A value that changes whenever the future trajectory may have changed; None if that is unknown."""
        ...


Signals: TypeAlias = Callable[[str], Signal]
"""The signal of a name. Raises `Misuse`."""


class _Crossing(NamedTuple):
    """The moment at which a signal crosses a level; computed again at ``until``."""

    version: object
    level: object
    due: Nanos | None
    until: Nanos


@lru_cache(maxsize=REMEMBERED)
def _in_units(text: str, units: tuple[tuple[str, str], ...]) -> Truth:
    """A condition with its numbers in the units of its names. Raises `Misuse` for a number in another one."""
    return parse_condition(text).in_unit("", dict(units).__getitem__)


WRONG_CONDITION = Message("simulation.wrong-condition", "condition {text!r}: {problem}")


class SignalCondition:
    """A condition with its signals."""

    __slots__ = ("_comparisons", "_crossings", "_signals", "_synced", "_test", "text")

    def __init__(self, text: str, signals: Signals, node: Truth | None = None) -> None:
        """``node``: what the text says, if it is known and its numbers are in the units of its signals.

        Raises `Misuse` for invalid text, for unknown signals, and for a number in a unit that its signals do not have.
        """
        self.text = text
        is_new = node is None
        node = parse_condition(text) if node is None else node
        self._signals = {name: signals(name) for name in node.names()}
        self._synced = tuple(self._signals.values())
        try:
            if is_new:
                node = _in_units(text, tuple((name, signal.unit) for name, signal in self._signals.items()))
        except Misuse as error:
            raise Misuse(WRONG_CONDITION(text=text, problem=text_of(error))) from None
        self._test = truth_of(node, {name: signal.value for name, signal in self._signals.items()})
        found = (_Comparison.of(one, self._signals) for one in comparisons(node))
        self._comparisons = [one for one in found if one.moving]
        self._crossings: list[_Crossing | None]
        """The crossings computed last."""
        self.forget()

    def sync(self, now: Nanos) -> tuple[Any, ...]:
        """As `Signal.sync`, for all its signals. Must be called before `holds` and `due`."""
        if len(self._synced) == 1:
            return self._synced[0].sync(now)
        found: dict[Any, None] = {}
        for signal in self._synced:
            found.update(dict.fromkeys(signal.sync(now)))
        return tuple(found)

    def holds(self, now: Nanos) -> bool:
        return self._test(now)

    def told(self, now: Nanos) -> str:
        """Its text and what its signals are, after `sync`: ``lift.count == 3; lift.count is 0``. At most `MOST_TOLD` of them."""
        texts = [f"{name} is {one.value(now):.9g} {one.unit}".rstrip() for name, one in self._signals.items()]
        more = len(texts) - MOST_TOLD
        told = ", ".join(texts) if more <= 0 else f"{', '.join(texts[:MOST_TOLD])} and {more} more"
        return f"{self.text}{INSTEAD}{told}" if told else self.text

    def due(self, now: Nanos) -> Nanos | None:
        """The next moment at which the condition may become true without an event; ``now`` if it is true; None if never."""
        return now if self.holds(now) else self.change(now)

    def change(self, now: Nanos) -> Nanos | None:
        """The next moment at which one of its comparisons may change without an event; None if never."""
        deadlines = [due for n in range(len(self._comparisons)) if (due := self._crossing(n, now)) is not None]
        return min(deadlines, default=None)

    def forget(self) -> None:
        """Compute crossings again: after a restored snapshot, whose signals may have versions that they had in another past."""
        self._crossings = [None] * len(self._comparisons)

    def _crossing(self, n: int, now: Nanos) -> Nanos | None:
        """The moment at which a comparison changes; cached while the trajectories of its signals are unchanged."""
        comparison, known = self._comparisons[n], self._crossings[n]
        version, level = comparison.version(), comparison.level(now)
        if known is not None and version is not None and known[:2] == (version, level) and now < known.until:
            return known.due
        due = comparison.change(now)
        self._crossings[n] = _Crossing(version, level, due, now + FARTHEST_NS // 2 if due is None else due)
        return due


@dataclass(frozen=True, slots=True)
class _Comparison:
    """A comparison, its signals that move, and the others. ``alone``: one that moves is compared with what does not."""

    difference: Quantity
    moving: Mapping[str, Signal]
    resting: Mapping[str, Signal]
    alone: tuple[Signal, Quantity] | None

    @staticmethod
    def of(node: Comparison, signals: Mapping[str, Signal]) -> _Comparison:
        left, right = tuple(node.left.names()), tuple(node.right.names())
        moving = {name: signals[name] for name in (*left, *right) if signals[name].continuous}
        resting = {name: signals[name] for name in (*left, *right) if not signals[name].continuous}
        alone: tuple[Signal, Quantity] | None = None
        if len(moving) == 1:
            ((name, signal),) = moving.items()
            for side, other, named in ((node.left, node.right, right), (node.right, node.left, left)):
                if side == SignalName(name) and name not in named:
                    alone = signal, other
        return _Comparison(Sum(node.left, -1, node.right), moving, resting, alone)

    def version(self) -> object:
        """As `Signal.version`, of all that move."""
        found = tuple(signal.version() for signal in self.moving.values())
        return None if None in found else found

    def level(self, now: Nanos) -> object:
        """The values of what does not move."""
        return tuple(signal.value(now) for signal in self.resting.values())

    def change(self, now: Nanos) -> Nanos | None:
        if self.alone is not None:
            signal, other = self.alone
            return crossing(signal, other.value(lambda name: self.resting[name].value(now)), now)
        return next_change(self.difference, self.moving, lambda name: self.resting[name].value(now), now)


def crossing(signal: Signal, level: float | Fraction, now: Nanos) -> Nanos | None:
    """First whole nanosecond after ``now`` at which the signal is on another side of ``level`` (below, at, above)."""
    return first_crossing(signal, (Border.of(level),), now)


def first_crossing(signal: Signal, borders: Collection[Border], now: Nanos) -> Nanos | None:
    """As `crossing`, of any of these levels."""
    begin, first = now, signal.value(now)
    for end in chain(signal.turning_points(now), (now + FARTHEST_NS,)):
        last = signal.value(end)
        crossed = [border for border in borders if border.side(last) != border.side(first)]
        if crossed:
            return min(_first_other(signal, border, (begin, first), (end, last)) for border in crossed)
        begin, first = end, last
    return None


GREATEST = sys.float_info.max


class Border(NamedTuple):
    """An exact level between floating-point numbers: more than ``below`` is above the level, less than ``above`` is below it."""

    below: float
    above: float

    @staticmethod
    def of(level: float | Fraction) -> Border:
        try:
            nearest = float(level)
        except OverflowError:
            return Border(GREATEST, inf) if level > 0 else Border(-inf, -GREATEST)
        if nearest == level:
            return Border(nearest, nearest)
        return Border(nearest, nextafter(nearest, inf)) if nearest < level else Border(nextafter(nearest, -inf), nearest)

    def side(self, value: float) -> int:
        """-1 below, 0 at, 1 above."""
        return (value > self.below) - (value < self.above)


def _first_other(signal: Signal, border: Border, begin: tuple[Nanos, float], end: tuple[Nanos, float]) -> Nanos:
    """The first moment at which the signal is on another side than it is at ``begin``, as at ``end``; it goes one way between
    these, each with its value."""
    (low, first), (high, last) = begin, end
    side = border.side(first)
    step = kept = 0
    while high - low > 1:
        # Where a straight line would cross (Illinois: what is kept twice counts half); every third step halves what is left, and
        # each one after twelve: a jump, or what rounding makes of a slow change, is on no line.
        middle, step = (low + high) // 2, step + 1
        over, under = border.below - first, last - border.below
        if step < 12 and step % 3 and 0 < abs(over + under) < inf:
            middle = min(max(low + round((high - low) * (over / (over + under))), low + 1), high - 1)
        value = signal.value(middle)
        if border.side(value) == side:
            low, first = middle, value
            last, kept = ((last + border.below) / 2, 1) if kept == 1 else (last, 1)
        else:
            high, last = middle, value
            first, kept = ((first + border.below) / 2, -1) if kept == -1 else (first, -1)
    return high
