"""``steptwin decompile``: the source of a compiled image.

From Python: `steptwin.wbc.decompile.decompile`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.device import Json, print_json
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.wbc.decompile import Decompiled


def command(
    file: Annotated[Path, typer.Argument(help="Compiled image (.wbc).")],
    output: Annotated[Path | None, written("--output", "-o", help="Program to write (.prg); default: print it.")] = None,
    positions: Annotated[Path | None, written(help="Position table to write; default: beside the program, as .csv.")] = None,
    json: Json = False,
) -> None:
    """Turn a compiled image into a program and a position table that build to the same bytes."""
    from steptwin.files.textfiles import write_bytes
    from steptwin.files.writing import is_written_directly
    from steptwin.inputfiles import read_bytes
    from steptwin.wbc.decompile import decompile as decompile_image

    found = decompile_image(read_bytes(file))
    rows = len(found.positions.rows)
    table = positions
    if table is None and output is not None and rows and not is_written_directly(output):
        table = output.with_suffix(".csv")
        if table.exists():
            raise Misuse(f"{table} exists already: name the position table with --positions")
    if output is not None:
        write_bytes(output, found.text.encode("utf-8"))
    if table is not None:
        write_bytes(table, found.positions.text.encode("utf-8"))
    if json:
        print_json(
            {
                "file": str(file),
                "program": None if output is None else str(output),
                "text": found.text,
                "positions": None if table is None else str(table),
                "rows": rows,
                "unknown": found.unknown,
                "inferred": found.inferred,
            }
        )
        return
    if output is None:
        typer.echo(found.text, nl=False)
    else:
        typer.echo(f"{output}: {_summary(found)}")
    if table is None and rows:
        typer.echo(f"{file} has {rows} positions: write them with --positions", err=True)


def _summary(found: Decompiled) -> str:
    if not found.unknown and not found.inferred:
        return "everything known"
    parts = []
    if found.unknown:
        parts.append("1 unknown record" if found.unknown == 1 else f"{found.unknown} unknown records")
    if found.inferred:
        statements = "1 statement" if found.inferred == 1 else f"{found.inferred} statements"
        parts.append(f"{statements} marked as inferred: build takes them with --inferred")
    return ", ".join(parts)
