"""``steptwin studio``: a world, or devices, in a browser. Exit code 1 if an expectation of the world's scripts did not hold.

From another program: the WebSocket and REST, which docs/studio.md explains.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.optiongroups import OptionGroup, grouped
from steptwin.cli.worldoptions import LiveOptions, LogOptions, ReadyFile, WorldRunOptions, up_options
from steptwin.cli.writtenfiles import written


@dataclass(frozen=True, kw_only=True)
class PageOptions(OptionGroup):
    """The page and its service."""

    heading = "Options of the page"

    http: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Address of the page. Default: 127.0.0.1:8488, or the next free port."),
    ] = None
    remote: Annotated[
        bool, typer.Option("--remote", help="Permit an --http address that others can reach, without TLS; with tokens.")
    ] = False
    certificate: Annotated[Path | None, typer.Option(metavar="FILE", help="TLS: the certificate (PEM).")] = None
    key: Annotated[Path | None, typer.Option(metavar="FILE", help="TLS: its key (PEM).")] = None
    tokens: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Lines ROLE NAME TOKEN; roles are viewer, operator, engineer. Nobody else may read it. "
            "Default: a file of this user, made by the first studio.",
        ),
    ] = None
    open_to_local_users: Annotated[
        bool,
        typer.Option("--open-to-local-users", help="Ask for no token: every user of this computer is engineer."),
    ] = False
    audit: Annotated[Path | None, written(metavar="FILE", help="Append every command and its user to a file of JSON lines.")] = (
        None
    )
    device: Annotated[
        list[str] | None,
        typer.Option(
            "--device",
            "-d",
            metavar="DEVICE",
            help="A device to show, as for the other commands: /dev/ttyUSB0,unit=2, HOST:PORT, /dev/ttyUSB1,kind=m1486,chip=7. "
            "Repeatable. Without MACHINE.toml there is no world then.",
            autocompletion=completion.devices,
        ),
    ] = None
    view: Annotated[
        bool, typer.Option("--view", help="Show a session as it was: paused at its end, and nothing can be changed.")
    ] = False
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page where there is a desktop.")] = True


@grouped
def command(
    world: Annotated[
        Path | None,
        typer.Argument(metavar="MACHINE.toml", help="The description of a world, or a session (.json). Default: a demo machine."),
    ] = None,
    *,
    ready_file: ReadyFile = None,
    page: PageOptions,
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
        from steptwin.live.studio.options import StudioOptions
        from steptwin.live.studio.start import studio as run_studio
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in ("fastapi", "uvicorn", "websockets", "starlette"):
            raise
        from steptwin.extras import libraries_of, missing

        raise missing("the studio", libraries_of("studio")) from None
    if page.device and world is None:
        for group in (live, options):
            group.refuse("devices without a world: give a MACHINE.toml too")
    if page.view:
        for group in (live, options):
            group.refuse("a session that is only looked at")
    own = StudioOptions(
        http=page.http,
        remote=page.remote,
        certificate=page.certificate,
        key=page.key,
        tokens=page.tokens,
        open_to_local_users=page.open_to_local_users,
        audit=page.audit,
        browser=page.browser,
        devices=tuple(page.device or ()),
        view=page.view,
    )
    if not run_studio(own, up_options(world, ready_file, live, options, log)):
        raise typer.Exit(1)
