"""``steptwin displays``: displays for Phoebus. From Python: `steptwin.gateways.epics.displays.displays_of`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def displays(
    file: Annotated[Path, typer.Argument(help="World, or devices of steptwin bridge, with [gateway.epics].")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where they are written.")],
) -> None:
    """Write displays for Phoebus (.bob): an overview, and one of each controller, for the records of its EPICS gateway.

    Files of these names are replaced. Devices are asked for their firmware or type; nothing is changed in them.
    """
    from steptwin.commands.displays import write_displays

    for written in write_displays(file, output):
        typer.echo(written)
