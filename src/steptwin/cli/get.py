"""``steptwin get``, ``set``: values by name.

From Python: `steptwin.drivers.Mic488.get_shown` and `set`; the methods of `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Device, Json, LogFrames, find, kind_of, opened, print_json, values_data, values_table


def names_from(incomplete: str) -> list[str]:
    """Shell completion: names of values with this beginning."""
    from steptwin.drivers.kinds import DRIVERS

    return [name for kind in DRIVERS.values() for name in kind.names() if name.startswith(incomplete.upper())]


def get(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME",
            help="M1_POS_ACT, OUT3, 'M*_ACC', USER_REGISTER[100-109], USER_REGISTER[4]:real; by address 10020, hr:10020:real, "
            "hr:10020-10023:hex, co:6000, di:5000",
            autocompletion=names_from,
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


def set_(
    changes: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME=VALUE", help="M1_ACC=50 OUT3=on DATA_TYPE=REAL USER_REGISTER[4]=7", autocompletion=names_from
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
