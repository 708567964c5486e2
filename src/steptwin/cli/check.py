"""``steptwin check``: everything wrong or doubtful in a program, at once. Exit code 1 if there are errors.

From Python: `steptwin.m1486.check.check`, `steptwin.wbc.check.check`. The JSON is described in docs/reference/check-json.md.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.diagnostics import Diagnostic, SourceText
    from steptwin.m1486.check import ChipMemory

#: Raised when a member of the JSON changes its meaning or goes away.
JSON_VERSION = 1


@dataclass(frozen=True)
class CheckOptions:
    """The options of the command line; None: not given."""

    variant: str | None = None
    interface: str | None = None
    memory: bool = False
    positions: Path | None = None
    config: Path | None = None
    firmware: str | None = None

    def refuse(self, language: str, *names: str) -> None:
        """Raises `Misuse` if one of these options was given, which do not apply to the language of the file."""
        for name in names:
            if getattr(self, name):
                raise Misuse(f"--{name} is not for {language} programs")


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


def check(
    file: Annotated[Path, typer.Argument(help="Program to check.")],
    variant: Annotated[
        str | None,
        typer.Option(help="Type of M1486: A, B, C, E1, E2, or A2x and so on. Default A.", autocompletion=completion.variants),
    ] = None,
    interface: Annotated[str | None, typer.Option(help="Driver interface of the M1486: sd, dual or two. Default sd.")] = None,
    memory: Annotated[bool, typer.Option("--memory", help="Show the command memory each M1486 command takes.")] = False,
    positions: Annotated[
        Path | None, typer.Option(help="Position table of a WBC program. Default: the .csv of the same name.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="Configuration of its MIC488. Default: the .cfg of the same name.")] = None,
    firmware: Annotated[
        str | None, typer.Option(help="Firmware of the MIC488. Default 1.70.", autocompletion=completion.firmwares)
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Check a program and report everything wrong or doubtful in it: WBC in .prg files, M1486 in all others."""
    from steptwin.diagnostics import Severity, render, to_json
    from steptwin.files.textfiles import read_text

    checker = _checker(file)
    source = read_text(file).source
    report = checker(source, CheckOptions(variant, interface, memory, positions, config, firmware))
    findings = [(source, report.diagnostics), *report.companions]
    errors = sum(d.severity is Severity.ERROR for _, found in findings for d in found)
    warnings = sum(d.severity is Severity.WARNING for _, found in findings for d in found)
    if as_json:
        data = {
            "version": JSON_VERSION,
            "file": source.name,
            "language": report.language,
            "errors": errors,
            "warnings": warnings,
            "diagnostics": [row for where, found in findings for row in to_json(where, found)],
            **report.data,
        }
        typer.echo(json.dumps(data, ensure_ascii=False, indent=2))
    else:
        for where, found in findings:
            if found:
                typer.echo(render(where, found))
        typer.echo(f"{source.name}: {_count(errors, 'error')}, {_count(warnings, 'warning')}")
        for line in report.lines:
            typer.echo(line)
    if errors:
        raise typer.Exit(1)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _check_m1486(source: SourceText, options: CheckOptions) -> CheckReport:
    from steptwin.m1486 import lines, variants
    from steptwin.m1486.check import check as check_program

    options.refuse("M1486", "positions", "config", "firmware")
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
    from steptwin.files.programfiles import CompanionFiles, check_source
    from steptwin.wbc.dialect import DEFAULT, dialect_for

    options.refuse("WBC", "variant", "interface", "memory")
    dialect = DEFAULT if options.firmware is None else dialect_for(options.firmware)
    files = CompanionFiles.of(Path(source.name), options.positions, options.config)
    read = check_source(source, files.positions, files.config, dialect)
    lines = read.checked.lines
    shown = f"MIC488 firmware {dialect.firmware}, {_count(lines, 'executable line')} of {dialect.max_steps}"
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


#: The checker of each language by the suffix of its files; every other suffix is M1486.
_CHECKERS: dict[str, Callable[[SourceText, CheckOptions], CheckReport]] = {".prg": _check_wbc}


def _checker(file: Path) -> Callable[[SourceText, CheckOptions], CheckReport]:
    if file.suffix.lower() == ".wbc":
        raise Misuse(f"{file} is a compiled image: steptwin decompile makes a program of it")
    return _CHECKERS.get(file.suffix.lower(), _check_m1486)
