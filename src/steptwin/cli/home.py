"""``steptwin home``: the position of axes from their switches.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Device, Json, LogFrames, find, kind_of
from steptwin.cli.motions import Timeout, Wait, carry_out


def command(
    velocities: Annotated[
        list[str],
        typer.Argument(
            metavar="AXIS=VELOCITY", help="1=-20: towards KL; positive: towards KR. M1486: 1=-B8, direction and line."
        ),
    ],
    device: Device = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Home axes, at the velocities given. Exit code 1 when one does not arrive.

    An M1486 seeks the line at start/stop speed, and its position is 0 there.
    """
    address = find(device)
    carry_out(address, kind_of(address).home(velocities), wait=wait, timeout=timeout, json=json, log_frames=log_frames)
