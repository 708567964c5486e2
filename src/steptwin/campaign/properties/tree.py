"""A property as a tree: what its text says, before it is known of which world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.simulation.logic.expression import Comparison

OPPOSITE = {"==": "!=", "!=": "==", "<": ">=", ">=": "<", ">": "<=", "<=": ">"}


@dataclass(frozen=True, slots=True)
class Atom:
    """A comparison, true or false at each moment."""

    comparison: Comparison

    def negated(self) -> Atom:
        return Atom(replace(self.comparison, sign=OPPOSITE[self.comparison.sign]))

    def parts(self) -> tuple[PropertyFormula, ...]:
        return ()


@dataclass(frozen=True, slots=True)
class Combination:
    """Joined by ``and``, or by ``or``."""

    word: str
    inner: tuple[PropertyFormula, ...]

    def negated(self) -> Combination:
        return Combination("or" if self.word == "and" else "and", tuple(one.negated() for one in self.inner))

    def parts(self) -> tuple[PropertyFormula, ...]:
        return self.inner


@dataclass(frozen=True, slots=True)
class Lasting:
    """``always`` or ``eventually`` from each moment on, for ``length`` ns or to the end of the run."""

    word: str
    length: Nanos | None
    inner: PropertyFormula

    def negated(self) -> Lasting:
        return Lasting("eventually" if self.word == "always" else "always", self.length, self.inner.negated())

    def parts(self) -> tuple[PropertyFormula, ...]:
        return (self.inner,)


@dataclass(frozen=True, slots=True)
class Delayed:
    """``inner`` at the moment ``length`` ns after each moment."""

    length: Nanos
    inner: PropertyFormula

    def negated(self) -> Delayed:
        return Delayed(self.length, self.inner.negated())

    def parts(self) -> tuple[PropertyFormula, ...]:
        return (self.inner,)


@dataclass(frozen=True, slots=True)
class Holding:
    """``first`` at every moment before ``then``, which must come; ``released``: ``then`` up to and with ``first``, or always."""

    first: PropertyFormula
    then: PropertyFormula
    released: bool = False

    def negated(self) -> Holding:
        return Holding(self.first.negated(), self.then.negated(), not self.released)

    def parts(self) -> tuple[PropertyFormula, ...]:
        return self.first, self.then


@dataclass(frozen=True, slots=True)
class Becoming:
    """The moments at which ``inner`` becomes true, the beginning included; ``never``: all others."""

    inner: PropertyFormula
    never: bool = False

    def negated(self) -> Becoming:
        return Becoming(self.inner, not self.never)

    def parts(self) -> tuple[PropertyFormula, ...]:
        return (self.inner,)


@dataclass(frozen=True, slots=True)
class Tally:
    """How often ``inner`` becomes true from a moment on, compared with a number."""

    inner: PropertyFormula
    sign: str
    number: float

    def negated(self) -> Tally:
        return Tally(self.inner, OPPOSITE[self.sign], self.number)

    def parts(self) -> tuple[PropertyFormula, ...]:
        return (self.inner,)


@dataclass(frozen=True, slots=True)
class CycleTime:
    """Every time from a moment at which ``begin`` becomes true to the next at which ``end`` does, compared with ``limit`` ns.

    ``some``: not every one, but one at least.
    """

    begin: PropertyFormula
    end: PropertyFormula
    sign: str
    limit: Nanos
    some: bool = False

    def negated(self) -> CycleTime:
        return CycleTime(self.begin, self.end, OPPOSITE[self.sign], self.limit, not self.some)

    def parts(self) -> tuple[PropertyFormula, ...]:
        return self.begin, self.end


PropertyFormula: TypeAlias = Atom | Combination | Lasting | Delayed | Holding | Becoming | Tally | CycleTime


def nodes(formula: PropertyFormula) -> Iterator[PropertyFormula]:
    """It and all that it consists of."""
    yield formula
    for part in formula.parts():
        yield from nodes(part)


def measured(formula: PropertyFormula) -> Iterator[CycleTime]:
    """The cycle times in it, whose least, greatest and mean are measures of a run."""
    yield from (node for node in nodes(formula) if isinstance(node, CycleTime))
