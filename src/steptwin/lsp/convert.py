"""Answers in the types of the protocol, places as lines and columns. The only module that uses both."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from lsprotocol import types as lsp

from steptwin.diagnostics import Diagnostic, Severity, Span
from steptwin.lsp import answers as a
from steptwin.lsp.positions import Encoding, LineIndex
from steptwin.messages import text_of
from steptwin.symbols import SymbolKind

SOURCE = "steptwin"
_SEVERITIES = {
    Severity.ERROR: lsp.DiagnosticSeverity.Error,
    Severity.WARNING: lsp.DiagnosticSeverity.Warning,
    Severity.NOTE: lsp.DiagnosticSeverity.Hint,
}
_UNNECESSARY = frozenset({"W204", "W206", "W251", "M206", "M207"})
"""Codes of findings about unnecessary code, which editors show faded."""
_ITEM_KINDS = {
    a.CompletionKind.KEYWORD: lsp.CompletionItemKind.Keyword,
    a.CompletionKind.SNIPPET: lsp.CompletionItemKind.Snippet,
    a.CompletionKind.REGISTER: lsp.CompletionItemKind.Property,
    a.CompletionKind.CONSTANT: lsp.CompletionItemKind.Constant,
    a.CompletionKind.VARIABLE: lsp.CompletionItemKind.Variable,
    a.CompletionKind.VALUE: lsp.CompletionItemKind.EnumMember,
    a.CompletionKind.LABEL: lsp.CompletionItemKind.Method,
    a.CompletionKind.POSITION: lsp.CompletionItemKind.Struct,
    a.CompletionKind.FUNCTION: lsp.CompletionItemKind.Function,
    a.CompletionKind.KEY: lsp.CompletionItemKind.Field,
    a.CompletionKind.FILE: lsp.CompletionItemKind.File,
}
SYMBOL_KINDS = {
    SymbolKind.CONSTANT: lsp.SymbolKind.Constant,
    SymbolKind.VARIABLE: lsp.SymbolKind.Variable,
    SymbolKind.REGISTER: lsp.SymbolKind.Property,
    SymbolKind.VALUE: lsp.SymbolKind.EnumMember,
    SymbolKind.FUNCTION: lsp.SymbolKind.Function,
    SymbolKind.LABEL: lsp.SymbolKind.Function,
    SymbolKind.POSITION: lsp.SymbolKind.Struct,
    SymbolKind.SECTION: lsp.SymbolKind.Namespace,
    SymbolKind.KEY: lsp.SymbolKind.Field,
    SymbolKind.CONTROLLER: lsp.SymbolKind.Class,
    SymbolKind.LINE: lsp.SymbolKind.Interface,
    SymbolKind.AXIS: lsp.SymbolKind.Object,
    SymbolKind.BUTTON: lsp.SymbolKind.Event,
    SymbolKind.ELEMENT: lsp.SymbolKind.Object,
    SymbolKind.SCRIPT: lsp.SymbolKind.Method,
}
TOKEN_TYPES = [kind.value for kind in a.TokenKind]
_TOKEN_NUMBERS = {kind: number for number, kind in enumerate(a.TokenKind)}
TOKEN_MODIFIERS = ["modification", "readonly"]


class Converter:
    """For one text and the encoding of its client."""

    def __init__(self, lines: LineIndex, encoding: Encoding) -> None:
        self.lines = lines
        self._encoding = encoding

    def place(self, position: lsp.Position) -> int:
        return self.lines.place(position.line, position.character, self._encoding)

    def span(self, range_: lsp.Range) -> Span:
        start = self.place(range_.start)
        return Span(start, max(start, self.place(range_.end)))

    def position(self, place: int) -> lsp.Position:
        return lsp.Position(*self.lines.position(min(place, len(self.lines.text)), self._encoding))

    def range(self, span: Span) -> lsp.Range:
        return lsp.Range(self.position(span.start), self.position(span.end))

    def diagnostic(self, found: Diagnostic) -> lsp.Diagnostic:
        """Its ``data`` are message and hint as messages (`steptwin.messages`), for the page of the studio."""
        lines = [found.message] if found.hint is None else [found.message, found.hint]
        tags = [lsp.DiagnosticTag.Unnecessary] if found.code in _UNNECESSARY else None
        severity = _SEVERITIES[found.severity]
        data = [text_of(line).to_json() for line in lines]
        return lsp.Diagnostic(
            self.range(found.span), "\n".join(lines), severity=severity, code=found.code, source=SOURCE, tags=tags, data=data
        )

    def hover(self, found: a.Hover) -> lsp.Hover:
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, found.text), self.range(found.span))

    def items(self, found: a.Completions, *, snippets: bool) -> lsp.CompletionList:
        ranges: dict[Span, lsp.Range] = {}
        for item in found.items:
            if item.span not in ranges:
                ranges[item.span] = self.range(item.span)
        items = [self._item(item, ranges[item.span], number, snippets=snippets) for number, item in enumerate(found.items)]
        return lsp.CompletionList(not found.is_complete, items)

    @staticmethod
    def _item(item: a.Completion, range_: lsp.Range, number: int, *, snippets: bool) -> lsp.CompletionItem:
        insert = item.insert or item.label
        is_snippet = item.is_snippet and snippets
        return lsp.CompletionItem(
            item.label,
            kind=_ITEM_KINDS[item.kind],
            detail=item.detail or None,
            documentation=lsp.MarkupContent(lsp.MarkupKind.Markdown, item.text) if item.text else None,
            sort_text=f"{number:04}",
            insert_text_format=lsp.InsertTextFormat.Snippet if is_snippet else lsp.InsertTextFormat.PlainText,
            text_edit=lsp.TextEdit(range_, item.label if item.is_snippet and not snippets else insert),
        )

    @staticmethod
    def signature(found: a.Signature) -> lsp.SignatureHelp:
        parameters = [lsp.ParameterInformation(parameter) for parameter in found.parameters]
        text = lsp.MarkupContent(lsp.MarkupKind.Markdown, found.text)
        # One past the last means that none is being typed.
        active = len(parameters) if found.active is None else found.active
        return lsp.SignatureHelp([lsp.SignatureInformation(found.label, text, parameters)], 0, active)

    def section(self, found: a.OutlineItem) -> lsp.DocumentSymbol:
        span = Span(min(found.span.start, found.name_span.start), max(found.span.end, found.name_span.end))
        children = [self.section(child) for child in found.children]
        kind = SYMBOL_KINDS[found.kind]
        ranges = self.range(span), self.range(found.name_span)
        return lsp.DocumentSymbol(found.name or "?", kind, *ranges, detail=found.detail or None, children=children or None)

    @staticmethod
    def fold(found: a.Fold) -> lsp.FoldingRange:
        return lsp.FoldingRange(found.first, found.last, kind=found.kind.value)

    def edits(self, found: Iterable[a.Edit]) -> list[lsp.TextEdit]:
        return [lsp.TextEdit(self.range(edit.span), edit.text) for edit in found]

    def hint(self, found: a.Hint) -> lsp.InlayHint:
        return lsp.InlayHint(self.position(found.place), found.label, tooltip=found.text or None, padding_left=True)

    def tokens(self, found: Sequence[a.SemanticToken]) -> lsp.SemanticTokens:
        """Line and column each as the difference to the token before, length, type, modifiers."""
        data: list[int] = []
        line = column = 0
        for token in found:
            at, start = self.lines.position(token.span.start, self._encoding)
            end = self.lines.position(token.span.end, self._encoding)[1]
            modifiers = int(token.written) | int(token.fixed) << 1
            data += (at - line, start - column if at == line else start, end - start, _TOKEN_NUMBERS[token.kind], modifiers)
            line, column = at, start
        return lsp.SemanticTokens(data)


def changes_of(edits: a.Edits, converter: Callable[[str], Converter | None], spelled: Callable[[str], str]) -> lsp.WorkspaceEdit:
    """Edits by file; ``converter`` gives that of each text, ``shown`` its address for the client."""
    changes: dict[str, Sequence[lsp.TextEdit]] = {}
    for uri, found in edits.items():
        made = converter(uri)
        if made is not None:
            changes[spelled(uri)] = made.edits(found)
    return lsp.WorkspaceEdit(changes=changes)
