"""A text that is too long for analysis."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.diagnostics import Diagnostic, Severity, Span
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.documents import MOST_CHARACTERS


class TooLong(Analysis):
    """Reports only that."""

    def diagnostics(self) -> Sequence[Diagnostic]:
        message = f"the text has {len(self.text)} characters; only {MOST_CHARACTERS} are looked at"
        return [Diagnostic("S001", Severity.NOTE, Span(0, 0), message)]
