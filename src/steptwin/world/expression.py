"""Conditions over signals: ``table.IN3 and not x.position > 100``. Parsed, never evaluated as code.

    condition   = conjunction { "or" conjunction }
    conjunction = negation { "and" negation }
    negation    = "not" negation | "(" condition ")" | comparison
    comparison  = operand [ ( "==" | "!=" | "<" | "<=" | ">" | ">=" ) operand ]
    operand     = number | signal

A signal alone is true if it is not 0. Names of signals, such as ``table.M1.position``, ``table.hr:10020`` and
``table.USER_REGISTER[12]:real``, are resolved by `Signals`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from operator import eq, ge, gt, le, lt, ne
from typing import Any, NamedTuple, Protocol, TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.points import FARTHEST_NS

MOST_NESTED = 64
"""Limit of nesting, because the parser is recursive."""

_COMPARE: dict[str, Callable[[float, float], bool]] = {"==": eq, "!=": ne, "<=": le, ">=": ge, "<": lt, ">": gt}
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_][\w&-]*(?:\.[\w&-]+(?:\[\d+\])?(?::\w+)*)*)|(?P<sign>[=!<>]=|[<>()-])|(?P<wrong>\S))"
)


class Signal(Protocol):
    """A quantity of a world. ``continuous``: it also changes between events."""

    @property
    def continuous(self) -> bool: ...
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
class NumberLiteral:
    value: float


@dataclass(frozen=True, slots=True)
class SignalName:
    text: str


@dataclass(frozen=True, slots=True)
class SignalComparison:
    left: NumberLiteral | SignalName
    sign: str
    right: NumberLiteral | SignalName


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
        yield from (side.text for side in (node.left, node.right) if isinstance(side, SignalName))
    elif isinstance(node, Not):
        yield from names(node.inner)
    else:
        for part in node.parts:
            yield from names(part)


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [(m.lastgroup or "", m[m.lastgroup or 0], m.start(m.lastgroup or 0)) for m in _TOKEN.finditer(text)]
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
        if self._peek().lower() in ("not", "("):
            self._depth += 1
            if self._depth > MOST_NESTED:
                raise Misuse(f"condition {self._text[:40]!r}...: 'not' and parentheses are nested more than {MOST_NESTED} deep")
            node = self._nested()
            self._depth -= 1
            return node
        left = self._operand()
        if self._peek() in _COMPARE:
            sign = self._peek()
            self._at += 1
            return SignalComparison(left, sign, self._operand())
        if isinstance(left, NumberLiteral):
            raise self._wrong(f"one of {' '.join(_COMPARE)}")
        return SignalComparison(left, "!=", NumberLiteral(0.0))

    def _nested(self) -> Node:
        if self._accept("not"):
            return Not(self._negation())
        self._accept("(")
        node = self._condition()
        if not self._accept(")"):
            raise self._wrong("')'")
        return node

    def _operand(self) -> NumberLiteral | SignalName:
        minus = self._accept("-")
        if self._at < len(self._tokens):
            kind, text, _ = self._tokens[self._at]
            if kind == "number":
                self._at += 1
                return NumberLiteral(-float(text) if minus else float(text))
            if kind == "name" and not minus and text.lower() not in ("and", "or", "not"):
                self._at += 1
                return SignalName(text)
        raise self._wrong("a number" if minus else "a signal or a number")


class _Crossing(NamedTuple):
    """The moment at which a signal crosses a level; computed again at ``until``."""

    version: object
    level: float
    due: Nanos | None
    until: Nanos


class SignalCondition:
    """A condition with its signals."""

    __slots__ = ("_comparisons", "_crossings", "_node", "_signals", "text")

    def __init__(self, text: str, signals: Signals) -> None:
        """Raises `Misuse` for invalid text, and for a comparison of two continuous signals."""
        self.text = text
        self._node = parse(text)
        self._signals = {name: signals(name) for name in names(self._node)}
        self._comparisons = list(self._moving(self._node))
        self._crossings: list[_Crossing | None] = [None] * len(self._comparisons)
        """The crossings computed last."""

    def bring(self, now: Nanos) -> tuple[Any, ...]:
        """As `Signal.bring`, for all its signals. Must be called before `holds` and `due`."""
        found: dict[Any, None] = {}
        for signal in self._signals.values():
            found.update(dict.fromkeys(signal.bring(now)))
        return tuple(found)

    def holds(self, now: Nanos) -> bool:
        return self._holds(self._node, now)

    def _holds(self, node: Node, now: Nanos) -> bool:
        if isinstance(node, SignalComparison):
            return _COMPARE[node.sign](self._value(node.left, now), self._value(node.right, now))
        if isinstance(node, Not):
            return not self._holds(node.inner, now)
        if isinstance(node, And):
            return all(self._holds(part, now) for part in node.parts)
        return any(self._holds(part, now) for part in node.parts)

    def _value(self, side: NumberLiteral | SignalName, now: Nanos) -> float:
        return side.value if isinstance(side, NumberLiteral) else self._signals[side.text].value(now)

    def _moving(self, node: Node) -> Iterator[tuple[Signal, NumberLiteral | SignalName]]:
        """The comparisons with a continuous signal: that signal, and the other operand."""
        if isinstance(node, Not):
            yield from self._moving(node.inner)
        elif not isinstance(node, SignalComparison):
            for part in node.parts:
                yield from self._moving(part)
        else:
            moving = [
                side for side in (node.left, node.right) if isinstance(side, SignalName) and self._signals[side.text].continuous
            ]
            if len(moving) > 1:
                raise Misuse(f"condition {self.text!r}: {moving[0].text} and {moving[1].text} both move: compare with a number")
            if moving:
                yield self._signals[moving[0].text], node.right if moving[0] is node.left else node.left

    def due(self, now: Nanos) -> Nanos | None:
        """The next moment at which the condition may become true without an event; ``now`` if it is true; None if never."""
        if self.holds(now):
            return now
        dues = [due for n in range(len(self._comparisons)) if (due := self._crossing(n, now)) is not None]
        return min(dues, default=None)

    def _crossing(self, n: int, now: Nanos) -> Nanos | None:
        """The moment at which a comparison changes; cached while the course of its signal is unchanged."""
        signal, side = self._comparisons[n]
        version, level, known = signal.version(), self._value(side, now), self._crossings[n]
        if known is not None and version is not None and known[:2] == (version, level) and now < known.until:
            return known.due
        due = crossing(signal, level, now)
        self._crossings[n] = _Crossing(version, level, due, now + FARTHEST_NS // 2 if due is None else due)
        return due


def crossing(signal: Signal, level: float | Fraction, now: Nanos) -> Nanos | None:
    """First whole nanosecond after ``now`` at which the signal is on another side of ``level`` (below, at, above)."""
    begin = now
    for turn in signal.turns(now):
        found = _first_other(signal, level, begin, turn)
        if found is not None:
            return found
        begin = turn
    return _first_other(signal, level, begin, now + FARTHEST_NS)


def _side(value: float, level: float | Fraction) -> int:
    return (value > level) - (value < level)


def _first_other(signal: Signal, level: float | Fraction, begin: Nanos, end: Nanos) -> Nanos | None:
    side = _side(signal.value(begin), level)
    if _side(signal.value(end), level) == side:
        return None
    low, high = begin, end
    while high - low > 1:
        middle = (low + high) // 2
        if _side(signal.value(middle), level) == side:
            low = middle
        else:
            high = middle
    return high
