"""``steptwin ports``: the ports of this computer.

From Python: `steptwin.live.ports`.
"""

from __future__ import annotations

import typer

from steptwin.cli.device import Json, complain, print_json, table


def command(json: Json = False) -> None:
    """List serial ports, and the pseudo terminals of running twins."""
    from steptwin.live.ports import serial_ports, twin_ports

    places = serial_ports() + twin_ports()
    if json:
        print_json([{"address": place.address, "what": place.what} for place in places])
    elif places:
        typer.echo(table([(place.address, place.what) for place in places]))
    else:
        complain("this computer has no serial port, and no twin is running")
