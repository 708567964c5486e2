"""``steptwin sniff``: the traffic between a master and a device, decoded, until Ctrl-C.

From Python: `steptwin.live.sniff.sniff`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import complain
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.drivers.kind import Decoding
    from steptwin.wire.frameline import FrameLine


def command(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="The line, or the device to pass everything on to.")],
    listen: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Relay: programs connect here instead of to the device.")
    ] = None,
    pty: Annotated[Path | None, typer.Option(help="Stand in the line: programs open the pseudo terminal PATH instead.")] = None,
    language: Annotated[str, typer.Option(help="Protocol on the line: modbus or m1486.")] = "modbus",
    baud: Annotated[int, typer.Option(help="Baud rate of a serial port.")] = 38400,
    firmware: Annotated[
        str | None, typer.Option(help="Register map of the MIC488. Default: 1.70.", autocompletion=completion.firmwares)
    ] = None,
    variant: Annotated[str | None, typer.Option(help="Type of M1486. Default: A.", autocompletion=completion.variants)] = None,
    json: Annotated[bool, typer.Option("--json", help="Print a line of JSON for each frame.")] = False,
) -> None:
    """Log the traffic between a master and a device in words.

    Without --listen and --pty it only listens: on RS-485 it receives both. With one of them it stands between a program and the
    device and passes everything on, so it works on RS-232, on Modbus TCP and for the M1486 too.
    """
    import asyncio

    from steptwin.drivers.lineaddress import parse_line_address
    from steptwin.live.sniff import sniff as run
    from steptwin.simulation.toml.addresses import parse_address

    decoding = _decoding(language, {"firmware": firmware, "variant": variant})
    place = parse_line_address(address, baud)
    if not decoding.framed_tcp:
        place = replace(place, framed=False)
    where = None if listen is None else parse_address(listen, listen_any=False)
    show = _print_json if json else _print
    decoder = decoding.make(show, variant or firmware, place.framed)

    async def main() -> None:
        await run(place, decoder, listen=where, pty=pty, ready=complain)

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main())


def _decoding(protocol: str, variants: Mapping[str, str | None]) -> Decoding:
    """Decoding of a protocol. Raises `Misuse` also for a variant of another kind of controller."""
    from steptwin.drivers.kinds import DRIVERS

    known = {kind.decoding.protocol: (kind, kind.decoding) for kind in DRIVERS.values() if kind.decoding is not None}
    if protocol not in known:
        raise Misuse(f"--language {protocol}: permitted are {', '.join(known)}")
    kind, decoding = known[protocol]
    for option, value in variants.items():
        if value is not None and option != kind.selection.variant:
            raise Misuse(f"--{option} is not for {kind.title}")
    return decoding


def _print(frame: FrameLine) -> None:
    from steptwin.controller import SECOND
    from steptwin.live.sniff import ARROWS

    arrow = ARROWS[frame.direction] if frame.raw else "?"
    raw = f"{frame.raw.hex(' ')}  " if frame.raw else ""
    typer.echo(f"{frame.time / SECOND:12.6f} s  {arrow} {raw}{frame.meaning}")


def _print_json(frame: FrameLine) -> None:
    import json

    from steptwin.controller import SECOND

    data = {
        "time_s": frame.time / SECOND,
        "direction": frame.direction.value,
        "bytes": frame.raw.hex(" "),
        "meaning": frame.meaning,
    }
    typer.echo(json.dumps(data, ensure_ascii=False))
