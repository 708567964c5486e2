"""Places in a text as the protocol gives them: line and column from 0, columns in the units the client chose."""

from __future__ import annotations

import enum
import re
from bisect import bisect_right
from itertools import accumulate

_LINE_END = re.compile(r"\r\n|\n|\r")


class Encoding(enum.Enum):
    """What a column counts."""

    UTF8 = "utf-8"
    UTF16 = "utf-16"
    UTF32 = "utf-32"


class LineIndex:
    """A text and its lines, which end as defined by the protocol: at a line feed, a carriage return or both."""

    __slots__ = ("_ascii", "ends", "starts", "text")
    starts: list[int]
    ends: list[int]
    """Where the content of each line ends, before its line end."""

    def __init__(self, text: str) -> None:
        self.text = text
        if "\r" in text:
            found = [end.span() for end in _LINE_END.finditer(text)]
            self.starts = [0, *(after for _, after in found)]
            self.ends = [*(before for before, _ in found), len(text)]
        else:
            lengths = list(map(len, text.split("\n")))
            self.ends = list(accumulate(lengths, _with_line_feed))
            self.starts = [0, *(end + 1 for end in self.ends[:-1])]
        self._ascii = text.isascii()

    def place(self, line: int, column: int, encoding: Encoding) -> int:
        """The character at a position; one beyond the line or the text means its end, one inside a character its beginning."""
        if line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[line], self.ends[line]
        if self._ascii or encoding is Encoding.UTF32:
            return min(start + column, end)
        units = 0
        for place in range(start, end):
            units += _units(self.text[place], encoding)
            if units > column:
                return place
        return end

    def position(self, place: int, encoding: Encoding) -> tuple[int, int]:
        """Line and column of a character."""
        line = bisect_right(self.starts, place) - 1
        start = self.starts[line]
        if self._ascii or encoding is Encoding.UTF32:
            return line, place - start
        return line, sum(_units(character, encoding) for character in self.text[start:place])

    def line_of(self, place: int) -> int:
        """The line of a character, from 0."""
        return bisect_right(self.starts, place) - 1

    def line(self, number: int) -> str:
        """The content of a line, from 0."""
        return self.text[self.starts[number] : self.ends[number]]


def _with_line_feed(end: int, length: int) -> int:
    """Where a line ends that begins behind the line feed at ``end``."""
    return end + 1 + length


def _units(character: str, encoding: Encoding) -> int:
    code = ord(character)
    if encoding is Encoding.UTF16:
        return 2 if code > 0xFFFF else 1
    return 1 if code < 0x80 else 2 if code < 0x800 else 3 if code < 0x10000 else 4
