"""Program, position table and configuration of a MIC488 as the files a user has."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from steptwin.diagnostics import Diagnostic, Severity, SourceText
from steptwin.files.textfiles import read_text
from steptwin.inputfiles import read_bytes
from steptwin.mic488.config import ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.program_banks import setup_of
from steptwin.wbc.check import CheckedProgram, check
from steptwin.wbc.decompile import IMAGE
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.positions import PositionTable, parse_positions


@dataclass(frozen=True, slots=True)
class ProgramFiles:
    """A program with what it was checked against. ``findings`` go by file, program first."""

    checked: CheckedProgram
    positions: PositionTable | None
    config: ControllerConfig | None
    findings: tuple[tuple[SourceText, list[Diagnostic]], ...]

    def count(self, severity: Severity) -> int:
        return sum(d.severity is severity for _, diagnostics in self.findings for d in diagnostics)


@dataclass(frozen=True, slots=True)
class CompanionFiles:
    """The files that belong to a program: those the user named, else those of the same name that lie beside it.

    ``found`` are the names of the latter.
    """

    positions: Path | None
    config: Path | None
    found: tuple[str, ...] = ()

    @classmethod
    def of(cls, program: Path, positions: Path | None, config: Path | None) -> CompanionFiles:
        """A controller has three files of one name, as in the vendor's tool: ``.prg``, ``.csv`` and ``.cfg``.

        A compiled image has its positions in it.
        """
        table = _beside(program, ".csv") if positions is None and program.suffix.lower() != IMAGE else None
        settings = _beside(program, ".cfg") if config is None else None
        found = tuple(path.name for path in (table, settings) if path is not None)
        return cls(positions or table, config or settings, found)

    def __str__(self) -> str:
        return f"with {' and '.join(self.found)}, found beside the program"


def _beside(program: Path, suffix: str) -> Path | None:
    return next((path for end in (suffix, suffix.upper()) if (path := program.with_suffix(end)).is_file()), None)


def read_program(
    program: Path, positions: Path | None = None, config: Path | None = None, dialect: Dialect = DEFAULT
) -> ProgramFiles:
    """Read and check a program with its companion files. Raises `Misuse` for files that cannot be read."""
    return check_source(read_text(program).source, positions, config, dialect)


def check_source(
    source: SourceText, positions: Path | None = None, config: Path | None = None, dialect: Dialect = DEFAULT
) -> ProgramFiles:
    """Check a program that was read already; otherwise like `read_program`."""
    table = settings = None
    others: list[tuple[SourceText, list[Diagnostic]]] = []
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
