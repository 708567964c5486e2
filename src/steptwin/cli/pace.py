"""``steptwin pause``, ``step``, ``resume``, ``save``: the time of a running world.

From Python: `steptwin.World`, which advances only when told to, and `steptwin.files.session`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.twin import Json, Twin


def pause(twin: Twin = None, json: Json = False) -> None:
    """Pause a running world."""
    _tell(_ask(twin, {"do": "pause"}), json)


def resume(
    speed: Annotated[str | None, typer.Option(help="Virtual seconds in a second from now on: 0.1, 1, 10 or 'max'.")] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Continue a paused world, or change its speed."""
    _tell(_ask(twin, {"do": "resume", "speed": speed}), json)


def step(
    duration: Annotated[
        str | None, typer.Argument(metavar="[TIME]", help="How far, such as 10ms. Else to the next thing that happens by itself.")
    ] = None,
    until: Annotated[
        str | None, typer.Option(metavar="CONDITION", help="Until this is true, after TIME (else 1h) at the latest.")
    ] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Advance a world by a time, to a condition or to its next event, show what happened, and pause."""
    from steptwin.files.timedinputs import parse_duration

    request: dict[str, object] = {"do": "step", "until": until}
    if duration is not None:
        request["for_ns"] = parse_duration(duration, "step")
    happened: list[str] = []
    while True:
        there = _ask(twin, request)
        if json:
            happened += there["happened"]
        else:
            for line in there["happened"]:
                typer.echo(line)
        if "to_ns" not in there:
            break
        request = {"do": "step", "until": until, "to_ns": there["to_ns"]}
    if there["idle"]:
        typer.echo("nothing happens any more by itself", err=True)
    if there["stopped"] is None and until is not None and not there["came"]:
        typer.echo(f"warning: {until} did not come true", err=True)
    _tell({**there, "happened": happened}, json)


def save(
    file: Annotated[Path, typer.Argument(help="Where to write the session, such as now.json.")],
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Save the session of a running world, to replay it or to continue from it with 'run' and 'up'."""
    from steptwin.files.beginning import check_session_target

    check_session_target(file)
    there = _ask(twin, {"do": "save", "file": str(file.absolute())})
    if not json:
        typer.echo(f"wrote {file}: {there['inputs']} inputs, digest {there['digest']}")
    _tell(there, json)


def _ask(twin: str | None, request: dict[str, object]) -> Any:
    from steptwin.live.control import ask

    return ask(twin, request)


def _tell(there: dict[str, Any], json: bool) -> None:
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
