"""``steptwin encoder``: the encoder shafts of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

import re
from typing import Annotated

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import print_data, selected
from steptwin.errors import Misuse


def command(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="M1+40 or M1-40 turns the shaft by counts; M1=drive, M1=free, M1=blocked selects what turns it."),
    ] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Turn, couple or block the encoder shafts of a running twin, or show them."""
    wanted: dict[int, int | str] = {}
    for change in changes or []:
        match = re.fullmatch(r"(?ai)M([1-9]\d{0,8})(?:([+-]\d{1,18})|=(\w+))", change.strip())
        if match is None:
            raise Misuse(f"{change!r}: expected M1+40, M1-40, M1=drive, M1=free or M1=blocked")
        wanted[int(match[1])] = int(match[2]) if match[2] else match[3].lower()
    from steptwin.simulation.script.steps import Couple, Turn
    from steptwin.subject.commands import Encoders

    with selected(twin) as there:
        controller = there.one()
        for axis, change in wanted.items():
            there.do(Turn(controller, axis, change) if isinstance(change, int) else Couple(controller, axis, change))
        shafts = there.do(Encoders(controller))
    if json:
        print_data(shafts)
    else:
        typer.echo("\n".join(f"M{s['axis']}  {s['counts']:>10} counts, turned by: {s['turned_by']}" for s in shafts))
