"""Whether a variant takes a command with its number."""

from __future__ import annotations

from steptwin.m1486.commands import find, permitted_text
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import Variant


def out_of_range(command: ChipCommand, variant: Variant) -> str | None:
    """Why ``variant`` does not take ``command``; None if it does. A number left out is checked when it is known."""
    if not command.from_variable and find(command.key, command.number, variant) is None:
        return f"{command} is out of range: permitted is {permitted_text(command.key, variant)}"
    argument = command.argument
    if isinstance(argument, JumpCondition) and find("J", argument.label, variant) is None:
        return f"{command} is out of range: permitted is label {permitted_text('J', variant)}"
    return None
