"""``steptwin ports``, ``scan``: ports of this computer, and devices that respond on them.

From Python: `steptwin.live.ports`, `steptwin.drivers.mic488.identify.scan`, `steptwin.drivers.m1486.identify.scan_chips`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.device import Json, clear_line, complain, print_json, table
from steptwin.errors import LineFailure, Misuse

if TYPE_CHECKING:
    from steptwin.drivers.kind import AnyDriverKind, DeviceSearch, FoundDevice

ANY = "any"


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
    kind: Annotated[str, typer.Option(help="Kind of controller to find: mic488, m1486; any of them.")] = ANY,
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

    kinds = _kinds(kind)
    numbers = numbers_of(units, "--units", 1, 247)
    bauds = None if baud is None else numbers_of(baud, "--baud", 300, 1_000_000)
    if not 0.0 < timeout <= 10.0:
        raise Misuse(f"--timeout {timeout:g}: permitted are more than 0 and at most 10 s")
    wanted = places or [place.address for place in serial_ports() + twin_ports()]
    rows: list[_Row] = []
    try:
        for place in wanted:
            rows += _found_at(place, kinds, numbers, bauds, timeout)
    except KeyboardInterrupt:
        complain("interrupted: the scan is not complete")
    if json:
        print_json([row.data() for row in rows])
    elif rows:
        typer.echo(table([row.text() for row in rows]))
    if not rows:
        complain(f"no device responded on {', '.join(wanted) or 'any port: there is none'}")
        raise typer.Exit(1)


@dataclass(frozen=True, slots=True)
class _Row:
    """A device at an address; ``baud`` is None on a network."""

    place: str
    baud: int | None
    kind: AnyDriverKind
    found: FoundDevice

    def text(self) -> tuple[str, ...]:
        how = self.kind.selection
        return self.place, f"{self.baud or ''}", f"{how.option} {how.show(self.found.number)}", self.found.what

    def data(self) -> dict[str, Any]:
        how, found = self.kind.selection, self.found
        where = {"address": self.place, "baud": self.baud, "kind": self.kind.name}
        return {**where, how.option: found.number, how.variant: found.variant, "what": found.what}


def _kinds(name: str) -> list[AnyDriverKind]:
    """The kinds to be searched in this order: first those whose search disturbs no others. Raises `Misuse`."""
    from steptwin.drivers.kinds import DRIVERS

    searched = {kind.name: kind for kind in DRIVERS.values() if kind.search is not None}
    if name != ANY and name not in searched:
        raise Misuse(f"--kind {name}: permitted are {ANY}, {', '.join(searched)}")
    wanted = searched.values() if name == ANY else [searched[name]]
    return sorted(wanted, key=lambda kind: kind.search is not None and kind.search.disturbs)


def _found_at(place: str, kinds: list[AnyDriverKind], numbers: list[int], bauds: list[int] | None, timeout: float) -> list[_Row]:
    """The devices that respond at an address, of the first kind that does. An address that cannot be opened is reported and
    gives none."""
    searches = [(kind, kind.search, _rates(place, bauds or list(kind.search.bauds))) for kind in kinds if kind.search]
    rows: list[_Row] = []
    try:
        for kind, search, rates in searches:
            rows = rows or _searched(place, kind, search, rates, numbers, timeout)
    except LineFailure as failure:
        complain(str(failure))
    finally:
        if not rows:
            for kind, search, rates in searches:
                _leave(place, kind, search, rates, kinds)
    return rows


def _searched(
    place: str, kind: AnyDriverKind, search: DeviceSearch, rates: list[int], numbers: list[int], timeout: float
) -> list[_Row]:
    for baud in rates:
        with _progress(f"{_title(place, baud)} {search.title}", search.numbers or len(numbers), search.form) as step:
            found = search.find(place, baud, numbers, timeout, step)
        if found:  # a line has one baud rate
            return [_Row(place, None if "://" in place else baud, kind, one) for one in found]
    return []


def _leave(place: str, kind: AnyDriverKind, search: DeviceSearch, rates: list[int], searched: list[AnyDriverKind]) -> None:
    """Nothing was found: leave the line as it was. The most likely rate is last, because characters at other rates are rubbish
    at it."""
    for baud in reversed(rates):
        search.leave(place, baud)
    if search.disturbs and searched == [kind]:
        for baud in rates:
            clear_line(kind, place, baud)


def _rates(place: str, bauds: list[int]) -> list[int]:
    """The rates to try: all on serial ports, local or RFC 2217; otherwise one, because the rate has no effect."""
    if place.startswith("rfc2217://") or not ("://" in place or str(Path(place).resolve()).startswith("/dev/pts/")):
        return bauds
    return bauds[:1]


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
