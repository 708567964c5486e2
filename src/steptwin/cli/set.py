"""``steptwin set``: values by name.

From Python: `steptwin.drivers.Mic488.set`; the methods of `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Device, Json, LogFrames, find, kind_of, opened, print_json, values_data, values_table


def command(
    changes: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME=VALUE", help="M1_ACC=50 OUT3=on DATA_TYPE=REAL USER_REGISTER[4]=7", autocompletion=completion.values
        ),
    ],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Write registers by name, one after the other. A motion register moves at once.

    A register that acts on every write is sent only once. If its response is lost, the message says that the write is
    unconfirmed.
    """
    address = find(device)
    write = kind_of(address).writing(changes)
    with opened(address, log_frames=log_frames) as driver:
        values = write(driver)
    if json:
        print_json(values_data(values))
    elif values:
        typer.echo(values_table(values))
