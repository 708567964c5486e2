"""``steptwin history``: what has been kept of twins and devices.

From Python: `steptwin.history.HistoryDatabase`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json
from steptwin.cli.writtenfiles import written


def command(
    database: Annotated[str, typer.Argument(metavar="DATABASE", help="FILE.db, sqlite:///FILE.db or postgresql://HOST/NAME.")],
    points: Annotated[
        list[str] | None, typer.Argument(metavar="[POINT]...", help="Such as table.M1.position or 'table.pins.*'.")
    ] = None,
    run: Annotated[int | None, typer.Option(help="Only this run; -1 is the last one.")] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="A date, or a time since the begin of the run: '2026-03-01 14:30', '10 s'."),
    ] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="TIME", help="As --from.")] = None,
    every: Annotated[
        str | None, typer.Option(metavar="TIME", help="Show a value at this interval. Default: every recorded one.")
    ] = None,
    other: Annotated[
        int | None, typer.Option("--with", metavar="RUN", help="Compare with this run. Exit code 1: they differ.")
    ] = None,
    events: Annotated[bool, typer.Option("--events", help="Show events instead of values.")] = False,
    writes: Annotated[
        bool, typer.Option("--writes", help="Show what programs have written and commanded, and who they are.")
    ] = False,
    output: Annotated[
        Path | None, written("--output", "-o", help="Write a file: .csv, .parquet, or a picture, .png or .svg.")
    ] = None,
    json: Json = False,
) -> None:
    """Show, export and compare what a database has kept of twins and devices.

    Without points: runs, and the points that there are. Dates are local time unless they have an offset.
    """
    from steptwin.cli.history_pages import HistoryOptions, show

    options = HistoryOptions(
        points=tuple(points or ()),
        run=run,
        other=other,
        begin=begin,
        end=end,
        every=every,
        output=output,
        events=events,
        writes=writes,
        as_json=json,
    )
    if not show(database, options, typer.echo):
        raise typer.Exit(1)
