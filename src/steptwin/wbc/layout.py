"""The layout of a program text that printing keeps: alignment, and indentation below labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from steptwin.wbc.lexer import BLANKS
from steptwin.wbc.statements import CLOSING, OPENING
from steptwin.wbc.tree import (
    Broken,
    ConstantDefinition,
    ImageRecord,
    KeywordStatement,
    Label,
    PositionRecord,
    SourceLine,
    StatementNode,
)

INDENT = 4
_MOST_LEVELS = 40
"""Deeper blocks are indented no further: the text would grow with the square of its lines."""
_TABS = (4, 8)
"""Widths of a tab in editors; cells are aligned if they are with one of these."""


class LayoutCell(NamedTuple):
    """Something in a line that may stand below its like in other lines.

    ``columns`` are where it stands, as pairs of tab width and column, ``least`` is the first column it can have in print.
    ``arranged``: its place is more than the usual distance from what is before it. ``follows``: it is aligned to earlier
    cells, but other cells are not aligned to it.
    """

    columns: frozenset[tuple[int, int]]
    least: int
    arranged: bool = True
    follows: bool = False


def columns_of(text: str, place: int) -> frozenset[tuple[int, int]]:
    """The column of character ``place`` of a line, for each width of a tab."""
    return frozenset((tab, len(text[:place].expandtabs(tab))) for tab in _TABS)


def indentation(text: str) -> int:
    """Columns before the first character of a line."""
    return len(text[: len(text) - len(text.lstrip(BLANKS))].expandtabs(_TABS[0]))


def aligned(cells: Sequence[LayoutCell | None], borders: Sequence[bool]) -> list[int | None]:
    """The column of every cell in print; None for a cell that is aligned to no other.

    Cells are aligned where they follow each other in one column, whatever lines without a cell are between them. Nothing is
    aligned over a line in ``borders``.
    """
    found: list[int | None] = [None] * len(cells)
    run: list[int] = []
    common: frozenset[tuple[int, int]] = frozenset()

    def close() -> None:
        members = [cell for number in run if (cell := cells[number]) is not None]
        if len(run) > 1 and any(cell.arranged for cell in members):
            column = max(min(column for _, column in common), *(cell.least for cell in members))
            for number in run:
                found[number] = column
        run.clear()

    for number, (cell, border) in enumerate(zip(cells, borders, strict=True)):
        if border:
            close()
        if cell is None:
            continue
        if run and common & cell.columns:
            common &= cell.columns
            run.append(number)
        elif not cell.follows:
            close()
            common = cell.columns
            run.append(number)
    close()
    return found


def keyword_of(statement: StatementNode | None) -> str | None:
    return statement.keyword if isinstance(statement, KeywordStatement | Broken) else None


def indentations(lines: Sequence[SourceLine], written: Sequence[str]) -> list[int]:
    """The indentation of every line in print: by its blocks, and one level more below a label whose lines were indented."""
    levels = _levels(lines)
    found: list[int] = []
    below = 0
    for number, (line, level) in enumerate(zip(lines, levels, strict=True)):
        statement = line.statement
        if isinstance(statement, Label):
            below = _below(lines, written, levels, number)
        left = isinstance(statement, Label | ConstantDefinition | ImageRecord | PositionRecord)
        # A comment at the margin belongs to the next label rather than to the lines above it.
        left = left or (statement is None and not level and not indentation(written[number]))
        found.append(0 if left else INDENT * min(below + level, _MOST_LEVELS))
    return found


def _levels(lines: Sequence[SourceLine]) -> list[int]:
    """In how many blocks each line is."""
    levels: list[int] = []
    level = 0
    for line in lines:
        keyword = keyword_of(line.statement)
        if keyword in CLOSING:
            level = max(level - 1, 0)
        levels.append(max(level - 1, 0) if keyword == "ELSE" else level)
        if keyword in OPENING:
            level += 1
    return levels


def _below(lines: Sequence[SourceLine], written: Sequence[str], levels: Sequence[int], label: int) -> int:
    """How many levels the lines below a label are indented under it: 1 when all are that are in no further block, else 0."""
    section: list[int] = []
    for number in range(label + 1, len(lines)):
        statement = lines[number].statement
        if isinstance(statement, Label):
            break
        if statement is not None and not isinstance(statement, ConstantDefinition | ImageRecord | PositionRecord):
            section.append(number)
    lowest = min((levels[number] for number in section), default=0)
    margin = indentation(written[label]) + INDENT * lowest
    return int(bool(section) and all(indentation(written[n]) > margin for n in section if levels[n] == lowest))
