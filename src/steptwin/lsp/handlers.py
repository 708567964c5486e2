"""Handlers of the messages of the protocol: each asks the session and converts its answer; `HANDLERS` names them all.

They are synchronous: an answer belongs to one state of the texts.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from lsprotocol import types as lsp
from pygls.capabilities import get_capability
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams

from steptwin.errors import Misuse
from steptwin.lsp import navigation
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import TextLocation
from steptwin.lsp.convert import SYMBOL_KINDS, TOKEN_MODIFIERS, TOKEN_TYPES, Converter, changes_of
from steptwin.lsp.documents import TextChange
from steptwin.lsp.editorserver import EditorServer
from steptwin.lsp.languages import LANGUAGES
from steptwin.symbols import SymbolRole

Answer = TypeVar("Answer")


class AtPosition(typing.Protocol):
    """The parameters of a question about a place."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


def _of(server: EditorServer, uri: str, ask: Callable[[Analysis, Converter], Answer]) -> Answer | None:
    """The answer of an analysis; None if there is no analysis."""
    found = server.analysed(uri)
    return None if found is None else ask(*found)


def _at(server: EditorServer, params: AtPosition, ask: Callable[[Analysis, Converter, int], Answer]) -> Answer | None:
    """As `_of`, for a place."""
    return _of(server, params.text_document.uri, lambda text, converter: ask(text, converter, converter.place(params.position)))


def _refused(error: Misuse) -> JsonRpcInvalidParams:
    return JsonRpcInvalidParams(str(error))


# ---------------------------------------------------------------------- texts


def _initialize(server: EditorServer, params: lsp.InitializeParams) -> None:
    server.begin(params)


async def _initialized(server: EditorServer, params: lsp.InitializedParams) -> None:
    """Register for notifications of files that change outside the editor, if the client supports them."""
    capabilities = server.client_capabilities
    if not get_capability(capabilities, "workspace.did_change_watched_files.dynamic_registration", False):
        return
    watchers = [lsp.FileSystemWatcher(f"**/*{one.suffix}") for one in LANGUAGES.values()]
    options = lsp.DidChangeWatchedFilesRegistrationOptions(watchers)
    registration = lsp.Registration("files", lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
    # A client that refuses is asked nothing: files are read anyway when an answer depends on them.
    with suppress(JsonRpcException):
        await server.client_register_capability_async(lsp.RegistrationParams([registration]))


def _did_open(server: EditorServer, params: lsp.DidOpenTextDocumentParams) -> None:
    text = params.text_document
    server.session.open(text.uri, text.language_id, text.version, text.text)
    server.changed(text.uri)


def _did_change(server: EditorServer, params: lsp.DidChangeTextDocumentParams) -> None:
    server.session.change(params.text_document.uri, params.text_document.version, [_change(c) for c in params.content_changes])
    server.changed(params.text_document.uri)


def _change(change: lsp.TextDocumentContentChangeEvent) -> TextChange:
    if isinstance(change, lsp.TextDocumentContentChangeWholeDocument):
        return TextChange(change.text)
    start, end = change.range.start, change.range.end
    return TextChange(change.text, (start.line, start.character), (end.line, end.character))


def _end(server: EditorServer, _: object) -> None:
    server.end()


def _did_close(server: EditorServer, params: lsp.DidCloseTextDocumentParams) -> None:
    others = server.session.affected(params.text_document.uri)[1:]
    server.session.close(params.text_document.uri)
    server.closed(params.text_document.uri)
    for other in others:
        server.changed(other)


def _did_save(server: EditorServer, params: lsp.DidSaveTextDocumentParams) -> None:
    server.changed_outside()


def _did_change_watched_files(server: EditorServer, params: lsp.DidChangeWatchedFilesParams) -> None:
    server.changed_outside()


# ---------------------------------------------------------------------- questions about a place


def _hover(server: EditorServer, params: lsp.HoverParams) -> lsp.Hover | None:
    def ask(text: Analysis, converter: Converter, place: int) -> lsp.Hover | None:
        found = text.hover(place)
        return None if found is None else converter.hover(found)

    return _at(server, params, ask)


def _completion(server: EditorServer, params: lsp.CompletionParams) -> lsp.CompletionList | None:
    return _at(server, params, lambda text, conv, place: conv.items(text.items(place), snippets=server.snippets))


def _signature_help(server: EditorServer, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    def ask(text: Analysis, converter: Converter, place: int) -> lsp.SignatureHelp | None:
        found = text.signature(place)
        return None if found is None else converter.signature(found)

    return _at(server, params, ask)


def _definition(server: EditorServer, params: lsp.DefinitionParams) -> list[lsp.Location] | None:
    uri = params.text_document.uri
    found = _at(server, params, lambda text, conv, place: navigation.definition(server.session, uri, place))
    return [server.location(place) for place in found or ()] or None


def _references(server: EditorServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    uri, with_definition = params.text_document.uri, params.context.include_declaration
    found = _at(
        server,
        params,
        lambda text, conv, place: navigation.references(server.session, uri, place, with_definition=with_definition),
    )
    return [server.location(place) for place in found or ()]


def _document_highlight(server: EditorServer, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
    def ask(text: Analysis, converter: Converter, place: int) -> list[lsp.DocumentHighlight]:
        found = navigation.highlights(server.session, params.text_document.uri, place)
        kinds = lsp.DocumentHighlightKind
        return [
            lsp.DocumentHighlight(converter.range(use.span), kinds.Read if use.role is SymbolRole.READ else kinds.Write)
            for use in found
        ]

    return _at(server, params, ask) or []


def _prepare_rename(server: EditorServer, params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder | None:
    def ask(text: Analysis, converter: Converter, place: int) -> lsp.PrepareRenamePlaceholder:
        try:
            use = navigation.renamable(server.session, params.text_document.uri, place)
        except Misuse as error:
            raise _refused(error) from None
        return lsp.PrepareRenamePlaceholder(converter.range(use.span), use.symbol.text)

    return _at(server, params, ask)


def _rename(server: EditorServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
    converter = server.converter(params.text_document.uri)
    if converter is None:
        return None
    place = converter.place(params.position)
    try:
        edits = navigation.rename(server.session, params.text_document.uri, place, params.new_name)
    except Misuse as error:
        raise _refused(error) from None
    return changes_of(edits, server.converter, server.session.spelled)


def _prepare_calls(server: EditorServer, params: lsp.CallHierarchyPrepareParams) -> list[lsp.CallHierarchyItem] | None:
    def ask(text: Analysis, converter: Converter, place: int) -> list[lsp.CallHierarchyItem] | None:
        found = navigation.caller_at(server.session, params.text_document.uri, place)
        return None if found is None else [_call_item(server, converter, found)]

    return _at(server, params, ask)


def _call_item(server: EditorServer, converter: Converter, caller: navigation.Caller) -> lsp.CallHierarchyItem:
    section = caller.section
    ranges = converter.range(section.span), converter.range(section.name_span)
    kind = SYMBOL_KINDS[section.kind]
    return lsp.CallHierarchyItem(section.name, kind, server.session.spelled(caller.uri), *ranges, detail=None, data=caller.key)


def _calls(server: EditorServer, item: lsp.CallHierarchyItem, *, incoming: bool) -> list[tuple[Any, list[lsp.Range]]]:
    """The other ends of calls with the places of the statements that call."""
    converter = server.converter(item.uri)
    if converter is None or not isinstance(item.data, str):
        return []
    found = navigation.calls(server.session, item.uri, item.data, incoming=incoming)
    return [(_call_item(server, converter, other), [converter.range(call.span) for call in calls]) for other, calls in found]


def _incoming_calls(server: EditorServer, params: lsp.CallHierarchyIncomingCallsParams) -> list[lsp.CallHierarchyIncomingCall]:
    return [lsp.CallHierarchyIncomingCall(item, ranges) for item, ranges in _calls(server, params.item, incoming=True)]


def _outgoing_calls(server: EditorServer, params: lsp.CallHierarchyOutgoingCallsParams) -> list[lsp.CallHierarchyOutgoingCall]:
    return [lsp.CallHierarchyOutgoingCall(item, ranges) for item, ranges in _calls(server, params.item, incoming=False)]


# ---------------------------------------------------------------------- questions about a text


def _document_symbol(server: EditorServer, params: lsp.DocumentSymbolParams) -> Sequence[lsp.DocumentSymbol] | None:
    return _of(server, params.text_document.uri, lambda text, conv: [conv.section(section) for section in text.outline()])


def _folding_range(server: EditorServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange] | None:
    return _of(server, params.text_document.uri, lambda text, conv: [conv.fold(fold) for fold in text.folds()])


def _formatting(server: EditorServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit] | None:
    return _of(server, params.text_document.uri, lambda text, conv: conv.edits(text.format_edits()))


def _semantic_tokens(server: EditorServer, params: lsp.SemanticTokensParams) -> lsp.SemanticTokens | None:
    return _of(server, params.text_document.uri, lambda text, conv: conv.tokens(text.tokens()))


def _semantic_tokens_range(server: EditorServer, params: lsp.SemanticTokensRangeParams) -> lsp.SemanticTokens | None:
    def ask(text: Analysis, converter: Converter) -> lsp.SemanticTokens:
        span = converter.span(params.range)
        return converter.tokens([t for t in text.tokens() if t.span.start <= span.end and span.start <= t.span.end])

    return _of(server, params.text_document.uri, ask)


def _inlay_hint(server: EditorServer, params: lsp.InlayHintParams) -> list[lsp.InlayHint] | None:
    def ask(text: Analysis, converter: Converter) -> list[lsp.InlayHint]:
        span = converter.span(params.range)
        return [converter.hint(hint) for hint in text.hints() if span.start <= hint.place <= span.end]

    return _of(server, params.text_document.uri, ask)


def _document_link(server: EditorServer, params: lsp.DocumentLinkParams) -> list[lsp.DocumentLink] | None:
    shown = server.session.spelled
    return _of(
        server,
        params.text_document.uri,
        lambda text, conv: [lsp.DocumentLink(conv.range(link.span), target=shown(link.uri)) for link in text.links()],
    )


def _code_action(server: EditorServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction] | None:
    only = [kind.value if isinstance(kind, lsp.CodeActionKind) else kind for kind in params.context.only or ()]
    if only and not any(lsp.CodeActionKind.QuickFix.value.startswith(kind) for kind in only):
        return None

    def ask(text: Analysis, converter: Converter) -> list[lsp.CodeAction]:
        found = navigation.fixes(server.session, params.text_document.uri, converter.span(params.range))
        return [
            lsp.CodeAction(
                str(action.title),
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[converter.diagnostic(action.mends)],
                edit=changes_of(action.edits, server.converter, server.session.spelled),
                data=action.title.to_json(),
            )
            for action in found
        ]

    return _of(server, params.text_document.uri, ask)


def _workspace_symbol(server: EditorServer, params: lsp.WorkspaceSymbolParams) -> list[lsp.WorkspaceSymbol]:
    return [
        lsp.WorkspaceSymbol(server.location(TextLocation(uri, section.name_span)), section.name, SYMBOL_KINDS[section.kind])
        for uri, section in navigation.workspace_symbols(server.session, params.query)
    ]


_LEGEND = lsp.SemanticTokensLegend(TOKEN_TYPES, TOKEN_MODIFIERS)
HANDLERS: dict[str, tuple[Callable[[EditorServer, Any], Any], Any]] = {
    lsp.INITIALIZE: (_initialize, None),
    lsp.INITIALIZED: (_initialized, None),
    lsp.SHUTDOWN: (_end, None),
    lsp.EXIT: (_end, None),
    lsp.TEXT_DOCUMENT_DID_OPEN: (_did_open, None),
    lsp.TEXT_DOCUMENT_DID_CHANGE: (_did_change, None),
    lsp.TEXT_DOCUMENT_DID_CLOSE: (_did_close, None),
    lsp.TEXT_DOCUMENT_DID_SAVE: (_did_save, lsp.SaveOptions(include_text=False)),
    lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES: (_did_change_watched_files, None),
    lsp.TEXT_DOCUMENT_HOVER: (_hover, None),
    lsp.TEXT_DOCUMENT_COMPLETION: (
        _completion,
        lsp.CompletionOptions(trigger_characters=list('@$= #[";')),
    ),
    lsp.TEXT_DOCUMENT_SIGNATURE_HELP: (_signature_help, lsp.SignatureHelpOptions(trigger_characters=[" ", "(", ",", ";"])),
    lsp.TEXT_DOCUMENT_DEFINITION: (_definition, None),
    lsp.TEXT_DOCUMENT_REFERENCES: (_references, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: (_document_highlight, None),
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: (_prepare_rename, None),
    lsp.TEXT_DOCUMENT_RENAME: (_rename, lsp.RenameOptions(prepare_provider=True)),
    lsp.TEXT_DOCUMENT_PREPARE_CALL_HIERARCHY: (_prepare_calls, None),
    lsp.CALL_HIERARCHY_INCOMING_CALLS: (_incoming_calls, None),
    lsp.CALL_HIERARCHY_OUTGOING_CALLS: (_outgoing_calls, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: (_document_symbol, None),
    lsp.TEXT_DOCUMENT_FOLDING_RANGE: (_folding_range, None),
    lsp.TEXT_DOCUMENT_FORMATTING: (_formatting, None),
    lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: (_semantic_tokens, _LEGEND),
    lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE: (_semantic_tokens_range, _LEGEND),
    lsp.TEXT_DOCUMENT_INLAY_HINT: (_inlay_hint, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_LINK: (_document_link, None),
    lsp.TEXT_DOCUMENT_CODE_ACTION: (
        _code_action,
        lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix]),
    ),
    lsp.WORKSPACE_SYMBOL: (_workspace_symbol, None),
}
"""By method of the protocol, with the options that are registered for it."""
