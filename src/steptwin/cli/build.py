"""``steptwin build``: the vendor's compiled image of a WBC program.

From Python: `steptwin.wbc.image.build`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json, print_json
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


def command(
    file: Annotated[Path, typer.Argument(help="WBC program (.prg).")],
    positions: Annotated[
        Path | None, typer.Option(help="Position table; default: the .csv of the same name, else an empty one.")
    ] = None,
    output: Annotated[Path | None, written("--output", "-o", help="Image to write; default: FILE.wbc.")] = None,
    inferred: Annotated[
        bool, typer.Option("--inferred", help="Also write what has a form that is inferred, but was never seen in an image.")
    ] = False,
    firmware: Annotated[
        str, typer.Option(help="Firmware the program is checked for.", autocompletion=completion.firmwares)
    ] = "1.70",
    json: Json = False,
) -> None:
    """Compile a WBC program to the image of firmware 1.25. Exit code 1 if it has errors or something without a known form.

    Few statements have a known form: IF, ELSE, WHILE, WAIT, DELAY, JUMP, RETURN, HOME, MOVEPTP, WAITPOS, SET without calculation,
    labels INT_INn; with --inferred also the other motions and PROGRESET. Variables, END, $I, $D and $R have none, and neither
    have the comparisons <= and >=, for which IF ... ELSE can be written.
    """
    from steptwin.diagnostics import Severity, render
    from steptwin.files.programfiles import CompanionFiles, read_program
    from steptwin.files.textfiles import write_bytes
    from steptwin.wbc.decompile import IMAGE
    from steptwin.wbc.dialect import dialect_for
    from steptwin.wbc.image import build as build_image
    from steptwin.wbc.positions import PositionTable

    if file.suffix.lower() == IMAGE:
        raise Misuse(f"{file} is a compiled image already: steptwin decompile makes a program of it")
    files = CompanionFiles.of(file, positions, None)
    read = read_program(file, files.positions, dialect=dialect_for(firmware))
    for source, diagnostics in read.findings:
        if diagnostics:
            typer.echo(render(source, diagnostics), err=True)
    if read.count(Severity.ERROR):
        raise typer.Exit(1)
    executable = read.checked.executable
    if executable is None:
        raise Misuse(f"{file} names positions: give the table with --positions")
    table = read.positions or PositionTable()
    data, refused = build_image(executable, table, inferred=inferred)
    if data is None:
        typer.echo(render(read.findings[0][0], refused), err=True)
        raise typer.Exit(1)
    target = output or file.with_suffix(".wbc")
    write_bytes(target, data)
    if json:
        print_json(
            {
                "file": str(file),
                "positions": None if files.positions is None else str(files.positions),
                "image": str(target),
                "commands": len(executable.steps),
                "rows": len(table.rows),
            }
        )
        return
    if files.found:
        typer.echo(str(files))
    typer.echo(f"{target}: {len(executable.steps)} commands, {len(table.rows)} positions")
