"""Groups of commands, and how the help of their commands names values."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from typer.core import TyperArgument, TyperGroup, TyperOption

from steptwin.errors import Misuse

LONGEST_SUMMARY = 200
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


class CommandGroup(TyperGroup):
    """Help with names of values instead of Python types; messages without the name of a validator."""

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
        with formatter.section("Commands"):
            formatter.write_dl([(name, each.get_short_help_str(LONGEST_SUMMARY)) for name, each in self.commands.items()])
