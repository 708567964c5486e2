"""Compile commands in the memory to closures."""

from __future__ import annotations

from typing import NamedTuple

from steptwin.m1486 import flow_effects, io_effects, motion_effects, numeric_effects
from steptwin.m1486.commands import TABLE, When, find
from steptwin.m1486.effects import CommandHost, Effect, Making, WrongData, refusing
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.machine import Nanos


class CompiledCommand(NamedTuple):
    """A compiled command; the rest as in `Making`."""

    effect: Effect
    computes: bool
    is_linked: bool


_MAKERS: dict[str, Making] = flow_effects.MAKERS | motion_effects.MAKERS | io_effects.MAKERS | numeric_effects.MAKERS


def compile_command(chip: CommandHost, command: ChipCommand, place: int, following: int) -> CompiledCommand:
    """The closure of a command stored in the memory at ``place``."""
    if command.from_variable:
        return CompiledCommand(_with_variable(chip, command.key, place, following), computes=False, is_linked=False)
    why = out_of_range(command, chip.variant)
    spec = find(command.key, command.number, chip.variant)
    if why is not None or spec is None:
        return CompiledCommand(refusing(why or f"{command} is not a command"), computes=True, is_linked=False)
    if isinstance(command.argument, JumpCondition):
        return CompiledCommand(*flow_effects.condition(chip, command.argument, following), is_linked=True)
    row = _MAKERS[spec.name]
    effect = row.make(chip, command.argument or 0, place, following)
    return CompiledCommand(effect, computes=row.computes, is_linked=row.is_linked)


def _with_variable(chip: CommandHost, key: str, place: int, following: int) -> Effect:
    """A command without number, which uses the value of the internal variable at its execution."""

    def run(now: Nanos) -> int:
        number = chip.unit.variable
        spec = find(key, number, chip.variant)
        if spec is None:
            raise WrongData(f"the internal variable gives: {out_of_range(ChipCommand(key, number), chip.variant)}")
        return _MAKERS[spec.name].make(chip, number, place, following)(now)

    return run


_unmade = {spec.name for spec in TABLE if spec.when is When.QUEUED} - _MAKERS.keys() - {"If"}
if _unmade:
    raise ValueError(f"commands without an effect: {', '.join(sorted(_unmade))}")
