"""Texts in the program memories of controllers, and how they come there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.explain.model import MemoryUse
from steptwin.simulation.script.steps import Step


class TextLanguage(NamedTuple):
    """A language of the texts in the program memory of a kind of controllers."""

    name: str
    """For editors."""
    suffix: str
    """Suffix of files in it."""
    key: str
    """Key of the table of a controller that names these files."""
    in_banks: bool = False
    """Whether the value of the key is a table with the number of the bank of each."""
    is_shared: bool = False
    """Whether one file that is alone in its key is that of all banks."""
    has_statements: bool = False
    """Whether a text is a program, in whose statements a debugger stops."""
    is_typed: bool = False
    """Whether a host types a text into the memory over the line of the controller, as a user at a terminal could."""


def bank_text(bank: int) -> str:
    """The place of the program in a bank."""
    return f"program {bank}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramText:
    """A place in the program memory of a controller, and the text there."""

    place: str
    """Unlike all others of the controller: ``program 0``, ``positions 0``, ``program``."""
    language: TextLanguage
    """One of those of the kind of its controller."""
    source: SourceText
    check: Callable[[], Sequence[Diagnostic]]
    """Findings of the checker of its language, in the order of the text."""
    memory: Callable[[str], Sequence[MemoryUse]]
    """Use of the memory at this place by another text; empty for one with errors."""
    is_empty: bool = False
    """Whether nothing is there; the text is empty then."""
    is_running: bool = False


class Destination(NamedTuple):
    """Where a text goes."""

    controller: str
    line: str | None
    """The name of its line; None where it is on none."""
    place: str


class Downloading(NamedTuple):
    """How a text that was checked comes to its place."""

    put: Callable[[Nanos], None] = lambda now: None
    """Action at once."""
    typed: tuple[Step, ...] = ()
    """Characters that a host types after that."""
