"""Position tables (`.csv`): one line per row, ``name;p1;p2;p3;p4``, ``x`` = leave this axis or parameter alone.

Values are in configured units (positions), units per second (path velocity) or degrees (angle), as the statement that uses the
row takes them. Rows count from 0. A table knows the text it was read from and gives it back unchanged.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from steptwin.diagnostics import Diagnostic, Fix, Span, split_lines
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.wbc import findings as f
from steptwin.wbc.dialect import MAX_POSITIONS
from steptwin.wbc.lexer import is_name, plain_name
from steptwin.wbc.registers import REAL_MAX

WRITE_A_CELL = Message("wbc.write-a-cell", "write a number like 20, -70, 20.5 or 20,5, or x to leave the axis alone")
NOTHING = Message("wbc.nothing", "nothing")
ONE_ROW = Message("wbc.one-row", "1 row")
ROWS = Message("wbc.rows", "{count} rows")
ROWS_ARE_COUNTED = Message("wbc.rows-are-counted", "remove it: rows are counted by lines")
NUMBER_OF_COLUMNS = Message("wbc.number-of-columns", "{count} columns instead of {wanted}")
NAME_OF_ANOTHER_ROW = Message("wbc.name-of-another-row", "{name} is already the name of row {index}")
EMPTY_LINE = Message("wbc.empty-line", "an empty line")
A_ROW = Message("wbc.a-row", "a row is name;p1;p2;p3;p4")
CANNOT_BE_WRITTEN_AFTER = Message("wbc.cannot-be-written-after", "{name!r} cannot be written after @")
NO_NUMBER_AND_NO_X = Message("wbc.no-number-and-no-x", "p{number} is {found}, neither a number nor x")
BEYOND_REAL = Message("wbc.beyond-real", "p{number} is beyond the range of REAL, ±{most:.3g}")
NAMES_DIFFER = Message("wbc.names-differ", "names differ in more than case")
MORE_THAN_ROWS = Message("wbc.more-than-rows", "more than {most} rows")
TABLE_HOLDS = Message("wbc.table-holds", "the table holds {most}")

PARAMETERS = 4
_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)?$")
_LEFT_ALONE = "x"


@dataclass(frozen=True, slots=True)
class PositionRow:
    """``values`` are p1…p4, None for ``x``. ``start`` and ``end`` are the place of the line in the text."""

    name: str
    values: tuple[float | None, ...]
    start: int = field(default=0, compare=False)
    end: int = field(default=0, compare=False)

    @property
    def mask(self) -> int:
        """The axes the row names, bit 0 = M1."""
        return sum(1 << n for n, value in enumerate(self.values) if value is not None)


@dataclass(frozen=True)
class PositionTable:
    """Rows, and the text from which they were read; immutable."""

    rows: tuple[PositionRow, ...] = ()
    text: str = ""
    _index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        index: dict[str, int] = {}
        for number, row in enumerate(self.rows):
            if row.name:
                index.setdefault(row.name.upper(), number)
        object.__setattr__(self, "_index", index)

    def index(self, name: str) -> int | None:
        """Number of the row with this name (either case), from 0; None when there is none."""
        return self._index.get(name.upper())

    def names(self) -> list[str]:
        return [row.name for row in self.rows if row.name]


def rows_text(count: int) -> str:
    """A number of rows in words."""
    return ONE_ROW() if count == 1 else ROWS(count=count)


def row_text(name: str, values: Sequence[float | None]) -> str:
    """A line of the table; numbers are written so that reading them gives the same REAL."""
    return ";".join([name, *(_LEFT_ALONE if value is None else number_text(value) for value in values)])


def number_text(value: float) -> str:
    """The shortest decimal number, without exponent, that gives this value when read."""
    if not math.isfinite(value):
        raise Misuse(f"{value} cannot be written as a number: permitted are finite numbers")
    text = repr(value)
    if "e" not in text:
        return text.removesuffix(".0")
    mantissa, _, exponent = text.lower().partition("e")
    sign = "-" if mantissa.startswith("-") else ""
    whole, _, fraction = mantissa.lstrip("-").partition(".")
    digits, point = whole + fraction, len(whole) + int(exponent)
    if point <= 0:
        return f"{sign}0.{'0' * -point}{digits}"
    return f"{sign}{digits[:point].ljust(point, '0')}{'.' + digits[point:] if digits[point:] else ''}"


def table_of(rows: Sequence[tuple[str, Sequence[float | None]]]) -> PositionTable:
    """A table made from rows instead of a text."""
    table, diagnostics = parse_positions("".join(row_text(name, values) + "\n" for name, values in rows))
    if diagnostics:
        raise Misuse(diagnostics[0].message)
    return table


def parse_positions(text: str) -> tuple[PositionTable, list[Diagnostic]]:
    """The table of a text and its diagnostics. Never raises.

    A wrong cell counts as ``x``, so that rows keep their numbers.
    """
    rows: list[PositionRow] = []
    diagnostics: list[Diagnostic] = []
    names: dict[str, int] = {}
    blanks: list[Span] = []
    start = 0
    for line, end in split_lines(text):
        content = line.rstrip()
        span = Span(start, start + len(content))
        start += len(line) + len(end)
        if not content:
            blanks.append(Span(span.start, start))
            continue
        hint = ROWS_ARE_COUNTED()
        diagnostics += [f.TABLE_BLANK.at(blank, EMPTY_LINE(), hint, Fix(blank, "")) for blank in blanks]
        blanks.clear()
        row = _row(content, span, diagnostics)
        key = row.name.upper()
        if key in names:
            message = NAME_OF_ANOTHER_ROW(name=row.name, index=names[key])
            diagnostics.append(f.TABLE_DUPLICATE.at(_cell(span.start, content), message, NAMES_DIFFER()))
        elif key:
            names[key] = len(rows)
        if len(rows) == MAX_POSITIONS:
            diagnostics.append(f.TABLE_TOO_LONG.at(span, MORE_THAN_ROWS(most=MAX_POSITIONS), TABLE_HOLDS(most=MAX_POSITIONS)))
        rows.append(row)
    return PositionTable(tuple(rows), text), diagnostics


def _cell(start: int, text: str) -> Span:
    return Span(start, start + len(text.split(";", 1)[0]))


def _row(content: str, span: Span, diagnostics: list[Diagnostic]) -> PositionRow:
    cells = content.split(";")
    # A separator after the last value is a habit of spreadsheets.
    if len(cells) == PARAMETERS + 2 and not cells[-1].strip():
        cells.pop()
    if len(cells) != PARAMETERS + 1:
        message = NUMBER_OF_COLUMNS(count=len(cells), wanted=PARAMETERS + 1)
        kept, more = cells[: PARAMETERS + 1], cells[PARAMETERS + 1 :]
        # A value that is missing is none, which is written x; one that is too many is removed if it is empty.
        whole = ";".join([*kept, *["x"] * (PARAMETERS + 1 - len(kept))])
        fix = None if any(cell.strip() for cell in more) else whole
        diagnostics.append(f.TABLE_COLUMNS.at(span, message, A_ROW(), fix=fix))
    name = cells[0].strip()
    if name and not is_name(name):
        hint = f.NAMES_HAVE_LETTERS()
        place = _cell(span.start, content)
        diagnostics.append(f.TABLE_NAME.at(place, CANNOT_BE_WRITTEN_AFTER(name=name), hint, plain_name(name)))
    values: list[float | None] = []
    at = span.start + len(cells[0]) + 1
    for number, cell in enumerate(cells[1 : PARAMETERS + 1], 1):
        values.append(_value(cell, number, Span(at, at + len(cell)), diagnostics))
        at += len(cell) + 1
    values += [None] * (PARAMETERS - len(values))
    return PositionRow(name, tuple(values), span.start, span.end)


def _value(cell: str, number: int, span: Span, diagnostics: list[Diagnostic]) -> float | None:
    text = cell.strip()
    if text.lower() == _LEFT_ALONE:
        return None
    hint = WRITE_A_CELL()
    if not _NUMBER.match(text):
        found = repr(text) if text else NOTHING()
        joined = "".join(text.split())
        fix = joined if _NUMBER.match(joined) else None if text else _LEFT_ALONE
        diagnostics.append(f.TABLE_NUMBER.at(span, NO_NUMBER_AND_NO_X(number=number, found=found), hint, fix))
        return None
    value = float(text.replace(",", "."))
    if abs(value) > REAL_MAX:
        diagnostics.append(f.TABLE_NUMBER.at(span, BEYOND_REAL(number=number, most=REAL_MAX), hint))
        return None
    return value
