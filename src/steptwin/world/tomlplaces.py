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

_BLANKS = re.compile(r"[ \t]*")
_GAP = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY_PART = re.compile(r"""[A-Za-z0-9_-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*'""")
_STRING = re.compile(
    r"\"\"\"(?:\\.|[^\\])*?\"\"\"\"{0,2}"  # of several lines, with escapes
    r"|'''.*?''''{0,2}"
    r"|\"(?:\\.|[^\"\\\n])*\""
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^\s,\]}#]+(?: [0-9][^\s,\]}#]*)?")


class UnsupportedToml(Misuse):
    """A text that is not supported; ``span`` is where."""

    def __init__(self, span: Span, message: str) -> None:
        self.span = span
        super().__init__(message)


def find_places(text: str) -> dict[Path, Span]:
    """Span by path: of a table its header, of a key the key with its value, of an item of an array the item.

    Raises `UnsupportedToml` for what is nested too deeply and for numbers that are too long.
    """
    finder = _Finder(text)
    with suppress(_NotToml):
        finder.document()
    return finder.spans


class _NotToml(Exception):
    """What comes next is not TOML."""


class _Finder:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.spans: dict[Path, Span] = {}
        self._last_item: dict[Path, int] = {}
        """Arrays of tables: the number of the table that was begun last."""

    def document(self) -> None:
        table: Path = ()
        self._skip(_GAP)
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._key_and_value(table)
            self._skip(_GAP)

    # ------------------------------------------------------------------ parts of the grammar

    def _header(self) -> Path:
        begin = self.at
        brackets = "[[" if self.text.startswith("[[", begin) else "["
        self.at += len(brackets)
        parts = self._key()
        self._expect("]" * len(brackets))
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
        self._expect("=")
        self._skip(_BLANKS)
        self._value(paths[-1], depth)
        for path in paths[1:]:
            self.spans.setdefault(path, Span(begin, self.at))

    def _key(self) -> list[str]:
        parts: list[str] = []
        while True:
            self._skip(_BLANKS)
            found = _KEY_PART.match(self.text, self.at)
            if found is None:
                raise _NotToml
            parts.append(_plain(found[0]))
            if len(parts) > MOST_NESTED:
                raise UnsupportedToml(Span(found.start(), found.end()), f"a key of more than {MOST_NESTED} parts")
            self.at = found.end()
            self._skip(_BLANKS)
            if not self.text.startswith(".", self.at):
                return parts
            self.at += 1

    def _value(self, path: Path, depth: int = 0) -> None:
        if depth > MOST_NESTED:
            raise UnsupportedToml(Span(self.at, self.at + 1), f"values are nested more than {MOST_NESTED} deep")
        found = _STRING.match(self.text, self.at)
        if found is not None:
            self.at = found.end()
        elif self.text.startswith("[", self.at):
            self._array(path, depth)
        elif self.text.startswith("{", self.at):
            self._inline_table(path, depth)
        else:
            found = _SCALAR.match(self.text, self.at)
            if found is None:
                raise _NotToml
            if len(found[0]) > LONGEST_SCALAR:
                message = f"a value of {len(found[0])} characters that is not text: permitted are {LONGEST_SCALAR}"
                raise UnsupportedToml(Span(found.start(), found.start() + LONGEST_SCALAR), message)
            self.at = found.end()

    def _array(self, path: Path, depth: int) -> None:
        self.at += 1
        number = 0
        while not self._ends("]"):
            begin = self.at
            self._value((*path, number), depth + 1)
            self.spans.setdefault((*path, number), Span(begin, self.at))
            number += 1
            self._comma("]")

    def _inline_table(self, path: Path, depth: int) -> None:
        self.at += 1
        while not self._ends("}"):
            self._key_and_value(path, depth + 1)
            self._comma("}")

    # ------------------------------------------------------------------ characters

    def _skip(self, what: re.Pattern[str]) -> None:
        found = what.match(self.text, self.at)
        if found is not None:
            self.at = found.end()

    def _ends(self, bracket: str) -> bool:
        self._skip(_GAP)
        if self.text.startswith(bracket, self.at):
            self.at += 1
            return True
        return False

    def _comma(self, bracket: str) -> None:
        self._skip(_GAP)
        if self.text.startswith(",", self.at):
            self.at += 1
        elif not self.text.startswith(bracket, self.at):
            raise _NotToml

    def _expect(self, what: str) -> None:
        self._skip(_BLANKS)
        if not self.text.startswith(what, self.at):
            raise _NotToml
        self.at += len(what)


def _plain(part: str) -> str:
    """A part of a key without its quotes."""
    if part[0] == "'":
        return part[1:-1]
    if part[0] != '"':
        return part
    try:
        return tomllib.loads(f"x = {part}")["x"] if "\\" in part else part[1:-1]
    except tomllib.TOMLDecodeError:
        raise _NotToml from None
