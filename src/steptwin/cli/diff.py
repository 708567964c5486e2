"""``steptwin diff``: where two transcripts differ.

From Python: `steptwin.drivers.mic488.transcript.differences`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.device import Json, print_json


def command(
    one: Annotated[Path, typer.Argument(help="A transcript, of a twin for example.")],
    two: Annotated[Path, typer.Argument(help="Another of the same requests, of the device.")],
    tolerance: Annotated[float, typer.Option(help="How far numbers may be apart.")] = 0.0,
    time: Annotated[
        float | None, typer.Option(help="How far moments may be apart, in seconds. Default: they do not matter.")
    ] = None,
    json: Json = False,
) -> None:
    """Report where two transcripts of the same requests differ. Exit code 1 if they do."""
    from steptwin.drivers.mic488.transcript import differences, from_text
    from steptwin.inputfiles import read_recorded

    found = differences(
        from_text(read_recorded(one), str(one)), from_text(read_recorded(two), str(two)), tolerance=tolerance, time_s=time
    )
    if json:
        print_json([_data(d.step, d.line, d.what, d.one, d.two) for d in found])
    elif found:
        typer.echo("\n".join(map(str, found)))
    if found:
        raise typer.Exit(1)


def _data(step: int, line: str, what: str, one: Any, two: Any) -> dict[str, Any]:
    return {"step": step, "line": line, "what": what, "one": one, "two": two}
