"""Sentences in the sources, and which of them fit the tables of sentences of the page (`studio-web/src/text`)."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
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
