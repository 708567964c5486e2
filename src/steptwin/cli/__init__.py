"""The command line. Each command lives in a module of its own and imports what it needs when it runs.

Exit codes: 0 done, 1 not done (a check found something, a peer refused, a line failed), 2 wrong use.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Annotated, Any

import typer
from typer.core import TyperGroup, TyperOption

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

GROUPS = {
    "Twins": ("serve", "up", "state", "pin", "encoder", "power-cycle", "fault", "pause", "step", "resume", "save"),
    "Programs and runs": ("check", "fmt", "build", "decompile", "run", "replay", "export"),
    "Devices and twins": (
        "ports", "scan", "info", "get", "set", "watch", "enable", "disable", "home", "move", "jog", "stop", "send", "terminal",
        "monitor", "sniff", "record", "diff",
    ),
    "Reference": ("registers", "commands"),
}  # fmt: skip
"""The commands as ``--help`` lists them."""
LONGEST_SUMMARY = 200

VALUE_NAMES = {"str": "TEXT", "list[str]": "TEXT", "int": "N", "float": "NUMBER", "path": "PATH", "list[path]": "PATH"}
"""What help shows as the value of an option, where typer would show a Python type."""


def _constant(text: str, ctx: Any) -> str:
    return text


class _Commands(TyperGroup):
    """Help in groups, with names of values instead of Python types; messages without the name of a validator."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        command = super().get_command(ctx, cmd_name)
        for parameter in getattr(command, "params", ()):
            shown = parameter.display_type(ctx).strip("<>") if isinstance(parameter, TyperOption) else ""
            parameter.display_type = partial(_constant, VALUE_NAMES.get(shown, shown))
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        names = self.list_commands(ctx)
        for title, group in GROUPS.items() if ctx.parent is None else (("Commands", tuple(names)),):
            rows = [(name, self.commands[name].get_short_help_str(LONGEST_SUMMARY)) for name in group if name in names]
            with formatter.section(title):
                formatter.write_dl(rows)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            if type(error) is not typer.BadParameter:  # a missing parameter
                raise
            # typer checks choices with a validator whose name it puts before the message.
            message = error.message.removeprefix("Value error, ")
            raise typer.BadParameter(message, error.ctx, error.param, error.param_hint) from None


app = typer.Typer(
    name="steptwin",
    cls=_Commands,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(serve.app, name="serve", cls=_Commands)
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
