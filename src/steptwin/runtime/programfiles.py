"""Program, position table and configuration of a MIC488 as the files a user has."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from steptwin.diagnostics import Diagnostic, Severity, Source
from steptwin.files import read_bytes
from steptwin.mic488.config import ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.runtime.textfiles import read_text
from steptwin.wbc.check import Checked, check
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.wbc.usage import Setup


@dataclass(frozen=True, slots=True)
class ProgramFiles:
    """A program with what it was checked against. ``findings`` go by file, program first."""

    checked: Checked
    positions: PositionTable | None
    config: ControllerConfig | None
    findings: tuple[tuple[Source, list[Diagnostic]], ...]

    def count(self, severity: Severity) -> int:
        return sum(d.severity is severity for _, diagnostics in self.findings for d in diagnostics)


def read_program(
    program: Path, positions: Path | None = None, config: Path | None = None, dialect: Dialect = DEFAULT
) -> ProgramFiles:
    """Read and check a program with the files it goes with. Raises `Misuse` for files that cannot be read."""
    return check_source(read_text(program).source, positions, config, dialect)


def check_source(
    source: Source, positions: Path | None = None, config: Path | None = None, dialect: Dialect = DEFAULT
) -> ProgramFiles:
    """Check a program that was read already; otherwise like `read_program`."""
    table = settings = None
    others: list[tuple[Source, list[Diagnostic]]] = []
    if positions is not None:
        text = read_text(positions).source
        table, found = parse_positions(text.text)
        others.append((text, found))
    if config is not None:
        file = IniFile.parse(read_bytes(config), str(config))
        settings, found = examine_config(file, dialect.firmware)
        others.append((file.source, found))
    checked = check(source.text, table, None if settings is None else setup_of(settings), dialect)
    return ProgramFiles(checked, table, settings, ((source, checked.diagnostics), *others))


def setup_of(config: ControllerConfig) -> Setup:
    """What the checker of programs needs of a configuration."""
    return Setup(
        gears=tuple(axis.gear for axis in config.axes),
        accelerations=tuple(axis.acc for axis in config.axes),
        decelerations=tuple(axis.dec for axis in config.axes),
        input_interrupts=tuple(settings.interrupt for settings in config.inputs),
    )
