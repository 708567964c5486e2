"""``steptwin up``: a world in real time. Exit code 1 if an expectation of its scripts did not hold.

From Python: `steptwin.runtime.world.World`, which runs in virtual time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def up(
    world: Annotated[Path, typer.Argument(metavar="MACHINE.toml", help="The description of the world.")],
    speed: Annotated[
        str, typer.Option(help="Virtual seconds in a second: 0.1, 1, 10; 'max' for worlds without clients outside.")
    ] = "1",
    name: Annotated[
        str | None, typer.Option(help="Name under which 'steptwin pin' and its like find it. Default: that of the file.")
    ] = None,
    session: Annotated[Path | None, typer.Option(help="Write a session for 'steptwin replay' when it ends.")] = None,
    trace: Annotated[Path | None, typer.Option(help="Write what happened to a file or into a directory when it ends.")] = None,
    ready_file: Annotated[Path | None, typer.Option(help="JSON file with the end points, written once they listen.")] = None,
    listen_any: Annotated[bool, typer.Option("--listen-any", help="Permit addresses that others can reach.")] = False,
) -> None:
    """Run a world until Ctrl-C, with its lines open to other programs."""
    from steptwin.runtime.up_world import UpOptions
    from steptwin.runtime.up_world import up as run_up

    options = UpOptions(
        world=world,
        speed=speed,
        name=name,
        session=session,
        trace=trace,
        ready_file=ready_file,
        listen_any=listen_any,
    )
    if not run_up(options):
        raise typer.Exit(1)
