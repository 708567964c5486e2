"""Properties as text: conditions of worlds with words of time.

    formula = until [ "implies" formula ]
    until   = either [ "until" [ "within" TIME ] either | "for" TIME ]
    either  = both { "or" both }
    both    = one { "and" one }
    one     = "not" one
            | "always" formula | "never" formula | "eventually" [ "within" TIME ] formula | "within" TIME formula
            | "at" TIME formula
            | "after" either ( "within" | "at" ) TIME formula
            | "count" "(" formula ")" SIGN number
            | "time" "between" either "and" either SIGN TIME
            | comparison

Comparisons are those of conditions (`steptwin.simulation.logic.expression`), so ``and`` and ``or`` between them are, too. A word
of time reaches as far as it can. In ``time between A and B``, A and B with ``and`` or ``or`` need parentheses.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from steptwin.campaign.properties.tree import (
    Atom,
    Becoming,
    Combination,
    CycleTime,
    Delayed,
    Holding,
    Lasting,
    PropertyFormula,
    Tally,
)
from steptwin.controller import Nanos
from steptwin.durations import UNITS, duration
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.logic.expression import Comparison, ConditionParser
from steptwin.simulation.logic.quantities import NumberLiteral, Quantity

WORDS = (
    "always",
    "never",
    "eventually",
    "within",
    "at",
    "after",
    "until",
    "for",
    "count",
    "time",
    "between",
    "implies",
    "and",
    "or",
    "not",
)
SIGNALS = ("time", "idle")
"""Signals whose names have no dot."""
SIGNS = ("==", "!=", "<=", ">=", "<", ">")
_BESIDE = (*SIGNS, "+", "-", "*", "/", "%")
_FORMULAS = (Atom, Combination, Lasting, Delayed, Holding, Becoming, Tally, CycleTime)


@lru_cache(maxsize=512)
def parse_property(text: str) -> PropertyFormula:
    """Raises `Misuse` with the column, what is there and what is expected."""
    return _PropertyParser(text).formula()


PROPERTY = Message("campaign.property", "property {text!r}")


class _PropertyParser(ConditionParser):
    def __init__(self, text: str) -> None:
        super().__init__(text, PROPERTY)

    def formula(self) -> PropertyFormula:
        found = self._formula(self._implied())
        if self._at < len(self._tokens):
            raise self._wrong("the end, 'and', 'or', 'implies' or 'until'")
        return found

    # ------------------------------------------------------------------ operands

    def _formula(self, node: Quantity | PropertyFormula) -> PropertyFormula:
        """The operand that ends here, as a formula."""
        if isinstance(node, _FORMULAS):
            return node
        found = self._truth(node)
        if not isinstance(found, Comparison):
            raise self._wrong("a comparison")
        return Atom(found)

    def _or(self) -> Quantity:
        return self._implied()  # type: ignore[return-value]

    def _enclosed(self, inner: Callable[[], Quantity]) -> Quantity:
        before = self._tokens[self._at - 2][1] if self._at > 1 else ""
        found = super()._enclosed(inner)
        if isinstance(found, _FORMULAS) and (before in _BESIDE or self._peek() in _BESIDE):
            raise self._wrong("'and', 'or', 'implies', 'until' or the end: what is in the parentheses is true or false")
        return found

    def _factor(self) -> Quantity:
        kind, text, column = self._tokens[self._at] if self._at < len(self._tokens) else ("", "", 0)
        if kind == "name" and "." not in text and text.lower() not in (*SIGNALS, "abs"):
            if text.lower() in WORDS:
                raise self._wrong(self._operand)
            hint = NearMiss().hint(text, (*WORDS, *SIGNALS))
            raise Misuse(f"{self._shown}, column {column + 1}: no word or signal {text!r}{hint}; a signal is OWNER.NAME")
        return super()._factor()

    # ------------------------------------------------------------------ grammar

    def _implied(self) -> Quantity | PropertyFormula:
        left = self._lasting()
        if not self._accept("implies"):
            return left
        self._enter()
        condition, then = self._formula(left), self._formula(self._implied())
        self._depth -= 1
        return Combination("or", (condition.negated(), then))

    def _lasting(self) -> Quantity | PropertyFormula:
        left = self._either()
        if self._accept("for"):
            return Lasting("always", self._time(), self._formula(left))
        if not self._accept("until"):
            return left
        within = self._time() if self._accept("within") else None
        first, then = self._formula(left), self._formula(self._either())
        held = Holding(first, then)
        return held if within is None else Combination("and", (held, Lasting("eventually", within, then)))

    def _either(self) -> Quantity | PropertyFormula:
        return self._combined("or", self._both)

    def _both(self) -> Quantity | PropertyFormula:
        return self._combined("and", self._one)

    def _combined(self, word: str, operand: Callable[[], Quantity | PropertyFormula]) -> Quantity | PropertyFormula:
        first = operand()
        if self._peek().lower() != word:
            return first
        parts = [self._formula(first)]
        while self._accept(word):
            parts.append(self._formula(operand()))
        return Combination(word, tuple(parts))

    def _one(self) -> Quantity | PropertyFormula:
        self._enter()
        found = self._temporal()
        self._depth -= 1
        return found

    def _temporal(self) -> Quantity | PropertyFormula:
        match self._peek().lower():
            case "not":
                self._at += 1
                return self._formula(self._one()).negated()
            case "always":
                self._at += 1
                return Lasting("always", None, self._formula(self._implied()))
            case "never":
                self._at += 1
                return Lasting("always", None, self._formula(self._implied()).negated())
            case "eventually":
                self._at += 1
                within = self._time() if self._accept("within") else None
                return Lasting("eventually", within, self._formula(self._implied()))
            case "within" | "at" as word:
                self._at += 1
                return self._timed(word, self._time())
            case "after":
                self._at += 1
                return self._response()
            case "count" if self._follows("("):
                self._at += 2
                inner = self._formula(super()._enclosed(self._or))
                sign = self._sign()
                return Tally(inner, sign, self._number())
            case "time" if self._follows("between"):
                self._at += 2
                return self._cycle()
        return self._compare()

    def _timed(self, word: str, length: Nanos) -> PropertyFormula:
        inner = self._formula(self._implied())
        return Lasting("eventually", length, inner) if word == "within" else Delayed(length, inner)

    def _response(self) -> PropertyFormula:
        trigger = self._formula(self._either())
        word = self._accept("within", "at")
        if not word:
            raise self._wrong("'within' or 'at' with a time")
        then = self._timed(word, self._time())
        return Lasting("always", None, Combination("or", (Becoming(trigger, never=True), then)))

    def _cycle(self) -> PropertyFormula:
        begin = self._formula(self._one())
        if not self._accept("and"):
            raise self._wrong("'and' with what ends it")
        end = self._formula(self._one_before_time())
        sign = self._sign()
        return CycleTime(begin, end, sign, self._time())

    def _one_before_time(self) -> Quantity | PropertyFormula:
        """Read the end of a cycle: its own sign, if it has one, is followed by another."""
        if self._accept("not"):
            return self._formula(self._one_before_time()).negated()
        return self._enclosed_first() if self._peek() == "(" else self._compare_once()

    def _enclosed_first(self) -> Quantity | PropertyFormula:
        self._at += 1
        return super()._enclosed(self._or)

    def _compare_once(self) -> Quantity | PropertyFormula:
        left = self._sum()
        begin = self._at
        sign = self._accept(*SIGNS)
        if not sign:
            return left
        right = self._sum()
        if self._peek() in SIGNS:
            return Comparison(left, sign, right)
        self._at = begin
        return left

    # ------------------------------------------------------------------ numbers

    def _follows(self, token: str) -> bool:
        return self._at + 1 < len(self._tokens) and self._tokens[self._at + 1][1].lower() == token

    def _sign(self) -> str:
        sign = self._accept(*SIGNS)
        if not sign:
            raise self._wrong(f"one of {' '.join(SIGNS)}")
        return sign

    def _number(self) -> float:
        found = self._sum()
        if not isinstance(found, NumberLiteral) or found.unit:
            raise self._wrong("a number without a unit")
        return found.number

    def _time(self) -> Nanos:
        """ns of a time with its unit."""
        if self._at == len(self._tokens) or self._tokens[self._at][0] != "number":
            raise self._wrong("a time, such as 200 ms")
        number = self._tokens[self._at][1]
        self._at += 1
        unit = self._peek()
        if unit != "ns" and unit not in UNITS:
            raise self._wrong(f"a unit of time: {', '.join(UNITS)} or ns")
        self._at += 1
        if unit == "ns":
            return round(float(number))
        try:
            return duration(f"{number} {unit}")
        except Misuse as error:
            raise Misuse(f"{self._shown}: {error}") from None
