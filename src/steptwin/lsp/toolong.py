"""A text that is too long for analysis."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.diagnostics import Diagnostic, Severity, Span
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.positions import LineIndex


class TooLong(Analysis):
    """Reports only that. ``most``: how many characters it may have."""

    def __init__(self, uri: str, lines: LineIndex, most: int) -> None:
        super().__init__(uri, lines)
        self._most = most

    def diagnostics(self) -> Sequence[Diagnostic]:
        message = f"the text has {len(self.text)} characters: texts of more than {self._most} are not analysed"
        return [Diagnostic("S001", Severity.NOTE, Span(0, 0), message)]
