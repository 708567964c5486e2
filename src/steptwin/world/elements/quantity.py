"""Signals and conditions that elements depend on, in keys such as ``when`` and ``of``."""

from __future__ import annotations

from functools import partial

from steptwin.errors import Misuse
from steptwin.world.board import Board
from steptwin.world.condition import SignalCondition
from steptwin.world.expression import parse_condition
from steptwin.world.reader import TomlText
from steptwin.world.signals import Idle, SignalOf, find_signal
from steptwin.world.site import Site
from steptwin.world.tomlplaces import Path

TIME = "time"
"""The signal that belongs to no machine and no element."""


def owners_of(condition: str) -> tuple[str, ...]:
    """Machines and elements whose signals are in a condition; none for one that is wrong."""
    try:
        return tuple(dict.fromkeys(name.partition(".")[0] for name in parse_condition(condition).names()))
    except Misuse:
        return ()


def check_condition(text: TomlText, path: Path, condition: str) -> None:
    """Report a condition that cannot be read."""
    try:
        parse_condition(condition)
    except Misuse as error:
        text.wrong((*path, "when"), "D003", str(error))


def signal_of(key: str, board: Board, site: Site, name: str) -> SignalOf | Idle:
    """A signal of what is in one kernel with a board. Raises `Misuse`."""
    found = find_signal(site.parts, name)
    if isinstance(found, Idle) or any(source.kernel is not board.kernel for source in found.sources):
        raise Misuse(f"{key}: {name!r} is no quantity of a machine or an element")
    found.watch(name)
    return found


def condition_of(text: str, board: Board, site: Site) -> SignalCondition:
    return SignalCondition(text, partial(signal_of, "when", board, site))
