"""``steptwin stop``: the end of motions, at once.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Axes, Device, LogFrames, axes_of, complain, find, kind_of, log_of, other_kinds_named


def command(
    axes: Axes = None,
    device: Device = None,
    program: Annotated[
        bool, typer.Option("--program", help="End the program too, which switches drives and outputs of a MIC488 off.")
    ] = False,
    log_frames: LogFrames = False,
) -> None:
    """Stop axes at once, without ramp; an M1486 with its ramp, and its program. The program of a MIC488 may move them again: see
    --program."""
    address = find(device)
    kind = kind_of(address)
    with other_kinds_named(kind, address):
        warning = kind.stop(address, log_of(log_frames), axes_of(axes, kind), program)
    if warning is not None:
        complain(warning)
