"""Conditions over signals: ``table.IN3 and not x.position > 100``. Parsed, never evaluated as code.

    condition   = conjunction { "or" conjunction }
    conjunction = negation { "and" negation }
    negation    = "not" negation | "(" condition ")" | comparison
    comparison  = sum [ ( "==" | "!=" | "<" | "<=" | ">" | ">=" ) sum ]

Sums of numbers and signals are those of `steptwin.world.quantities`. A signal alone is true if it is not 0. Names of signals,
such as ``table.M1.position``, ``table.hr:10020`` and ``table.USER_REGISTER[12]:real``, are resolved by `Signals`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from math import inf, nextafter
from operator import eq, ge, gt, le, lt, ne
from typing import Any, NamedTuple, Protocol, TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.points import FARTHEST_NS
from steptwin.world.quantities import (
    LARGEST,
    UNIT_NAMES,
    Absolute,
    NumberLiteral,
    Product,
    Quantity,
    SignalName,
    Sum,
    next_change,
)

MOST_NESTED = 64
"""Limit of nesting, because the parser is recursive."""
MOST_OPERATIONS = 200
"""Limit of the signs + - * / of a condition, because they are evaluated recursively."""

_COMPARE: dict[str, Callable[[float, float], bool]] = {"==": eq, "!=": ne, "<=": le, ">=": ge, "<": lt, ">": gt}
_WORDS = ("and", "or", "not")
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_][\w&-]*(?:\.[\w&-]+(?:\[\d+\])?(?::\w+)*)*)|(?P<sign>[=!<>]=|[<>()+*/-])|(?P<wrong>\S))"
)


class Signal(Protocol):
    """A quantity of a world. ``continuous``: it also changes between events."""

    @property
    def continuous(self) -> bool: ...
    @property
    def unit(self) -> str: ...
    def bring(self, now: Nanos) -> tuple[Any, ...]:
        """Prepare the value at ``now``. Returns what it depends on: until one of these changes, it follows its course."""
        ...

    def value(self, now: Nanos) -> float: ...
    def turns(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after ``now``, in order, between which (and after the last of which) the value is monotonic."""
        ...

    def version(self) -> object:
        """A value that changes whenever the future course may have changed; None if that is unknown."""
        ...


Signals: TypeAlias = Callable[[str], Signal]
"""The signal of a name. Raises `Misuse`."""


@dataclass(frozen=True, slots=True)
class SignalComparison:
    left: Quantity
    sign: str
    right: Quantity


@dataclass(frozen=True, slots=True)
class Not:
    inner: Node


@dataclass(frozen=True, slots=True)
class And:
    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Or:
    parts: tuple[Node, ...]


Node: TypeAlias = SignalComparison | Not | And | Or


def parse(text: str) -> Node:
    """Parse a condition. Raises `Misuse` with the column, the found and the expected token."""
    return _Parser(text).whole()


def names(node: Node) -> Iterator[str]:
    """The signals of a condition."""
    if isinstance(node, SignalComparison):
        yield from node.left.names()
        yield from node.right.names()
    elif isinstance(node, Not):
        yield from names(node.inner)
    else:
        for part in node.parts:
            yield from names(part)


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [(m.lastgroup or "", m[m.lastgroup or 0], m.start(m.lastgroup or 0)) for m in _TOKEN.finditer(text)]
        if sum(token in ("+", "-", "*", "/") for _, token, _ in self._tokens) > MOST_OPERATIONS:
            raise Misuse(f"condition {text[:40]!r}...: there are more than {MOST_OPERATIONS} of + - * /")
        self._at = 0
        self._depth = 0

    def whole(self) -> Node:
        node = self._condition()
        if self._at < len(self._tokens):
            raise self._wrong("the end, 'and' or 'or'")
        return node

    def _peek(self) -> str:
        return self._tokens[self._at][1] if self._at < len(self._tokens) else ""

    def _accept(self, word: str) -> bool:
        if self._peek().lower() != word:
            return False
        self._at += 1
        return True

    def _wrong(self, expected: str) -> Misuse:
        if self._at == len(self._tokens):
            return Misuse(f"condition {self._text!r} ends too early: expected {expected}")
        _, found, column = self._tokens[self._at]
        return Misuse(f"condition {self._text!r}, column {column + 1}: found {found!r}, expected {expected}")

    def _condition(self) -> Node:
        parts = [self._conjunction()]
        while self._accept("or"):
            parts.append(self._conjunction())
        return parts[0] if len(parts) == 1 else Or(tuple(parts))

    def _conjunction(self) -> Node:
        parts = [self._negation()]
        while self._accept("and"):
            parts.append(self._negation())
        return parts[0] if len(parts) == 1 else And(tuple(parts))

    def _negation(self) -> Node:
        if self._peek().lower() == "not" or (self._peek() == "(" and self._is_condition()):
            with self._deeper():
                return self._nested()
        left = self._sum()
        if self._peek() in _COMPARE:
            sign = self._peek()
            self._at += 1
            return SignalComparison(left, sign, self._sum())
        if left != SignalName(next(left.names(), "")):
            raise self._wrong(f"one of {' '.join(_COMPARE)}")
        return SignalComparison(left, "!=", NumberLiteral(0.0))

    @contextmanager
    def _deeper(self) -> Generator[None]:
        self._depth += 1
        if self._depth > MOST_NESTED:
            raise Misuse(f"condition {self._text[:40]!r}...: 'not' and parentheses are nested more than {MOST_NESTED} deep")
        yield
        self._depth -= 1

    def _is_condition(self) -> bool:
        """Whether the parentheses that begin here have a condition in them, no sum."""
        depth = 0
        for _, text, _ in self._tokens[self._at :]:
            depth += (text == "(") - (text == ")")
            if depth == 0:
                return False
            if text in _COMPARE or text.lower() in _WORDS:
                return True
        return True

    def _nested(self) -> Node:
        if self._accept("not"):
            return Not(self._negation())
        self._accept("(")
        node = self._condition()
        self._close()
        return node

    def _close(self) -> None:
        if not self._accept(")"):
            raise self._wrong("')'")

    def _sum(self) -> Quantity:
        found = self._product()
        while self._peek() in ("+", "-"):
            sign = 1 if self._accept("+") else -1
            if sign < 0:
                self._accept("-")
            found = Sum(found, sign, self._product())
        return found

    def _product(self) -> Quantity:
        found = self._factor()
        while self._peek() in ("*", "/"):
            divides = not self._accept("*")
            if divides:
                self._accept("/")
            found = Product(found, self._factor(), divides)
        return found

    def _factor(self) -> Quantity:
        if self._accept("-"):
            with self._deeper():
                inner = self._factor()
            return inner.negative()
        if self._accept("("):
            with self._deeper():
                inner = self._sum()
            self._close()
            return inner
        if self._at == len(self._tokens):
            raise self._wrong("a signal or a number")
        kind, text, _ = self._tokens[self._at]
        if kind == "number":
            if float(text) > LARGEST:
                raise self._wrong(f"a number up to {LARGEST:g}")
            self._at += 1
            return NumberLiteral(float(text), self._unit())
        if kind != "name" or text.lower() in _WORDS:
            raise self._wrong("a signal or a number")
        self._at += 1
        if text.lower() == "abs" and self._accept("("):
            with self._deeper():
                inner = self._sum()
            self._close()
            return Absolute(inner)
        return SignalName(text)

    def _unit(self) -> str:
        """The unit after a number."""
        if self._peek() not in UNIT_NAMES:
            return ""
        self._at += 1
        return self._tokens[self._at - 1][1]


class _Crossing(NamedTuple):
    """The moment at which a signal crosses a level; computed again at ``until``."""

    version: object
    level: object
    due: Nanos | None
    until: Nanos


class SignalCondition:
    """A condition with its signals."""

    __slots__ = ("_brought", "_comparisons", "_crossings", "_signals", "_test", "text")

    def __init__(self, text: str, signals: Signals) -> None:
        """Raises `Misuse` for invalid text, for unknown signals, and for a number in a unit that its signals do not have."""
        self.text = text
        node = parse(text)
        self._signals = {name: signals(name) for name in names(node)}
        self._brought = tuple(self._signals.values())
        node = self._converted(node)
        self._test = self._compiled(node)
        self._comparisons = list(self._moving(node))
        self._crossings: list[_Crossing | None] = [None] * len(self._comparisons)
        """The crossings computed last."""

    def bring(self, now: Nanos) -> tuple[Any, ...]:
        """As `Signal.bring`, for all its signals. Must be called before `holds` and `due`."""
        if len(self._brought) == 1:
            return self._brought[0].bring(now)
        found: dict[Any, None] = {}
        for signal in self._brought:
            found.update(dict.fromkeys(signal.bring(now)))
        return tuple(found)

    def holds(self, now: Nanos) -> bool:
        return self._test(now)

    def _compiled(self, node: Node) -> Callable[[Nanos], bool]:
        """Conditions are evaluated far more often than made."""
        if isinstance(node, SignalComparison):
            compare, left, right = _COMPARE[node.sign], self._read(node.left), self._read(node.right)
            return lambda now: compare(left(now), right(now))
        if isinstance(node, Not):
            inner = self._compiled(node.inner)
            return lambda now: not inner(now)
        parts = tuple(map(self._compiled, node.parts))
        if isinstance(node, And):
            return lambda now: all(part(now) for part in parts)
        return lambda now: any(part(now) for part in parts)

    def _read(self, side: Quantity) -> Callable[[Nanos], float]:
        signals = self._signals
        if isinstance(side, SignalName):
            return signals[side.text].value
        return lambda now: side.value(lambda name: signals[name].value(now))

    def _converted(self, node: Node) -> Node:
        """With all numbers in the units of the signals that they are compared with."""
        if isinstance(node, Not):
            return Not(self._converted(node.inner))
        if not isinstance(node, SignalComparison):
            return type(node)(tuple(map(self._converted, node.parts)))
        units = [self._signals[name].unit for name in (*node.left.names(), *node.right.names())]
        unit = next((unit for unit in units if unit), "")
        try:
            return SignalComparison(node.left.in_unit(unit), node.sign, node.right.in_unit(unit))
        except Misuse as error:
            raise Misuse(f"condition {self.text!r}: {error}") from None

    def _moving(self, node: Node) -> Iterator[_Comparison]:
        """The comparisons with continuous signals."""
        if isinstance(node, Not):
            yield from self._moving(node.inner)
        elif not isinstance(node, SignalComparison):
            for part in node.parts:
                yield from self._moving(part)
        else:
            found = _Comparison.of(node, self._signals)
            if found.moving:
                yield found

    def due(self, now: Nanos) -> Nanos | None:
        """The next moment at which the condition may become true without an event; ``now`` if it is true; None if never."""
        return now if self.holds(now) else self.change(now)

    def change(self, now: Nanos) -> Nanos | None:
        """The next moment at which one of its comparisons may change without an event; None if never."""
        dues = [due for n in range(len(self._comparisons)) if (due := self._crossing(n, now)) is not None]
        return min(dues, default=None)

    def _crossing(self, n: int, now: Nanos) -> Nanos | None:
        """The moment at which a comparison changes; cached while the courses of its signals are unchanged."""
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
    def of(node: SignalComparison, signals: Mapping[str, Signal]) -> _Comparison:
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
    border = Border.of(level)
    begin = now
    for turn in signal.turns(now):
        found = _first_other(signal, border, begin, turn)
        if found is not None:
            return found
        begin = turn
    return _first_other(signal, border, begin, now + FARTHEST_NS)


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


def _first_other(signal: Signal, border: Border, begin: Nanos, end: Nanos) -> Nanos | None:
    side = border.side(signal.value(begin))
    if border.side(signal.value(end)) == side:
        return None
    low, high = begin, end
    while high - low > 1:
        middle = (low + high) // 2
        if border.side(signal.value(middle)) == side:
            low = middle
        else:
            high = middle
    return high
