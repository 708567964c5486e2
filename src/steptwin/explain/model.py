"""Explanation of a program, for both languages. Statements are known by their numbers, from 0 in the order of the text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText


class ExplainedStatement(NamedTuple):
    """``line`` from 1; ``text`` as written, blanks between words reduced."""

    line: int
    text: str


class FlowWay(NamedTuple):
    """A way on from a block. ``target``: the index of a block, None the end of the program. ``when``: the condition for it.

    ``is_call``: the program comes back to the next line. ``is_back``: this is that next line.
    """

    target: int | None
    when: str = ""
    is_call: bool = False
    is_back: bool = False


class StraightPiece(NamedTuple):
    """Statements without a branch or a wait between them. ``duration``: from the first to the statement after the last, or to the
    last if that waits: ``wait`` is for what."""

    first: int
    last: int
    duration: Nanos
    wait: str = ""


@dataclass(frozen=True, slots=True)
class FlowBlock:
    """Statements ``first`` to ``last``, always executed one after the other; ``names``: labels and interrupts before them."""

    first: int
    last: int
    names: tuple[str, ...]
    ways: tuple[FlowWay, ...]
    pieces: tuple[StraightPiece, ...]
    is_entry: bool = False
    """The program or an interrupt begins here."""


class MemoryUse(NamedTuple):
    """Use of a memory; ``unit`` is that of ``used`` and ``most``."""

    what: str
    used: int
    most: Annotated[int | None, "Null: the memory of the other parts limits it."]
    unit: str


class MemorySection(NamedTuple):
    """A section of the program from a label to the next, with what it takes. ``line``: of its first statement."""

    name: str
    line: int
    statements: int
    size: int


class Usage(NamedTuple):
    """An input, output, register or position and the lines that read it and that change it."""

    name: str
    read: tuple[int, ...]
    written: tuple[int, ...]


class LongWait(NamedTuple):
    """A statement or loop at which the program can stay for ever, and why. ``way_out``: what leads on nevertheless."""

    line: int
    text: str
    reason: str
    way_out: str = ""


class EndlessLoop(NamedTuple):
    """Statements that the program does not leave once it has come to one of them. ``reads``: what it can react to there.

    ``left_by``: interrupts that can lead elsewhere.
    """

    statements: tuple[int, ...]
    reads: tuple[str, ...]
    left_by: tuple[str, ...]


class LostInterrupt(NamedTuple):
    """A reason for which an event of an interrupt can be lost; ``line`` of what causes it."""

    name: str
    line: int
    reason: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """``title``: what it was explained for. ``sections`` of the memory in ``section_unit``. ``unreachable``: numbers of
    statements that no path leads to. ``notes``: what could not be explained."""

    source: SourceText
    language: str
    title: str
    statement_time: Nanos
    statements: Sequence[ExplainedStatement]
    blocks: Sequence[FlowBlock]
    memory: Sequence[MemoryUse]
    sections: Sequence[MemorySection]
    section_unit: str
    usage: Mapping[str, Sequence[Usage]]
    waits: Sequence[LongWait]
    loops: Sequence[EndlessLoop]
    lost: Sequence[LostInterrupt]
    unreachable: Sequence[int]
    notes: Sequence[str] = field(default_factory=tuple)
    interrupts_at: str = ""
    """When entries other than the first are executed, in a language whose entries are interrupts: ``at any statement``."""

    def lines(self, statements: Sequence[int]) -> list[int]:
        return sorted({self.statements[number].line for number in statements if number < len(self.statements)})
