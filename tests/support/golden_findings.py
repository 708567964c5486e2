"""Findings as golden files have them: place, severity, code, the marked text, message; below them the hint and the repair.

`steptwin.diagnostics.render` repeats the source line, which stands above in a golden file, and leaves out most repairs.
"""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.diagnostics import Diagnostic, SourceText, Span


def shown(source: SourceText, diagnostics: Iterable[Diagnostic]) -> str:
    lines = []
    for found in diagnostics:
        line, column = source.position(found.span.start)
        lines.append(f"{line}:{column} {found.severity.value} {found.code} {_marked(source, found.span)}: {found.message}")
        if found.hint:
            lines.append(f"    = {found.hint}")
        if found.fix:
            lines.append(f"    {_marked(source, found.fix.span)} → {_quoted(found.fix.text)}")
    return "\n".join(lines)


def _marked(source: SourceText, span: Span) -> str:
    return _quoted(source.text[span.start : span.end])


def _quoted(text: str) -> str:
    return f"«{''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)}»"
