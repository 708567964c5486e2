"""The command line. Each command lives in a module of its own and imports what it needs when it runs.

Exit codes: 0 done, 1 not done (a check found something, a peer refused, a line failed), 2 wrong use (an option, a name, a value,
a file that is missing or has errors), 3 a database failed, 130 interrupted. docs/reference/command-line.md has the table.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from io import TextIOWrapper
from itertools import pairwise
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand
from typer.exceptions import TyperException
from typer.main import get_command

from steptwin import __version__
from steptwin.cli.commandgroup import CommandGroup
from steptwin.cli.optiongroups import GroupedCommand
from steptwin.errors import DatabaseFailure, Misuse, SourceErrors, SteptwinError

COMMANDS: Mapping[str, Mapping[str, str]] = {
    "Twins": {
        "serve": "Serve a twin until Ctrl-C.",
        "studio": "Show a world or devices in a browser, until Ctrl-C.",
        "up": "Run a world in real time until Ctrl-C or until one of its scripts stops it; other programs connect to its lines.",
        "twins": "List running twins: names as --device takes them, kinds, and addresses at which other programs reach them.",
        "state": "Show the state of a running twin.",
        "pin": "Set inputs of a running twin, press or release its buttons, or show all pins.",
        "encoder": "Turn, couple or block the encoder shafts of a running twin, or show them.",
        "power-cycle": "Switch a running twin off and on again.",
        "fault": "Set, clear or show the faults of a running twin.",
        "pause": "Pause a running world.",
        "step": "Advance a world by a time, to a condition or to its next event, show what happened, and pause.",
        "resume": "Continue a paused world, or change its speed.",
        "save": "Save the recording of a running world, to replay it or to continue from it with 'run' and 'up'.",
        "certificate": "Make a certificate, signed by itself, and its key: for [gateway.opcua], tls_tcp of a [[line]], steptwin "
        "studio.",
    },
    "Programs and runs": {
        "check": "Check a file and report everything wrong or doubtful in it: WBC programs (.prg), position tables (.csv), "
        "configurations (.cfg), worlds (.toml); all others are M1486 programs.",
        "explain": "Explain a program without running it: control flow, durations, memory, inputs and outputs, where it can wait "
        "for ever.",
        "migrate": "Show what of a program does not fit another type of M1486 or another firmware of the MIC488, and why, with "
        "changes.",
        "fmt": "Write WBC programs in one style: blanks, indentation, keywords in capitals.",
        "build": "Compile a WBC program to the image of firmware 1.25.",
        "decompile": "Turn a compiled image into a program and a position table that build to the same bytes.",
        "run": "Run a program or a world in virtual time and print its moves, waits, outputs and uploads.",
        "replay": "Run a recording again and compare what happens.",
        "why": "Show the chain of causes of a value, of a condition or of a wait.",
        "export": "Write a recorded trace as timeline (html), picture (png, svg), machine in motion (glb), signals (vcd), "
        "frames (pcapng) or samples (csv, parquet).",
        "picture": "Draw the machine of a world at a moment, up to which the world runs in virtual time.",
        "lsp": "Serve an editor on standard input and output (Language Server Protocol): programs, tables, configurations, "
        "worlds.",
        "dap": "Serve an editor on standard input and output (Debug Adapter Protocol): breakpoints, steps, also backwards in "
        "time.",
        "campaign": "Run campaigns: many runs of a world, each a little different.",
    },
    "Devices and twins": {
        "doctor": "Examine this computer: libraries, ports that are taken, serial ports, the page of the studio, a browser.",
        "ports": "List serial ports, and the pseudo terminals of running twins.",
        "scan": "Find controllers on serial ports and network addresses.",
        "info": "Show what a controller is and what it is doing.",
        "get": "Read registers by name or address.",
        "set": "Write registers by name, one after the other.",
        "watch": "Read registers again and again.",
        "enable": "Switch drives on.",
        "disable": "Switch drives off.",
        "home": "Home axes, at the velocities given.",
        "seek": "Move an M1486 at start/stop speed until a line has its end level.",
        "move": "Move axes; several begin in the same instant.",
        "jog": "Jog an axis until a key is pressed.",
        "stop": "Stop axes at once, without ramp; an M1486 with its ramp, and its program.",
        "send": "Download a program into an M1486.",
        "terminal": "Talk to a controller line by line: names read, NAME=VALUE writes.",
        "sniff": "Log the traffic between a master and a device in words.",
        "verify": "Check whether a controller behaves as the numbered assumptions say.",
        "bridge": "Serve real devices to programs of a plant, by the gateways of a file, until Ctrl-C.",
        "history": "Show, export and compare what a database has kept of twins and devices.",
        "record": "Run a list of requests on a controller and record the answers.",
        "diff": "Report where two transcripts of the same requests differ.",
    },
    "Reference": {
        "calc": "Calculate a move: its times, or with a time the quantity that is not given; and GEAR from the mechanics.",
        "registers": "Show the coils, inputs and holding registers of a controller.",
        "commands": "Show the statements or commands of a controller, their arguments and effects, and all findings of the "
        "checker.",
        "datasheet": "Show the data sheet of a controller: axes, pins, points with unit and range, commands, events.",
    },
}
"""By group and name, in the order of ``--help``: the first sentence of each command's help, so that it imports none of them.

A command is ``command`` in the module of its name.
"""
NOT_DONE, MISUSED, DATABASE = 1, 2, 3
"""Exit codes."""


class _Steptwin(CommandGroup):
    """The commands of `COMMANDS`, imported one by one when they are needed."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        rows = [row for group in COMMANDS.values() for row in group.items()]
        self.commands = {name: TyperCommand(name, help=summary) for name, summary in rows}

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name in self.commands:
            self.commands[cmd_name] = _imported(cmd_name)
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        for title, group in COMMANDS.items():
            with formatter.section(title):
                formatter.write_dl(list(group.items()))


@cache
def _imported(name: str) -> Any:
    """The command or group of commands in the module of its name."""
    found = import_module(f"steptwin.cli.{name.replace('-', '_')}").command
    if not isinstance(found, typer.Typer):
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(name, cls=GroupedCommand)(found)
        found = alone
    return get_command(found)


app = typer.Typer(
    name="steptwin",
    cls=_Steptwin,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


GREETING = f"""steptwin {__version__}: the WObit MIC488 and Microcon M1486 motion controllers as software. Three things to try:

  steptwin studio                a machine that moves, in the browser
  steptwin serve mic488 --demo   a controller for your own master, on Modbus TCP 127.0.0.1:5020 and on a pty
  steptwin run FILE              a program or a machine of yours, in virtual time

'steptwin --help' lists all commands, 'steptwin doctor' what this computer lacks."""


@app.callback(invoke_without_command=True)
def _steptwin(
    ctx: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """The WObit MIC488 and Microcon M1486 motion controllers as software."""
    if ctx.invoked_subcommand is None:
        typer.echo(GREETING)


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
"""Sentences of the library that reads options, and ours for them."""


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
