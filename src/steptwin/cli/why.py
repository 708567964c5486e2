"""``steptwin why``: why something in a running twin or in a recorded session is as it is.

From Python: `steptwin.files.why.why_of_session`, or `steptwin.files.world.World.why`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json


def command(
    where: Annotated[
        str,
        typer.Argument(
            metavar="TWIN|SESSION",
            help="A running twin: its name, file (.toml) or address; or a session (.json) of 'steptwin run' or 'up'.",
            autocompletion=completion.devices,
        ),
    ],
    question: Annotated[
        str,
        typer.Argument(
            help="A signal (table.OUT3), a condition ('table.OUT3 == 0'), or a controller (table): what its program waits for. "
            "Default: the controller, where there is only one with a program.",
        ),
    ] = "",
    at: Annotated[str | None, typer.Option(metavar="TIME", help="The moment, such as 2.5s. Default: now, or the end.")] = None,
    json: Json = False,
) -> None:
    """Show the chain of causes of a value, of a condition or of a wait.

    A running twin answers if its past is kept: in the studio, or with 'steptwin up --past'.
    """
    from steptwin.cli.why_pages import answer

    answer(where, question, at, typer.echo, as_json=json)
