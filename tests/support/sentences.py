"""Sentences in the sources, and which of them fit the tables of sentences of the page (`studio-web/src/text`)."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEXTS = ROOT / "studio-web/src/text"
_ENTRY = re.compile(r"""^  (?:("(?:[^"\\]|\\.)*")|'((?:[^'\\]|\\.)*)'|(\w+)):""", re.MULTILINE)
_PLACE = re.compile(r"\{#?\w+\}")
_NUMBER = r"[-−]?\d[\d .,e+-]*?"


def table(*names: str) -> set[str]:
    """The sentences of tables, in English; ``{name}`` stands for a text, ``{#name}`` for a number."""
    entries = (_ENTRY.findall((TEXTS / name).read_text("utf-8")) for name in names)
    return {json.loads(double) if double else single or bare for found in entries for double, single, bare in found}


class Sentences:
    """Sentences with places in them."""

    def __init__(self, sentences: Iterable[str]) -> None:
        self._exact = set(sentences)
        self._forms = [(max(_PLACE.split(one), key=len), re.compile(_form(one), re.DOTALL)) for one in self._exact if "{" in one]

    def fits(self, text: str) -> bool:
        """Whether a text is one of them; lists, lines and what stands behind a colon part by part, as the page does it."""
        if text in self._exact or any(piece in text and form.fullmatch(text) for piece, form in self._forms):
            return True
        for between in ("\n", ", "):
            parts = text.split(between)
            if len(parts) > 1 and all(not has_words(part) or self.fits(part.lstrip()) for part in parts):
                return True
        head, colon, rest = text.partition(": ")
        return bool(head and colon) and self.fits(rest)


def has_words(text: str) -> bool:
    """Whether a text has more than names, numbers and signs."""
    return re.search(r"[a-z]{2}", text) is not None


def _form(sentence: str) -> str:
    """A text right behind another one is an addition, which may be missing."""
    pieces = re.split(r"(\{#?\w+\})", sentence)
    form = ""
    for index, piece in enumerate(pieces):
        if index % 2 == 0:
            form += re.escape(piece)
        elif piece.startswith("{#"):
            form += _NUMBER
        else:
            form += r"(?:[ ,;(].*)?" if index > 1 and pieces[index - 1] == "" else ".+?"
    return form


def refused(path: Path) -> Iterator[str]:
    """What a module raises, with 7 for what is computed; without errors of other families than those for users."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
            kind = node.exc.func
            name = kind.id if isinstance(kind, ast.Name) else kind.attr if isinstance(kind, ast.Attribute) else ""
            if name not in ("ValueError", "TypeError", "RuntimeError", "AttributeError", "KeyError"):
                yield from filter(has_words, _texts(node.exc.args[0]))


def _texts(node: ast.AST) -> list[str]:
    """The texts that an expression can be."""
    match node:
        case ast.Constant(str(text)):
            return [text]
        case ast.JoinedStr(values):
            found, before = "", ""
            for value in values:
                part = value.value if isinstance(value, ast.Constant) else "7"
                found += "" if part == before == "7" else str(part)
                before = str(part)
            return [found]
        case ast.IfExp(body=body, orelse=orelse):
            return [*_texts(body), *_texts(orelse)]
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return [one + other for one in _texts(left) for other in _texts(right)]
    return []
