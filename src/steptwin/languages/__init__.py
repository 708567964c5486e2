"""The languages of files that the commands `check`, `explain`, `migrate`, `fmt`, `run` and the debug adapter take.

No command asks which language a file has: it takes the one that belongs to the end of the name, and the methods that it offers.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.languages.contract import FileLanguage
from steptwin.languages.m1486 import M1486_PROGRAMS
from steptwin.languages.wbc import CONFIGURATIONS, POSITION_TABLES, WBC_IMAGES, WBC_PROGRAMS
from steptwin.languages.world import WORLDS

LANGUAGES: dict[str, FileLanguage] = {}
"""By name. `register` adds to it."""


def register(language: FileLanguage) -> None:
    """From now on, commands take its files. Raises `Misuse` if a registered language has its name or one of its suffixes."""
    for other in LANGUAGES.values():
        taken = ({language.name} & {other.name}) | (set(language.suffixes) & set(other.suffixes))
        if taken or (language.is_usual and other.is_usual):
            raise Misuse(f"{other.title} have {', '.join(sorted(taken)) or 'files with unknown suffixes'} already")
    LANGUAGES[language.name] = language


def by_suffix(path: Path) -> FileLanguage | None:
    """The language whose suffix a file has; None for another suffix."""
    return next((one for one in LANGUAGES.values() if path.suffix.lower() in one.suffixes), None)


def language_for(path: Path, action: str, method: Callable[..., object]) -> FileLanguage:
    """The language of a file, which offers a method. Raises `Misuse`, with the files whose languages do, if it does not;
    ``action`` is the verb of the message."""
    language = by_suffix(path) or next(one for one in LANGUAGES.values() if one.is_usual)
    if language.offers(method):
        return language
    if language.not_text:
        raise Misuse(f"{path} {language.not_text}")
    able = [one.description for one in LANGUAGES.values() if one.offers(method)]
    raise Misuse(f"cannot {action} {path}: permitted are {' and '.join(able)}")


for _language in (WBC_PROGRAMS, WBC_IMAGES, POSITION_TABLES, CONFIGURATIONS, WORLDS, M1486_PROGRAMS):
    register(_language)
