"""The analysis of a configuration of a MIC488 (`.cfg`) for editors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Span
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import Completion, CompletionKind, Completions, Fold, Hint, Hover, OutlineItem, SemanticToken, TokenKind
from steptwin.lsp.positions import LineIndex
from steptwin.mic488.config import ConfigKey, examine_config, input_name, keys_of, sections_of
from steptwin.mic488.inifile import Header, IniEntry, IniFile
from steptwin.symbols import SymbolKind

_COMMENTS = (";", "#", "//")


class ConfigAnalysis(Analysis):
    """``firmware`` is that of the controller it is for."""

    def __init__(self, uri: str, lines: LineIndex, firmware: str) -> None:
        super().__init__(uri, lines)
        self._firmware = firmware
        self._file = IniFile.of_text(lines.text)

    @cached_property
    def _keys(self) -> Mapping[str, Mapping[str, ConfigKey]]:
        """The keys of every section, both in lower case."""
        return {section.lower(): {key.name.lower(): key for key in keys_of(section, self._firmware)} for section in sections_of()}

    def _key(self, entry: IniEntry) -> ConfigKey | None:
        return self._keys.get(entry.section.lower(), {}).get(entry.key.lower())

    def diagnostics(self) -> Sequence[Diagnostic]:
        return examine_config(self._file, self._firmware)[1]

    def _entry_at(self, place: int) -> IniEntry | None:
        return next((e for e in self._file.entries if e.key_span.start <= place <= max(e.key_span.end, e.value_span.end)), None)

    def hover(self, place: int) -> Hover | None:
        entry = self._entry_at(place)
        if entry is None:
            return self._hover_section(place)
        key = self._key(entry)
        if key is None:
            return None
        span = Span(entry.key_span.start, max(entry.key_span.end, entry.value_span.end))
        meaning = _meaning(key, entry.value)
        value = f"\n\n{entry.value} is {meaning}." if meaning else ""
        return Hover(span, f"`[{entry.section}] {key.name}`\n\n{key.hint[0].upper()}{key.hint[1:]}.{value}")

    def _hover_section(self, place: int) -> Hover | None:
        header = next((header for header in self._file.headers if header.span.start <= place <= header.span.end), None)
        keys = {} if header is None else self._keys.get(header.section.lower(), {})
        if header is None or not keys:
            return None
        rows = [f"* `{key.name}`: {key.hint}" for key in keys.values()]
        return Hover(header.span, "\n".join((f"`[{header.section}]` {_section_meaning(header.section)}\n", *rows)))

    def items(self, place: int) -> Completions:
        number = self.lines.line_of(place)
        start = self.lines.starts[number]
        before = self.text[start:place].lstrip()
        if before.startswith(_COMMENTS):
            return Completions(())
        if before.startswith("["):
            span = Span(place - len(before), self.lines.end(number))
            names = [name for name in sections_of() if name.lower() not in self._present]
            return Completions([Completion(f"[{name}]", CompletionKind.KEY, span, "section") for name in names])
        header = self._header_at(place)
        keys = self._keys.get(header.section.lower(), {}) if header is not None else {}
        name, equals, value = before.partition("=")
        if not equals:
            return Completions(tuple(self._key_items(keys, header, Span(place - len(before), place))))
        key = keys.get(name.strip().lower())
        span = Span(place - len(value.lstrip()), place)
        return Completions(
            () if key is None else [Completion(f"{n}", CompletionKind.VALUE, span, text) for n, text in key.choices.items()]
        )

    def _key_items(self, keys: Mapping[str, ConfigKey], header: Header | None, span: Span) -> Iterator[Completion]:
        for key in keys.values():
            if header is not None and self._file.find(header.section, key.name) is None:
                yield Completion(key.name, CompletionKind.KEY, span, key.hint, insert=f"{key.name}=")

    @cached_property
    def _present(self) -> frozenset[str]:
        return frozenset(header.section.lower() for header in self._file.headers)

    def _header_at(self, place: int) -> Header | None:
        return next((header for header in reversed(self._file.headers) if header.span.start < place), None)

    def _sections(self) -> Iterator[tuple[Header, int]]:
        """Every section and the last line that belongs to it."""
        headers = self._file.headers
        for header, following in zip(headers, (*headers[1:], None), strict=False):
            last = len(self.lines.starts) if following is None else self.lines.line_of(following.span.start)
            while last > 0 and not self.lines.line(last - 1).strip():
                last -= 1
            yield header, last - 1

    def outline(self) -> Sequence[OutlineItem]:
        return [self._section(header, last) for header, last in self._sections()]

    def _section(self, header: Header, last: int) -> OutlineItem:
        span = Span(header.span.start, max(header.span.end, self.lines.end(last)))
        inside = [entry for entry in self._file.entries if span.start <= entry.key_span.start < span.end]
        children = tuple(
            OutlineItem(entry.key, SymbolKind.KEY, Span(entry.key_span.start, entry.value_span.end), entry.key_span, entry.value)
            for entry in inside
            if entry.value_span.end >= entry.key_span.end
        )
        return OutlineItem(f"[{header.section}]", SymbolKind.SECTION, span, header.span, "", children)

    def folds(self) -> Sequence[Fold]:
        lines = ((self.lines.line_of(header.span.start), last) for header, last in self._sections())
        return [Fold(first, last) for first, last in lines if last > first]

    def tokens(self) -> Sequence[SemanticToken]:
        found = [SemanticToken(header.span, TokenKind.SECTION) for header in self._file.headers]
        for entry in self._file.entries:
            found.append(SemanticToken(entry.key_span, TokenKind.REGISTER))
            if entry.value_span.end > entry.value_span.start:
                found.append(SemanticToken(entry.value_span, TokenKind.NUMBER))
        for number, start in enumerate(self.lines.starts):
            content = self.lines.line(number)
            if content.lstrip().startswith(_COMMENTS):
                found.append(
                    SemanticToken(Span(start + len(content) - len(content.lstrip()), start + len(content)), TokenKind.COMMENT)
                )
        return sorted(found, key=lambda token: token.span)

    def hints(self) -> Sequence[Hint]:
        """Meanings of the numbers."""
        found: list[Hint] = []
        for entry in self._file.entries:
            key = self._key(entry)
            meaning = "" if key is None else _meaning(key, entry.value)
            if meaning:
                found.append(Hint(entry.value_span.end, meaning, "the meaning of the number"))
        return found


def _section_meaning(section: str) -> str:
    """Meaning of a section of the configuration."""
    kind, number = section.rstrip("0123456789").lower(), section.lstrip("AINXSainxs")
    if kind == "axis":
        return f"is axis M{int(number) + 1}."
    if kind in ("in", "ain"):
        return f"is {'input IN' if kind == 'in' else 'analog input AIN'}{int(number) + 1}."
    return {"wbc_program": "is for programs.", "trigger": "is for the trigger mode."}.get(section.lower(), "")


def _meaning(key: ConfigKey, value: str) -> str:
    """The meaning of a value, if its numbers have meanings."""
    if not value.isascii() or not value.isdecimal() or len(value) > 9:
        return ""
    number = int(value)
    if key.attribute in ("in_kl", "in_kr"):
        return input_name(number)
    return key.choices.get(number, "")
