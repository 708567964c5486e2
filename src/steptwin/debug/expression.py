"""Expressions of a person at a breakpoint: ``n + 1``, ``PosM1 > 50 and IN3 = ON``, ``other.OUT2 = 1``.

    or        = and { ("or" | "||") and }
    and       = not { ("and" | "&&") not }
    not       = "not" not | compare
    compare   = sum [ ("=" | "==" | "<>" | "!=" | "<" | "<=" | ">" | ">=") sum ]
    sum       = product { ("+" | "-") product }
    product   = unary { ("*" | "/" | "%") unary }
    unary     = "-" unary | number | name | "(" or ")"

Names are those of the program; with a dot in it, a signal of the world (`steptwin.world.signals`). What is compared gives 1 or 0.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from math import fmod, isfinite
from operator import add, eq, ge, gt, le, lt, mul, ne, sub
from sys import float_info
from typing import TypeAlias

from steptwin.errors import Misuse

MOST_NESTED = 64
LONGEST = 1000
"""Characters of an expression."""
EXACT = 1e15
"""Whole numbers below it are shown with all their digits."""

Names: TypeAlias = Callable[[str], float]
"""The value of a name. Raises `Misuse`."""
_Node: TypeAlias = Callable[[Names], float]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>\$?[A-Za-z_][\w]*(?:\.[\w&-]+(?:\[\d+\])?(?::\w+)*)*)"
    r"|(?P<sign>&&|\|\||[=!<>]=|<>|[-+*/%<>=()])|(?P<wrong>\S))"
)
_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "=": eq, "==": eq, "<>": ne, "!=": ne, "<": lt, "<=": le, ">": gt, ">=": ge,
}  # fmt: skip


class Expression:
    """A text that was read. ``names`` are those in it."""

    def __init__(self, text: str) -> None:
        """Raises `Misuse` with the place, what was found and what was expected."""
        parser = _Parser(text)
        self.text = text
        self._node = parser.whole()
        self.names = frozenset(parser.names)

    @property
    def is_local(self) -> bool:
        """Whether it speaks of the program and its controller alone."""
        return not any("." in name for name in self.names)

    def value(self, names: Names) -> float:
        """Raises `Misuse` for a name that means nothing, a division by zero, and a result that is too large."""
        return float(self._node(names))


class LogText:
    """A text with expressions in braces: ``n is {n}``."""

    def __init__(self, text: str) -> None:
        """Raises `Misuse` for what is no expression, and for a brace without its partner."""
        self._parts: list[str | Expression] = []
        for plain, inner, stray in re.findall(r"([^{}]+)|\{([^{}]*)\}|([{}])", text):
            if stray:
                raise Misuse(f"log {text!r}: a brace has no partner")
            self._parts.append(plain or Expression(inner))

    @property
    def names(self) -> frozenset[str]:
        return frozenset().union(*(part.names for part in self._expressions()))

    def _expressions(self) -> Iterator[Expression]:
        return (part for part in self._parts if isinstance(part, Expression))

    def shown(self, names: Names) -> str:
        return "".join(part if isinstance(part, str) else number_text(part.value(names)) for part in self._parts)


class HitCount:
    """Which of the hits count: ``5`` and ``= 5`` the fifth, ``> 5``, ``>= 5``, ``< 5``, ``<= 5``, ``% 5`` every fifth."""

    def __init__(self, text: str) -> None:
        """Raises `Misuse`."""
        match = re.fullmatch(r"\s*(%|[=<>]=?)?\s*([1-9]\d{0,8})\s*", text)
        if match is None:
            raise Misuse(f"hit count {text!r}: expected a number from 1 on, after nothing, or one of = < <= > >= %")
        self._sign, self._number = match[1] or "=", int(match[2])

    def counts(self, hit: int) -> bool:
        """Whether hit ``hit``, from 1, is one of them."""
        return hit % self._number == 0 if self._sign == "%" else _COMPARE[self._sign](hit, self._number)


def number_text(value: float) -> str:
    """A number for people."""
    return str(int(value)) if abs(value) < EXACT and value == int(value) else f"{value:.9g}"


class _Parser:
    def __init__(self, text: str) -> None:
        if len(text) > LONGEST:
            raise Misuse(f"expression {text[:40]!r}... has {len(text)} characters: permitted are {LONGEST}")
        self._text = text
        self._tokens = [(m.lastgroup or "", m[m.lastgroup or 0], m.start(m.lastgroup or 0)) for m in _TOKEN.finditer(text)]
        self._at = 0
        self._depth = 0
        self.names: set[str] = set()

    def whole(self) -> _Node:
        node = self._or()
        if self._at < len(self._tokens):
            raise self._wrong("the end or an operator")
        return node

    def _peek(self) -> str:
        return self._tokens[self._at][1].lower() if self._at < len(self._tokens) else ""

    def _accept(self, *words: str) -> str:
        found = self._peek()
        if found not in words or not found:
            return ""
        self._at += 1
        return found

    def _wrong(self, expected: str) -> Misuse:
        if self._at >= len(self._tokens):
            return Misuse(f"expression {self._text!r} ends too early: expected {expected}")
        _, found, column = self._tokens[self._at]
        return Misuse(f"expression {self._text!r}, column {column + 1}: found {found!r}, expected {expected}")

    def _or(self) -> _Node:
        left = self._and()
        while self._accept("or", "||"):
            left = _either(left, self._and())
        return left

    def _and(self) -> _Node:
        left = self._not()
        while self._accept("and", "&&"):
            left = _both(left, self._not())
        return left

    def _not(self) -> _Node:
        if not self._accept("not"):
            return self._compare()
        self._enter()
        inner = self._not()
        self._depth -= 1
        return lambda names: float(not inner(names))

    def _enter(self) -> None:
        self._depth += 1
        if self._depth > MOST_NESTED:
            raise Misuse(f"expression {self._text[:40]!r}... is nested more than {MOST_NESTED} deep")

    def _compare(self) -> _Node:
        left = self._sum()
        sign = self._accept(*_COMPARE)
        return _applied(_COMPARE[sign], left, self._sum()) if sign else left

    def _sum(self) -> _Node:
        left = self._product()
        while sign := self._accept("+", "-"):
            left = _applied(add if sign == "+" else sub, left, self._product())
        return left

    def _product(self) -> _Node:
        left = self._unary()
        while sign := self._accept("*", "/", "%"):
            left = _applied(mul if sign == "*" else _quotient if sign == "/" else _remainder, left, self._unary())
        return left

    def _unary(self) -> _Node:
        if self._accept("-"):
            self._enter()
            inner = self._unary()
            self._depth -= 1
            return lambda names: -inner(names)
        if self._accept("("):
            self._enter()
            inner = self._or()
            self._depth -= 1
            if not self._accept(")"):
                raise self._wrong("')'")
            return inner
        kind, text, _ = self._tokens[self._at] if self._at < len(self._tokens) else ("", "", 0)
        if kind == "number":
            self._at += 1
            number = _finite(float(text), text)
            return lambda names: number
        if kind == "name" and text.lower() not in ("and", "or", "not"):
            self._at += 1
            self.names.add(text)
            return lambda names: names(text)
        raise self._wrong("a name or a number")


def _applied(operation: Callable[[float, float], float], left: _Node, right: _Node) -> _Node:
    return lambda names: _finite(float(operation(left(names), right(names))), "a result")


def _finite(value: float, what: str) -> float:
    """Raises `Misuse` for infinity, with which nothing can be calculated, set or sent."""
    if not isfinite(value):
        raise Misuse(f"{what} is too large: permitted are numbers up to {float_info.max:.3g}")
    return value


def _either(left: _Node, right: _Node) -> _Node:
    return lambda names: float(bool(left(names)) or bool(right(names)))


def _both(left: _Node, right: _Node) -> _Node:
    return lambda names: float(bool(left(names)) and bool(right(names)))


def _quotient(left: float, right: float) -> float:
    if not right:
        raise Misuse("division by zero")
    return left / right


def _remainder(left: float, right: float) -> float:
    if not right:
        raise Misuse("remainder of a division by zero")
    return fmod(left, right)
