"""The command line. Each command lives in a module of its own and imports what it needs when it runs.

Exit codes: 0 done, 1 not done (a check found something, a peer refused, a line failed), 2 wrong use.
"""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from steptwin import __version__
from steptwin.cli import (
    build,
    check,
    commands,
    decompile,
    export,
    fault,
    fmt,
    get,
    info,
    monitor,
    move,
    pace,
    record,
    registers,
    replay,
    run,
    scan,
    send,
    serve,
    sniff,
    terminal,
    twin,
    up,
    watch,
)
from steptwin.errors import Misuse, SteptwinError


class _Commands(TyperGroup):
    """typer checks choices with a validator whose name it puts before the message."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            message = error.message.removeprefix("Value error, ")
            raise typer.BadParameter(message, error.ctx, error.param, error.param_hint) from None


app = typer.Typer(
    name="steptwin",
    cls=_Commands,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(serve.app, name="serve")
app.command()(registers.registers)
app.command()(commands.commands)
app.command()(check.check)
app.command()(fmt.fmt)
app.command()(build.build)
app.command()(decompile.decompile)
app.command()(run.run)
app.command()(up.up)
app.command()(replay.replay)
app.command()(export.export)
app.command()(twin.pin)
app.command()(twin.encoder)
app.command("power-cycle")(twin.power_cycle)
app.command()(twin.state)
app.command()(fault.fault)
app.command()(pace.pause)
app.command()(pace.step)
app.command()(pace.resume)
app.command()(pace.save)
app.command()(info.info)
app.command()(get.get)
app.command("set")(get.set_)
app.command()(watch.watch)
app.command()(move.enable)
app.command()(move.disable)
app.command()(move.home)
app.command()(move.move)
app.command()(move.jog)
app.command()(move.stop)
app.command()(monitor.monitor)
app.command()(scan.ports)
app.command()(scan.scan)
app.command()(send.send)
app.command()(sniff.sniff)
app.command()(terminal.terminal)
app.command()(record.record)
app.command()(record.diff)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _steptwin(
    version: Annotated[bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """The WObit MIC488 and Microcon M1486 motion controllers as software."""


def main() -> None:
    try:
        app()
    except SteptwinError as error:
        print(f"steptwin: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2 if isinstance(error, Misuse) else 1)
