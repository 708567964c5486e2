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
    """Download a program into an M1486. A program in [ ] starts at its ]: the motor may move. E types are erased first.

    A program that selects chips with X is sent to all of them; --device then names their line: ADDRESS,kind=m1486, or the twin.
    """
    address = None if file.suffix.lower() in MIC488_PROGRAMS else find(device, whole_line=True)
    if address is not None and address.kind == "m1486":
        send_to_chip(address, file, json=json, log_frames=log_frames)
        return
    raise Refusal(
        f"{file} was not sent: the download protocol of the MIC488 is not documented. Compile it with 'steptwin build' and "
        "download the image with the vendor's tool, or run it in a twin with 'steptwin serve mic488 --program'. To send to an "
        "M1486, name it with --device"
    )
