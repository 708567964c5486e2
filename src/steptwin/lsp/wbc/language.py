"""The files of a MIC488 in editors: programs, position tables, configurations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.lsp.config import ConfigAnalysis
from steptwin.lsp.files import relative
from steptwin.lsp.language import EditorLanguage, OtherTexts
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.table import TableAnalysis, UsedRows
from steptwin.lsp.wbc.analysis import WbcAnalysis
from steptwin.lsp.wbc.surroundings import ProgramContext
from steptwin.lsp.world.tables import text_of
from steptwin.mic488.config import ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.simulation.kinds.mic488.table import banks_value
from steptwin.wbc.dialect import DEFAULT, Dialect, dialect_for
from steptwin.wbc.incremental import Edited
from steptwin.wbc.positions import PositionTable, parse_positions

_SECTION = re.compile(r"^[ \t]*\[(?:Axis[0-3]|IN[0-9]|AIN[01]|WBC_PROGRAM)\]", re.MULTILINE | re.IGNORECASE)
_BEGINNING = 4000
"""Characters in which a position table shows its first row."""


@dataclass(frozen=True, slots=True)
class Mic488Files:
    """A MIC488 of a world: addresses of its files, by bank where there are banks."""

    firmware: str
    config: str | None
    programs: Mapping[int, str]
    positions: Mapping[int, str]

    @property
    def files(self) -> Iterator[str]:
        yield from self.programs.values()
        yield from self.positions.values()
        if self.config is not None:
            yield self.config

    def table_of(self, program: str) -> str | None:
        """The table of a program: that of its bank, or the only one there is."""
        bank = next((bank for bank, uri in self.programs.items() if uri == program), None)
        if bank in self.positions:
            return self.positions[bank]
        return next(iter(self.positions.values())) if len(self.positions) == 1 else None

    @property
    def dialect(self) -> Dialect:
        try:
            return dialect_for(self.firmware)
        except Misuse:
            return DEFAULT


def controller_of(world: str, table: Mapping[str, Any]) -> Mic488Files:
    """The files of a MIC488, by its table in a description; wrong values are left out."""
    programs = _banks(world, table, "programs")
    single = text_of(table, "program")
    if single is not None:
        programs = {0: relative(world, single)} | programs
    config = text_of(table, "config")
    return Mic488Files(
        str(table.get("firmware", DEFAULT.firmware)),
        None if config is None else relative(world, config),
        programs,
        _banks(world, table, "positions"),
    )


def _banks(world: str, table: Mapping[str, Any], key: str) -> dict[int, str]:
    try:
        return {bank: relative(world, name) for bank, name in banks_value(table[key])} if key in table else {}
    except Misuse:
        return {}


def _table(uri: str, text: str) -> PositionTable:
    return parse_positions(text)[0]


def _config(uri: str, text: str, firmware: str) -> ControllerConfig:
    return examine_config(IniFile.of_text(text, uri), firmware)[0]


def _context(session: OtherTexts, program: str) -> ProgramContext:
    controller = next((one for one in session.controllers(Mic488Files) if program in one.programs.values()), None)
    table = (controller.table_of(program) if controller else None) or session.beside(program, POSITION_TABLES.suffix)
    config = (controller.config if controller else None) or session.beside(program, CONFIGURATIONS.suffix)
    dialect = controller.dialect if controller else DEFAULT
    return ProgramContext(session.derived(table, _table), session.derived(config, _config, dialect.firmware), dialect)


def _firmware(session: OtherTexts, config: str) -> str:
    return next((one.dialect.firmware for one in session.controllers(Mic488Files) if one.config == config), DEFAULT.firmware)


def _programs_of(session: OtherTexts, table: str) -> list[str]:
    """The programs that use a position table."""
    found = [
        program
        for controller in session.controllers(Mic488Files)
        for program in controller.programs.values()
        if controller.table_of(program) == table
    ]
    same_name = session.beside(table, WBC_PROGRAMS.suffix)
    return list(dict.fromkeys([*found, *([same_name] if same_name else [])]))


def _used_rows(session: OtherTexts, table: str) -> UsedRows | None:
    """Rows of a table that programs use; None where there is no program."""
    analyses = map(session.analysis, _programs_of(session, table))
    used = [one.used_rows for one in analyses if isinstance(one, WbcAnalysis)]
    if not used:
        return None
    names = frozenset[str]().union(*(rows.names for rows in used))
    numbers = frozenset[int]().union(*(rows.numbers for rows in used))
    return UsedRows(names, numbers, any(rows.all_may_be for rows in used))


class WbcPrograms(EditorLanguage):
    name = "wbc"
    suffix = ".prg"
    shares_name = True

    def around(self, session: OtherTexts, uri: str) -> tuple[object, ...]:
        around = _context(session, uri)
        return around.positions, around.config, around.dialect

    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex) -> WbcAnalysis:
        edited = session.kept(uri, Edited)
        edited.update(lines.text, (lines.contents, lines.starts))
        return WbcAnalysis(uri, lines, edited, _context(session, uri))


class PositionTables(EditorLanguage):
    name = "mic488-positions"
    suffix = ".csv"
    shares_name = True

    def is_meant(self, text: str) -> bool:
        beginning = text[:_BEGINNING].lstrip()
        return not beginning or ";" in re.split("[\r\n]", beginning, maxsplit=1)[0]

    def around(self, session: OtherTexts, uri: str) -> tuple[UsedRows | None]:
        return (_used_rows(session, uri),)

    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex) -> TableAnalysis:
        return TableAnalysis(uri, lines, _used_rows(session, uri))


class Configurations(EditorLanguage):
    name = "mic488-config"
    suffix = ".cfg"
    shares_name = True

    def is_meant(self, text: str) -> bool:
        return _SECTION.search(text) is not None

    def around(self, session: OtherTexts, uri: str) -> tuple[str]:
        return (_firmware(session, uri),)

    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex) -> ConfigAnalysis:
        return ConfigAnalysis(uri, lines, _firmware(session, uri))


WBC_PROGRAMS = WbcPrograms()
POSITION_TABLES = PositionTables()
CONFIGURATIONS = Configurations()
