"""``steptwin send``: a program into a device."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.errors import Refusal


def send(file: Annotated[Path, typer.Argument(help="The program.")]) -> None:
    """Download a program."""
    raise Refusal(
        f"{file} is not sent: how the vendor's tool downloads a program into a MIC488 is documented nowhere. "
        "'steptwin build' makes the vendor's image of it; download that with the vendor's tool, or give it to a twin: "
        "'steptwin serve mic488 --program'"
    )
