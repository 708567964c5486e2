"""``steptwin move``: axes, to positions or by distances.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Device, Json, LogFrames, find, kind_of
from steptwin.cli.motions import Timeout, Wait, carry_out


def command(
    targets: Annotated[list[str], typer.Argument(metavar="AXIS=POSITION", help="1=100 2=-12.5, in the configured units.")],
    device: Device = None,
    by: Annotated[bool, typer.Option("--by", help="The numbers are distances.")] = False,
    velocity: Annotated[float | None, typer.Option(help="Set VMAX first.")] = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Move axes; several begin in the same instant. Exit code 1 when one does not arrive.

    An M1486 has axis 1, and its unit is the full step.
    """
    from steptwin.drivers.kind import WantedMoves
    from steptwin.drivers.typed import tied

    address = find(device)
    kind = kind_of(address)
    motion = kind.move(WantedMoves(tied(targets, kind.axes), by, velocity))
    carry_out(address, motion, wait=wait, timeout=timeout, json=json, log_frames=log_frames)
