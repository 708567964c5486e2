"""Where the tables, keys and values of a TOML text are.

`tomllib` reads TOML and reports what is wrong with it, but keeps no places; no maintained library for Python does. This finds
them by the same grammar without evaluating it: strings, comments and brackets; all else is left to `tomllib`. In a
text that is not TOML it stops where it does not understand more.
"""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress
from typing import TypeAlias

from steptwin.diagnostics import Span
from steptwin.errors import Misuse

Path: TypeAlias = tuple[str | int, ...]
"""Where a value is: names of tables and keys, numbers in arrays."""

MOST_NESTED = 32
"""Parts of a key and arrays in arrays: no description needs as many, and reading them takes time that grows with its square."""
LONGEST_SCALAR = 64
"""Characters of a number or a moment."""

_BLANKS = r"[ \t]*"
_GAP = r"(?:[ \t\r\n]+|#[^\n]*)*"
_REST = re.compile(_GAP)
_KEY_PART = re.compile(_BLANKS + r"""([A-Za-z0-9_-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*')""" + _BLANKS + r"(\.?)")
"""With the point that another part follows."""
_EQUALS = re.compile("=" + _BLANKS)
_VALUE = re.compile(
    r"(?P<string>\"\"\"(?:\\.|[^\\])*?\"\"\"\"{0,2}"  # of several lines, with escapes
    r"|'''.*?''''{0,2}"
    r"|\"(?:\\.|[^\"\\\n])*\""
    r"|'[^'\n]*')"
    r"|(?P<array>\[)|(?P<table>\{)|(?P<scalar>[^\s,\]}#]+(?: [0-9][^\s,\]}#]*)?)",
    re.DOTALL,
)
_BEGINS = re.compile(_GAP + r"(?P<comma>)(?P<end>[\]}]?)")
"""Begin of an array or a table in a line: its first item, or its end."""
_FOLLOWS = re.compile(_GAP + r"(?:,(?P<comma>)" + _GAP + r")?(?P<end>[\]}]?)")
"""After an item: the next one, or the end."""


class UnsupportedToml(Misuse):
    """A text that is not supported; ``span`` is where."""

    def __init__(self, span: Span, message: str) -> None:
        self.span = span
        super().__init__(message)


def find_spans(text: str) -> dict[Path, Span]:
    """Span by path: of a table its header, of a key the key with its value, of an item of an array the item.

    Raises `UnsupportedToml` for what is nested too deeply and for numbers that are too long.
    """
    finder = _Finder(text)
    with suppress(_NotToml):
        finder.document()
    return finder.spans


class _NotToml(Exception):
    """Error: what comes next is not TOML."""


class _Finder:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.spans: dict[Path, Span] = {}
        self._last_item: dict[Path, int] = {}
        """Arrays of tables: the number of the table that was begun last."""

    def document(self) -> None:
        table: Path = ()
        self._skip(_REST)
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._key_and_value(table)
            self._skip(_REST)

    # ------------------------------------------------------------------ parts of the grammar

    def _header(self) -> Path:
        begin = self.at
        brackets = "[[" if self.text.startswith("[[", begin) else "["
        self.at += len(brackets)
        parts = self._key()
        if not self.text.startswith("]" * len(brackets), self.at):
            raise _NotToml
        self.at += len(brackets)
        path: Path = ()
        for n, part in enumerate(parts, 1):
            path = (*path, part)
            if brackets == "[[" and n == len(parts):
                self._last_item[path] = self._last_item.get(path, -1) + 1
            if path in self._last_item:
                path = (*path, self._last_item[path])
        self.spans.setdefault(path, Span(begin, self.at))
        return path

    def _key_and_value(self, table: Path, depth: int = 0) -> None:
        begin = self.at
        paths = [table]
        for part in self._key():
            paths.append((*paths[-1], part))
        self._skip(_EQUALS)
        self._value(paths[-1], depth)
        for path in paths[1:]:
            self.spans.setdefault(path, Span(begin, self.at))

    def _key(self) -> list[str]:
        parts: list[str] = []
        while True:
            found = _KEY_PART.match(self.text, self.at)
            if found is None:
                raise _NotToml
            part = found[1]
            parts.append(_unquoted(part) if part[0] in "\"'" else part)
            if len(parts) > MOST_NESTED:
                raise UnsupportedToml(Span(*found.span(1)), f"a key of more than {MOST_NESTED} parts")
            self.at = found.end()
            if not found[2]:
                return parts

    def _value(self, path: Path, depth: int = 0) -> None:
        if depth > MOST_NESTED:
            raise UnsupportedToml(Span(self.at, self.at + 1), f"values are nested more than {MOST_NESTED} deep")
        found = _VALUE.match(self.text, self.at)
        if found is None:
            raise _NotToml
        kind, begin, self.at = found.lastgroup, self.at, found.end()
        if kind == "array":
            self._array(path, depth)
        elif kind == "table":
            self._inline_table(path, depth)
        elif kind == "scalar" and self.at - begin > LONGEST_SCALAR:
            message = f"a value of {self.at - begin} characters that is not text: permitted are {LONGEST_SCALAR}"
            raise UnsupportedToml(Span(begin, begin + LONGEST_SCALAR), message)

    def _array(self, path: Path, depth: int) -> None:
        number, more = 0, self._goes_on(_BEGINS, "]")
        while more:
            begin = self.at
            self._value((*path, number), depth + 1)
            self.spans.setdefault((*path, number), Span(begin, self.at))
            number += 1
            more = self._goes_on(_FOLLOWS, "]")

    def _inline_table(self, path: Path, depth: int) -> None:
        more = self._goes_on(_BEGINS, "}")
        while more:
            self._key_and_value(path, depth + 1)
            more = self._goes_on(_FOLLOWS, "}")

    # ------------------------------------------------------------------ characters

    def _skip(self, what: re.Pattern[str]) -> None:
        found = what.match(self.text, self.at)
        if found is None:
            raise _NotToml
        self.at = found.end()

    def _goes_on(self, what: re.Pattern[str], end: str) -> bool:
        """Whether another item comes, instead of the end."""
        found = what.match(self.text, self.at)
        if found is None:
            raise _NotToml
        comma, there = found.groups()
        if there != end and (there or comma is None):
            raise _NotToml
        self.at = found.end()
        return not there


def _unquoted(part: str) -> str:
    """A part of a key without its quotes."""
    try:
        return tomllib.loads(f"x = {part}")["x"] if "\\" in part else part[1:-1]
    except tomllib.TOMLDecodeError:
        raise _NotToml from None
