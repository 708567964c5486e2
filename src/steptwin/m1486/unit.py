"""The numeric unit of the chip (manual chapters VII.6 and VII.7): internal variable, carry, remainder, flags, functions."""

from __future__ import annotations

from steptwin.m1486.functions import FUNCTIONS, INPUT, REGISTER, TABLE, USER_FLAGS
from steptwin.state import Stateful

MASK = 0xFFFFFF
"""M-13: the internal variable and the position counter have 24 bits and begin anew after the last."""
_SIGN = 0x800000
NUMBER, FROM_LINES, FROM_REGISTER = range(3)
"""Source of the operand of + - * /."""

_DEFAULTS = tuple(function.default for function in TABLE)


def counter_text(counter_u: int) -> str:
    """The position counter as text; a position below 0, which its 24 bits show as a large number, also as itself."""
    return f"{counter_u} ({counter_u - MASK - 1})" if counter_u & _SIGN else str(counter_u)


class NumericUnit(Stateful):
    __slots__ = ("carry", "flags", "functions", "operand_source", "remainder", "variable")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.variable = 0
        self.carry = False
        self.remainder = 0
        """Remainder of the last division: register 10."""
        self.flags = [False] * len(USER_FLAGS)
        """User flags from 80 on."""
        self.functions = list(_DEFAULTS)
        """Functions from 40 on."""
        self.operand_source = NUMBER

    def on(self, function: int) -> bool:
        return self.functions[function - FUNCTIONS.start]

    def switch(self, function: int, on: bool) -> None:
        self.functions[function - FUNCTIONS.start] = on
        # M-14: lines go before registers.
        self.operand_source = FROM_LINES if self.on(INPUT) else FROM_REGISTER if self.on(REGISTER) else NUMBER

    def flag_byte(self) -> int:
        """Flags 80 to 87, M-22: the lowest number is the least significant bit."""
        return _bits([*self.flags, self.carry])

    def function_byte(self, first: int) -> int:
        """Eight functions from ``first`` on, M-22."""
        begin = first - FUNCTIONS.start
        return _bits(self.functions[begin : begin + 8])


def _bits(states: list[bool]) -> int:
    return sum(1 << n for n, on in enumerate(states) if on)
