"""Builds a MIC488 from its description: configuration, programs, positions."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.diagnostics import Severity, SourceText, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.mic488.config import ConfigError, ControllerConfig, examine_config
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.present import place_of
from steptwin.mic488.program import LoadedProgram, load, setup_of
from steptwin.mic488.registers import firmware
from steptwin.mic488.status import ProgramState
from steptwin.wbc.check import check
from steptwin.wbc.decompile import IMAGE, program_of
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.world.kind import BuildContext, text_of
from steptwin.world.kinds.mic488.table import Mic488Spec, config_of
from steptwin.world.programtexts import CSV, WBC, ProgramText


def build(spec: Mic488Spec, memory: bytes | None, context: BuildContext) -> Mic488Device:
    config = _config(spec, context)
    programs, positions = _banks(spec, config, context)
    statement_time = STATEMENT_TIME if spec.statement_time is None else spec.statement_time
    return Mic488Device(
        config,
        spec.firmware,
        lenient=spec.lenient,
        memory=memory,
        programs=programs,
        positions=positions,
        statement_time=statement_time,
    )


def texts(spec: Mic488Spec, device: Mic488Device, context: BuildContext) -> list[ProgramText]:
    """See `steptwin.world.kind.ControllerKind.texts`. A program that was given as an image is the text made of it."""
    sources, tables = _texts(spec, context)
    setup, dialect = setup_of(_config(spec, context)), dialect_for(spec.firmware)
    control, place = device.program, place_of(device)
    found: list[ProgramText] = []
    for bank, source in sources.items():
        line = place.line if place is not None and (control.program_bank, place.file) == (bank, source.name) else None
        found.append(
            ProgramText(
                place=f"program {bank}",
                language=WBC,
                source=source,
                diagnostics=check(source.text, _table_for(bank, tables), setup, dialect).diagnostics,
                is_running=line is not None and control.state is ProgramState.RUNNING,
                line=line,
            )
        )
    for bank, name in spec.positions:
        source = SourceText(name, text_of(context, name))
        findings = parse_positions(source.text)[1]
        found.append(ProgramText(place=f"positions {bank}", language=CSV, source=source, diagnostics=findings))
    return found


def _config(spec: Mic488Spec, context: BuildContext) -> ControllerConfig:
    base = ControllerConfig()
    if spec.config is not None:
        file = IniFile.parse(context.data(spec.config), spec.config)
        base, found = examine_config(file, spec.firmware)
        if any(finding.severity is Severity.ERROR for finding in found):
            raise ConfigError(file.source, found)
        context.warn(file.source, found)
    return config_of(spec, base)


def _banks(
    spec: Mic488Spec, config: ControllerConfig, context: BuildContext
) -> tuple[dict[int, LoadedProgram], dict[int, PositionTable]]:
    """What is in the banks. Names of positions are found in the table of the same bank, or else in the only one there is."""
    sources, tables = _texts(spec, context)
    programs: dict[int, LoadedProgram] = {}
    for bank, name in spec.all_programs:
        table = _table_for(bank, tables)
        checked = check(sources[bank].text, table, setup_of(config), dialect_for(spec.firmware))
        if checked.errors:
            raise SourceErrors(render(sources[bank], checked.errors))
        context.warn(sources[bank], checked.diagnostics)
        programs[bank] = load(checked, name)
    return programs, tables


def _table_for(bank: int, tables: Mapping[int, PositionTable]) -> PositionTable | None:
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
            context.warn(sources[bank], doubts)
            if table.rows:
                tables.setdefault(bank, table)
        else:
            sources[bank] = SourceText(name, text_of(context, name))
    return sources, tables


def _positions(name: str, context: BuildContext) -> PositionTable:
    source = SourceText(name, text_of(context, name))
    table, findings = parse_positions(source.text)
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if errors or table is None:
        raise SourceErrors(render(source, errors))
    context.warn(source, findings)
    return table
