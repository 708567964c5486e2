"""The protocol around a session: pygls takes the messages apart, each handler asks the session and converts its answer.

Handlers are synchronous: an answer belongs to one state of the texts. Diagnostics are pushed a moment after a change, so that
what the client asks meanwhile is answered first; the longer a text took to check, the longer that moment.
"""

from __future__ import annotations

import asyncio
import gc
import inspect
import logging
import typing
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from time import perf_counter
from typing import Any, TypeAlias, TypeVar

from lsprotocol import types as lsp
from pygls.capabilities import ServerCapabilitiesBuilder, get_capability
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams, JsonRpcInvalidRequest, JsonRpcServerNotInitialized
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, default_converter, json_rpc, lsp_method

from steptwin import __version__
from steptwin.errors import Misuse
from steptwin.lsp import navigation
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import TextLocation
from steptwin.lsp.convert import SYMBOL_KINDS, TOKEN_MODIFIERS, TOKEN_TYPES, Converter, changes_of
from steptwin.lsp.documents import TextChange
from steptwin.lsp.files import DiskFiles, Files, normal
from steptwin.lsp.languages import LANGUAGES
from steptwin.lsp.positions import Encoding
from steptwin.lsp.session import EditorSession
from steptwin.symbols import SymbolRole

FIRST_DELAY_S = 0.004
LONGEST_DELAY_S = 0.5
"""Between a change and its diagnostics."""
OTHERS_DELAY_S = 0.3
"""Delay before the other files of a machine are analysed again."""
_COLLECT_AFTER = 100_000
"""Objects after which Python looks for garbage: trees of programs are many small objects, none of them in cycles."""

Answer = TypeVar("Answer")
Handling: TypeAlias = Generator[Any, Any, Any]
"""In the form of pygls' own handlers, which yield the functions to call."""


class AtPlace(typing.Protocol):
    """The parameters of a question about a place."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


class Protocol(LanguageServerProtocol):
    """Only the session stores texts: pygls' workspace would store each a second time, and reads files that are not open.

    Every request has an answer: pygls gives none to one whose parameters are wrong, and none after a shutdown.
    """

    _is_initialized = False

    def structure_message(self, data: dict[str, Any]) -> Any:
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "id" in data and "method" in data:
                text = f"{data['method']}: its parameters are not those of the protocol"
                self._refuse(data["id"], JsonRpcInvalidParams(text) if isinstance(error, JsonRpcInvalidParams) else error)
            return None

    def handle_message(self, message: Any) -> None:
        if not hasattr(message, "jsonrpc"):
            return  # refused, or no message of the protocol
        method, number = getattr(message, "method", None), getattr(message, "id", None)
        if method == lsp.INITIALIZE:
            self._is_initialized = True
        if method is None or number is None:
            super().handle_message(message)
        elif not self._is_initialized:
            self._refuse(number, JsonRpcServerNotInitialized("the first request is initialize"))
        elif self._shutdown:
            self._refuse(number, JsonRpcInvalidRequest("the server has been shut down"))
        else:
            super().handle_message(message)

    def _refuse(self, number: int | str, error: JsonRpcException) -> None:
        self._send_response(number, None, error.to_response_error())

    @lsp_method(lsp.TEXT_DOCUMENT_DID_OPEN)
    def lsp_text_document__did_open(self, params: lsp.DidOpenTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_OPEN], (params,), None

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: lsp.DidChangeTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CHANGE], (params,), None

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def lsp_text_document__did_close(self, params: lsp.DidCloseTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CLOSE], (params,), None


class EditorServer(LanguageServer):
    """One client."""

    def __init__(self, files: Files | None = None) -> None:
        super().__init__("steptwin", __version__, protocol_cls=Protocol, converter_factory=default_converter)
        self._files = DiskFiles() if files is None else files
        self.session = EditorSession(self._files)
        self.snippets = False
        self._delays: dict[str, float] = {}
        self._timers: dict[str, asyncio.TimerHandle] = {}

    def begin(self, params: lsp.InitializeParams) -> None:
        encoding = ServerCapabilitiesBuilder.choose_position_encoding(params.capabilities)
        self.session = EditorSession(self._files, Encoding(lsp.PositionEncodingKind(encoding).value))
        name = "text_document.completion.completion_item.snippet_support"
        self.snippets = bool(get_capability(params.capabilities, name, False))

    # -- diagnostics

    def changed(self, uri: str) -> None:
        """Analyse a text soon, and later the open texts of its machine."""
        first, *others = self.session.affected(uri)
        self._later(first, self._delays.get(first, FIRST_DELAY_S))
        for other in others:
            self._later(other, OTHERS_DELAY_S)

    def changed_outside(self) -> None:
        """Analyse all texts again."""
        self.session.refresh()
        for uri in self.session.open_uris:
            self._later(uri, OTHERS_DELAY_S)

    def closed(self, uri: str) -> None:
        timer = self._timers.pop(normal(uri), None)
        if timer is not None:
            timer.cancel()
        self._delays.pop(normal(uri), None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def end(self) -> None:
        """The client has disconnected: no text is analysed any more."""
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()

    def _later(self, uri: str, seconds: float) -> None:
        timer = self._timers.pop(uri, None)
        if timer is not None:
            timer.cancel()
        self._timers[uri] = asyncio.get_running_loop().call_later(seconds, self._diagnose, uri)

    def _diagnose(self, uri: str) -> None:
        self._timers.pop(uri, None)
        document = self.session.document(uri)
        if document is None:
            return
        begin = perf_counter()
        analysis = self.session.analysis(uri)
        converter = Converter(document.lines, self.session.encoding)
        found = [] if analysis is None else [converter.diagnostic(diagnostic) for diagnostic in analysis.diagnostics()]
        # A text whose analysis takes long is analysed less often during typing.
        taken = perf_counter() - begin
        self._delays[uri] = FIRST_DELAY_S if taken < 0.05 else min(taken, LONGEST_DELAY_S)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(document.uri, found, document.version))

    # -- what handlers need

    def analysed(self, uri: str) -> tuple[Analysis, Converter] | None:
        """The analysis of a text and its converter."""
        analysis = self.session.analysis(uri)
        return None if analysis is None else (analysis, Converter(analysis.lines, self.session.encoding))

    def converter(self, uri: str) -> Converter | None:
        lines = self.session.lines(normal(uri))
        return None if lines is None else Converter(lines, self.session.encoding)

    def location(self, place: TextLocation) -> lsp.Location:
        converter = self.converter(place.uri)
        nowhere = lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0))
        return lsp.Location(self.session.shown(place.uri), nowhere if converter is None else converter.range(place.span))


def _of(server: EditorServer, uri: str, ask: Callable[[Analysis, Converter], Answer]) -> Answer | None:
    """The answer of an analysis; None if there is no analysis."""
    found = server.analysed(uri)
    return None if found is None else ask(*found)


def _at(server: EditorServer, params: AtPlace, ask: Callable[[Analysis, Converter, int], Answer]) -> Answer | None:
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
    # A client that refuses is asked nothing: files are looked at anyway when an answer depends on them.
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
    return changes_of(edits, server.converter, server.session.shown)


def _prepare_calls(server: EditorServer, params: lsp.CallHierarchyPrepareParams) -> list[lsp.CallHierarchyItem] | None:
    def ask(text: Analysis, converter: Converter, place: int) -> list[lsp.CallHierarchyItem] | None:
        found = navigation.caller_at(server.session, params.text_document.uri, place)
        return None if found is None else [_call_item(server, converter, found)]

    return _at(server, params, ask)


def _call_item(server: EditorServer, converter: Converter, caller: navigation.Caller) -> lsp.CallHierarchyItem:
    section = caller.section
    ranges = converter.range(section.span), converter.range(section.name_span)
    kind = SYMBOL_KINDS[section.kind]
    return lsp.CallHierarchyItem(section.name, kind, server.session.shown(caller.uri), *ranges, detail=None, data=caller.key)


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
    shown = server.session.shown
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
                action.title,
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[converter.diagnostic(action.mends)],
                edit=changes_of(action.edits, server.converter, server.session.shown),
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
_HANDLERS: dict[str, tuple[Callable[[EditorServer, Any], Any], Any]] = {
    lsp.INITIALIZE: (_initialize, None),
    lsp.INITIALIZED: (_initialized, None),
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


def server(files: Files | None = None) -> EditorServer:
    """A server that is ready for one client; without ``files`` it reads those of this machine."""
    logging.getLogger(json_rpc.__name__).addFilter(_is_fault)
    made = EditorServer(files)
    for method, (handler, options) in _HANDLERS.items():
        made.feature(method, options)(_bound(made, handler))
    return made


def _is_fault(record: logging.LogRecord) -> bool:
    """Refusals go to the client; pygls would log each with a traceback, too."""
    if str(record.msg).startswith("Unable to deserialize message"):
        return False
    return record.exc_info is None or not isinstance(record.exc_info[1], JsonRpcInvalidParams)


def _bound(made: EditorServer, handler: Callable[[EditorServer, Any], Any]) -> Callable[[Any], Any]:
    if inspect.iscoroutinefunction(handler):

        async def later(params: Any) -> Any:
            return await handler(made, params)

        return later

    def now(params: Any) -> Any:
        return handler(made, params)

    return now


def serve_stdio() -> None:
    """Serve the client on standard input and output until it disconnects."""
    gc.set_threshold(_COLLECT_AFTER)
    server().start_io()
