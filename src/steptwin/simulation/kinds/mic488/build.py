"""Builds a MIC488 from its description: configuration, programs, positions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.mic488.config import ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.program_banks import LoadedProgram, load, setup_of
from steptwin.mic488.registers import firmware
from steptwin.simulation.kinds.kind import BuildContext, text_of
from steptwin.simulation.kinds.mic488.table import Mic488Spec, config_of
from steptwin.wbc.check import check
from steptwin.wbc.decompile import IMAGE, program_of
from steptwin.wbc.dialect import Dialect, dialect_for
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.wbc.usage import Setup

REMEMBERED = 16
"""Programs and tables that are kept for the next world with the same."""


def configured(spec: Mic488Spec, context: BuildContext) -> ControllerConfig:
    base = ControllerConfig()
    if spec.config is not None:
        file = IniFile.parse(context.data(spec.config), spec.config)
        base, found = examine_config(file, spec.firmware)
        context.accept(file.source, found)
    return config_of(spec, base)


def banks(
    spec: Mic488Spec, config: ControllerConfig, context: BuildContext
) -> tuple[dict[int, LoadedProgram], dict[int, PositionTable]]:
    """Contents of the banks. Names of positions are found in the table of the same bank, or else in the only one there is."""
    sources, tables = _texts(spec, context)
    programs: dict[int, LoadedProgram] = {}
    for bank, name in spec.all_programs:
        table = table_for(bank, tables)
        of = sources[bank].text, table, setup_of(config), dialect_for(spec.firmware)
        context.accept(sources[bank], _checked(*of).diagnostics)
        programs[bank] = _loaded(name, *of)
    return programs, tables


_checked = lru_cache(maxsize=REMEMBERED)(check)


@lru_cache(maxsize=REMEMBERED)
def _loaded(name: str, text: str, table: PositionTable | None, setup: Setup, dialect: Dialect) -> LoadedProgram:
    return load(_checked(text, table, setup, dialect), name)


def table_for(bank: int, tables: Mapping[int, PositionTable]) -> PositionTable | None:
    """In which names of positions are found: the table of the same bank, or else the only one there is."""
    only = next(iter(tables.values())) if len(tables) == 1 else None
    return tables.get(bank, only)


def _texts(spec: Mic488Spec, context: BuildContext) -> tuple[dict[int, SourceText], dict[int, PositionTable]]:
    """Programs and positions by bank."""
    number = firmware(spec.firmware).banks
    for key, given in (("programs", spec.all_programs), ("positions", spec.positions)):
        for bank, name in given:
            if bank >= number:
                raise Misuse(f"{key}: {name} is for bank {bank}: firmware {spec.firmware} has banks 0 to {number - 1}")
    tables = {bank: _positions(name, context) for bank, name in spec.positions}
    sources: dict[int, SourceText] = {}
    for bank, name in spec.all_programs:
        if name.lower().endswith(IMAGE):
            sources[bank], table, doubts = program_of(context.data(name), name)
            context.accept(sources[bank], doubts)
            if table.rows:
                tables.setdefault(bank, table)
        else:
            sources[bank] = SourceText(name, text_of(context, name))
    return sources, tables


_parsed = lru_cache(maxsize=REMEMBERED)(parse_positions)


def _positions(name: str, context: BuildContext) -> PositionTable:
    source = SourceText(name, text_of(context, name))
    table, findings = _parsed(source.text)
    context.accept(source, findings)
    return table
