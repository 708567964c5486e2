"""Expressions over names: ``table.IN3 and not x.position > 3 cm``, ``n % 4 + 1``. Parsed, never evaluated as code.

    or      = and { ( "or" | "||" ) and }
    and     = not { ( "and" | "&&" ) not }
    not     = "not" not | compare
    compare = sum [ ( "==" | "=" | "!=" | "<>" | "<" | "<=" | ">" | ">=" ) sum ]
    sum     = product { ( "+" | "-" ) product }
    product = factor { ( "*" | "/" | "%" ) factor }
    factor  = number [ unit ] | name | "-" factor | "abs" "(" sum ")" | "(" or ")"

A name with a dot may have a hyphen in it, so a minus beside one needs a space. What is true has the value 1, otherwise 0. A name
alone is true if it is not 0. In a condition, other numbers must be compared with something.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from operator import eq, ge, gt, le, lt, ne
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.logic.quantities import (
    LARGEST,
    UNIT_NAMES,
    Absolute,
    NumberLiteral,
    Product,
    Quantity,
    Range,
    Remainder,
    SignalName,
    Sum,
    UnitOf,
    negative,
    sides,
    unit_of_all,
)

MOST_NESTED = 64
"""Limit of nesting, because the parser is recursive."""
MOST_OPERATIONS = 200
"""Limit of the signs + - * / % of an expression, because they are evaluated recursively."""
LONGEST = 20_000
"""Limit of the characters of an expression."""
REMEMBERED = 512
"""Conditions whose parts are remembered by their text, since worlds of one description have the same."""

COMPARE: Mapping[str, Callable[[float, float], bool]] = {"==": eq, "!=": ne, "<=": le, ">=": ge, "<": lt, ">": gt}
_OTHER_SIGNS: Mapping[str, str] = {"=": "==", "<>": "!=", "&&": "and", "||": "or"}
_WORDS = ("and", "or", "not")
_OPERATIONS = ("+", "-", "*", "/", "%")
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_][\w-]*(?:\.\$?(?:[\w-]|&(?!&))+(?:\[\d+\])?(?::\w+)*)+|\$?[A-Za-z_]\w*)"
    r"|(?P<sign>&&|\|\||[=!<>]=|<>|[-+*/%<>=()])|(?P<wrong>\S))"
)

ReadAt: TypeAlias = Callable[[Nanos], float]
"""The value of a name at a moment."""


@dataclass(frozen=True, slots=True)
class Comparison:
    left: Quantity
    sign: str
    right: Quantity

    def names(self) -> Iterator[str]:
        yield from self.left.names()
        yield from self.right.names()

    def value(self, values: Callable[[str], float]) -> float:
        return float(COMPARE[self.sign](self.left.value(values), self.right.value(values)))

    def range(self, ranges: Callable[[str], Range]) -> Range:
        touched = sides(*Sum(self.left, -1, self.right).range(ranges))
        truths = {COMPARE[self.sign](side, 0) for side in touched}
        return float(min(truths)), float(max(truths))

    def in_unit(self, unit: str, unit_of: UnitOf) -> Comparison:
        own = unit_of_all(self, unit_of)
        return Comparison(self.left.in_unit(own, unit_of), self.sign, self.right.in_unit(own, unit_of))


@dataclass(frozen=True, slots=True)
class Not:
    inner: Truth

    def names(self) -> Iterator[str]:
        yield from self.inner.names()

    def value(self, values: Callable[[str], float]) -> float:
        return 1.0 - self.inner.value(values)

    def range(self, ranges: Callable[[str], Range]) -> Range:
        low, high = self.inner.range(ranges)
        return 1.0 - high, 1.0 - low

    def in_unit(self, unit: str, unit_of: UnitOf) -> Not:
        return Not(self.inner.in_unit(unit, unit_of))


@dataclass(frozen=True, slots=True)
class Junction:
    """Several conditions joined by ``and``, or by ``or``."""

    word: str
    parts: tuple[Truth, ...]

    def names(self) -> Iterator[str]:
        for part in self.parts:
            yield from part.names()

    def value(self, values: Callable[[str], float]) -> float:
        joined = all if self.word == "and" else any
        return float(joined(part.value(values) for part in self.parts))

    def range(self, ranges: Callable[[str], Range]) -> Range:
        most = min if self.word == "and" else max
        lows, highs = zip(*(part.range(ranges) for part in self.parts), strict=True)
        return most(lows), most(highs)

    def in_unit(self, unit: str, unit_of: UnitOf) -> Junction:
        return Junction(self.word, tuple(part.in_unit(unit, unit_of) for part in self.parts))


Truth: TypeAlias = Comparison | Not | Junction


@lru_cache(maxsize=REMEMBERED)
def parse_condition(text: str) -> Truth:
    """Parse what is true or false. Raises `Misuse` with the column, the found and the expected token."""
    return ConditionParser(text, CONDITION).condition()


def parse_expression(text: str) -> Quantity:
    """Parse what has a value; a number counts as true if it is not 0. Raises `Misuse` as `parse_condition`."""
    return ConditionParser(text, EXPRESSION).whole()


def comparisons(node: Truth) -> Iterator[Comparison]:
    """The comparisons on which a condition depends."""
    if isinstance(node, Comparison):
        yield node
    elif isinstance(node, Not):
        yield from comparisons(node.inner)
    else:
        for part in node.parts:
            yield from comparisons(part)


def deciding(node: Truth, values: Callable[[str], float], *, wanted: bool) -> Iterator[Comparison]:
    """The comparisons because of which a condition is not as ``wanted``: each would have to be another one, or with ``or`` one of
    them."""
    if isinstance(node, Comparison):
        yield node
    elif isinstance(node, Not):
        yield from deciding(node.inner, values, wanted=not wanted)
    else:
        for part in node.parts:
            if bool(part.value(values)) is not wanted:
                yield from deciding(part, values, wanted=wanted)


def truth_of(node: Truth, reads: Mapping[str, ReadAt], check: Callable[[float], float] | None = None) -> Callable[[Nanos], bool]:
    """Whether a condition holds at a moment, as a function, because conditions are evaluated far more often than made.

    ``reads``: the values of its names. ``check`` is applied to each calculated number before it is compared.
    """
    if isinstance(node, Comparison):
        compare, left, right = COMPARE[node.sign], value_of(node.left, reads, check), value_of(node.right, reads, check)
        return lambda now: compare(left(now), right(now))
    if isinstance(node, Not):
        inner = truth_of(node.inner, reads, check)
        return lambda now: not inner(now)
    parts = tuple(truth_of(part, reads, check) for part in node.parts)
    if node.word == "and":
        return lambda now: all(part(now) for part in parts)
    return lambda now: any(part(now) for part in parts)


def value_of(node: Quantity, reads: Mapping[str, ReadAt], check: Callable[[float], float] | None = None) -> ReadAt:
    """The value of an expression at a moment, as `truth_of`."""
    match node:
        case SignalName(name):
            return reads[name]
        case NumberLiteral(number):
            return lambda now: number
        case Comparison() | Not() | Junction():
            holds = truth_of(node, reads, check)
            return lambda now: float(holds(now))
    if check is not None:
        return lambda now: check(node.value(lambda name: reads[name](now)))
    return lambda now: node.value(lambda name: reads[name](now))


CONDITION = Message("simulation.condition", "condition {text!r}")
EXPRESSION = Message("simulation.expression", "expression {text!r}")
BEGINS = Message("simulation.begins", "{text}...")
TEXT_IS_TOO_LONG = Message("simulation.text-is-too-long", "{start} has {count} characters: permitted are {most}")
TOO_MANY_OPERATIONS = Message("simulation.too-many-operations", "{start}: there are more than {most} of + - * / %")
NESTED_TOO_DEEP = Message("simulation.nested-too-deep", "{start}: 'not' and parentheses are nested more than {most} deep")
ENDS_TOO_EARLY = Message("simulation.ends-too-early", "{shown} ends too early: expected {expected}")
FOUND_SOMETHING_ELSE = Message(
    "simulation.found-something-else", "{shown}, column {column}: found {found!r}, expected {expected}"
)
SIGNAL_OR_NUMBER = Message("simulation.signal-or-number", "a signal or a number")
NAME_OR_NUMBER = Message("simulation.name-or-number", "a name or a number")
END_AND_OR = Message("simulation.end-and-or", "the end, 'and' or 'or'")
END_OR_OPERATOR = Message("simulation.end-or-operator", "the end or an operator")
ONE_OF = Message("simulation.one-of-signs", "one of {signs}")
NUMBER_UP_TO = Message("simulation.number-up-to", "a number up to {most:g}")


class ConditionParser:
    """``kind``: `EXPRESSION`; or `CONDITION`, in which numbers must be compared."""

    def __init__(self, text: str, kind: Message) -> None:
        self._shown = kind(text=text)
        self._start = BEGINS(text=kind(text=text[:40]))
        self._must_compare = kind is not EXPRESSION
        self._operand = SIGNAL_OR_NUMBER() if self._must_compare else NAME_OR_NUMBER()
        if len(text) > LONGEST:
            raise Misuse(TEXT_IS_TOO_LONG(start=self._start, count=len(text), most=LONGEST))
        self._tokens = list(self._tokens_of(text.rstrip()))
        self._words = [*(_OTHER_SIGNS.get(found, found.lower()) for _, found, _ in self._tokens), ""]
        """The tokens as words and signs are compared; empty after the last."""
        self._at = 0
        self._depth = 0

    def _tokens_of(self, text: str) -> Iterator[tuple[str, str, int]]:
        """Kind, text and place of each. ``text`` must not end with spaces, and operations are counted at once: otherwise the time
        grows with the square of the length, of spaces without a token or of hyphens that might be in a name."""
        operations = 0
        for match in _TOKEN.finditer(text):
            kind = match.lastgroup or ""
            operations += match[kind] in _OPERATIONS
            if operations > MOST_OPERATIONS:
                raise Misuse(TOO_MANY_OPERATIONS(start=self._start, most=MOST_OPERATIONS))
            yield kind, match[kind], match.start(kind)

    def condition(self) -> Truth:
        node = self._truth(self._or())
        self._end()
        return node

    def whole(self) -> Quantity:
        node = self._or()
        self._end()
        return node

    def _end(self) -> None:
        if self._at < len(self._tokens):
            raise self._wrong(END_AND_OR() if self._must_compare else END_OR_OPERATOR())

    def _peek(self) -> str:
        if self._at == len(self._tokens):
            return ""
        text = self._tokens[self._at][1]
        return _OTHER_SIGNS.get(text, text)

    def _accept(self, *words: str) -> str:
        """The next token if it is one of these, otherwise an empty text."""
        found = self._words[self._at]
        if found not in words:
            return ""
        self._at += 1
        return found

    def _wrong(self, expected: str) -> Misuse:
        if self._at == len(self._tokens):
            return Misuse(ENDS_TOO_EARLY(shown=self._shown, expected=expected))
        _, found, column = self._tokens[self._at]
        return Misuse(FOUND_SOMETHING_ELSE(shown=self._shown, column=column + 1, found=found, expected=expected))

    def _enter(self) -> None:
        self._depth += 1
        if self._depth > MOST_NESTED:
            raise Misuse(NESTED_TOO_DEEP(start=self._start, most=MOST_NESTED))

    def _truth(self, node: Quantity) -> Truth:
        """The operand that ends here, as a condition."""
        if isinstance(node, Comparison | Not | Junction):
            return node
        if self._must_compare and not isinstance(node, SignalName):
            raise self._wrong(ONE_OF(signs=" ".join(COMPARE)))
        return Comparison(node, "!=", NumberLiteral(0.0))

    def _or(self) -> Quantity:
        return self._joined("or", self._and)

    def _and(self) -> Quantity:
        return self._joined("and", self._not)

    def _joined(self, word: str, operand: Callable[[], Quantity]) -> Quantity:
        first = operand()
        if self._words[self._at] != word:
            return first
        parts = [self._truth(first)]
        while self._accept(word):
            parts.append(self._truth(operand()))
        return Junction(word, tuple(parts))

    def _not(self) -> Quantity:
        if not self._accept("not"):
            return self._compare()
        self._enter()
        inner = self._truth(self._not())
        self._depth -= 1
        return Not(inner)

    def _compare(self) -> Quantity:
        left = self._sum()
        sign = self._accept(*COMPARE)
        return Comparison(left, sign, self._sum()) if sign else left

    def _sum(self) -> Quantity:
        found = self._product()
        while sign := self._accept("+", "-"):
            found = Sum(found, 1 if sign == "+" else -1, self._product())
        return found

    def _product(self) -> Quantity:
        found = self._factor()
        while sign := self._accept("*", "/", "%"):
            right = self._factor()
            found = Remainder(found, right) if sign == "%" else Product(found, right, sign == "/")
        return found

    def _factor(self) -> Quantity:
        if self._accept("-"):
            self._enter()
            inner = self._factor()
            self._depth -= 1
            return negative(inner)
        if self._accept("("):
            return self._enclosed(self._or)
        kind, text, _ = self._tokens[self._at] if self._at < len(self._tokens) else ("", "", 0)
        if kind == "number":
            if float(text) > LARGEST:
                raise self._wrong(NUMBER_UP_TO(most=LARGEST))
            self._at += 1
            return NumberLiteral(float(text), self._unit())
        if kind != "name" or text.lower() in _WORDS:
            raise self._wrong(self._operand)
        self._at += 1
        if text.lower() == "abs" and self._accept("("):
            return Absolute(self._enclosed(self._sum))
        return SignalName(text)

    def _enclosed(self, inner: Callable[[], Quantity]) -> Quantity:
        """Quantity between parentheses, the first of which was read."""
        self._enter()
        node = inner()
        self._depth -= 1
        if not self._accept(")"):
            raise self._wrong("')'")
        return node

    def _unit(self) -> str:
        """The unit after a number."""
        if self._peek() not in UNIT_NAMES:
            return ""
        self._at += 1
        return self._tokens[self._at - 1][1]
