"""``steptwin seek``: the level of a line, by a motion.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Device, Json, LogFrames, find, kind_of
from steptwin.cli.motions import Timeout, Wait, carry_out


def command(
    line: Annotated[str, typer.Argument(metavar="1=LINE", help="1=-B8: in negative direction to line B8; 1=+B8: positive.")],
    device: Device = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Move an M1486 at start/stop speed until a line has its end level. Exit code 1 when it does not arrive.

    That is low for B1 to B3, B8 to B11 and B16 to B19, else high. The number of the line is in the internal variable afterwards.
    """
    address = find(device)
    carry_out(address, kind_of(address).seek([line]), wait=wait, timeout=timeout, json=json, log_frames=log_frames)
