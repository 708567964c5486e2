"""``steptwin info``: a controller at a glance.

From Python: `steptwin.drivers.Mic488.status`, `steptwin.drivers.m1486.M1486.status`.
"""

from __future__ import annotations

import typer

from steptwin.cli.device import Device, Json, LogFrames, find, format_value, kind_of, opened, print_json, table


def command(device: Device = None, json: Json = False, log_frames: LogFrames = False) -> None:
    """Show what a controller is and what it is doing."""
    address = find(device)
    with opened(address, log_frames=log_frames) as driver:
        found = kind_of(address).info(driver, address)
    if json:
        print_json(found.data)
        return
    rows = table([[format_value(cell) for cell in row] for row in found.rows])
    typer.echo("\n".join([*found.head, *([rows] if rows else []), *found.tail]))
