"""Matching of IF, ELSE, ENDIF, WHILE and ENDWHILE."""

from __future__ import annotations

from dataclasses import dataclass, field

from steptwin.diagnostics import Diagnostic
from steptwin.messages import Message
from steptwin.wbc import findings as f
from steptwin.wbc.findings import ProgramFinding, Spanned
from steptwin.wbc.foreign import IF_UNKNOWN
from steptwin.wbc.tree import KeywordStatement

IS_NOT_CLOSED = Message("wbc.is-not-closed", "{keyword} is not closed")
CLOSING_IS_MISSING = Message("wbc.closing-is-missing", "{closing} is missing")
WITHOUT_OPENING = Message("wbc.without-opening", "{keyword} without {opening}")
NOTHING_IS_OPEN = Message("wbc.nothing-is-open", "no {opening} is open here")
SECOND_ELSE = Message("wbc.second-else", "a second ELSE in one IF")
CLOSE_THE_INNER_IF = Message("wbc.close-the-inner-if", "close the inner IF with ENDIF first")


@dataclass(slots=True)
class Blocks:
    """Step numbers: ``close`` of IF, ELSE and WHILE, ``middle`` (the ELSE) of IF, ``open`` (the WHILE) of ENDWHILE.

    A step without its counterpart is in none of them.
    """

    close: dict[int, int] = field(default_factory=dict)
    middle: dict[int, int] = field(default_factory=dict)
    open: dict[int, int] = field(default_factory=dict)


_NOT_CLOSED: dict[str, tuple[ProgramFinding, str]] = {"IF": (f.IF_NOT_CLOSED, "ENDIF"), "WHILE": (f.WHILE_NOT_CLOSED, "ENDWHILE")}
_NOT_OPENED: dict[str, tuple[ProgramFinding, str]] = {
    "ELSE": (f.ELSE_WITHOUT_IF, "IF"),
    "ENDIF": (f.ENDIF_WITHOUT_IF, "IF"),
    "ENDWHILE": (f.ENDWHILE_WITHOUT_WHILE, "WHILE"),
}


BLOCK_WORDS = frozenset({*_NOT_CLOSED, *_NOT_OPENED})
"""The keywords for `BlockMatcher`."""

_OF_IF = frozenset(finding.code for finding in (f.IF_NOT_CLOSED, f.ELSE_WITHOUT_IF, f.ENDIF_WITHOUT_IF, f.SECOND_ELSE))


class BlockMatcher:
    """Takes the block keywords in order. A forgotten end is reported once, at its beginning, and leaves outer blocks alone."""

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        self.blocks = Blocks()
        self._reported = diagnostics
        self._diagnostics: list[Diagnostic] = []
        self._uncertain = False
        self._stack: list[tuple[str, int, Spanned]] = []
        self._open = {"IF": 0, "WHILE": 0}

    def take(self, keyword: str, step: int, place: Spanned) -> None:
        if keyword in _NOT_CLOSED:
            self._stack.append((keyword, step, place))
            self._open[keyword] += 1
        elif keyword in _NOT_OPENED:
            self._continue(keyword, step, place)
        elif keyword == IF_UNKNOWN:
            self._uncertain = True

    def finish(self) -> Blocks:
        while self._stack:
            self._abandon()
        # With an ELSE IF the intended number of ENDIFs is unknown; the ELSE IF was reported.
        self._reported += [d for d in self._diagnostics if not (self._uncertain and d.code in _OF_IF)]
        return self.blocks

    def _continue(self, keyword: str, step: int, place: Spanned) -> None:
        finding, opening = _NOT_OPENED[keyword]
        if not self._open[opening]:
            fix = "" if isinstance(place, KeywordStatement) else None  # else another word was meant
            self._diagnostics.append(
                finding.at(place, WITHOUT_OPENING(keyword=keyword, opening=opening), NOTHING_IS_OPEN(opening=opening), fix)
            )
            return
        while self._stack[-1][0] != opening:
            self._abandon()
        _, start, _ = self._stack[-1]
        blocks = self.blocks
        if keyword == "ELSE":
            if start in blocks.middle:
                self._diagnostics.append(f.SECOND_ELSE.at(place, SECOND_ELSE(), CLOSE_THE_INNER_IF()))
            else:
                blocks.middle[start] = step
            return
        self._stack.pop()
        self._open[opening] -= 1
        blocks.close[start] = step
        if keyword == "ENDWHILE":
            blocks.open[step] = start
        elif start in blocks.middle:
            blocks.close[blocks.middle[start]] = step

    def _abandon(self) -> None:
        keyword, _, place = self._stack.pop()
        self._open[keyword] -= 1
        finding, closing = _NOT_CLOSED[keyword]
        self._diagnostics.append(finding.at(place, IS_NOT_CLOSED(keyword=keyword), CLOSING_IS_MISSING(closing=closing)))
