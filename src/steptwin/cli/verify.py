"""``steptwin verify``: whether a controller behaves as the assumptions say.

From Python: `steptwin.verify.run.verify`.
"""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Device, complain, find, kind_of
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


def command(
    device: Device = None,
    write: Annotated[bool, typer.Option("--write", help="Permit checks that write settings and put them back.")] = False,
    move: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS=DISTANCE",
            help="Permit checks that move this axis of a MIC488, by at most this distance in its units, and return it.",
        ),
    ] = None,
    json: Annotated[Path | None, written("--json", metavar="FILE", help="Also write the report as JSON.")] = None,
) -> None:
    """Check whether a controller behaves as the numbered assumptions say. By default nothing moves and no setting changes.

    The checks read, send requests that a controller is to refuse, and wrong frames. They take half a minute on a serial line,
    and other masters must leave it alone meanwhile. Wrong data end a program of an M1486; a chip that runs one does not
    respond, and is not checked. Commands of the checks take command memory: they can overwrite what was sent to an M1486
    before, and registers 1 to 8 of a type A or C.

    Exit code 1 when an assumption is refuted. The report can be sent to the project.
    """
    from steptwin import __version__
    from steptwin.files.textfiles import check_writable, write_bytes
    from steptwin.live.interrupts import FirstInterrupt
    from steptwin.verify.check import CheckOutcome
    from steptwin.verify.run import verify as check

    if json is not None:
        check_writable(json)
    address = find(device)
    with FirstInterrupt() as interrupt:
        report = check(
            address,
            datetime.now(UTC).isoformat(timespec="seconds"),
            __version__,
            write=write,
            move=None if move is None else _move(move, kind_of(address).axes),
            progress=_progress,
            is_cancelled=lambda: interrupt.came,
        )
    if json is not None:
        write_bytes(json, report.json_text().encode())
    typer.echo(report.to_text())
    if report.of(CheckOutcome.REFUTED) or not report.is_complete:
        raise typer.Exit(1)


def _move(text: str, axes: int) -> tuple[int, float]:
    from steptwin.drivers.typed import axis_of, number_of

    name, equals, value = text.partition("=")
    if not equals:
        raise Misuse(f"--move {text}: expected AXIS=DISTANCE, such as 1=0.5")
    return axis_of(name, axes), number_of(value, text)


def _progress(id_: str, number: int, count: int) -> None:
    if sys.stderr.isatty():
        complain(f"{number + 1}/{count} {id_}")
