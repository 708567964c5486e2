"""``steptwin ports``, ``scan``: where a device could be, and where one is.

From Python: `steptwin.runtime.ports`, `steptwin.host.mic488.identify.scan`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.device import Json, complain, print_json, table
from steptwin.errors import LineFailure, Misuse

if TYPE_CHECKING:
    from steptwin.host.mic488.identify import Found

BAUDS = "38400,9600,19200,57600,115200"


def ports(json: Json = False) -> None:
    """List serial ports, and the pseudo terminals of running twins."""
    from steptwin.runtime.ports import serial_ports, twin_ports

    places = serial_ports() + twin_ports()
    if json:
        print_json([{"address": place.address, "what": place.what} for place in places])
    elif places:
        typer.echo(table([(place.address, place.what) for place in places]))
    else:
        complain("no serial port here, and no twin is running")


def scan(
    places: Annotated[
        list[str] | None, typer.Argument(metavar="[ADDRESS]...", help="Ports or addresses. Default: all that 'ports' lists.")
    ] = None,
    units: Annotated[str, typer.Option(help="Slave addresses, such as 1-247 or 1,2,5.")] = "1-16",
    baud: Annotated[str, typer.Option(help="Baud rates to try on serial ports.")] = BAUDS,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for each unit beside the time on the wire.")] = 0.1,
    json: Json = False,
) -> None:
    """Look for MIC488 controllers: on each port, at each baud rate, each unit is asked to read its inputs. Nothing is written.

    Exit code 1 when nobody is found.
    """
    from steptwin.runtime.ports import serial_ports, twin_ports

    numbers, bauds = numbers_of(units, "--units", 1, 247), numbers_of(baud, "--baud", 300, 1_000_000)
    if not 0.0 < timeout <= 10.0:
        raise Misuse(f"--timeout {timeout:g}: permitted are more than 0 and at most 10 s")
    wanted = places or [place.address for place in serial_ports() + twin_ports()]
    rows: list[dict[str, Any]] = []
    try:
        for place in wanted:
            for rate in bauds if "://" not in place or place.startswith("rfc2217") else bauds[:1]:
                found = _scanned(place, rate, numbers, timeout)
                rows += [_row(place, rate, one) for one in found]
                if found:
                    break  # a line has one baud rate
    except KeyboardInterrupt:
        complain("interrupted: not everything was looked at")
    if json:
        print_json(rows)
    elif rows:
        typer.echo(table([(r["address"], f"{r['baud'] or ''}", f"unit {r['unit']}", r["what"]) for r in rows]))
    if not rows:
        complain(f"nobody answers on {', '.join(wanted) or 'any port: there is none'}")
        raise typer.Exit(1)


def _row(place: str, baud: int, found: Found) -> dict[str, Any]:
    what = "answers, but is no MIC488" if found.firmware is None else f"MIC488, firmware {found.firmware}"
    return {
        "address": place,
        "baud": None if "://" in place else baud,
        "unit": found.unit,
        "firmware": found.firmware,
        "what": what,
    }


def _scanned(place: str, baud: int, units: list[int], timeout: float) -> list[Found]:
    from steptwin.host.blocking import finish
    from steptwin.host.mic488.identify import scan as scan_units
    from steptwin.host.mic488.sync import ModbusLine
    from steptwin.machine import SECOND

    title = place if "://" in place else f"{place} {baud}"
    try:
        with ModbusLine(place, baud=baud) as line, _progress(title, len(units)) as step:
            return finish(scan_units(line.line, units, timeout_ns=round(timeout * SECOND), progress=step))
    except LineFailure as failure:
        complain(str(failure))
        return []


@contextlib.contextmanager
def _progress(title: str, total: int) -> Generator[Callable[[int], object]]:
    """A bar on the standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda unit: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(TextColumn("{task.description}"), BarColumn(), console=Console(stderr=True), transient=True)
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda unit: bar.update(task, advance=1, description=f"{title} unit {unit}")


def numbers_of(text: str, option: str, least: int, most: int) -> list[int]:
    """``1-5,9`` as numbers. Raises `Misuse`."""
    numbers: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()):
            raise Misuse(f"{option} {text}: {part.strip()!r} is no number and no range such as 1-16")
        begin, end = int(first), int(last or first)
        if not least <= begin <= end <= most:
            raise Misuse(f"{option} {text}: {part.strip()} is outside {least} to {most}")
        numbers |= dict.fromkeys(range(begin, end + 1))
    return list(numbers)
