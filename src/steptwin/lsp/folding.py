"""Ranges that can be folded in a text of any language."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from steptwin.lsp.answers import Fold, FoldKind


class NestedFolds:
    """The folds of blocks that nest. The end of a block also ends the blocks in it that have no end, which are not folded."""

    def __init__(self) -> None:
        self.folds: list[Fold] = []
        self._open: list[tuple[str, int]] = []

    def begin(self, end_word: str, line: int) -> None:
        self._open.append((end_word, line))

    def end(self, end_word: str, line: int) -> None:
        """Has no effect if no such block is open."""
        if not any(wanted == end_word for wanted, _ in self._open):
            return
        while True:
            wanted, first = self._open.pop()
            if wanted == end_word:
                if line > first:
                    self.folds.append(Fold(first, line))
                return


def runs(kinds: Sequence[FoldKind | None]) -> Iterator[Fold]:
    """Two or more neighbouring lines of one kind; ``kinds`` has one for each line."""
    for kind, group in groupby(range(len(kinds)), key=kinds.__getitem__):
        lines = list(group)
        if kind is not None and len(lines) > 1:
            yield Fold(lines[0], lines[-1], kind)
