"""The server of one client: its session, when a text is analysed, and its answers in the types of the protocol.

Diagnostics are pushed a moment after a change, so that what the client asks meanwhile is answered first; the longer a text took
to check, the longer that moment.
"""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from time import perf_counter

from lsprotocol import types as lsp
from pygls.capabilities import ServerCapabilitiesBuilder, get_capability
from pygls.lsp.server import LanguageServer
from pygls.protocol import default_converter

from steptwin import __version__
from steptwin.diagnostics import Diagnostic, Severity
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import TextLocation
from steptwin.lsp.convert import Converter
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.files import DiskFiles, Files, normal
from steptwin.lsp.positions import Encoding
from steptwin.lsp.protocol import Protocol

FIRST_DELAY_S = 0.004
LONGEST_DELAY_S = 0.5
"""Between a change and its diagnostics."""
OTHERS_DELAY_S = 0.3
"""Delay before the other files of a controller are analysed again."""

MOST_DIAGNOSTICS = 1000
"""Most findings of one text: editors become slow with more, and one mistake is often the reason of all."""
_RANKS = {severity: rank for rank, severity in enumerate(Severity)}


class EditorServer(LanguageServer):
    """One client."""

    def __init__(self, files: Files | None = None) -> None:
        super().__init__("steptwin", __version__, protocol_cls=Protocol, converter_factory=default_converter)
        self._files = DiskFiles() if files is None else files
        self.session = EditorSession(self._files)
        self.snippets = False
        self._delays: dict[str, float] = {}
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self.number: int | str | None = None
        """Number of the request that is handled; None for a notification."""
        self.is_answering = False
        """Whether a handler is at work, which may be interrupted."""

    @contextmanager
    def answering(self) -> Generator[None]:
        """Permit an interruption."""
        self.is_answering = True
        try:
            yield
        finally:
            self.is_answering = False

    def begin(self, params: lsp.InitializeParams) -> None:
        encoding = ServerCapabilitiesBuilder.choose_position_encoding(params.capabilities)
        self.session = EditorSession(self._files, Encoding(lsp.PositionEncodingKind(encoding).value))
        name = "text_document.completion.completion_item.snippet_support"
        self.snippets = bool(get_capability(params.capabilities, name, False))

    # -- diagnostics

    def changed(self, uri: str) -> None:
        """Analyse a text soon, and later the open texts of its controller."""
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
        """The client has disconnected, or will: no text is analysed any more."""
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
        found = (
            [] if analysis is None else [converter.diagnostic(diagnostic) for diagnostic in most_severe(analysis.diagnostics())]
        )
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
        return lsp.Location(self.session.spelled(place.uri), nowhere if converter is None else converter.range(place.span))


def most_severe(diagnostics: Sequence[Diagnostic]) -> Sequence[Diagnostic]:
    """As many as are shown, in order of the text, and at the first place that is not shown how many there are."""
    if len(diagnostics) <= MOST_DIAGNOSTICS:
        return diagnostics
    numbers = sorted(range(len(diagnostics)), key=lambda number: _RANKS[diagnostics[number].severity])
    shown, others = sorted(numbers[:MOST_DIAGNOSTICS]), numbers[MOST_DIAGNOSTICS:]
    message = f"{len(diagnostics)} findings: the {MOST_DIAGNOSTICS} most severe are shown"
    return [*(diagnostics[number] for number in shown), Diagnostic("S002", Severity.NOTE, diagnostics[min(others)].span, message)]
