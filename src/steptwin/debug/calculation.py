"""Expressions of a user at a breakpoint: ``n + 1``, ``PosM1 > 50 and IN3 = ON``, ``other.OUT2 = 1``.

Their language is that of `steptwin.simulation.logic.expression`. Names without a dot are those of the program; with a dot,
signals of the world.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from math import isfinite
from operator import eq, ge, gt, le, lt
from sys import float_info

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import NONE, Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.components.signals import Idle
from steptwin.simulation.logic.expression import ReadAt, parse_expression, value_of
from steptwin.simulation.logic.quantities import unit_of_all
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.world.simulation import Simulation

EXACT = 1e15
"""Whole numbers below it are shown with all their digits."""

_COUNTS: Mapping[str, Callable[[int, int], bool]] = {"=": eq, "==": eq, "<": lt, "<=": le, ">": gt, ">=": ge}


class ResolvedExpression:
    """An expression whose names are resolved for a controller of a world."""

    def __init__(self, world: Simulation, controller: str, text: str) -> None:
        """Raises `Misuse` for what is no expression, and for unknown signals; names of a program may get their meaning later."""
        node = parse_expression(text)
        names = dict.fromkeys(node.names())
        signals = {name: found for name in names if (found := _signal(world, controller, name)) is not None}
        reads = {name: signals[name].value if name in signals else _read_by_program(world, controller, name) for name in names}
        self._world, self._controller, self._programs = world, controller, world.programs_of(controller)
        self._by_program = [name for name in names if name not in signals]
        self.is_local = not signals
        """Whether it has names of the program only."""

        def unit_of(name: str) -> str:
            return signals[name].unit if name in signals else ""

        self._value = value_of(node.in_unit(unit_of_all(node, unit_of), unit_of), reads, _checked)
        self._own = world.objects.scheduler_of[controller]
        schedulers = {source.scheduler: None for signal in signals.values() for source in signal.sync(world.now)}
        self._others = [scheduler for scheduler in schedulers if scheduler is not self._own]

    def check_names(self) -> None:
        """Raises `Misuse` for a name that means nothing to the controller, and in none of its programs as they are now."""
        for name in self._by_program:
            if not self._programs.has_name(name):
                _own_signal(self._world, self._controller, name)

    @property
    def reads_others(self) -> bool:
        """Whether it depends on what has no connection to the controller."""
        return bool(self._others)

    def value(self, now: Nanos) -> float:
        """The value at the present moment of the world. Raises `Misuse` for a name that means nothing, a division by zero, and a
        result that is too large."""
        for scheduler in (self._own, *self._others):
            scheduler.advance(now)
        return float(self._value(now))

    def is_known_before_statement(self, now: Nanos) -> bool:
        """Whether `value_at_statement` can be asked: no controller that it depends on has gone ahead of the one that executes a
        statement at ``now``."""
        return all(scheduler.now < now for scheduler in self._others)

    def value_at_statement(self, now: Nanos) -> float:
        """The value that the statement finds which is about to be executed; what has no connection to its controller is as it was
        before that moment. Raises `Misuse` as `value`."""
        for scheduler in self._others:
            scheduler.advance(now - 1)
        return float(self._value(now))


WRITE_ONLY = Message("debug.write-only", "{name} can only be written")


def _signal(world: Simulation, controller: str, name: str) -> SignalOf | Idle | None:
    """The signal that a name means; None for a name of the program. Raises `Misuse`."""
    owner, dot, _ = name.partition(".")
    if not dot:
        return world.signal(name) if name == "time" and name not in world.programs_of(controller).variables(world.now) else None
    is_full = owner in world.controllers or owner in world.objects.element_names
    found = world.signal(name) if is_full else _own_signal(world, controller, name)
    if not found.is_readable:
        raise Misuse(WRITE_ONLY(name=name))
    return found


UNKNOWN_VARIABLE = Message("debug.unknown-variable", "{name!r} means nothing to {controller}{hint}: its variables are {names}")


def _own_signal(world: Simulation, controller: str, name: str) -> SignalOf | Idle:
    try:
        return world.signal(f"{controller}.{name}")
    except Misuse:
        variables = list(world.programs_of(controller).variables(world.now))
        hint = NearMiss().hint(name, [*variables, *world.controller(controller).pins(), *_paths(world, controller)])
        raise Misuse(UNKNOWN_VARIABLE(name=name, controller=controller, hint=hint, names=list(variables) or NONE())) from None


def _paths(world: Simulation, controller: str) -> list[str]:
    return [point.path for point in world.kind(controller).datasheet(world.controller(controller)).points]


def _read_by_program(world: Simulation, controller: str, name: str) -> ReadAt:
    """Meaning of a name for the statement of a moment, or else for the controller."""
    programs = world.programs_of(controller)

    def read(now: Nanos) -> float:
        value = programs.read(name, now)
        return float(_own_signal(world, controller, name).value(now)) if value is None else value

    return read


CALCULATION_FAILS = Message(
    "debug.calculation-fails", "a division by zero, or a result that is too large: permitted are numbers up to {most:.3g}"
)


def _checked(value: float) -> float:
    """Raises `Misuse` for what nothing can be calculated with, and nothing set to."""
    if not isfinite(value):
        raise Misuse(CALCULATION_FAILS(most=float_info.max))
    return value


BRACE_WITHOUT_PARTNER = Message("debug.brace-without-partner", "log {text!r}: a brace has no partner")
NO_NAME_IN_LOG = Message("debug.no-name-in-log", "log {text!r}: only names of the program can be in it")


class LogText:
    """A text with expressions in braces: ``n is {n}``."""

    def __init__(self, text: str, calculation: Callable[[str], ResolvedExpression]) -> None:
        """Raises `Misuse` for what is no expression of the program, and for a brace without its partner."""
        self._parts: list[str | ResolvedExpression] = []
        for plain, inner, stray in re.findall(r"([^{}]+)|\{([^{}]*)\}|([{}])", text):
            if stray:
                raise Misuse(BRACE_WITHOUT_PARTNER(text=text))
            self._parts.append(plain or self._local(text, calculation(inner)))

    @staticmethod
    def _local(text: str, calculation: ResolvedExpression) -> ResolvedExpression:
        if not calculation.is_local:
            raise Misuse(NO_NAME_IN_LOG(text=text))
        return calculation

    def formatted(self, now: Nanos) -> str:
        """As a statement at ``now`` finds it."""
        return "".join(part if isinstance(part, str) else number_text(part.value_at_statement(now)) for part in self._parts)


WRONG_HIT_COUNT = Message(
    "debug.wrong-hit-count", "hit count {text!r}: expected a number from 1 on, after nothing, or one of = < <= > >= %"
)


class HitCount:
    """Which of the hits count: ``5`` and ``= 5`` the fifth, ``> 5``, ``>= 5``, ``< 5``, ``<= 5``, ``% 5`` every fifth."""

    def __init__(self, text: str) -> None:
        """Raises `Misuse`."""
        match = re.fullmatch(r"\s*(%|[=<>]=?)?\s*([1-9]\d{0,8})\s*", text)
        if match is None:
            raise Misuse(WRONG_HIT_COUNT(text=text))
        self._sign, self._number = match[1] or "=", int(match[2])

    def counts(self, hit: int) -> bool:
        """Whether hit ``hit``, from 1, is one of them."""
        return hit % self._number == 0 if self._sign == "%" else _COUNTS[self._sign](hit, self._number)


def number_text(value: float) -> str:
    """A number for people."""
    return str(int(value)) if abs(value) < EXACT and value == int(value) else f"{value:.9g}"
