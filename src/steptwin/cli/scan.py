"""``steptwin scan``: devices that respond on ports of this computer.

From Python: `steptwin.drivers.mic488.identify.scan`, `steptwin.drivers.m1486.identify.scan_chips`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator
from typing import Annotated

import typer

from steptwin.cli.device import Json, complain, print_json, table
from steptwin.errors import Misuse


def command(
    places: Annotated[
        list[str] | None, typer.Argument(metavar="ADDRESS", help="Ports or addresses. Default: all that 'ports' lists.")
    ] = None,
    kind: Annotated[str, typer.Option(help="Kind of controller to find: mic488, m1486; any of them.")] = "any",
    units: Annotated[str, typer.Option(help="Slave addresses of MIC488, such as 1-247 or 1,2,5.")] = "1-16",
    baud: Annotated[
        str | None, typer.Option(help="Baud rates to try on serial ports. Default: all rates of each kind of controller.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for each response, in addition to the time on the wire.")] = 0.1,
    json: Json = False,
) -> None:
    """Find controllers on serial ports and network addresses. Nothing moves, and no setting is changed.

    The scan first asks each M1486 chip for its type. Where no chip responds, it reads the inputs of MIC488 controllers: each
    unit, at each baud rate. A chip that moves or runs a program does not respond, and Modbus bytes would end its program; the
    scan deselects it first where it can. --kind m1486 never disturbs a chip.

    Exit code 1 when no device responds.
    """
    from steptwin.live.ports import serial_ports, twin_ports
    from steptwin.live.scanning import FoundAt, found_at, kinds_named, numbers_of

    kinds = kinds_named(kind, "--kind")
    numbers = numbers_of(units, "--units", 1, 247)
    bauds = None if baud is None else numbers_of(baud, "--baud", 300, 1_000_000)
    if not 0.0 < timeout <= 10.0:
        raise Misuse(f"--timeout {timeout:g}: permitted are more than 0 and at most 10 s")
    wanted = places or [place.address for place in serial_ports() + twin_ports()]
    rows: list[FoundAt] = []
    try:
        for place in wanted:
            rows += found_at(place, kinds, numbers, bauds, timeout, progress=_progress, report=complain)
    except KeyboardInterrupt:
        complain("interrupted: the scan is not complete")
    if json:
        print_json([row.data() for row in rows])
    elif rows:
        typer.echo(table([row.text() for row in rows]))
    if not rows:
        complain(f"no device responded on {', '.join(wanted) or 'any port: there is none'}")
        raise typer.Exit(1)


@contextlib.contextmanager
def _progress(title: str, total: int, form: str) -> Generator[Callable[[int], object]]:
    """A progress bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda number: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(TextColumn("{task.description}"), BarColumn(), console=Console(stderr=True), transient=True)
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda number: bar.update(task, advance=1, description=f"{title} {number:{form}}")
