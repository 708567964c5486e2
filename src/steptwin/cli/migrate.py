"""``steptwin migrate``: what of a program does not fit another type of M1486, or another firmware of the MIC488.

From Python: `steptwin.m1486.migration.findings`, `steptwin.wbc.migration.findings`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.device import Json, print_json
from steptwin.cli.writtenfiles import written


def command(
    file: Annotated[Path, typer.Argument(help="WBC program (.prg) or M1486 program.")],
    to: Annotated[str, typer.Option(metavar="TYPE", help="Type of M1486 (B, E2, A2x), or firmware of the MIC488 (1.40).")],
    old: Annotated[
        str | None, typer.Option("--from", metavar="TYPE", help="The type that it is for. Default: A, firmware 1.70.")
    ] = None,
    output: Annotated[Path | None, written("--output", "-o", help="Write the changed program to this file.")] = None,
    json: Json = False,
) -> None:
    """Show what of a program does not fit another type of M1486 or another firmware of the MIC488, and why, with changes.

    Exit code 1 if errors are left."""
    fits, data = _migrate(file, to, old, output, (lambda _: None) if json else typer.echo)
    if json:
        print_json(data)
    if not fits:
        raise typer.Exit(1)


def _migrate(
    path: Path, to: str, old: str | None, output: Path | None, out: Callable[[str], object]
) -> tuple[bool, dict[str, Any]]:
    """Print what has to change, write the changed program to ``output``. Returns whether it fits then, and the report as data.
    Raises `Misuse` for what is no program."""
    from steptwin.diagnostics import SourceText, diagnostics_to_json, render
    from steptwin.files.textfiles import read_text, write_bytes
    from steptwin.languages import language_for
    from steptwin.languages.contract import FileLanguage, count

    language = language_for(path, "migrate", FileLanguage.migrate)
    file = read_text(path)
    found = language.migrate(file.source, to, old)
    if output is not None:
        write_bytes(output, file.to_bytes(found.text))
    changes = sum(d.fix is not None for d in found.findings)
    changed = SourceText(str(output or path), found.text)
    out(f"{path}: {found.title}")
    for sentence in found.differences:
        out(f"  {sentence}")
    if found.findings:
        out(render(file.source, found.findings))
    out(f"{count(changes, 'change')}{'' if output is None else f', written to {output}'}; errors left: {len(found.left)}")
    if found.left:
        out(render(changed, found.left))
    return not found.left, {
        "version": 1,
        "file": str(path),
        "title": found.title,
        "differences": found.differences,
        "diagnostics": diagnostics_to_json(file.source, found.findings),
        "errors_left": diagnostics_to_json(changed, found.left),
        "text": found.text,
    }
