"""Incremental checking of a program in an editor.

The tree of an unchanged line is kept, and so is its step, although the line has another place now. For that, nodes have
*addresses* instead of places in the text: each line gets a number of its own that it keeps, and an address is this number and a
column. `Edited.place` and `Edited.address` translate. The findings are the same as those of `check`.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import replace
from itertools import accumulate
from operator import add

from steptwin.diagnostics import Diagnostic, Span, in_order
from steptwin.wbc.check import CheckedProgram, check_program
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.memory import StepMemory
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.syntax import Parser
from steptwin.wbc.tree import ProgramTree, SourceLine
from steptwin.wbc.usage import Setup

_LINE_END = re.compile(r"(\r\n|\n|\r)")
_COLUMNS = 1 << 32
"""Addresses of a line: more than the columns of any."""


class Edited:
    """A text being edited, with its tree. ``program`` and everything made from it has addresses."""

    def __init__(self) -> None:
        self.text = ""
        self.contents: list[str] = []
        """The lines without their ends; what follows the last line end is one only if it is not empty."""
        self.starts: list[int] = []
        """Where each line begins in the text."""
        self.program = ProgramTree(())
        self._bases: list[int] = []
        self._numbers: dict[int, int] | None = None
        """The number of each line by its base; made when it is first needed."""
        self._sound: list[SourceLine | None] = []
        self._next_base = 0
        self._memory = StepMemory()
        self._found: list[Diagnostic] = []

    def update(self, text: str, lines: tuple[list[str], list[int]] | None = None) -> None:
        """Read the changed lines. ``lines``: all of them without their ends, and where they begin, if that is known; those that
        are the same objects as before are compared faster."""
        contents, starts = split_lines(text) if lines is None else lines
        if contents and not contents[-1]:
            contents, starts = contents[:-1], starts[:-1]
        same = _common(self.contents, contents)
        kept = _common(self.contents[same:][::-1], contents[same:][::-1])
        fresh = range(self._next_base, self._next_base + len(contents) - same - kept)
        self._next_base = fresh.stop
        old = len(self.contents) - kept
        self._bases[same:old] = [number * _COLUMNS for number in fresh]
        self._sound[same:old] = [None] * len(fresh)
        self.text, self.contents, self.starts = text, contents, starts
        self._numbers = None
        self._read()

    def _read(self) -> None:
        parser = Parser(self.contents)
        sound = self._sound
        lines = list(sound)
        beyond = 0
        for first in [number for number, line in enumerate(sound) if line is None]:
            number = max(first, beyond)
            # Inside a comment of another language, which ends in one of the lines, none is a statement.
            while number == first or parser.in_comment:
                said, inside = len(parser.diagnostics), parser.in_comment
                lines[number] = line = parser.line(number, self._bases[number])
                if not inside:
                    sound[number] = line if len(parser.diagnostics) == said else None
                number += 1
            beyond = number
        self.program = ProgramTree(tuple(line for line in lines if line is not None))
        self._found = parser.diagnostics

    def check(
        self, positions: PositionTable | None = None, setup: Setup | None = None, dialect: Dialect = DEFAULT
    ) -> tuple[CheckedProgram, ProgramScope]:
        """The findings of `steptwin.wbc.check.check`, with places in the text, and the scope of the names."""
        checked, scope = check_program(self.text, self.program, list(self._found), positions, setup, dialect, memory=self._memory)
        diagnostics = in_order([self.placed(diagnostic) for diagnostic in checked.diagnostics])
        return replace(checked, diagnostics=diagnostics), scope

    # -- addresses

    def place(self, address: int) -> int:
        """The place in the text."""
        return self.starts[self.line_of(address)] + address % _COLUMNS

    def line_of(self, address: int) -> int:
        """The line of an address, from 0."""
        if self._numbers is None:
            self._numbers = dict(zip(self._bases, range(len(self._bases)), strict=True))
        return self._numbers[address - address % _COLUMNS]

    def line_at(self, place: int) -> int:
        """The line of a place in the text, from 0: one more than there are where nothing follows the last line end."""
        if self.text and self.text[-1] in "\r\n" and place >= len(self.text):
            return len(self.starts)
        return max(bisect_right(self.starts, place) - 1, 0)

    def address(self, place: int) -> int | None:
        """The address of a place in the text; None where there is no line."""
        number = self.line_at(place)
        return self._bases[number] + place - self.starts[number] if number < len(self._bases) else None

    def span(self, span: Span) -> Span:
        return Span(self.place(span.start), self.place(span.end))

    def placed(self, diagnostic: Diagnostic) -> Diagnostic:
        fix = diagnostic.fix
        moved = None if fix is None else replace(fix, span=self.span(fix.span))
        return replace(diagnostic, span=self.span(diagnostic.span), fix=moved)


def split_lines(text: str) -> tuple[list[str], list[int]]:
    """The lines of a text without their ends, and where they begin; the last one is what follows the last line end."""
    pieces = _LINE_END.split(text)
    contents, ends = pieces[::2], pieces[1::2]
    return contents, list(accumulate(map(add, map(len, contents), map(len, ends)), initial=0))


_BLOCK = 256


def _common(a: list[str], b: list[str]) -> int:
    """Number of equal items at the beginning."""
    least = min(len(a), len(b))
    for start in range(0, least, _BLOCK):
        end = min(start + _BLOCK, least)
        if a[start:end] != b[start:end]:
            return next(number for number in range(start, end) if a[number] != b[number])
    return least
