"""``steptwin ports``, ``scan``: ports of this computer, and devices that respond on them.

From Python: `steptwin.live.ports`, `steptwin.drivers.mic488.identify.scan`, `steptwin.drivers.m1486.identify.scan_chips`.
"""

from __future__ import annotations

import contextlib
import enum
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.device import Json, complain, drop_rubbish, print_json, search_line, table
from steptwin.errors import LineFailure, Misuse

BAUDS = (38400, 9600, 19200, 57600, 115200)
"""Baud rates at which MIC488 controllers are searched, bit/s."""


class ScannedKind(enum.StrEnum):
    ANY = "any"
    MIC488 = "mic488"
    M1486 = "m1486"


def ports(json: Json = False) -> None:
    """List serial ports, and the pseudo terminals of running twins."""
    from steptwin.live.ports import serial_ports, twin_ports

    places = serial_ports() + twin_ports()
    if json:
        print_json([{"address": place.address, "what": place.what} for place in places])
    elif places:
        typer.echo(table([(place.address, place.what) for place in places]))
    else:
        complain("this computer has no serial port, and no twin is running")


def scan(
    places: Annotated[
        list[str] | None, typer.Argument(metavar="ADDRESS", help="Ports or addresses. Default: all that 'ports' lists.")
    ] = None,
    kind: Annotated[ScannedKind, typer.Option(help="Kind of controller to find.")] = ScannedKind.ANY,
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

    numbers = numbers_of(units, "--units", 1, 247)
    bauds = None if baud is None else numbers_of(baud, "--baud", 300, 1_000_000)
    if not 0.0 < timeout <= 10.0:
        raise Misuse(f"--timeout {timeout:g}: permitted are more than 0 and at most 10 s")
    wanted = places or [place.address for place in serial_ports() + twin_ports()]
    rows: list[dict[str, Any]] = []
    try:
        for place in wanted:
            rows += _found_at(place, kind, numbers, bauds, timeout)
    except KeyboardInterrupt:
        complain("interrupted: the scan is not complete")
    if json:
        print_json(rows)
    elif rows:
        typer.echo(table([(r["address"], f"{r['baud'] or ''}", _which(r), r["what"]) for r in rows]))
    if not rows:
        complain(f"no device responded on {', '.join(wanted) or 'any port: there is none'}")
        raise typer.Exit(1)


def _which(row: dict[str, Any]) -> str:
    return f"unit {row['unit']}" if row["kind"] == ScannedKind.MIC488 else f"chip {row['chip']:X}"


def _found_at(place: str, kind: ScannedKind, units: list[int], bauds: list[int] | None, timeout: float) -> list[dict[str, Any]]:
    """All devices that respond at an address. An address that cannot be opened is reported and gives none."""
    from steptwin.drivers.m1486.identify import CHIP_BAUDS

    rows: list[dict[str, Any]] = []
    try:
        if kind is not ScannedKind.MIC488:
            chip_bauds = _rates(place, bauds or list(CHIP_BAUDS))
            try:
                rows = _chips(place, chip_bauds, timeout)
                if not rows and kind is ScannedKind.ANY:
                    rows = _controllers(place, _rates(place, bauds or list(BAUDS)), units, timeout)
            finally:
                if not rows:
                    _let_chips_listen(place, chip_bauds)
        else:
            rates = _rates(place, bauds or list(BAUDS))
            rows = _controllers(place, rates, units, timeout)
            if not rows:
                for rate in rates:
                    drop_rubbish(place, rate)
    except LineFailure as failure:
        complain(str(failure))
    return rows


def _rates(place: str, bauds: list[int]) -> list[int]:
    """The rates to try: all on serial ports, local or RFC 2217; otherwise one, because the rate has no effect."""
    if place.startswith("rfc2217://") or not ("://" in place or str(Path(place).resolve()).startswith("/dev/pts/")):
        return bauds
    return bauds[:1]


def _row(place: str, baud: int, kind: ScannedKind, what: str, **more: object) -> dict[str, Any]:
    return {"address": place, "baud": None if "://" in place else baud, "kind": kind.value, **more, "what": what}


def _chips(place: str, bauds: list[int], timeout: float) -> list[dict[str, Any]]:
    from steptwin.drivers import LineLost
    from steptwin.drivers.blocking import finish
    from steptwin.drivers.m1486.identify import scan_chips
    from steptwin.machine import SECOND

    for baud in bauds:
        with search_line(place, baud) as line, _progress(f"{_title(place, baud)} M1486 chip", 16, "X") as step:
            try:
                found = finish(scan_chips(line, baud=baud, timeout_ns=round(timeout * SECOND), progress=step))
            except LineLost:
                if "://" not in place:
                    raise
                return []  # a server of Modbus TCP closes the connection when it receives characters
        if found:
            return [
                _row(
                    place,
                    baud,
                    ScannedKind.M1486,
                    "M1486, busy" if chip.variant is None else f"M1486{chip.variant}",
                    chip=chip.address,
                    variant=chip.variant,
                )
                for chip in found
            ]
    return []


def _let_chips_listen(place: str, bauds: list[int]) -> None:
    """Select all chips again at each rate; the most likely rate is last, because characters at other rates are rubbish at it."""
    from steptwin.drivers.blocking import finish
    from steptwin.drivers.m1486.identify import select_all

    for baud in reversed(bauds):
        with contextlib.suppress(LineFailure), search_line(place, baud) as line:
            finish(select_all(line))


def _controllers(place: str, bauds: list[int], units: list[int], timeout: float) -> list[dict[str, Any]]:
    from steptwin.drivers.blocking import finish
    from steptwin.drivers.mic488.identify import scan as scan_units
    from steptwin.drivers.mic488.sync import ModbusLine
    from steptwin.machine import SECOND

    for baud in bauds:
        with ModbusLine(place, baud=baud) as line, _progress(f"{_title(place, baud)} unit", len(units), "d") as step:
            found = finish(scan_units(line.line, units, timeout_ns=round(timeout * SECOND), progress=step))
        if found:  # a line has one baud rate
            return [
                _row(
                    place,
                    baud,
                    ScannedKind.MIC488,
                    "responds, but is not a MIC488" if one.firmware is None else f"MIC488, firmware {one.firmware}",
                    unit=one.unit,
                    firmware=one.firmware,
                )
                for one in found
            ]
    return []


def _title(place: str, baud: int) -> str:
    return place if "://" in place else f"{place} {baud}"


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


def numbers_of(text: str, option: str, least: int, most: int) -> list[int]:
    """``1-5,9`` as numbers. Raises `Misuse`."""
    numbers: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()):
            raise Misuse(f"{option} {text}: {part.strip()!r} is neither a number nor a range such as 1-16")
        begin, end = int(first), int(last or first)
        if not least <= begin <= end <= most:
            raise Misuse(f"{option} {text}: {part.strip()} is outside {least} to {most}")
        numbers |= dict.fromkeys(range(begin, end + 1))
    return list(numbers)
