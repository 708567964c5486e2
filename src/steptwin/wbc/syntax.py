"""Text to tree. One broken line never hides the next: it becomes a `Broken` statement and a message."""

from __future__ import annotations

import re

from steptwin.diagnostics import Diagnostic, split_lines
from steptwin.wbc import findings as f
from steptwin.wbc.lexer import tokens
from steptwin.wbc.nearmiss import NearMiss
from steptwin.wbc.reader import Rejected, StatementReader
from steptwin.wbc.tree import Broken, Comment, Line, PositionRecord, Program, Record, Statement

RECORD_MARK = "//!record"
POSITION_MARK = "//!position"
_RECORD = re.compile(rf"{RECORD_MARK}\s+([0-9a-f]{{32}})$", re.IGNORECASE)
_POSITION = re.compile(rf"{POSITION_MARK}\s+([0-9]{{1,5}})\s+([0-9a-f]{{36}})$", re.IGNORECASE)


def parse(text: str) -> tuple[Program, list[Diagnostic]]:
    """The tree of a program and what is wrong with single lines of it, in the order of the text. Never raises."""
    lines: list[Line] = []
    diagnostics: list[Diagnostic] = []
    near = NearMiss()
    start = 0
    for line, end in split_lines(text):
        lines.append(_line(line.rstrip(), start, diagnostics, near))
        start += len(line) + len(end)
    return Program(tuple(lines)), diagnostics


def _line(content: str, start: int, diagnostics: list[Diagnostic], near: NearMiss) -> Line:
    code, slashes, _ = content.partition("//")
    end = start + len(content)
    comment = Comment(start + len(code), end, content[len(code) :]) if slashes else None
    words = tokens(code, start)
    if words:
        reader = StatementReader(words, near, diagnostics)
        try:
            return Line(start, end, reader.statement(), comment)
        except Rejected as rejected:
            diagnostics.append(rejected.diagnostic)
        text = code.strip()
        return Line(start, end, Broken(words[0].start, words[-1].end, text, reader.keyword, reader.target), comment)
    if comment and comment.text.startswith("//!"):
        record = _record(comment, diagnostics)
        if record is not None:
            return Line(start, end, record, None)
    return Line(start, end, None, comment)


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
