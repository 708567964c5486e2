"""``steptwin replay``: a recording again. Exit code 1 if something else happens.

From Python: `steptwin.files.recording.load`, then ``replay()``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json
from steptwin.cli.writtenfiles import written


def command(
    file: Annotated[Path, typer.Argument(help="A recording, as 'steptwin run' and 'steptwin up' write them.")],
    trace: Annotated[Path | None, written(help="Write what happened to a file or into a directory.")] = None,
    json: Json = False,
) -> None:
    """Run a recording again and compare what happens."""
    from steptwin.languages.run_world import replay as run_again

    if not run_again(file, trace, typer.echo, lambda text: typer.echo(text, err=True), as_json=json):
        raise typer.Exit(1)
