"""``steptwin why``: why something in a recorded session is as it is.

From Python: `steptwin.files.why.why_of_session`, or `steptwin.files.world.World.why`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json


def why(
    file: Annotated[Path, typer.Argument(help="A session, as 'steptwin run' and 'steptwin up' write them.")],
    question: Annotated[
        str,
        typer.Argument(
            help="A signal (table.OUT3), a condition ('table.OUT3 == 0'), or a controller (table): what its program waits for."
        ),
    ],
    at: Annotated[str | None, typer.Option(metavar="TIME", help="The moment, such as 2.5s. Default: the end.")] = None,
    json: Json = False,
) -> None:
    """Show the chain of causes of a value, of a condition or of a wait in a recorded session."""
    from steptwin.commands.why import answer

    answer(file, question, at, typer.echo, as_json=json)
