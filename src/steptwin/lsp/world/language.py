"""Descriptions of worlds in editors."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

from steptwin.errors import Misuse
from steptwin.lsp.language import ControllerFiles, EditorLanguage, OtherTexts
from steptwin.lsp.m1486.language import chip_of
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.wbc.language import controller_of
from steptwin.lsp.world.analysis import WorldAnalysis
from steptwin.lsp.world.built import ElementSignals
from steptwin.simulation.kinds.registry import KINDS

FILES: dict[str, Callable[[str, Mapping[str, Any]], ControllerFiles | None]] = {"mic488": controller_of, "m1486": chip_of}
"""Readers of the files of a controller from the address of a description and its table there, by kinds of controllers."""


def _tables(data: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    tables = data.get(kind)
    return [table for table in tables if isinstance(table, dict)] if isinstance(tables, list) else []


class Worlds(EditorLanguage):
    name = "steptwin-world"
    suffix = ".toml"

    def is_meant(self, text: str) -> bool:
        tables = "|".join(map(re.escape, ("world", *KINDS)))
        return re.search(rf"^[ \t]*\[\[?[ \t]*(?:{tables})[ \t]*[\].]", text, re.MULTILINE) is not None

    def around(self, session: OtherTexts, uri: str) -> tuple[object, ...]:
        return tuple(session.lines(file) for file in session.files_of(uri))

    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex) -> WorldAnalysis:
        return WorldAnalysis(uri, lines, session, session.kept(uri, ElementSignals))

    def controllers(self, uri: str, text: str) -> list[ControllerFiles]:
        """As `EditorLanguage.controllers`. Leaves out what is wrong."""
        try:
            data = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
            raise Misuse(str(error)) from None
        read = (files(uri, table) for kind, files in FILES.items() for table in _tables(data, kind))
        return [controller for controller in read if controller is not None]


WORLDS = Worlds()
