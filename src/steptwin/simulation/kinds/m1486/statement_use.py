"""What the commands of an M1486 read and change."""

from __future__ import annotations

from steptwin.m1486.functions import USER_FLAGS
from steptwin.m1486.lines import LINES
from steptwin.m1486.syntax import ChipCommand
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementUse

_AXIS = Resource(ResourceKind.AXIS, "1")
_ANY_PIN = Resource(ResourceKind.PIN, "")
_VARIABLE = Resource(ResourceKind.VALUE, "variable")
_EVERYTHING = range(1 << 16)
"""A conditional jump decides about what comes after it, wherever that is."""


def use_of(command: ChipCommand) -> StatementUse:
    """A move holds the program until its end."""
    key, line = command.key, command.number
    pin = () if line not in LINES else (Resource(ResourceKind.PIN, f"B{line}"),)
    match key:
        case "O" | "Z":
            return StatementUse(pin, waits=True)
        case "T" | "C":
            return StatementUse(writes=pin, keeps=line in USER_FLAGS)
        case "!":
            return StatementUse((_VARIABLE,), (_ANY_PIN,))
        case "?":
            return StatementUse((_ANY_PIN,), (_VARIABLE,))
        case ":" | "+" | "-" | "*" | "/" | "<":
            return StatementUse(writes=(_VARIABLE,))
        case "I":
            return StatementUse(pin, governs=_EVERYTHING)
        case "W":
            return StatementUse(waits=True)
        case "R" | ")" | "(":
            return StatementUse((_AXIS, *pin), (_AXIS,), waits=True)
        case _:
            return StatementUse()
