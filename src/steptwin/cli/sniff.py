"""``steptwin sniff``: the traffic between a master and a device, decoded, until Ctrl-C.

From Python: `steptwin.commands.sniff.sniff`.
"""

from __future__ import annotations

import contextlib
import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import complain

if TYPE_CHECKING:
    from steptwin.wire.frameline import FrameLine


class SniffedLanguage(enum.StrEnum):
    MODBUS = "modbus"
    M1486 = "m1486"


def sniff(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="The line, or the device to pass everything on to.")],
    listen: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Relay: programs connect here instead of to the device.")
    ] = None,
    pty: Annotated[Path | None, typer.Option(help="Stand in the line: programs open the pseudo terminal PATH instead.")] = None,
    language: Annotated[SniffedLanguage, typer.Option(help="Protocol on the line.")] = SniffedLanguage.MODBUS,
    baud: Annotated[int, typer.Option(help="Baud rate of a serial port.")] = 38400,
    firmware: Annotated[str, typer.Option(help="Register map of the MIC488.", autocompletion=completion.firmwares)] = "1.70",
    variant: Annotated[str, typer.Option(help="Type of the M1486.", autocompletion=completion.variants)] = "A",
    json: Annotated[bool, typer.Option("--json", help="Print a line of JSON for each frame.")] = False,
) -> None:
    """Log the traffic between a master and a device in words.

    Without --listen and --pty it only listens: on RS-485 it receives both. With one of them it stands between a program and the
    device and passes everything on, so it works on RS-232, on Modbus TCP and for the M1486 too.
    """
    import asyncio

    from steptwin.commands.sniff import Decoder, M1486Decoder, ModbusDecoder
    from steptwin.commands.sniff import sniff as run
    from steptwin.drivers.place import parse_line_address
    from steptwin.world.addresses import parse_address

    place = parse_line_address(address, baud)
    where = None if listen is None else parse_address(listen, listen_any=False)
    show = _print_json if json else _print
    decoder: Decoder
    if language is SniffedLanguage.M1486:
        decoder = M1486Decoder(show, variant)
    else:
        decoder = ModbusDecoder(show, firmware, tcp=place.framed)

    async def main() -> None:
        await run(place, decoder, listen=where, pty=pty, ready=complain)

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main())


def _print(frame: FrameLine) -> None:
    from steptwin.commands.sniff import ARROWS
    from steptwin.machine import SECOND

    arrow = ARROWS[frame.direction] if frame.raw else "?"
    raw = f"{frame.raw.hex(' ')}  " if frame.raw else ""
    typer.echo(f"{frame.time / SECOND:12.6f} s  {arrow} {raw}{frame.meaning}")


def _print_json(frame: FrameLine) -> None:
    import json

    from steptwin.machine import SECOND

    data = {
        "time_s": frame.time / SECOND,
        "direction": frame.direction.value,
        "bytes": frame.raw.hex(" "),
        "meaning": frame.meaning,
    }
    typer.echo(json.dumps(data, ensure_ascii=False))
