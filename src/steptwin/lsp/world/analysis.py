"""The analysis of a description of a world for editors."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Span
from steptwin.errors import Misuse
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import Completions, DocumentLink, Fold, Hover, OutlineItem, SemanticToken, TokenKind
from steptwin.lsp.files import name_of, relative
from steptwin.lsp.language import OtherTexts
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.world.built import ElementSignals, UnitsOfSignals
from steptwin.lsp.world.items import ItemBuilder, keys_of
from steptwin.lsp.world.outline import TableOutline, WorldOutline
from steptwin.lsp.world.signals import WorldSignals
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.includes import FILE_KEYS, USE
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.names import RESERVED
from steptwin.simulation.toml.values import name_value
from steptwin.simulation.world.check import diagnose
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use

_KEY = re.compile(r"[ \t]*([A-Za-z0-9_-]+)[ \t]*=")
_FILE = re.compile(r"""(["'])([^"'\n]+\.(?:prg|csv|cfg|m1486|wbc|toml))\1""", re.IGNORECASE)
_FILES = {**dict.fromkeys(KINDS, FILE_KEYS), USE: frozenset({"file"})}
_KINDS = {
    **dict.fromkeys(KINDS, SymbolKind.CONTROLLER),
    **dict.fromkeys(ELEMENTS, SymbolKind.ELEMENT),
    "line": SymbolKind.LINE,
    "axis": SymbolKind.AXIS,
    "button": SymbolKind.BUTTON,
    "script": SymbolKind.SCRIPT,
    "event": SymbolKind.SCRIPT,
}


class WorldAnalysis(Analysis):
    """The other files are read when an answer depends on them."""

    def __init__(self, uri: str, lines: LineIndex, around: OtherTexts, elements: ElementSignals) -> None:
        """``elements`` belongs to all states of the text."""
        super().__init__(uri, lines)
        self._around = around
        self._elements = elements
        self._outline = WorldOutline(lines)

    @cached_property
    def _signals(self) -> WorldSignals:
        return WorldSignals(self._outline, self._controllers, self._signals_of_elements)

    def _signals_of_elements(self, edited: TableOutline | None) -> UnitsOfSignals:
        """``edited``: the table that is being typed in."""
        return self._elements.known(self.lines, self._outline.tables, edited, name_of(self.uri), self._read)

    @cached_property
    def _found(self) -> Sequence[Diagnostic]:
        return diagnose(name_of(self.uri), self.text, self._read).findings

    def _read(self, name: str) -> bytes:
        """As worlds do it, only from their own folder and those below."""
        uri = relative(self.uri, name)
        if not uri.startswith(self.uri.rpartition("/")[0] + "/"):
            raise Misuse(f"{name} is outside the folder of the description: --allow-outside permits it")
        return self._around.read(uri)

    def diagnostics(self) -> Sequence[Diagnostic]:
        return self._found

    def _uses(self) -> Iterator[Use]:
        yield from self._outline.uses()

    def hover(self, place: int) -> Hover | None:
        use = self.use_at(place)
        if use is not None:
            defined = self._outline.definitions[use.symbol.key].span
            number = self.lines.line_of(defined.start) + 1
            return Hover(use.span, f"`{use.symbol.text}`: {use.symbol.kind.value}, named in line {number}.")
        table = self._outline.table_at(place)
        if table is None:
            return None
        line = self.lines.line_of(place)
        if line == table.first:
            keys = "\n".join(f"* `{key.name}`: {key.meaning}" for key in keys_of(table))
            return Hover(table.span, f"`{'.'.join(table.names)}`\n\n{keys}") if keys else None
        found = _KEY.match(self.text, self.lines.starts[line], self.lines.end(line))
        key = None if found is None else next((key for key in keys_of(table) if key.name == found[1]), None)
        if found is None or key is None or key.name == "when":
            of_signal = self._signals.hover(self.lines.line(line), self.lines.starts[line], place)
            if of_signal is not None or found is None or key is None:
                return of_signal
        span = Span(found.start(1), max(self.lines.end(line), found.end(1)))
        needed = " It is needed." if key.is_required else ""
        return Hover(span, f"`{key.name}` of `{'.'.join(table.names)}`\n\n{key.meaning[0].upper()}{key.meaning[1:]}.{needed}")

    def items(self, place: int) -> Completions:
        number = self.lines.line_of(place)
        before = self.text[self.lines.starts[number] : place]
        table = self._outline.table_at(place)
        present = () if table is None else self._present(table, number)
        files = [name_of(uri) for uri in self._around.in_folder(self.uri)]
        return ItemBuilder(self._outline, self._signals, files).items(before, place, present)

    def _present(self, table: TableOutline, without: int) -> Iterator[str]:
        """The keys of a table, except those of one line."""
        for number in range(table.first + 1, table.last + 1):
            found = _KEY.match(self.text, self.lines.starts[number], self.lines.end(number))
            if found is not None and number != without:
                yield found[1]

    @cached_property
    def _controllers(self) -> dict[str, AnyKind]:
        """The kinds of the controllers by their names."""
        names = {use.span.start: use.symbol.key for use in self._outline.definitions.values()}
        tables = [(table, KINDS[table.kind]) for table in self._outline.tables if table.kind in KINDS]
        return {
            name: kind
            for table, kind in tables
            for start, name in names.items()
            if table.span.end <= start <= self.lines.end(table.last)
        }

    def new_name_problem(self, symbol: Symbol, text: str) -> str | None:
        try:
            name_value(text)
        except Misuse as error:
            return str(error)
        if text.lower() in RESERVED:
            return f"{text!r} is {RESERVED[text.lower()]}: choose another name"
        taken = next((name for name in self._outline.definitions if name.lower() == text.lower()), None)
        return None if taken is None or taken == symbol.key else f"{taken!r} is taken already"

    @cached_property
    def _defined(self) -> Sequence[Use]:
        """Where names are given, in order of the text."""
        return sorted(self._outline.definitions.values(), key=_start)

    def outline(self) -> Sequence[OutlineItem]:
        return [self._section(table) for table in self._outline.tables]

    def _section(self, table: TableOutline) -> OutlineItem:
        span = Span(table.span.start, max(table.span.end, self.lines.end(table.last)))
        first = bisect_left(self._defined, span.start, key=_start)
        inside = [use for use in self._defined[first : first + 1] if use.span.start <= span.end]
        kind = _KINDS.get(table.kind, SymbolKind.SECTION)
        if not inside:
            return OutlineItem(".".join(table.names), kind, span, table.span)
        return OutlineItem(inside[0].symbol.text or "?", kind, span, inside[0].span, table.kind)

    def folds(self) -> Sequence[Fold]:
        return [Fold(table.first, table.last) for table in self._outline.tables if table.last > table.first]

    def tokens(self) -> Sequence[SemanticToken]:
        """The names of the description; editors highlight TOML itself."""
        headers = [SemanticToken(table.span, TokenKind.SECTION) for table in self._outline.tables]
        names = [
            SemanticToken(use.span, TokenKind.VARIABLE, use.role is SymbolRole.DEFINE)
            for use in self.uses
            if use.span.end > use.span.start
        ]
        return sorted([*headers, *names], key=lambda token: token.span)

    def links(self) -> Sequence[DocumentLink]:
        found: list[DocumentLink] = []
        for table in self._outline.tables:
            for number in range(table.first + 1, table.last + 1) if table.kind in _FILES else ():
                key = _KEY.match(self.text, self.lines.starts[number], self.lines.end(number))
                if key is not None and key[1] in _FILES[table.kind]:
                    found += self._files(key.end(), self.lines.end(number))
        return found

    def _files(self, start: int, end: int) -> Iterator[DocumentLink]:
        for found in _FILE.finditer(self.text, start, end):
            yield DocumentLink(Span(found.start(2), found.end(2)), relative(self.uri, found[2]))


def _start(use: Use) -> int:
    return use.span.start
