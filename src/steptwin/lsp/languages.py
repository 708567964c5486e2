"""Which language a text is in: as the client calls it, else by the ending of its name."""

from __future__ import annotations

import enum
import re

from steptwin.lsp.files import suffix_of


class Language(enum.Enum):
    """The values are the names for clients (``languageId``)."""

    WBC = "wbc"
    M1486 = "m1486"
    POSITIONS = "mic488-positions"
    CONFIG = "mic488-config"
    WORLD = "steptwin-world"


SUFFIXES = {
    ".prg": Language.WBC,
    ".m1486": Language.M1486,
    ".csv": Language.POSITIONS,
    ".cfg": Language.CONFIG,
    ".toml": Language.WORLD,
}
_BY_NAME = {language.value: language for language in Language}
_WORLD = re.compile(r"^[ \t]*\[\[?[ \t]*(?:world|mic488|m1486)[ \t]*[\].]", re.MULTILINE)
_SECTION = re.compile(r"^[ \t]*\[(?:Axis[0-3]|IN[0-9]|AIN[01]|WBC_PROGRAM)\]", re.MULTILINE | re.IGNORECASE)
_BEGINNING = 4000
"""Characters in which a position table shows its first row."""


def language_of(name: str, uri: str, text: str) -> Language | None:
    """None for a text in an unknown language."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    language = SUFFIXES.get(suffix_of(uri))
    return language if language is None or _looks_like(language, text) else None


def _looks_like(language: Language, text: str) -> bool:
    """Whether a text is one of these, because other programs use some of the endings too."""
    if language is Language.WORLD:
        return _WORLD.search(text) is not None
    if language is Language.CONFIG:
        return _SECTION.search(text) is not None
    beginning = text[:_BEGINNING].lstrip()
    return language is not Language.POSITIONS or not beginning or ";" in re.split("[\r\n]", beginning, maxsplit=1)[0]
