"""The analysis of a position table (`.csv`) for editors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Severity, Span, in_order
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import (
    Completion,
    CompletionKind,
    Completions,
    Hint,
    Hover,
    OutlineItem,
    SemanticToken,
    Signature,
    TokenKind,
)
from steptwin.lsp.positions import LineIndex
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use
from steptwin.wbc.lexer import is_name
from steptwin.wbc.positions import PARAMETERS, PositionRow, parse_positions

UNUSED_ROW = "W251"
_MEANINGS = (
    "name, written @name in a program; may be empty",
    "p1: position of M1, X of a line, a circle's centre or the end of an arc",
    "p2: position of M2, Y of a line, a circle's centre or the end of an arc",
    "p3: position of M3, path velocity of a line in u/s, radius of a circle or an arc",
    "p4: position of M4, angle of a circle in degrees, or 0 for an external and 1 for an internal arc",
)
_COLUMNS = ("name", "p1", "p2", "p3", "p4")
_ALONE = "x"
_MOST_VALUES = 8
"""Most values of other rows that are offered."""


@dataclass(frozen=True, slots=True)
class UsedRows:
    """Rows of a table that its programs use: names in upper case; whether they name rows by numbers that are not known."""

    names: frozenset[str]
    numbers: frozenset[int] = frozenset()
    all_may_be: bool = False


class TableAnalysis(Analysis):
    """``used`` is None where no program is known."""

    def __init__(self, uri: str, lines: LineIndex, used: UsedRows | None) -> None:
        super().__init__(uri, lines)
        self._used = used
        self._table, self._found = parse_positions(lines.text)

    def diagnostics(self) -> Sequence[Diagnostic]:
        return in_order([*self._found, *self._unused()])

    def _unused(self) -> Iterator[Diagnostic]:
        used = self._used
        if used is None or used.all_may_be:
            return
        for number, row in enumerate(self._table.rows):
            if row.name and row.name.upper() not in used.names and number not in used.numbers:
                message = f"no program uses the row {row.name}"
                yield Diagnostic(
                    UNUSED_ROW, Severity.NOTE, self._name_span(row), message, "it takes one of the places of the table"
                )

    def _cells(self, line: int) -> list[Span]:
        content, start = self.lines.line(line), self.lines.starts[line]
        spans: list[Span] = []
        for cell in content.split(";"):
            spans.append(Span(start, start + len(cell)))
            start += len(cell) + 1
        return spans

    def _name_span(self, row: PositionRow) -> Span:
        cell = self.text[row.start : row.end].split(";", 1)[0]
        start = row.start + len(cell) - len(cell.lstrip())
        return Span(start, start + len(cell.strip()))

    @cached_property
    def _row_of_line(self) -> dict[int, int]:
        return {self.lines.line_of(row.start): number for number, row in enumerate(self._table.rows)}

    def _cell_at(self, place: int) -> tuple[int, int, Span]:
        """Line, column of the table and span of the cell at a place."""
        line = self.lines.line_of(place)
        cells = self._cells(line)
        column = max(number for number, cell in enumerate(cells) if cell.start <= place or number == 0)
        return line, column, cells[column]

    def hover(self, place: int) -> Hover | None:
        line, column, cell = self._cell_at(place)
        number = self._row_of_line.get(line)
        if number is None or column >= len(_MEANINGS):
            return None
        row = self._table.rows[number]
        what = _MEANINGS[column]
        if column and row.values[column - 1] is None:
            what = f"{what}\n\n`x`: left alone"
        name = f" `{row.name}`" if row.name else ""
        return Hover(cell, f"Row {number}{name}\n\n{what}")

    def items(self, place: int) -> Completions:
        line, column, cell = self._cell_at(place)
        if column > PARAMETERS:
            return Completions(())
        typed = self.text[cell.start : place].strip()
        if column == 0:
            return Completions(tuple(self._names(cell, typed, is_alone=len(self._cells(line)) == 1)))
        return Completions(tuple(self._values(line, column, cell, typed)))

    def _names(self, cell: Span, typed: str, *, is_alone: bool) -> Iterator[Completion]:
        """Names that programs use and no row has; in a line without values a whole row."""
        there = {row.name.upper() for row in self._table.rows}
        missing = sorted(() if self._used is None else self._used.names - there)
        ends = ";".join(f"${{{n + 1}:{_ALONE}}}" for n in range(PARAMETERS))
        for name in missing:
            if name.startswith(typed.upper()):
                insert = f"{name};{ends}" if is_alone else name
                yield Completion(name, CompletionKind.POSITION, cell, "a program uses it", "", insert, is_alone, 1)
        if is_alone:
            shown = ";".join(_COLUMNS)
            insert = f"{typed or '${5:name}'};{ends}"
            label = f"{typed};{shown.partition(';')[2]}" if typed else shown
            yield Completion(label, CompletionKind.SNIPPET, cell, "a row", "", insert, True, 2)

    def _values(self, line: int, column: int, cell: Span, typed: str) -> Iterator[Completion]:
        """``x``, and what other rows have in this column, the nearest first."""
        if not typed:
            yield Completion(_ALONE, CompletionKind.VALUE, cell, "leaves the axis or parameter alone", rank=1)
        near = sorted((abs(there - line), there, number) for there, number in self._row_of_line.items() if there != line)
        known = {"", self.text[cell.start : cell.end].strip()}
        for _, there, number in near:
            cells = self._cells(there)
            value = self.text[cells[column].start : cells[column].end].strip() if column < len(cells) else ""
            if value in known or value.lower() == _ALONE or not value.startswith(typed):
                continue
            known.add(value)
            yield Completion(
                value, CompletionKind.VALUE, cell, f"as row {number} {self._table.rows[number].name}".rstrip(), rank=2
            )
            if len(known) > _MOST_VALUES:
                return

    def signature(self, place: int) -> Signature | None:
        _, column, _ = self._cell_at(place)
        active = column if column <= PARAMETERS else None
        return Signature(";".join(_COLUMNS), _MEANINGS[min(column, PARAMETERS)], _COLUMNS, active)

    def _uses(self) -> Iterator[Use]:
        for row in self._table.rows:
            if row.name:
                yield Use(Symbol(SymbolKind.POSITION, row.name.upper(), row.name), self._name_span(row), SymbolRole.DEFINE)

    def new_name_problem(self, symbol: Symbol, text: str) -> str | None:
        if not is_name(text):
            return f"{text!r} is not a name: letters without accents, digits and _, no digit first"
        if text.upper() != symbol.key and self._table.index(text) is not None:
            return f"there is a position {text} already"
        return None

    def outline(self) -> Sequence[OutlineItem]:
        return [
            OutlineItem(
                row.name or f"row {number}", SymbolKind.POSITION, Span(row.start, row.end), self._name_span(row), f"row {number}"
            )
            for number, row in enumerate(self._table.rows)
        ]

    def tokens(self) -> Sequence[SemanticToken]:
        found: list[SemanticToken] = []
        for line in self._row_of_line:
            cells = self._cells(line)[: PARAMETERS + 1]
            for column, cell in enumerate(cells):
                if cell.end > cell.start:
                    written = self.text[cell.start : cell.end].strip().lower()
                    kind = TokenKind.POSITION if column == 0 else TokenKind.VALUE if written == _ALONE else TokenKind.NUMBER
                    found.append(SemanticToken(cell, kind, written=column == 0))
                if column < len(cells) - 1:
                    found.append(SemanticToken(Span(cell.end, cell.end + 1), TokenKind.OPERATOR))
        return sorted(found, key=lambda token: token.span)

    def hints(self) -> Sequence[Hint]:
        """The numbers of the rows, by which programs may name them."""
        return [Hint(row.start, f"{number}", "number of the row") for number, row in enumerate(self._table.rows)]
