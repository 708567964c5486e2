"""``steptwin save``: the recording of a running world.

From Python: `steptwin.files.recording`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import ask_twin
from steptwin.cli.worldtime import print_time


def command(
    file: Annotated[
        Path,
        typer.Argument(help="Where to write the recording, such as now.json; else the last records of the trace."),
    ],
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Save the recording of a running world, to replay it or to continue from it with 'run' and 'up'."""
    from steptwin.files.export import FORMATS
    from steptwin.files.loader import check_recording_target, is_recording

    if file.suffix[1:].lower() not in FORMATS:
        check_recording_target(file)
    from steptwin.subject.commands import Save

    there = ask_twin(twin, Save(str(file.absolute())))
    if not json:
        what = f"{there['inputs']} inputs, digest {there['digest']}" if is_recording(file) else f"{there['records']} records"
        typer.echo(f"wrote {file}: {what}")
    print_time(there, json)
