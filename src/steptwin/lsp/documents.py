"""Texts that a client has open, as they come in changes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from steptwin.lsp.positions import Encoding, LineIndex

MOST_CHARACTERS = 1 << 20
"""Limit of an analysed text, as of a file (`steptwin.inputfiles.MOST_DESCRIPTION_BYTES`)."""


@dataclass(frozen=True, slots=True)
class TextChange:
    """``text`` takes the place of what is between two positions; of everything where there are none."""

    text: str
    start: tuple[int, int] | None = None
    end: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Document:
    """One state of an open text. ``language`` is what the client calls it."""

    uri: str
    language: str
    version: int
    lines: LineIndex

    @property
    def text(self) -> str:
        return self.lines.text

    def changed(self, version: int, changes: Iterable[TextChange], encoding: Encoding) -> Document:
        """The text after changes, which are applied one after the other."""
        lines = self.lines
        for change in changes:
            if change.start is None or change.end is None:
                lines = LineIndex(change.text)
                continue
            start = lines.place(*change.start, encoding)
            end = max(start, lines.place(*change.end, encoding))
            lines = lines.changed(start, end, change.text)
        return Document(self.uri, self.language, version, lines)
