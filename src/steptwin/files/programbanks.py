"""Programs and position tables from files into the banks of a MIC488."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from steptwin.diagnostics import Diagnostic, Severity, SourceText, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.files.textfiles import read_text
from steptwin.inputfiles import read_bytes
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.program_banks import LoadedProgram, load, setup_of
from steptwin.numerals import read_whole
from steptwin.wbc.check import CheckedProgram, check
from steptwin.wbc.decompile import IMAGE, program_of
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.positions import PositionTable, parse_positions

Findings: TypeAlias = tuple[tuple[SourceText, list[Diagnostic]], ...]
"""Findings by file."""


@dataclass(frozen=True, slots=True)
class Banks:
    """The contents of a controller's banks, and the findings about their files."""

    programs: Mapping[int, LoadedProgram] = field(default_factory=dict)
    positions: Mapping[int, PositionTable] = field(default_factory=dict)
    findings: Findings = ()


class ProgramErrors(SourceErrors):
    """Programs or tables with errors; the text shows them all, with the warnings."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        shown = [(source, [d for d in found if d.severity is not Severity.NOTE]) for source, found in findings]
        super().__init__("\n".join(render(source, found) for source, found in shown if found))


def parse_banks(option: str, given: Sequence[str], banks: int) -> dict[int, Path]:
    """``0=FILE`` is for bank 0, and so is ``FILE``. Raises `Misuse` for banks that are not there or given twice."""
    files: dict[int, Path] = {}
    for text in given:
        number, equals, name = text.partition("=")
        bank = read_whole(number.strip()) if equals else None
        if bank is None:
            bank, name = 0, text
        if not name:
            raise Misuse(f"{option} {text}: expected BANK=FILE, such as 0=machine.prg")
        if bank >= banks:
            raise Misuse(f"{option} {text}: permitted are banks 0 to {banks - 1}")
        if bank in files:
            raise Misuse(f"{option} {text}: bank {bank} has {files[bank]} already")
        files[bank] = Path(name)
    return files


def read_banks(
    programs: Mapping[int, Path],
    positions: Mapping[int, Path],
    config: ControllerConfig,
    dialect: Dialect = DEFAULT,
    *,
    option: str = "--positions {bank}=FILE",
) -> Banks:
    """Read and check the contents of the banks: programs (`.prg`) and compiled images (`.wbc`), which contain their own table.

    Names of positions are found in the table of the program's own bank number, or else in the only table there is. Raises
    `ProgramErrors`, and `Misuse` for files that cannot be read or run, and for a program that names positions where there is no
    table; ``option`` is how a table for a bank is given.
    """
    tables: dict[int, PositionTable] = {}
    findings: list[tuple[SourceText, list[Diagnostic]]] = []
    sources: dict[int, SourceText] = {}
    for bank, path in programs.items():
        if path.suffix.lower() == IMAGE:
            sources[bank], table, doubts = program_of(read_bytes(path), str(path))
            findings.append((sources[bank], doubts))
            if table.rows and bank not in positions:
                tables[bank] = table
        else:
            sources[bank] = read_text(path).source
    for bank, path in positions.items():
        source = read_text(path).source
        tables[bank], found = parse_positions(source.text)
        findings.append((source, found))
    only = next(iter(tables.values())) if len(tables) == 1 else None
    checked: dict[int, tuple[CheckedProgram, Path]] = {}
    for bank, path in programs.items():
        source = sources[bank]
        program = check(source.text, tables.get(bank, only), setup_of(config), dialect)
        checked[bank] = program, path
        findings.append((source, program.diagnostics))
    if any(d.severity is Severity.ERROR for _, diagnostics in findings for d in diagnostics):
        raise ProgramErrors(tuple(findings))
    for bank, (program, path) in checked.items():
        if program.executable is None:
            raise Misuse(f"{path} names positions: give the table with {option.format(bank=bank)}")
    return Banks({bank: load(program, str(path)) for bank, (program, path) in checked.items()}, tables, tuple(findings))
