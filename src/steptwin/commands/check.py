"""Checkers of files by the ends of their names, as ``steptwin check`` calls them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.errors import Misuse
from steptwin.files.programfiles import CompanionFiles, check_source
from steptwin.files.world import read_beside
from steptwin.m1486 import lines, variants
from steptwin.m1486.check import ChipMemory
from steptwin.m1486.check import check as check_program
from steptwin.mic488.config import examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.wbc.dialect import DEFAULT, dialect_for
from steptwin.wbc.positions import parse_positions
from steptwin.world.check import diagnose

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True)
class CheckOptions:
    """The options of the command line; None: not given."""

    variant: str | None = None
    interface: str | None = None
    memory: bool = False
    positions: Path | None = None
    config: Path | None = None
    firmware: str | None = None


def refuse_others(language: str, options: DataclassInstance, *taken: str) -> None:
    """Raises `Misuse` if an option was given that is not among those ``taken`` for the language of the file."""
    for name, given in asdict(options).items():
        if given and name not in taken:
            raise Misuse(f"--{name} is not for {language}")


@dataclass(frozen=True)
class CheckReport:
    """The result of the checker of one language: findings, further members of the JSON, further lines of the text.

    ``companions``: the other files that were read, with their findings.
    """

    language: str
    diagnostics: list[Diagnostic]
    data: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    companions: list[tuple[SourceText, list[Diagnostic]]] = field(default_factory=list)


def count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _check_m1486(source: SourceText, options: CheckOptions) -> CheckReport:
    refuse_others("M1486 programs", options, "variant", "interface", "memory")
    variant = variants.DEFAULT if options.variant is None else variants.variant(options.variant)
    interface = lines.STEP_DIRECTION if options.interface is None else lines.interface(options.interface)
    checked = check_program(source.text, variant, interface)
    shown = [f"{variant.title}, {interface.title} interface"]
    for chip in checked.memory:
        shown.append(_memory_summary(chip))
        if options.memory:
            shown += _memory_lines(source, chip)
    data = {
        "variant": variant.name,
        "interface": interface.name,
        "memory": [_memory_data(source, chip) for chip in checked.memory],
    }
    return CheckReport("m1486", checked.diagnostics, data, shown)


def _memory_summary(chip: ChipMemory) -> str:
    name = "command memory" if chip.address is None else f"command memory of chip {chip.address:X}"
    files = ", ".join(f"{bits} of {chip.limit} bits in [ ]" for bits in chip.files)
    total = f"{chip.total} bits in total"
    return f"{name}: {files}, {total}" if files else f"{name}: {total}, nothing in [ ] ({chip.limit} bits)"


def _memory_lines(source: SourceText, chip: ChipMemory) -> list[str]:
    shown, total = ["  line  bits  total  command"], 0
    for taken in chip.commands:
        total += taken.bits
        line, _ = source.position(taken.command.span.start)
        indent = "  " if taken.in_file else ""
        shown.append(f"  {line:>4}  {taken.bits:>4}  {total:>5}  {indent}{taken.command}")
    return shown


def _memory_data(source: SourceText, chip: ChipMemory) -> dict[str, Any]:
    commands = []
    for taken in chip.commands:
        line, column = source.position(taken.command.span.start)
        commands.append(
            {"line": line, "column": column, "command": str(taken.command), "bits": taken.bits, "in_file": taken.in_file}
        )
    return {
        "address": None if chip.address is None else f"{chip.address:X}",
        "limit_bits": chip.limit,
        "total_bits": chip.total,
        "file_bits": list(chip.files),
        "commands": commands,
    }


def _check_wbc(source: SourceText, options: CheckOptions) -> CheckReport:
    refuse_others("WBC programs", options, "positions", "config", "firmware")
    dialect = DEFAULT if options.firmware is None else dialect_for(options.firmware)
    files = CompanionFiles.of(Path(source.name), options.positions, options.config)
    read = check_source(source, files.positions, files.config, dialect)
    lines = read.checked.lines
    shown = f"MIC488 firmware {dialect.firmware}, {count(lines, 'executable line')} of {dialect.max_steps}"
    data = {
        "firmware": dialect.firmware,
        "positions": None if files.positions is None else str(files.positions),
        "config": None if files.config is None else str(files.config),
        "executable_lines": lines,
        "limit_lines": dialect.max_steps,
    }
    return CheckReport(
        "wbc", read.checked.diagnostics, data, [shown, *([str(files)] if files.found else [])], list(read.findings[1:])
    )


def _check_positions(source: SourceText, options: CheckOptions) -> CheckReport:
    refuse_others("position tables", options)
    table, found = parse_positions(source.text)
    return CheckReport("positions", found, {"positions": len(table.rows)}, [count(len(table.rows), "position")])


def _check_config(source: SourceText, options: CheckOptions) -> CheckReport:
    refuse_others("configurations", options, "firmware")
    dialect = DEFAULT if options.firmware is None else dialect_for(options.firmware)
    _, found = examine_config(IniFile.of_text(source.text), dialect.firmware)
    return CheckReport("config", found, {"firmware": dialect.firmware}, [f"MIC488 firmware {dialect.firmware}"])


def _check_world(source: SourceText, options: CheckOptions) -> CheckReport:
    refuse_others("worlds", options)
    folder = Path(source.name).parent
    return CheckReport("world", list(diagnose(source.name, source.text, lambda name: read_beside(folder, name))))


CHECKERS: dict[str, Callable[[SourceText, CheckOptions], CheckReport]] = {
    ".prg": _check_wbc,
    ".csv": _check_positions,
    ".cfg": _check_config,
    ".toml": _check_world,
}
"""Files with other suffixes are programs of the M1486."""


def checker_of(file: Path) -> Callable[[SourceText, CheckOptions], CheckReport]:
    """Raises `Misuse` for a compiled program."""
    if file.suffix.lower() == ".wbc":
        raise Misuse(f"{file} is a compiled image: steptwin decompile makes a program of it")
    return CHECKERS.get(file.suffix.lower(), _check_m1486)
