"""``steptwin bridge``: real devices behind OPC UA, MQTT, metrics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.optiongroups import grouped
from steptwin.live.options import AuditInto, ListenAny, LogOptions, ReadyFile


@grouped
def command(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Devices and gateways: see docs/gateways.md.")],
    *,
    listen_any: ListenAny = False,
    ready_file: ReadyFile = None,
    audit: AuditInto = None,
    log: LogOptions,
) -> None:
    """Serve real devices to programs of a plant, by the gateways of a file, until Ctrl-C.

    It owns the lines of the devices: commands are sent in order, stops first, and nothing is repeated."""
    from steptwin.live.bridge import bridge as serve_devices

    serve_devices(file, listen_any=listen_any, ready_file=ready_file, audit=audit, log=log)
