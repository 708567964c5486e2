"""``steptwin twins``: the running twins of this user.

From Python: `steptwin.live.twins.running_twins`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from steptwin.cli.device import Json, complain, print_json, table

if TYPE_CHECKING:
    from steptwin.live.twins import Twin, TwinController


def command(json: Json = False) -> None:
    """List running twins: names as --device takes them, kinds, and addresses at which other programs reach them."""
    from steptwin.live.twins import START, running_twins

    found = running_twins()
    if json:
        print_json([_data(twin) for twin in found])
    elif found:
        typer.echo(table([_row(each) for twin in found for each in twin.controllers]))
    else:
        complain(f"no twin is running: {START}")


def _row(controller: TwinController) -> tuple[str, ...]:
    return (
        controller.full_name,
        controller.kind,
        controller.selection.replace("=", " "),
        " ".join(controller.places) or "no address",
    )


def _data(twin: Twin) -> dict[str, Any]:
    return {
        "name": twin.name,
        "pid": twin.pid,
        "file": None if twin.file is None else str(twin.file),
        "controllers": [
            {
                "device": each.full_name,
                "kind": each.kind,
                "line": each.line,
                **each.selected,
                "addresses": list(each.places),
            }
            for each in twin.controllers
        ],
    }
