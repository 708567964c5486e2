"""The tables and names of a description that may be incomplete: by its lines, and by `find_spans` up to the first error."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.lsp.positions import LineIndex
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.includes import referring_keys
from steptwin.simulation.describe.tables import tables
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.keypaths import Path, find_spans
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use

_HEADER = re.compile(r"[ \t]*(\[\[?)[ \t]*([A-Za-z0-9_.\- \t]*)(\]?\]?)")
_KEY = re.compile(r"[ \t]*([A-Za-z0-9_-]+)[ \t]*=[ \t]*")
_IDENTIFIER = re.compile(r"(?<![\w.&-])[A-Za-z_][\w-]*")
_NAMED = {"line": SymbolKind.LINE, "axis": SymbolKind.AXIS, "button": SymbolKind.BUTTON}
_SCRIPTS = ("script", "event")
NAMING = referring_keys(tables())
"""Keys whose values name controllers, lines and elements."""


@dataclass(frozen=True, slots=True)
class TableOutline:
    """``[axis.motor]`` is ``("axis", "motor")``. ``first`` is the line of its header, ``last`` the last of its content."""

    names: tuple[str, ...]
    span: Span
    first: int
    last: int

    @property
    def kind(self) -> str:
        """Kind of table to which its keys belong."""
        return self.names[-1] if self.names else ""


class WorldOutline:
    """Outline of one text."""

    def __init__(self, lines: LineIndex) -> None:
        self._lines = lines

    @cached_property
    def tables(self) -> Sequence[TableOutline]:
        headers: list[tuple[tuple[str, ...], Span, int]] = []
        for number, start in enumerate(self._lines.starts):
            found = _HEADER.match(self._lines.text, start, self._lines.end(number))
            if found is not None and found[2].strip() and number not in self._inside:
                names = tuple(part.strip() for part in found[2].split("."))
                headers.append((names, Span(found.start(1), found.end()), number))
        tables: list[TableOutline] = []
        for at, (names, span, first) in enumerate(headers):
            last = headers[at + 1][2] - 1 if at + 1 < len(headers) else len(self._lines.starts) - 1
            while last > first and not self._lines.line(last).strip():
                last -= 1
            tables.append(TableOutline(names, span, first, last))
        return tables

    def table_at(self, place: int) -> TableOutline | None:
        """The table whose lines a place is in."""
        line = self._lines.line_of(place)
        return next((table for table in reversed(self.tables) if table.first <= line), None)

    @cached_property
    def _places(self) -> dict[Path, Span]:
        try:
            return find_spans(self._lines.text)
        except Misuse:
            return {}

    @cached_property
    def _values(self) -> Sequence[tuple[Path, Span]]:
        """Paths and spans of what holds nothing further, in order of the text."""
        holders = {path[:length] for path in self._places for length in range(1, len(path))}
        found = [(path, span) for path, span in self._places.items() if path not in holders]
        return sorted(found, key=lambda item: item[1])

    @cached_property
    def _inside(self) -> frozenset[int]:
        """The lines that begin inside a value."""
        found: set[int] = set()
        reached = 0
        for span in sorted(self._places.values()):
            first, last = self._lines.line_of(span.start) + 1, self._lines.line_of(span.end)
            found.update(range(max(first, reached), last + 1))
            reached = max(reached, last + 1)
        return frozenset(found)

    def value_span(self, path: Path, span: Span) -> Span:
        """The value of a key with its value; an item of an array is one already."""
        found = _KEY.match(self._lines.text, span.start, span.end) if isinstance(path[-1], str) else None
        return span if found is None else Span(found.end(), span.end)

    @cached_property
    def definitions(self) -> dict[str, Use]:
        """Where each name of a description is given."""
        found: dict[str, Use] = {}
        for path, span in self._values:
            kind = self._kind(path)
            if kind is not None:
                inner = self._text_span(self.value_span(path, span))
                name = self._lines.text[inner.start : inner.end]
                found.setdefault(name, Use(Symbol(kind, name, name), inner, SymbolRole.DEFINE))
        return found

    @staticmethod
    def _kind(path: Path) -> SymbolKind | None:
        if len(path) != 3 or path[2] != "name":
            return None
        table = str(path[0])
        if table in KINDS:
            return SymbolKind.CONTROLLER
        if table in _SCRIPTS:
            return SymbolKind.SCRIPT
        return _NAMED.get(table, SymbolKind.ELEMENT if table in ELEMENTS else None)

    def named(self, table: str) -> Iterator[str]:
        """The names in tables of a kind."""
        for path, span in self._values:
            if len(path) == 3 and (path[0], path[2]) == (table, "name"):
                inner = self._text_span(self.value_span(path, span))
                yield self._lines.text[inner.start : inner.end]

    def _text_span(self, span: Span) -> Span:
        """Span of the text between quotation marks."""
        text = self._lines.text[span.start : span.end]
        quoted = len(text) > 1 and text[0] in "\"'" and text[-1] == text[0]
        return Span(span.start + 1, span.end - 1) if quoted else span

    def uses(self) -> Iterator[Use]:
        """The names of controllers, lines and elements, where they are given and where they stand for these."""
        defined = {use.span.start: use for use in self.definitions.values()}
        for path, span in self._values:
            value = self.value_span(path, span)
            if value.start + 1 in defined:
                yield defined[value.start + 1]
            elif any(NAMING.refers(path[:n], step) for n, step in enumerate(path)):
                # Of { "table.M1_EN" = 1 } the key names something.
                yield from self._named(span if _is_key(path) else value)

    def _named(self, span: Span) -> Iterator[Use]:
        for found in _IDENTIFIER.finditer(self._lines.text, span.start, span.end):
            use = self.definitions.get(found[0])
            if use is not None and use.symbol.kind is not SymbolKind.SCRIPT:
                yield Use(Symbol(use.symbol.kind, use.symbol.key, found[0]), Span(found.start(), found.end()), SymbolRole.READ)


def _is_key(path: Path) -> bool:
    return len(path) > 1 and path[-2] in ("set", "write")
