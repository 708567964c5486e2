"""``steptwin resume``: a paused world goes on.

From Python: `steptwin.World`, which advances only on request.
"""

from __future__ import annotations

from typing import Annotated

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import ask_twin
from steptwin.cli.worldtime import print_time


def command(
    speed: Annotated[str | None, typer.Option(help="Virtual seconds in a second from now on: 0.1, 1, 10 or 'max'.")] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Continue a paused world, or change its speed."""
    from steptwin.live.pace import read_speed
    from steptwin.subject.commands import Resume

    print_time(ask_twin(twin, Resume(None if speed is None else read_speed(speed))), json)
