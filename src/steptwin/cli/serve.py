"""``steptwin serve``: serve twins made from options, a command for each controller."""

from __future__ import annotations

import typer

from steptwin.cli.commandgroup import CommandGroup
from steptwin.cli.optiongroups import GroupedCommand
from steptwin.cli.serve_m1486 import m1486
from steptwin.cli.serve_mic488 import mic488

command = typer.Typer(
    cls=CommandGroup, add_completion=False, rich_markup_mode=None, help="Serve a twin until Ctrl-C.", no_args_is_help=True
)
for _twin in (mic488, m1486):
    command.command(cls=GroupedCommand)(_twin)
