"""Navigation by names over all texts: definitions, references, renaming, callers; and quick fixes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from steptwin.diagnostics import Diagnostic, Span
from steptwin.errors import Misuse
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import SHARED, CallEdge, CodeAction, Edit, OutlineItem, TextLocation
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.files import normal
from steptwin.lsp.letters import has_letters
from steptwin.messages import Message, MessageText
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use

FIX = Message("lsp.fix", "{action} ({code})")
START_A_NEW_LINE = Message("lsp.start-a-new-line", "Start a new line")
REMOVE_THE_EMPTY_LINE = Message("lsp.remove-the-empty-line", "Remove the empty line")
REMOVE = Message("lsp.remove", "Remove {old}")
WRITE_A_BLANK = Message("lsp.write-a-blank", "Write a blank")
WRITE = Message("lsp.write", "Write {new}")
REPLACE = Message("lsp.replace", "Replace {old} by {new}")

MOST_SYMBOLS = 500
"""Answers to a search over all texts."""


def _texts_with(session: EditorSession, uri: str, symbol: Symbol) -> Iterator[tuple[str, Analysis]]:
    """The texts in which a name means the same: its own, and those of its controller for what a controller shares."""
    own = session.analysis(uri)
    if own is not None:
        yield normal(uri), own
    if symbol.kind in SHARED:
        for other in session.related(uri):
            analysis = session.analysis(other)
            if analysis is not None:
                yield other, analysis


def _use_at(session: EditorSession, uri: str, place: int) -> Use | None:
    analysis = session.analysis(uri)
    return None if analysis is None else analysis.use_at(place)


def definition(session: EditorSession, uri: str, place: int) -> list[TextLocation]:
    """Where the name at a place is defined; of a name of a file, that file."""
    analysis = session.analysis(uri)
    if analysis is None:
        return []
    linked = [TextLocation(link.uri, Span(0, 0)) for link in analysis.links() if link.span.start <= place <= link.span.end]
    use = analysis.use_at(place)
    if linked or use is None:
        return linked
    found = [
        TextLocation(where, span)
        for where, other in _texts_with(session, uri, use.symbol)
        for span in other.definitions(use.symbol)
    ]
    return found or [TextLocation(normal(uri), span) for span in analysis.also_defined(use.symbol)]


def references(session: EditorSession, uri: str, place: int, *, with_definition: bool = True) -> list[TextLocation]:
    use = _use_at(session, uri, place)
    if use is None:
        return []
    return [
        TextLocation(where, other.span)
        for where, analysis in _texts_with(session, uri, use.symbol)
        for other in analysis.uses
        if other.symbol == use.symbol and (with_definition or other.role is not SymbolRole.DEFINE)
    ]


def highlights(session: EditorSession, uri: str, place: int) -> list[Use]:
    """The uses of the name at a place in its own text."""
    analysis = session.analysis(uri)
    use = None if analysis is None else analysis.use_at(place)
    return [] if analysis is None or use is None else [other for other in analysis.uses if other.symbol == use.symbol]


def renamable(session: EditorSession, uri: str, place: int) -> Use:
    """The name at a place. Raises `Misuse` where there is none that could have another."""
    analysis = session.analysis(uri)
    use = None if analysis is None else analysis.use_at(place)
    if analysis is None or use is None:
        raise Misuse("there is no name here")
    problem = analysis.new_name_problem(use.symbol, use.symbol.text)
    if problem is not None:
        raise Misuse(problem)
    return use


def rename(session: EditorSession, uri: str, place: int, text: str) -> dict[str, list[Edit]]:
    """The edits that give the name at a place another text. Raises `Misuse` where it cannot have it."""
    use = renamable(session, uri, place)
    edits: dict[str, list[Edit]] = {}
    for where, analysis in _texts_with(session, uri, use.symbol):
        spans = [other.span for other in analysis.uses if other.symbol == use.symbol]
        if spans:
            problem = analysis.new_name_problem(use.symbol, text)
            if problem is not None:
                raise Misuse(problem)
            edits[where] = [Edit(span, text) for span in spans]
    return edits


def fixes(session: EditorSession, uri: str, span: Span) -> list[CodeAction]:
    """Quick fixes of the findings in a part of a text."""
    analysis = session.analysis(uri)
    if analysis is None:
        return []
    found: list[CodeAction] = []
    for diagnostic in analysis.diagnostics():
        fix = diagnostic.fix
        if fix is not None and diagnostic.span.start <= span.end and span.start <= diagnostic.span.end:
            edits = {normal(uri): [Edit(fix.span, fix.text)]}
            found.append(
                CodeAction(_title(diagnostic, analysis.text[fix.span.start : fix.span.end], fix.text), edits, diagnostic)
            )
    return found


def _title(diagnostic: Diagnostic, old: str, new: str) -> MessageText:
    old, shown = old.strip(), new.strip()
    if shown:
        action = REPLACE(old=old, new=shown) if old else WRITE(new=shown)
    elif new:
        action = START_A_NEW_LINE() if "\n" in new else WRITE_A_BLANK()
    else:
        action = REMOVE(old=old) if old else REMOVE_THE_EMPTY_LINE()
    return FIX(action=MessageText(action.splitlines()[0][:100], action.id, action.values), code=diagnostic.code)


def workspace_symbols(session: EditorSession, query: str) -> list[tuple[str, OutlineItem]]:
    """The names in the open texts and the files of their controllers that contain the letters of the query in order."""
    wanted = query.lower()
    uris = dict.fromkeys(other for uri in session.open_uris for other in (uri, *session.related(uri)))
    found: list[tuple[str, OutlineItem]] = []
    for uri in uris:
        analysis = session.analysis(uri)
        for section in () if analysis is None else _all(analysis.outline()):
            if has_letters(section.name.lower(), wanted):
                found.append((uri, section))
                if len(found) == MOST_SYMBOLS:
                    return found
    return found


def _all(sections: Iterable[OutlineItem]) -> Iterator[OutlineItem]:
    for section in sections:
        yield section
        yield from _all(section.children)


# -- calls


@dataclass(frozen=True, slots=True)
class Caller:
    """Lines of a program that call or are called: those below a label, or (``key`` "") those before the first."""

    uri: str
    key: str
    section: OutlineItem


def caller_at(session: EditorSession, uri: str, place: int) -> Caller | None:
    """The label that is named at a place, else the one whose lines the place is in."""
    analysis = session.analysis(uri)
    if analysis is None or not (analysis.calls() or any(s.kind is SymbolKind.LABEL for s in analysis.outline())):
        return None
    callers = callers_of(normal(uri), analysis)
    use = analysis.use_at(place)
    if use is not None and use.symbol.kind is SymbolKind.LABEL:
        return callers.get(use.symbol.key)
    inside = [caller for caller in callers.values() if caller.section.span.start <= place <= caller.section.span.end]
    return inside[-1] if inside else callers.get("")


def callers_of(uri: str, analysis: Analysis) -> dict[str, Caller]:
    """By key. The program before its first label comes first."""
    labels = [use for use in analysis.uses if use.symbol.kind is SymbolKind.LABEL and use.role is SymbolRole.DEFINE]
    sections = {section.name_span: section for section in analysis.outline() if section.kind is SymbolKind.LABEL}
    first = min((use.span.start for use in labels), default=len(analysis.text))
    main = OutlineItem("program", SymbolKind.SECTION, Span(0, first), Span(0, 0))
    found = {"": Caller(uri, "", main)}
    for use in labels:
        section = sections.get(use.span)
        if section is not None:
            found.setdefault(use.symbol.key, Caller(uri, use.symbol.key, section))
    return found


def calls(session: EditorSession, uri: str, key: str, *, incoming: bool) -> list[tuple[Caller, list[CallEdge]]]:
    """Callers of the lines of a label, or the labels that they call, each with the places."""
    analysis = session.analysis(uri)
    if analysis is None:
        return []
    callers = callers_of(normal(uri), analysis)
    grouped: dict[str, list[CallEdge]] = {}
    for call in analysis.calls():
        if key == (call.callee if incoming else call.caller):
            grouped.setdefault(call.caller if incoming else call.callee, []).append(call)
    return [(callers[other], found) for other, found in grouped.items() if other in callers]
