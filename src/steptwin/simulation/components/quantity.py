"""Signals and conditions that elements depend on, in keys such as ``when`` and ``of``."""

from __future__ import annotations

from functools import partial

from steptwin.errors import Misuse
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.expression import parse_condition, parse_expression
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.reader import TomlText

TIME = "time"
"""The signal that belongs to no controller and no element."""


def owners_of(condition: str) -> tuple[str, ...]:
    """Controllers and elements whose signals are in a condition; none for one that is wrong."""
    try:
        return tuple(dict.fromkeys(owner_of(name) for name in parse_condition(condition).names()))
    except Misuse:
        return ()


def owners_in(expression: str) -> tuple[str, ...]:
    """As `owners_of`, of an expression."""
    try:
        return tuple(dict.fromkeys(owner_of(name) for name in parse_expression(expression).names()))
    except Misuse:
        return ()


def check_condition(text: TomlText, path: Path, name: str, condition: str, key: str = "when") -> None:
    """Report a condition of the element ``name`` that cannot be read, or is over itself."""
    try:
        parse_condition(condition)
    except Misuse as error:
        text.wrong((*path, key), "D003", str(error))
    check_owners(text, (*path, key), name, owners_of(condition))


def check_expression(text: TomlText, path: Path, name: str, expression: str) -> None:
    """As `check_condition`, of an expression at the key ``path``."""
    try:
        parse_expression(expression)
    except Misuse as error:
        text.wrong(path, "D003", str(error))
    check_owners(text, path, name, owners_in(expression))


def check_owners(text: TomlText, path: Path, name: str, owners: tuple[str, ...]) -> None:
    """Report a key of the element ``name`` that is over its own signals."""
    if name in owners:
        text.wrong(path, "D007", f"{name!r} depends on itself")


def owner_of(signal: str) -> str:
    """The controller or element that has a signal."""
    return signal.partition(".")[0]


def signal_of(key: str, block: TerminalBlock, context: ElementContext, name: str) -> SignalOf | Idle:
    """A signal of what is in one scheduler with a terminal block. Raises `Misuse`."""
    found = find_signal(context.objects, name)
    if isinstance(found, Idle) or any(source.scheduler is not block.scheduler for source in found.sources):
        raise Misuse(f"{key}: {name!r} is not a quantity of a controller or an element")
    found.watch(name)
    return found


def condition_of(text: str, block: TerminalBlock, context: ElementContext) -> SignalCondition:
    return SignalCondition(text, partial(signal_of, "when", block, context))
