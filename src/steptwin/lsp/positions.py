"""Places in a text as the protocol gives them: line and column from 0, columns in the units the client chose."""

from __future__ import annotations

import enum
import re
from bisect import bisect_right
from itertools import accumulate
from operator import add

_LINE_END = re.compile(r"(\r\n|\n|\r)")


class Encoding(enum.Enum):
    """Unit of columns."""

    UTF8 = "utf-8"
    UTF16 = "utf-16"
    UTF32 = "utf-32"


class LineIndex:
    """A text and its lines, which end as defined by the protocol: at a line feed, a carriage return or both."""

    __slots__ = ("_ascii", "contents", "starts", "text")
    starts: list[int]
    contents: list[str]
    """The lines without their ends; the last one is empty if the text ends with a line end."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.contents, self.starts = _lines(text)
        self._ascii = text.isascii()

    def changed(self, start: int, end: int, text: str) -> LineIndex:
        """The text with ``text`` between two places. Only lines there, and one on each side, are made anew: a line end may have
        got its other half."""
        first, last = max(self.line_of(start) - 1, 0), min(self.line_of(end) + 2, len(self.starts))
        new = LineIndex.__new__(LineIndex)
        new.text = self.text[:start] + text + self.text[end:]
        new._ascii = (self._ascii and text.isascii()) or new.text.isascii()
        longer = len(new.text) - len(self.text)
        begin, is_rest = self.starts[first], last == len(self.starts)
        contents, starts = _lines(new.text[begin:] if is_rest else new.text[begin : self.starts[last] + longer])
        if not is_rest:  # after its last line end the next line begins
            contents.pop()
            starts.pop()
        new.contents = self.contents[:first] + contents + self.contents[last:]
        new.starts = self.starts[:first] + [begin + one for one in starts] + [one + longer for one in self.starts[last:]]
        return new

    def place(self, line: int, column: int, encoding: Encoding) -> int:
        """The character at a position; one beyond the line or the text means its end, one inside a character its beginning."""
        if line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[line], self.end(line)
        if self._ascii or encoding is Encoding.UTF32:
            return min(start + column, end)
        content = self.contents[line]
        return start + bisect_right(range(1, len(content) + 1), column, key=lambda count: _units(content[:count], encoding))

    def position(self, place: int, encoding: Encoding) -> tuple[int, int]:
        """Line and column of a character."""
        line = bisect_right(self.starts, place) - 1
        start = self.starts[line]
        if self._ascii or encoding is Encoding.UTF32:
            return line, place - start
        return line, _units(self.text[start:place], encoding)

    def line_of(self, place: int) -> int:
        """The line of a character, from 0."""
        return bisect_right(self.starts, place) - 1

    def end(self, number: int) -> int:
        """Where the content of a line ends, before its line end."""
        return self.starts[number] + len(self.contents[number])

    def line(self, number: int) -> str:
        """The content of a line, from 0."""
        return self.contents[number]


def _lines(text: str) -> tuple[list[str], list[int]]:
    """The lines without their ends, and where each begins."""
    if "\r" not in text:
        contents = text.split("\n")
        return contents, list(accumulate(map(len, contents[:-1]), _after_line_feed, initial=0))
    pieces = _LINE_END.split(text)
    contents = pieces[::2]
    return contents, list(accumulate(map(add, map(len, contents), map(len, pieces[1::2])), initial=0))


def _after_line_feed(start: int, length: int) -> int:
    """Where the next line begins."""
    return start + length + 1


def _units(text: str, encoding: Encoding) -> int:
    """Also of halves of pairs that stand alone."""
    if encoding is Encoding.UTF16:
        return len(text.encode("utf-16-le", "surrogatepass")) // 2
    return len(text.encode("utf-8", "surrogatepass"))
