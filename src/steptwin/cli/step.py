"""``steptwin step``: a world goes on by a time.

From Python: `steptwin.World`, which advances only on request.
"""

from __future__ import annotations

from typing import Annotated, Any

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.optiongroups import grouped
from steptwin.cli.selected import ask_twin
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
    from steptwin.subject.commands import Advance, Describe
    from steptwin.subject.contract import read_description
    from steptwin.subject.events import read_event
    from steptwin.subject.payloads import STEP_KINDS, named_in

    selection = ALL
    if shown.given():
        world = read_description(ask_twin(twin, Describe()))
        parts = (*world.controllers, *world.axes, *world.elements, *world.lines)
        selection = read_selection(shown.of, shown.show, (*(part.name for part in parts), *world.buttons), sorted(STEP_KINDS))
    wanted = Advance(None if duration is None else parse_duration(duration, "step"), until=until)
    events: list[dict[str, Any]] = []
    while True:
        there = ask_twin(twin, wanted)
        if json:
            events += there["events"]
        else:
            for event in there["events"]:
                found = read_event(event)
                if selection.takes(found.kind, (found.controller, *named_in(found.payload))):
                    typer.echo(str(found))
            if there["missed"]:
                typer.echo(f"... and {there['missed']} more", err=True)
        if "to_ns" not in there:
            break
        wanted = Advance(to=int(there["to_ns"]), until=until)
    if not json:
        for name, statement in there["statements"].items():
            typer.echo(f"{name}: {statement}")
    if there["idle"]:
        typer.echo("nothing happens any more by itself", err=True)
    if there["stopped"] is None and until is not None and not there["came"]:
        typer.echo(f"warning: {until} did not come true", err=True)
    print_time({**there, "events": events}, json)
