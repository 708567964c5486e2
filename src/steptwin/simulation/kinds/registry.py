"""The kinds of controllers that a description may have: `KINDS`. Each has a folder here; no other code asks which one it has."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.simulation.kinds.kind import AnyKind, AnyLineKind
from steptwin.simulation.kinds.links import LINK_KEYS
from steptwin.simulation.kinds.m1486.kind import M1486
from steptwin.simulation.kinds.mic488.kind import MIC488

KINDS: dict[str, AnyKind] = {}
"""By the name of the table in a description, in the order in which controllers are built. `register` adds to it."""


def register(kind: AnyKind) -> None:
    """Let descriptions that are read from now on have controllers of a kind. Raises `Misuse` where its name, or that of its line,
    is taken, and for links that no description can open."""
    if kind.name in KINDS:
        raise Misuse(f"there is a kind of controllers called {kind.name!r} already")
    if line_kinds().get(kind.line.name, kind.line) is not kind.line:
        raise Misuse(f"there is a kind of lines called {kind.line.name!r} already")
    unknown = kind.line.links.keys() - LINK_KEYS.keys()
    if unknown:
        raise Misuse(f"lines of kind {kind.line.name!r} have links that are no keys of [[line]]: {', '.join(sorted(unknown))}")
    KINDS[kind.name] = kind


def line_kinds() -> dict[str, AnyLineKind]:
    """The kinds of lines by name: those that controllers of any kind sit on."""
    return {kind.line.name: kind.line for kind in KINDS.values()}


register(MIC488)
register(M1486)
