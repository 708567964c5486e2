"""``steptwin check``: everything wrong or doubtful in a file, at once. Exit code 1 if there are errors.

From Python: `steptwin.m1486.check.check`, `steptwin.wbc.check.check`, `steptwin.world.check.diagnose`.
The JSON is described in docs/reference/check-json.md.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli import completion

#: Raised when a member of the JSON changes its meaning or goes away.
JSON_VERSION = 1


def check(
    file: Annotated[Path, typer.Argument(help="File to check.")],
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
    """Check a file and report everything wrong or doubtful in it: WBC programs (.prg), position tables (.csv), configurations
    (.cfg), worlds (.toml); all others are M1486 programs."""
    from steptwin.commands.check import CheckOptions, checker_of, count
    from steptwin.diagnostics import Severity, render, to_json
    from steptwin.files.textfiles import read_text

    checker = checker_of(file)
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
        typer.echo(f"{source.name}: {count(errors, 'error')}, {count(warnings, 'warning')}")
        for line in report.lines:
            typer.echo(line)
    if errors:
        raise typer.Exit(1)
