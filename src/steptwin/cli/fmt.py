"""``steptwin fmt``: WBC programs in one style.

From Python: `steptwin.wbc.printer.format_text`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.errors import Misuse

SUFFIX = ".prg"


def fmt(
    files: Annotated[list[Path], typer.Argument(help="WBC programs (.prg).")],
    check: Annotated[bool, typer.Option("--check", help="Change nothing; exit code 1 if a file is not in the style.")] = False,
) -> None:
    """Write WBC programs in one style: blanks, indentation, keywords in capitals. Lines with errors stay as they are."""
    from steptwin.files.textfiles import read_text, write_bytes
    from steptwin.wbc.printer import format_text

    changed = 0
    for path in files:
        if path.suffix.lower() != SUFFIX:
            raise Misuse(f"cannot format {path}: permitted are WBC programs ({SUFFIX})")
        file = read_text(path)
        text = format_text(file.source.text)
        if text == file.source.text:
            continue
        changed += 1
        if check:
            typer.echo(f"{path}: not in the style")
        else:
            write_bytes(path, file.to_bytes(text))
            typer.echo(f"{path}: formatted")
    if check and changed:
        raise typer.Exit(1)
