"""``steptwin monitor``: registers, axes and frames of a controller on the terminal.

From Python: `steptwin.drivers.AsyncMic488`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli import completion


def monitor(
    device: Annotated[
        str | None,
        typer.Argument(
            envvar="STEPTWIN_DEVICE",
            metavar="DEVICE",
            help="As --device of the other commands. Default: the only running twin.",
            autocompletion=completion.devices,
        ),
    ] = None,
    hz: Annotated[float, typer.Option(help="Samples per second, up to 10.")] = 5.0,
) -> None:
    """Show the axes, registers and frames of a MIC488, and operate it with the keyboard. Space or Esc stops. ? shows the keys."""
    from steptwin.monitor import monitor as show

    show(device, hz)
