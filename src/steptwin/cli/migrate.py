"""``steptwin migrate``: what of a program does not fit another type of M1486, or another firmware of the MIC488.

From Python: `steptwin.m1486.migration.findings`, `steptwin.wbc.migration.findings`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
    from steptwin.cli.migrate_pages import migrate as migrate_file

    fits, data = migrate_file(file, to, old, output, (lambda _: None) if json else typer.echo)
    if json:
        print_json(data)
    if not fits:
        raise typer.Exit(1)
