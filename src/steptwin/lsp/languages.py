"""The languages of the editor server, and which of them a text is in: as the client calls it, else by the ending of its name."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.lsp.files import suffix_of
from steptwin.lsp.language import EditorLanguage
from steptwin.lsp.m1486.language import M1486_PROGRAMS
from steptwin.lsp.wbc.language import CONFIGURATIONS, POSITION_TABLES, WBC_PROGRAMS
from steptwin.lsp.world.language import WORLDS

LANGUAGES: dict[str, EditorLanguage] = {}
"""By name. `register` adds to it."""


def register(language: EditorLanguage) -> None:
    """From now on, texts may be in it. Raises `Misuse` if a registered language has its name or suffix."""
    for other in LANGUAGES.values():
        if language.name == other.name or language.suffix == other.suffix:
            raise Misuse(f"{other.name} has this name or {other.suffix} already")
    LANGUAGES[language.name] = language


def language_of(name: str, uri: str, text: str) -> EditorLanguage | None:
    """None for a text in an unknown language."""
    if name in LANGUAGES:
        return LANGUAGES[name]
    suffix = suffix_of(uri)
    found = next((one for one in LANGUAGES.values() if one.suffix == suffix), None)
    return found if found is not None and found.is_meant(text) else None


for _language in (WBC_PROGRAMS, M1486_PROGRAMS, POSITION_TABLES, CONFIGURATIONS, WORLDS):
    register(_language)
