"""The command line. Each command lives in a module of its own and imports what it needs when it runs.

Exit codes: 0 done, 1 not done (a check found something, a peer refused, a line failed), 2 wrong use (an option, a name, a value,
a file that is missing or has errors), 3 a database failed, 130 interrupted. docs/reference/command-line.md has the table.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from functools import partial
from io import TextIOWrapper
from itertools import pairwise
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperArgument, TyperGroup, TyperOption
from typer.exceptions import TyperException

from steptwin import __version__
from steptwin.cli import (
    bridge,
    build,
    calc,
    campaign,
    certificate,
    check,
    commands,
    dap,
    datasheet,
    decompile,
    explain,
    export,
    fault,
    fmt,
    get,
    history,
    info,
    lsp,
    migrate,
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
    studio,
    terminal,
    twin,
    twins,
    up,
    verify,
    watch,
    why,
)
from steptwin.cli.optiongroups import GroupedCommand
from steptwin.errors import DatabaseFailure, Misuse, SourceErrors, SteptwinError

COMMANDS: Mapping[str, Mapping[str, Callable[..., None]]] = {
    "Twins": {
        "studio": studio.studio,
        "up": up.up,
        "twins": twins.twins,
        "state": twin.state,
        "pin": twin.pin,
        "encoder": twin.encoder,
        "power-cycle": twin.power_cycle,
        "fault": fault.fault,
        "pause": pace.pause,
        "step": pace.step,
        "resume": pace.resume,
        "save": pace.save,
        "certificate": certificate.certificate,
    },
    "Programs and runs": {
        "check": check.check,
        "explain": explain.explain,
        "migrate": migrate.migrate,
        "fmt": fmt.fmt,
        "build": build.build,
        "decompile": decompile.decompile,
        "run": run.run,
        "replay": replay.replay,
        "why": why.why,
        "export": export.export,
        "lsp": lsp.lsp,
        "dap": dap.dap,
    },
    "Devices and twins": {
        "ports": scan.ports,
        "scan": scan.scan,
        "info": info.info,
        "get": get.get,
        "set": get.set_,
        "watch": watch.watch,
        "enable": move.enable,
        "disable": move.disable,
        "home": move.home,
        "seek": move.seek,
        "move": move.move,
        "jog": move.jog,
        "stop": move.stop,
        "send": send.send,
        "terminal": terminal.terminal,
        "sniff": sniff.sniff,
        "verify": verify.verify,
        "bridge": bridge.bridge,
        "history": history.history,
        "record": record.record,
        "diff": record.diff,
    },
    "Reference": {
        "calc": calc.calc,
        "registers": registers.registers,
        "commands": commands.commands,
        "datasheet": datasheet.datasheet,
    },
}
"""By group and name, in the order of ``--help``. ``serve`` and ``campaign`` are groups of commands themselves."""
GROUPS = {title: tuple(group) for title, group in COMMANDS.items()}
GROUPS["Twins"] = ("serve", *GROUPS["Twins"])
GROUPS["Programs and runs"] = (*GROUPS["Programs and runs"], "campaign")
"""Names, as ``--help`` lists them."""
LONGEST_SUMMARY = 200
NOT_DONE, MISUSED, DATABASE = 1, 2, 3
"""Exit codes."""

VALUE_NAMES = {"str": "TEXT", "list[str]": "TEXT", "int": "N", "float": "NUMBER", "path": "PATH", "list[path]": "PATH"}
"""Names of option values in help, instead of Python types."""


def _constant(text: str, ctx: Any) -> str:
    return text


def _process_number(parameter: Any, process: Callable[[Any, Any], Any], is_float: bool, ctx: Any, value: Any) -> Any:
    """The value of an option, which is a number as everywhere; the library takes others, too. Raises `Misuse`."""
    if not isinstance(value, str):
        return process(ctx, value)
    from steptwin.numerals import read_number

    try:
        number = read_number(value)
    except Misuse as error:
        process(ctx, value)  # what it refuses as well has its usual message
        raise Misuse(f"{parameter.opts[0]}: {error}") from None
    return process(ctx, number if is_float else value)


class _Commands(TyperGroup):
    """Help in groups, with names of values instead of Python types; messages without the name of a validator."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        command = super().get_command(ctx, cmd_name)
        for parameter in getattr(command, "params", ()):
            shown = parameter.display_type(ctx).strip("<>") if isinstance(parameter, TyperOption) else ""
            parameter.display_type = partial(_constant, VALUE_NAMES.get(shown, shown))
            if shown in {"int", "float"}:
                parameter.process_value = partial(_process_number, parameter, parameter.process_value, shown == "float")
            if isinstance(parameter, TyperArgument) and parameter.metavar is None:
                parameter.metavar = str(parameter.name).upper()
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        names = self.list_commands(ctx)
        for title, group in GROUPS.items() if ctx.parent is None else (("Commands", tuple(names)),):
            rows = [(name, self.commands[name].get_short_help_str(LONGEST_SUMMARY)) for name in group if name in names]
            with formatter.section(title):
                formatter.write_dl(rows)


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
app.add_typer(campaign.app, name="campaign", cls=_Commands)
for _group in COMMANDS.values():
    for _name, _command in _group.items():
        app.command(_name, cls=GroupedCommand)(_command)


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
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # pipes on Windows have not every character
            stream.reconfigure(errors="replace")
    try:
        code = app(standalone_mode=False)
    except TyperException as error:
        message = _usage(error)
        _fail(message, MISUSED, head="" if message.startswith("Usage: ") else "steptwin: ")
    except SourceErrors as error:
        _fail(str(error), MISUSED, head="")
    except DatabaseFailure as error:
        _fail(str(error), DATABASE)
    except SteptwinError as error:
        _fail(str(error), MISUSED if isinstance(error, Misuse) else NOT_DONE)
    except typer.Abort:
        sys.exit(NOT_DONE)
    sys.exit(code if isinstance(code, int) else 0)


_NO_NUMBER = {
    "Input should be a valid number, unable to parse string as a number": "a number, without a unit",
    "Input should be a valid integer, unable to parse string as an integer": "a whole number",
}
"""What the library that reads options says of a value, and what it means."""


def _usage(error: TyperException) -> str:
    """The message for wrong usage, with the command that shows help."""
    # typer checks choices with a validator whose name it puts into the message.
    message = error.format_message().replace("Value error, ", "").rstrip(".")
    for words, needed in _NO_NUMBER.items():
        if words in message:
            given = next((one["input"] for one in getattr(error.__context__, "errors", list)()), None)
            message = message.replace(words, f"{given!r}: expected {needed}" if given is not None else f"expected {needed}")
    context = getattr(error, "ctx", None)
    if context is None or message.startswith("Usage: "):  # a group without a command is shown its help
        return message
    return f"{message}; usage: {context.command_path} -h"


def _fail(message: str, code: int, *, head: str = "steptwin: ") -> NoReturn:
    """End with a message; with --json as one line of JSON."""
    text = json.dumps({"error": message, "code": code}, ensure_ascii=False) if _wants_json() else f"{head}{message}"
    print(text, file=sys.stderr)  # noqa: T201
    sys.exit(code)


def _wants_json() -> bool:
    """Whether the command line asks for JSON; it may have a mistake that keeps it from being read."""
    given = sys.argv[1:]
    return "--json" in given or "--format=json" in given or ("--format", "json") in pairwise(given)
