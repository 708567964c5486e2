"""``steptwin doctor``: what this computer lacks. From Python: `steptwin.live.doctor`."""

from __future__ import annotations

from dataclasses import asdict

import typer

from steptwin.cli.device import Json, print_json, table


def command(json: Json = False) -> None:
    """Examine this computer: libraries, ports that are taken, serial ports, the page of the studio, a browser.

    Exit code 1 if 'steptwin studio' cannot run.
    """
    from steptwin.live.doctor import examine

    findings = list(examine())
    if json:
        print_json([asdict(each) for each in findings])
    else:
        typer.echo(table([("!" if each.todo else " ", each.what, each.found) for each in findings]))
        for todo in dict.fromkeys(each.todo for each in findings if each.todo):
            typer.echo(f"! {', '.join(each.what for each in findings if each.todo == todo)}: {todo}")
    if any(each.todo and each.is_vital for each in findings):
        raise typer.Exit(1)
