"""Text to tree. One broken line never hides the next: it becomes a `Broken` statement and a message."""

from __future__ import annotations

import re

from steptwin.diagnostics import Diagnostic, split_lines
from steptwin.wbc import findings as f
from steptwin.wbc.foreign import LABEL, declared, explain
from steptwin.wbc.foreign import Line as ForeignLine
from steptwin.wbc.foreign_words import LOOK_ALIKES
from steptwin.wbc.lexer import BLANKS as _BLANKS
from steptwin.wbc.lexer import STRANGE, Token, tokens
from steptwin.wbc.nearmiss import NearMiss
from steptwin.wbc.reader import Rejected, StatementReader
from steptwin.wbc.tree import Broken, Comment, Line, Name, PositionRecord, Program, Record, Statement

RECORD_MARK = "//!record"
POSITION_MARK = "//!position"
_RECORD = re.compile(rf"{RECORD_MARK}\s+([0-9a-f]{{32}})$", re.IGNORECASE)
_JUMP = re.compile(r"^[ \t]*JUMP[ \t]+(\w+)", re.IGNORECASE | re.MULTILINE)
_LONGEST_EXPLAINED = 500
"""Characters of a line up to which it is looked at for what other languages write: looking takes time."""
_MOST_LOOK_ALIKES = 3
"""Messages of one line about them."""
_POSITION = re.compile(rf"{POSITION_MARK}\s+([0-9]{{1,5}})\s+([0-9a-f]{{36}})$", re.IGNORECASE)


def parse(text: str) -> tuple[Program, list[Diagnostic]]:
    """The tree of a program and what is wrong with single lines of it, in the order of the text. Never raises."""
    return _Parser(text).program()


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._diagnostics: list[Diagnostic] = []
        self._near = NearMiss()
        self._jumps: frozenset[str] | None = None
        self._comment_ends = 0
        """Where a comment of another language ends that was begun with ``/*``."""

    def program(self) -> tuple[Program, list[Diagnostic]]:
        lines: list[Line] = []
        start = 0
        for line, end in split_lines(self._text):
            lines.append(self._line(line.rstrip(_BLANKS), start))
            start += len(line) + len(end)
        return Program(tuple(lines)), self._diagnostics

    def _line(self, content: str, start: int) -> Line:
        code, slashes, _ = content.partition("//")
        end = start + len(content)
        comment = Comment(start + len(code), end, content[len(code) :]) if slashes else None
        words = tokens(code, start)
        if words and start < self._comment_ends:
            return Line(start, end, Broken(words[0].start, words[-1].end, code.strip(_BLANKS)), comment)
        if words:
            return Line(start, end, self._statement(words, code, start), comment)
        if comment and comment.text.startswith("//!"):
            record = _record(comment, self._diagnostics)
            if record is not None:
                return Line(start, end, record, None)
        return Line(start, end, None, comment)

    def _statement(self, words: list[Token], code: str, start: int) -> Statement:
        found: list[Diagnostic] = []
        plain = self._without_look_alikes(words, code, start)
        reader = StatementReader(words if plain is None else tokens(plain, start) or words, self._near, found)
        keyword = label = None
        try:
            statement = reader.statement()
        except Rejected as rejected:
            if plain is None:
                keyword, label = self._reject(rejected.diagnostic, words, code, start)
        else:
            if plain is None:
                self._diagnostics += found
                return statement
        text = code.strip(_BLANKS)
        target = reader.target
        if target is None and (name := declared(words)) is not None:
            target = Name(name.start, name.end, name.text, name.text.upper())
        return Broken(words[0].start, words[-1].end, text, keyword or reader.keyword, target, label)

    def _without_look_alikes(self, words: list[Token], code: str, start: int) -> str | None:
        """The line as it is meant, after reporting characters that only look like those of WBC; None where there are none."""
        strange = [word for word in words if word.kind == STRANGE and word.text in LOOK_ALIKES]
        if not strange:
            return None
        for word in strange[:_MOST_LOOK_ALIKES]:
            what, meant = LOOK_ALIKES[word.text]
            shown = f"{word.text} (U+{ord(word.text):04X})" if word.text.isprintable() else f"U+{ord(word.text):04X}"
            hint = f"write {meant}" if meant.strip() else "write a blank" if meant else "remove it"
            self._diagnostics.append(f.ILLEGAL_CHARACTER.at(word, f"{shown} is {what}", hint, fix=meant))
        return "".join(LOOK_ALIKES.get(character, ("", character))[1] for character in code)

    def _reject(self, found: Diagnostic, words: list[Token], code: str, start: int) -> tuple[str | None, Name | None]:
        """Report a refused line; the keyword and the label that were meant, where they are known."""
        if len(code) > _LONGEST_EXPLAINED:
            self._diagnostics.append(found)
            return None, None
        if self._jumps is None:
            self._jumps = frozenset(match[1].upper() for match in _JUMP.finditer(self._text))
        advice, keyword = explain(ForeignLine(words, code, start, self._jumps, self._reads), found)
        self._diagnostics.append(advice)
        opened = code.find("/*")
        if opened >= 0 and "*/" not in code[opened:]:
            self._comment_ends = self._text.find("*/", start + len(code)) + 1
        if keyword == LABEL:
            name = words[-1]
            return None, Name(name.start, name.end, name.text, name.text.upper())
        return keyword, None

    def _reads(self, text: str) -> bool:
        words = tokens(text, 0)
        try:
            return bool(words) and bool(StatementReader(words, self._near, []).statement())
        except Rejected:
            return False


def _record(comment: Comment, diagnostics: list[Diagnostic]) -> Statement | None:
    """The raw data that decompiling leaves in comments a vendor tool skips; None for any other comment."""
    text = comment.text
    if match := _RECORD.match(text):
        return Record(comment.start, comment.end, bytes.fromhex(match[1]))
    if match := _POSITION.match(text):
        return PositionRecord(comment.start, comment.end, int(match[1]), bytes.fromhex(match[2]))
    word = text.split(None, 1)[0].lower()
    if word not in (RECORD_MARK, POSITION_MARK):
        return None
    usage = (
        f"{RECORD_MARK} and 32 hexadecimal digits" if word == RECORD_MARK else f"{POSITION_MARK} INDEX and 36 hexadecimal digits"
    )
    diagnostics.append(f.BAD_RECORD.at(comment, f"malformed {word}", f"write {usage}"))
    return Broken(comment.start, comment.end, text)
