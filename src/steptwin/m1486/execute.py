"""Compile commands in the memory to closures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.m1486 import flow_effects, io_effects, motion_effects, numeric_effects
from steptwin.m1486.commands import TABLE, ArgType, When, find, takes_variable
from steptwin.m1486.effects import CommandHost, Effect, Making, WrongData, refusing
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.messages import Message, text_of
from steptwin.tables import complete


class CompiledCommand(NamedTuple):
    """A compiled command; the rest as in `Making`."""

    effect: Effect
    computes: bool
    is_linked: bool


_MAKERS: Mapping[str, Making] = complete(
    "command",
    # A command with a variable as its number waits in the memory, whatever the number is.
    [
        spec.name
        for spec in TABLE
        if (spec.when is When.QUEUED and spec.kind is not ArgType.CONDITION) or takes_variable(spec.key)
    ],
    "effect",
    flow_effects.MAKERS | motion_effects.MAKERS | io_effects.MAKERS | numeric_effects.MAKERS,
)


NO_COMMAND = Message("m1486.no-command", "{command} is not a command")


def compile_command(chip: CommandHost, command: ChipCommand, place: int, following: int) -> CompiledCommand:
    """The closure of a command stored in the memory at ``place``."""
    if command.from_variable:
        return CompiledCommand(_with_variable(chip, command.key, place, following), computes=False, is_linked=False)
    why = out_of_range(command, chip.variant)
    spec = find(command.key, command.number, chip.variant)
    if why is not None or spec is None:
        return CompiledCommand(refusing(why or NO_COMMAND(command=command)), computes=True, is_linked=False)
    if isinstance(command.argument, JumpCondition):
        return CompiledCommand(*flow_effects.condition(chip, command.argument, following), is_linked=True)
    row = _MAKERS[spec.name]
    effect = row.make(chip, command.argument or 0, place, following)
    return CompiledCommand(effect, computes=row.computes, is_linked=row.is_linked)


VARIABLE_GIVES = Message("m1486.variable-gives", "the internal variable gives: {why}")


def _with_variable(chip: CommandHost, key: str, place: int, following: int) -> Effect:
    """A command without number, which uses the value of the internal variable at its execution."""

    def run(now: Nanos) -> int:
        number = chip.unit.variable
        spec = find(key, number, chip.variant)
        if spec is None:
            raise WrongData(VARIABLE_GIVES(why=text_of(out_of_range(ChipCommand(key, number), chip.variant) or "None")))
        return _MAKERS[spec.name].make(chip, number, place, following)(now)

    return run
