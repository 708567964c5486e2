"""Text to tree. One broken line never hides the next: it becomes a `Broken` statement and a message."""

from __future__ import annotations

import re
from collections.abc import Sequence

from steptwin.diagnostics import Diagnostic, split_lines
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.wbc import findings as f
from steptwin.wbc.foreign import LABEL, ForeignLine, declared, explain
from steptwin.wbc.foreign_words import LOOK_ALIKES
from steptwin.wbc.lexer import BLANKS as _BLANKS
from steptwin.wbc.lexer import STRANGE, Lexeme, tokens
from steptwin.wbc.reader import Rejected, StatementReader
from steptwin.wbc.tree import Broken, Comment, Identifier, ImageRecord, PositionRecord, ProgramTree, SourceLine, StatementNode

MALFORMED = Message("wbc.malformed", "malformed {word}")
WRITE_RECORD = Message("wbc.write-record", "write //!record and 32 hexadecimal digits")
WRITE_POSITION_RECORD = Message("wbc.write-position-record", "write //!position INDEX and 36 hexadecimal digits")
WRITE_A_BLANK = Message("wbc.write-a-blank", "write a blank")
REMOVE_IT = Message("wbc.remove-it", "remove it")
IS = Message("wbc.is", "{shown} is {what}")

RECORD_MARK = "//!record"
POSITION_MARK = "//!position"
_RECORD = re.compile(rf"{RECORD_MARK}\s+([0-9a-f]{{32}})$", re.IGNORECASE)
_JUMP = re.compile(r"^[ \t]*JUMP[ \t]+(\w+)", re.IGNORECASE | re.MULTILINE)
_LONGEST_EXPLAINED = 500
"""Characters of a line that are searched for what other languages write: the search takes time."""
_MOST_LOOK_ALIKES = 3
"""Messages of one line about them."""
_POSITION = re.compile(rf"{POSITION_MARK}\s+([0-9]{{1,5}})\s+([0-9a-f]{{36}})$", re.IGNORECASE)


def parse(text: str) -> tuple[ProgramTree, list[Diagnostic]]:
    """The tree of a program and the diagnostics of single lines, in the order of the text. Never raises."""
    written = list(split_lines(text))
    parser = Parser([content for content, _ in written])
    lines: list[SourceLine] = []
    start = 0
    for number, (content, end) in enumerate(written):
        lines.append(parser.line(number, start))
        start += len(content) + len(end)
    return ProgramTree(tuple(lines)), parser.diagnostics


class Parser:
    """Reads the lines of one text, given without their ends, in their order. What is wrong goes into ``diagnostics``.

    A sound line depends on no other, so it may be left out by who has read it before, unless it is ``in_comment``: inside a
    comment of another language, begun with ``/*``, nothing is a statement.
    """

    def __init__(self, lines: Sequence[str]) -> None:
        self._lines = lines
        self.diagnostics: list[Diagnostic] = []
        self.in_comment = False
        self._near = NearMiss()
        self._jumps: frozenset[str] | None = None
        self._last_end: int | None = None
        """The last line in which a comment begun with ``/*`` could end."""

    def line(self, number: int, start: int) -> SourceLine:
        """Read a line, counted from 0. ``start`` is where it begins, so that its nodes know their places."""
        content = self._lines[number].rstrip(_BLANKS)
        code, slashes, _ = content.partition("//")
        end = start + len(content)
        comment = Comment(start + len(code), end, content[len(code) :]) if slashes else None
        words = tokens(code, start)
        if self.in_comment:
            self.in_comment = "*/" not in content
            if words:
                return SourceLine(start, end, Broken(words[0].start, words[-1].end, code.strip(_BLANKS)), comment)
        elif words:
            return SourceLine(start, end, self._statement(number, words, code, start), comment)
        if comment and comment.text.startswith("//!"):
            record = _record(comment, self.diagnostics)
            if record is not None:
                return SourceLine(start, end, record, None)
        return SourceLine(start, end, None, comment)

    def _statement(self, number: int, words: list[Lexeme], code: str, start: int) -> StatementNode:
        found: list[Diagnostic] = []
        plain = self._without_look_alikes(words, code, start)
        reader = StatementReader(words if plain is None else tokens(plain, start) or words, self._near, found)
        keyword = label = None
        try:
            statement = reader.statement()
        except Rejected as rejected:
            if plain is None:
                keyword, label = self._reject(rejected.diagnostic, number, words, code, start)
        else:
            if plain is None:
                self.diagnostics += found
                return statement
        text = code.strip(_BLANKS)
        target = reader.target
        if target is None and (name := declared(words)) is not None:
            target = Identifier(name.start, name.end, name.text, name.text.upper())
        return Broken(words[0].start, words[-1].end, text, keyword or reader.keyword, target, label)

    def _without_look_alikes(self, words: list[Lexeme], code: str, start: int) -> str | None:
        """The line as it is meant, after reporting characters that only look like those of WBC; None where there are none."""
        strange = [word for word in words if word.kind == STRANGE and word.text in LOOK_ALIKES]
        if not strange:
            return None
        for word in strange[:_MOST_LOOK_ALIKES]:
            what, meant = LOOK_ALIKES[word.text]
            shown = f"{word.text} (U+{ord(word.text):04X})" if word.text.isprintable() else f"U+{ord(word.text):04X}"
            hint = f.WRITE(text=meant) if meant.strip() else WRITE_A_BLANK() if meant else REMOVE_IT()
            self.diagnostics.append(f.ILLEGAL_CHARACTER.at(word, IS(shown=shown, what=what), hint, fix=meant))
        return "".join(LOOK_ALIKES.get(character, ("", character))[1] for character in code)

    def _reject(
        self, found: Diagnostic, number: int, words: list[Lexeme], code: str, start: int
    ) -> tuple[str | None, Identifier | None]:
        """Report a refused line; the keyword and the label that were meant, where they are known."""
        if len(code) > _LONGEST_EXPLAINED:
            self.diagnostics.append(found)
            return None, None
        advice, keyword = explain(ForeignLine(words, code, start, self._labels, self._reads), found)
        self.diagnostics.append(advice)
        opened = code.find("/*")
        if opened >= 0 and "*/" not in code[opened:] and "*/" not in self._lines[number][len(code) :]:
            if self._last_end is None:
                self._last_end = max((n for n, line in enumerate(self._lines) if "*/" in line), default=-1)
            self.in_comment = number < self._last_end
        if keyword == LABEL:
            name = words[-1]
            return None, Identifier(name.start, name.end, name.text, name.text.upper())
        return keyword, None

    def _labels(self) -> frozenset[str]:
        """Those that JUMPs name."""
        if self._jumps is None:
            self._jumps = frozenset(name.upper() for name in _JUMP.findall("\n".join(self._lines)))
        return self._jumps

    def _reads(self, text: str) -> bool:
        words = tokens(text, 0)
        try:
            return bool(words) and bool(StatementReader(words, self._near, []).statement())
        except Rejected:
            return False


def _record(comment: Comment, diagnostics: list[Diagnostic]) -> StatementNode | None:
    """The raw data that decompiling leaves in comments a vendor tool skips; None for any other comment."""
    text = comment.text
    if match := _RECORD.match(text):
        return ImageRecord(comment.start, comment.end, bytes.fromhex(match[1]))
    if match := _POSITION.match(text):
        return PositionRecord(comment.start, comment.end, int(match[1]), bytes.fromhex(match[2]))
    word = text.split(None, 1)[0].lower()
    if word not in (RECORD_MARK, POSITION_MARK):
        return None
    usage = WRITE_RECORD() if word == RECORD_MARK else WRITE_POSITION_RECORD()
    diagnostics.append(f.BAD_RECORD.at(comment, MALFORMED(word=word), usage))
    return Broken(comment.start, comment.end, text)
