"""Messages about source text: one type for the command line, the studio and the editor.

Offsets count characters of the text from 0; lines and columns shown to people count from 1.
"""

from __future__ import annotations

import enum
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from steptwin.jsonvalues import to_json
from steptwin.messages import Message, MessageText, text_of

REPORT = Message("diagnostics.report", "{lines:\n}")
FOUND = Message("diagnostics.found", "{place}: {severity} {code}: {message}")
HINT = Message("diagnostics.hint", "  {pad} = {hint}")
SUGGESTION = Message("diagnostics.suggestion", "  {pad} = suggestion: {text}")
REMOVE_IT = Message("diagnostics.remove-it", "remove it")
START_A_NEW_LINE = Message("diagnostics.start-a-new-line", "start a new line")
A_BLANK = Message("diagnostics.a-blank", "a blank")
MORE = Message("diagnostics.more", "{name}: {count} more are not shown")
LONGEST_SHOWN = 400
"""Characters of a source line in a message; of a longer one the part around the place."""
MOST_SHOWN = 100
"""Diagnostics of one text shown to people; JSON has all of them."""
LONGEST_TEXT = 500
"""Characters of a message shown to people: it may quote a word of any length."""
# C0 and C1 except tabs, and characters that reverse the direction of writing.
_CONTROL = re.compile("[\x00-\x08\x0a-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_PICTURES = {chr(code): chr(0x2400 + code) for code in range(0x20)} | {"\x7f": "\u2421"}
_LINE_END = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """Characters ``start`` (included) to ``end`` (excluded) of a source text."""

    start: int
    end: int


class Severity(enum.Enum):
    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


_SEVERITIES = {one: Message(f"diagnostics.{one.value}", one.value)() for one in Severity}


@dataclass(frozen=True, slots=True)
class Fix:
    """Replace ``span`` by ``text``. ``is_named``: the message or the hint has the text already."""

    span: Span
    text: str
    is_named: bool = False


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding. ``code`` is stable (``M101``, ``W204``), ``message`` is the finding, ``hint`` what is permitted."""

    code: str
    severity: Severity
    span: Span
    message: str
    hint: str | None = None
    fix: Fix | None = None


@dataclass(frozen=True)
class SourceText:
    """A named text that knows its lines.

    Lines end where editors end them: at a line feed, a carriage return or both. Other separators that
    ``str.splitlines`` knows (form feed, U+2028) stay inside a line. After a final line end comes an empty last line.
    """

    name: str
    text: str

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *(end.end() for end in _LINE_END.finditer(self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a character offset, both from 1. The offset after the last character has a place too."""
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1

    def line(self, number: int) -> str:
        """Text of a line (from 1) without its end."""
        first, after = self._starts[number - 1], self._starts[number : number + 1]
        return self.text[first : after[0] if after else None].rstrip("\r\n")


def split_lines(text: str) -> Iterator[tuple[str, str]]:
    """The lines of a text as `SourceText` counts them, each with its line end; an empty last line is left out."""
    start = 0
    for end in _LINE_END.finditer(text):
        yield text[start : end.start()], end.group()
        start = end.end()
    if start < len(text):
        yield text[start:], ""


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The diagnostics in the order of the text."""
    return sorted(diagnostics, key=lambda d: (d.span.start, d.span.end, d.code))


def render(source: SourceText, diagnostics: Sequence[Diagnostic]) -> MessageText:
    """The diagnostics as text: place, severity, code, message, source line with carets, hint, suggestion.

    For terminals: at most `MOST_SHOWN` of them, long texts cut, control characters made visible.
    """
    lines: list[str] = []
    for d in diagnostics[:MOST_SHOWN]:
        line, column = source.position(d.span.start)
        text = source.line(line)
        before = len(text[: column - 1].expandtabs(4))
        marked = text[: column - 1 + d.span.end - d.span.start]
        width = max(1, len(marked.expandtabs(4)) - before)
        gutter = str(line)
        pad = " " * len(gutter)
        shown = text.expandtabs(4)
        if len(shown) > LONGEST_SHOWN:
            first = min(max(0, before - LONGEST_SHOWN // 2), len(shown) - LONGEST_SHOWN)
            shown, before = shown[first : first + LONGEST_SHOWN], before - first
            width = min(width, LONGEST_SHOWN - before) or 1
        place = f"{visible(source.name)}:{line}:{column}"
        lines.append(FOUND(place=place, severity=_SEVERITIES[d.severity], code=d.code, message=_cut(d.message)))
        lines.append(f"  {gutter} | {visible(shown)}")
        lines.append(f"  {pad} | {' ' * before}{'^' * width}")
        if d.hint:
            lines.append(HINT(pad=pad, hint=_cut(d.hint)))
        if d.fix and not d.fix.is_named:
            lines.append(SUGGESTION(pad=pad, text=_cut(d.fix.text.strip()) or _blank_fix(d.fix.text)))
    if len(diagnostics) > MOST_SHOWN:
        lines.append(MORE(name=visible(source.name), count=len(diagnostics) - MOST_SHOWN))
    return REPORT(lines=lines)


def _cut(text: str) -> MessageText:
    """A text for a terminal, of a length that it can show."""
    said = text_of(text)
    return MessageText(visible(text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}…"), said.id, said.values)


def visible(text: str) -> str:
    """A text for a terminal: every control character becomes one character that shows it, so that columns stay."""
    return _CONTROL.sub(lambda found: _PICTURES.get(found[0], "\ufffd"), text)


def _blank_fix(text: str) -> MessageText:
    if not text:
        return REMOVE_IT()
    return START_A_NEW_LINE() if "\n" in text else A_BLANK()


@dataclass(frozen=True, slots=True)
class Finding:
    """A diagnostic with its place in the text; lines and columns count from 1."""

    line: int
    column: int
    end_line: int
    end_column: int
    severity: Severity
    code: str
    message: str
    hint: str | None


def findings(source: SourceText, diagnostics: Sequence[Diagnostic]) -> tuple[Finding, ...]:
    places = [(*source.position(one.span.start), *source.position(one.span.end)) for one in diagnostics]
    return tuple(
        [Finding(*at, one.severity, one.code, one.message, one.hint) for at, one in zip(places, diagnostics, strict=True)]
    )


def diagnostics_to_json(source: SourceText, diagnostics: Sequence[Diagnostic]) -> list[dict[str, object]]:
    """The diagnostics as plain data: file, the fields of `Finding`, fix."""
    rows: list[dict[str, object]] = []
    for d, finding in zip(diagnostics, findings(source, diagnostics), strict=True):
        row: dict[str, object] = {"file": source.name, **to_json(finding), "fix": None}
        if d.fix:
            fl, fc = source.position(d.fix.span.start)
            el, ec = source.position(d.fix.span.end)
            row["fix"] = {"line": fl, "column": fc, "end_line": el, "end_column": ec, "text": d.fix.text}
        rows.append(row)
    return rows
