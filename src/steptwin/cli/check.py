"""``steptwin check``: everything wrong or doubtful in a file, at once. Exit code 1 if there are errors.

From Python: `steptwin.m1486.check.check`, `steptwin.wbc.check.check`, `steptwin.simulation.world.check.diagnose`;
`[history]` and gateways are checked where `steptwin.services` is imported.
The JSON is described in docs/reference/check-json.md.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.languageoptions import M1486FileOptions, WbcFileOptions, given_of
from steptwin.cli.optiongroups import grouped
from steptwin.options import option_of

JSON_VERSION = 1
"""Raised when a member of the JSON changes its meaning or goes away."""


@dataclass(frozen=True, kw_only=True)
class M1486CheckOptions(M1486FileOptions):
    memory: Annotated[bool, typer.Option("--memory", help="Show the command memory each command takes.")] = False


@grouped
def command(
    file: Annotated[Path, typer.Argument(help="File to check.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    *,
    wbc: WbcFileOptions,
    chip: M1486CheckOptions,
) -> None:
    """Check a file and report everything wrong or doubtful in it: WBC programs (.prg), position tables (.csv), configurations
    (.cfg), worlds (.toml); all others are M1486 programs."""
    from steptwin.diagnostics import Severity, diagnostics_to_json, render
    from steptwin.files.textfiles import read_text
    from steptwin.languages import language_for
    from steptwin.languages.contract import FileLanguage, count

    language = language_for(file, "check", FileLanguage.check)
    given = given_of(wbc, chip)
    language.refuse_others(given, option_of)
    source = read_text(file).source
    report = language.check(source, given)
    findings = [(source, report.diagnostics), *report.companions]
    in_files = [where.name for where, found in report.companions if found]
    errors = sum(d.severity is Severity.ERROR for _, found in findings for d in found)
    # That a file has errors is shown where it is named; they are counted in the file.
    errors -= sum(d.code == "D010" and any(name in d.message for name in in_files) for d in report.diagnostics)
    warnings = sum(d.severity is Severity.WARNING for _, found in findings for d in found)
    if as_json:
        data = {
            "version": JSON_VERSION,
            "file": source.name,
            "language": language.name,
            "errors": errors,
            "warnings": warnings,
            "diagnostics": [row for where, found in findings for row in diagnostics_to_json(where, found)],
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
