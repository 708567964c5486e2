"""``steptwin fmt``: WBC programs in one style.

From Python: `steptwin.wbc.printer.format_text`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json, print_json


def command(
    files: Annotated[list[Path], typer.Argument(help="WBC programs (.prg).")],
    check: Annotated[bool, typer.Option("--check", help="Change nothing; exit code 1 if a file is not in the style.")] = False,
    json: Json = False,
) -> None:
    """Write WBC programs in one style: blanks, indentation, keywords in capitals. Lines with errors stay as they are."""
    from steptwin.files.textfiles import read_text, write_bytes
    from steptwin.languages import language_for
    from steptwin.languages.contract import FileLanguage

    changed: list[str] = []
    for path in files:
        language = language_for(path, "format", FileLanguage.format)
        file = read_text(path)
        text = language.format(file.source.text)
        if text == file.source.text:
            continue
        changed.append(str(path))
        if not check:
            write_bytes(path, file.to_bytes(text))
        if not json:
            typer.echo(f"{path}: {'not in the style' if check else 'formatted'}")
    if json:
        print_json({"files": [str(path) for path in files], "not_in_the_style" if check else "formatted": changed})
    if check and changed:
        raise typer.Exit(1)
