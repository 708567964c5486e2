"""The program memory of a MIC488 in a world: banks of programs and of positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from steptwin.diagnostics import Diagnostic, Severity, SourceText, render
from steptwin.errors import SourceErrors
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import setup_of
from steptwin.mic488.status import ProgramState
from steptwin.simulation.kinds.mic488.build import table_for
from steptwin.simulation.kinds.mic488.table import Mic488Spec
from steptwin.simulation.kinds.programtexts import ProgramText, TextLanguage, bank_text
from steptwin.wbc.check import CheckedProgram, check
from steptwin.wbc.positions import PositionTable, parse_positions

if TYPE_CHECKING:
    from steptwin.explain.model import MemoryUse

WBC = TextLanguage("wbc", ".prg", "programs", in_banks=True, has_statements=True)
TABLES = TextLanguage("csv", ".csv", "positions", in_banks=True, is_shared=True)
PROGRAM, POSITIONS = "program", "positions"


def program_texts(device: Mic488Device) -> Iterator[ProgramText]:
    control = device.program
    for bank in range(device.firmware.banks):
        place, program = bank_text(bank), control.banks.programs.get(bank)
        source = SourceText(place, "") if program is None else program.source
        yield ProgramText(
            place=place,
            language=WBC,
            source=source,
            check=lambda bank=bank, text=source.text: checked(device, bank, text).diagnostics,
            memory=lambda text, bank=bank: _program_memory(device, bank, text),
            is_empty=program is None,
            is_running=control.runs_program(bank) and control.state is ProgramState.RUNNING,
        )


def position_texts(spec: Mic488Spec, device: Mic488Device) -> Iterator[ProgramText]:
    names = dict(spec.positions)
    for bank in range(device.firmware.banks):
        place, table = f"{POSITIONS} {bank}", device.program.banks.positions.get(bank)
        source = SourceText(names.get(bank, place), "" if table is None else table.text)
        yield ProgramText(
            place=place,
            language=TABLES,
            source=source,
            check=lambda text=source.text: parse_positions(text)[1],
            memory=lambda text: _position_memory(device, text),
            is_empty=table is None,
        )


def checked(device: Mic488Device, bank: int, text: str) -> CheckedProgram:
    control = device.program
    return check(text, table_for(bank, control.banks.positions), setup_of(device.config), control.dialect)


def _program_memory(device: Mic488Device, bank: int, text: str) -> Sequence[MemoryUse]:
    from steptwin.explain.mic488 import memory_of  # only on request

    found = checked(device, bank, text)
    return [] if found.executable is None else memory_of(found.executable, found.positions, device.program.dialect)


def _position_memory(device: Mic488Device, text: str) -> Sequence[MemoryUse]:
    from steptwin.explain.mic488 import position_memory

    table, findings = parse_positions(text)
    has_errors = any(finding.severity is Severity.ERROR for finding in findings)
    return [] if has_errors else position_memory(len(table.rows), device.program.dialect)


def table_of(source: SourceText) -> PositionTable:
    table, findings = parse_positions(source.text)
    refuse(source, [finding for finding in findings if finding.severity is Severity.ERROR])
    return table


def refuse(source: SourceText, errors: Sequence[Diagnostic]) -> None:
    if errors:
        raise SourceErrors(render(source, errors))
