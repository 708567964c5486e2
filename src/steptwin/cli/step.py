"""``steptwin step``: a world goes on by a time.

From Python: `steptwin.World`, which advances only on request.
"""

from __future__ import annotations

from typing import Annotated, Any

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.optiongroups import grouped
from steptwin.cli.selected import selected
from steptwin.cli.worldtime import print_time
from steptwin.files.worldoptions import ShownOptions


@grouped
def command(
    duration: Annotated[
        str | None, typer.Argument(metavar="TIME", help="How far, such as 10ms. Else to the next thing that happens by itself.")
    ] = None,
    until: Annotated[
        str | None, typer.Option(metavar="CONDITION", help="Until this is true, after TIME (else 1h) at the latest.")
    ] = None,
    twin: Twin = None,
    json: Json = False,
    *,
    shown: ShownOptions,
) -> None:
    """Advance a world by a time, to a condition or to its next event, show what happened, and pause."""
    from steptwin.files.timedinputs import parse_duration
    from steptwin.simulation.world.records import ALL, read_selection
    from steptwin.subject.commands import Advance
    from steptwin.subject.events import read_event
    from steptwin.subject.payloads import STEP_KINDS, named_in

    wanted = Advance(None if duration is None else parse_duration(duration, "step"), until=until)
    selection = ALL
    events: list[dict[str, Any]] = []
    there: dict[str, Any] = {}
    with selected(twin) as chosen:
        if shown.given():
            world = chosen.subject.description
            parts = (*world.controllers, *world.axes, *world.elements, *world.lines)
            names = (*(part.name for part in parts), *world.buttons)
            selection = read_selection(shown.of, shown.show, names, sorted(STEP_KINDS))
        for part in chosen.subject.advance(wanted):
            there = part.value
            if json:
                events += there["events"]
                continue
            for event in there["events"]:
                found = read_event(event)
                if selection.takes(found.kind, (found.controller, *named_in(found.payload))):
                    typer.echo(str(found))
            if there["missed"]:
                typer.echo(f"... and {there['missed']} more", err=True)
    if not json:
        for name, statement in there["statements"].items():
            typer.echo(f"{name}: {statement}")
    if there["idle"]:
        typer.echo("nothing happens any more by itself", err=True)
    if there["stopped"] is None and until is not None and not there["came"]:
        typer.echo(f"warning: {until} did not come true", err=True)
    print_time({**there, "events": events}, json)
