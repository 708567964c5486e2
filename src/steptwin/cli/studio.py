"""``steptwin studio``: a world, or devices, in a browser. Exit code 1 if an expectation of the world's scripts did not hold.

From another program: the WebSocket and REST, which docs/studio/rest.md explains.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.optiongroups import grouped
from steptwin.files.worldoptions import WorldRunOptions
from steptwin.live.options import LiveOptions, LogOptions, ReadyFile, UpOptions
from steptwin.live.studio.options import StudioOptions


@grouped
def command(
    world: Annotated[
        Path | None,
        typer.Argument(
            metavar="MACHINE.toml", help="The description of a world, or a recording (.json). Default: a demo machine."
        ),
    ] = None,
    *,
    ready_file: ReadyFile = None,
    page: StudioOptions,
    live: LiveOptions,
    options: WorldRunOptions,
    log: LogOptions,
) -> None:
    """Show a world or devices in a browser, until Ctrl-C.

    The lines of a world are open as with 'steptwin up', for any other program. The page can move axes, so only this computer
    reaches it unless another address is permitted, and a token is asked for, which is in the printed address. The demo
    machine asks for one only where a device is connected.
    """
    try:
        from steptwin.live.studio.start import studio as run_studio
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in ("fastapi", "uvicorn", "websockets", "starlette"):
            raise
        from steptwin.extras import missing

        raise missing("the studio", "studio") from None
    if page.device and (world is None or page.has_no_world):
        for group in (live, options):
            group.refuse("devices without a world" if page.has_no_world else "devices without a world: give a MACHINE.toml too")
    if page.view:
        for group in (live, options):
            group.refuse("a recording that is only viewed")
    if not run_studio(page, UpOptions(world=world, ready_file=ready_file, live=live, run=options, log=log)):
        raise typer.Exit(1)
