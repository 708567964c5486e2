"""``steptwin pause``, ``step``, ``resume``, ``save``: the time of a running world.

From Python: `steptwin.World`, which advances only on request, and `steptwin.files.session`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.selected import ask_twin
from steptwin.cli.twin import Json, Twin
from steptwin.cli.worldoptions import Of, Show


def pause(twin: Twin = None, json: Json = False) -> None:
    """Pause a running world."""
    from steptwin.subject.commands import Pause

    _print(ask_twin(twin, Pause()), json)


def resume(
    speed: Annotated[str | None, typer.Option(help="Virtual seconds in a second from now on: 0.1, 1, 10 or 'max'.")] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Continue a paused world, or change its speed."""
    from steptwin.live.pace import read_speed
    from steptwin.subject.commands import Resume

    _print(ask_twin(twin, Resume(None if speed is None else read_speed(speed))), json)


def step(
    duration: Annotated[
        str | None, typer.Argument(metavar="TIME", help="How far, such as 10ms. Else to the next thing that happens by itself.")
    ] = None,
    until: Annotated[
        str | None, typer.Option(metavar="CONDITION", help="Until this is true, after TIME (else 1h) at the latest.")
    ] = None,
    of: Of = None,
    show: Show = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Advance a world by a time, to a condition or to its next event, show what happened, and pause."""
    from steptwin.files.timedinputs import parse_duration
    from steptwin.subject.commands import Advance, Describe
    from steptwin.subject.contract import read_description
    from steptwin.subject.events import read_event
    from steptwin.subject.payloads import STEP_KINDS, named_in
    from steptwin.world.records import ALL, read_selection

    selection = ALL
    if of or show:
        world = read_description(ask_twin(twin, Describe()))
        parts = (*world.machines, *world.axes, *world.elements, *world.lines)
        selection = read_selection(of or (), show or (), (*(part.name for part in parts), *world.buttons), sorted(STEP_KINDS))
    wanted = Advance(None if duration is None else parse_duration(duration, "step"), until=until)
    events: list[dict[str, Any]] = []
    while True:
        there = ask_twin(twin, wanted)
        if json:
            events += there["events"]
        else:
            for event in there["events"]:
                found = read_event(event)
                if selection.takes(found.kind, (found.machine, *named_in(found.payload))):
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
    _print({**there, "events": events}, json)


def save(
    file: Annotated[
        Path,
        typer.Argument(help="Where to write the session, such as now.json; else the last records of the trace."),
    ],
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Save the session of a running world, to replay it or to continue from it with 'run' and 'up'."""
    from steptwin.files.beginning import check_session_target, is_session
    from steptwin.files.export import FORMATS

    if file.suffix[1:].lower() not in FORMATS:
        check_session_target(file)
    from steptwin.subject.commands import Save

    there = ask_twin(twin, Save(str(file.absolute())))
    if not json:
        what = f"{there['inputs']} inputs, digest {there['digest']}" if is_session(file) else f"{there['records']} records"
        typer.echo(f"wrote {file}: {what}")
    _print(there, json)


def _print(there: dict[str, Any], json: bool) -> None:
    if json:
        import json as json_

        typer.echo(json_.dumps(there, indent=2))
        return
    how, speed = ("paused", "") if there["paused"] else ("running", _how_fast(there["speed"]))
    if there.get("stopped") is not None:
        how, speed = "ended", f" by: {there['stopped']}"
    typer.echo(f"{there['world']} {how} at {there['time_s']:.9f} s{speed}")


def _how_fast(speed: float | str) -> str:
    if speed == "max":
        return ", as fast as possible"
    return "" if speed == 1 else f", {speed:g} virtual seconds a second"
