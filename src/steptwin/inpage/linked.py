"""Programs of a twin as they are at present, for a link and a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.kinds.registry import KINDS
from steptwin.studio.programs import ProgramTexts

SUFFIXES = frozenset(language.suffix for kind in KINDS.values() for language in kind.languages)
"""Suffixes of files with programs and positions."""
NO_PROGRAM = Message("inpage.no-program", "{name}: a link can have files with programs only, which end in {suffixes}")
NOT_NAMED = Message(
    "inpage.not-named",
    "{controller}: the description names no file for {place}, so neither a link nor a campaign can have its text",
)
TWO_TEXTS = Message(
    "inpage.two-texts",
    "{name}: it is the file of several places, whose texts differ now; a link or a campaign has one text for it",
)


class LinkedTexts:
    """The files that a description names, with the present texts of the programs in them."""

    def __init__(self, files: Mapping[str, bytes], programs: ProgramTexts) -> None:
        """``programs``: at the beginning."""
        self._files = files
        self._programs = programs
        self._names = {(one.controller, one.place): one.name for one in programs.list() if one.name in files}

    def linked(self) -> Mapping[str, str]:
        """The texts by the names of their files. Raises `Misuse` where a link cannot have them."""
        for name in self._files:
            if PurePath(name).suffix not in SUFFIXES:
                raise Misuse(NO_PROGRAM(name=name, suffixes=sorted(SUFFIXES)))
        return self._present()

    def files(self) -> Mapping[str, bytes]:
        """All files that the description names, with the present texts. Raises `Misuse` where a text belongs to no file."""
        return {**self._files, **{name: text.encode() for name, text in self._present().items()}}

    def _present(self) -> Mapping[str, str]:
        found: dict[str, str] = {}
        for one in self._programs.list():
            name = self._names.get((one.controller, one.place))
            if name is None and one.empty:
                continue
            if name is None:
                raise Misuse(NOT_NAMED(controller=one.controller, place=one.place))
            text = self._programs.text(one.controller, one.place).text
            if found.setdefault(name, text) != text:
                raise Misuse(TWO_TEXTS(name=name))
        return found
