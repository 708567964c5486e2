"""The analysis of a text. Each language implements what it supports; the defaults are empty."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Span
from steptwin.lsp.answers import (
    CallEdge,
    Completions,
    DocumentLink,
    Edit,
    Fold,
    Hint,
    Hover,
    OutlineItem,
    SemanticToken,
    Signature,
)
from steptwin.lsp.positions import LineIndex
from steptwin.symbols import Symbol, SymbolRole, Use


class Analysis:
    """A text of one language at one moment. Places and spans count characters of the text.

    Any place may be asked that is in a line or at its end, as `LineIndex.place` gives them.
    """

    def __init__(self, uri: str, lines: LineIndex) -> None:
        self.uri = uri
        self.lines = lines

    @property
    def text(self) -> str:
        return self.lines.text

    def diagnostics(self) -> Sequence[Diagnostic]:
        return ()

    def hover(self, place: int) -> Hover | None:
        return None

    def items(self, place: int) -> Completions:
        """The completions at a place."""
        return Completions(())

    def signature(self, place: int) -> Signature | None:
        return None

    @cached_property
    def uses(self) -> Sequence[Use]:
        """Every name that can be followed, in order of the text."""
        return tuple(self._uses())

    def _uses(self) -> Iterator[Use]:
        yield from ()

    def use_at(self, place: int) -> Use | None:
        """The name at a place, also right behind it."""
        found = [use for use in self.uses if use.span.start <= place <= use.span.end]
        return found[-1] if found else None

    def also_defined(self, symbol: Symbol) -> Sequence[Span]:
        """Where else something belongs that is not defined by its name, such as the label of an interrupt."""
        return ()

    def new_name_problem(self, symbol: Symbol, text: str) -> str | None:
        """Why a name cannot be replaced by a text; None when it can."""
        return f"a {symbol.kind.value} cannot be renamed"

    def outline(self) -> Sequence[OutlineItem]:
        return ()

    def folds(self) -> Sequence[Fold]:
        return ()

    def formatted(self) -> str | None:
        """The text in its one style, None where the language has none."""
        return None

    def tokens(self) -> Sequence[SemanticToken]:
        """In order of the text, each within one line, none over another."""
        return ()

    def hints(self) -> Sequence[Hint]:
        return ()

    def links(self) -> Sequence[DocumentLink]:
        return ()

    def calls(self) -> Sequence[CallEdge]:
        return ()

    # -- for all languages

    def definitions(self, symbol: Symbol) -> list[Span]:
        return [use.span for use in self.uses if use.symbol == symbol and use.role is SymbolRole.DEFINE]

    def format_edits(self) -> list[Edit]:
        """The edits that give the formatted text: of the lines that differ."""
        wanted = self.formatted()
        if wanted is None or wanted == self.text:
            return []
        new = LineIndex(wanted)
        old = self.lines
        count = min(len(old.starts), len(new.starts))
        edits = [Edit(Span(old.starts[n], old.end(n)), new.line(n)) for n in range(count - 1) if old.line(n) != new.line(n)]
        rest_old, rest_new = Span(old.starts[count - 1], len(old.text)), new.text[new.starts[count - 1] :]
        if self.text[rest_old.start :] != rest_new:
            edits.append(Edit(rest_old, rest_new))
        return edits
