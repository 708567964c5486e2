"""``steptwin get``: values by name.

From Python: `steptwin.drivers.Mic488.get_shown`; the methods of `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Device, Json, LogFrames, find, kind_of, opened, print_json, values_data, values_table


def command(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME",
            help="M1_POS_ACT, OUT3, 'M*_ACC', USER_REGISTER[100-109], USER_REGISTER[4]:real; by address 10020, hr:10020:real, "
            "hr:10020-10023:hex, co:6000, di:5000",
            autocompletion=completion.values,
        ),
    ],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Read registers by name or address. 'steptwin registers mic488' lists them; an M1486 has POSITION, COUNTER, FLAGS…"""
    address = find(device)
    read = kind_of(address).reading(names)
    with opened(address, log_frames=log_frames) as driver:
        values = read(driver)
    if json:
        print_json(values_data(values))
    else:
        typer.echo(values_table(values))
