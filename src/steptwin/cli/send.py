"""``steptwin send``: a program into a device.

From Python: `steptwin.drivers.m1486.M1486.download`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.chip import send as send_to_chip
from steptwin.cli.device import Device, Json, LogFrames, find
from steptwin.errors import Refusal

MIC488_PROGRAMS = (".prg", ".wbc")


def send(
    file: Annotated[Path, typer.Argument(help="The program.")],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Download a program into an M1486. A file in [ ] is started by its ]: the motor may move. An E type is erased before.

    A program that names its chips with X goes into all of them: --device
    names their line: ADDRESS,kind=m1486, or the twin.
    """
    address = None if file.suffix.lower() in MIC488_PROGRAMS else find(device, whole_line=True)
    if address is not None and address.kind == "m1486":
        send_to_chip(address, file, json=json, log_frames=log_frames)
        return
    raise Refusal(
        f"{file} is not sent: how the vendor's tool downloads a program into a MIC488 is documented nowhere. "
        "'steptwin build' makes the vendor's image of it; download that with the vendor's tool, or give it to a twin: "
        "'steptwin serve mic488 --program'. An M1486 takes programs: name it with --device"
    )
