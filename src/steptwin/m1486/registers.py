"""Names of ``<``, ``>`` and ``U``: the registers 1 to 10 and the bytes 1 to 20 (manual chapters VII.1 Upload and VII.7)."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.m1486.commanduse import ChipState
from steptwin.messages import Message, MessageText


@dataclass(frozen=True, slots=True)
class ChipRegister:
    number: int
    bits: int
    name: str
    is_operand: bool
    """May stand as operand of + - * / while function 58 is ON."""
    state: ChipState


POSITION_REGISTER = 9
REMAINDER_REGISTER = 10

REGISTERS: tuple[ChipRegister, ...] = (
    *(ChipRegister(n, 16, f"general purpose {n}", True, ChipState.REGISTERS) for n in range(1, 9)),
    ChipRegister(POSITION_REGISTER, 24, "position counter", False, ChipState.POSITION),
    ChipRegister(REMAINDER_REGISTER, 8, "remainder of the last division", False, ChipState.REMAINDER),
)


def register(number: int) -> ChipRegister:
    return REGISTERS[number - 1]


GENERAL = range(1, 9)
"""The registers that share the command memory on some variants."""

UPLOADS: dict[int, MessageText] = {
    number: Message(f"m1486.upload.{number}", text)()
    for number, text in (
        (1, "position, low byte"),
        (2, "position, middle byte"),
        (3, "position, high byte"),
        (4, "internal variable, low byte"),
        (5, "internal variable, middle byte"),
        (6, "internal variable, high byte"),
        (14, "flags 80 to 87"),
        (15, "driver interface: 0 Two DACs, 1 Dual DAC, 2 Step & Direction"),
        (16, "production series"),
        (17, "functions 40 to 47"),
        (18, "functions 48 to 55"),
        (19, "functions 56 to 63"),
        (20, "type letter in ASCII"),
    )
}
"""Bytes that ``U`` can request; the heading of the section says 18, its table goes to 20. The others are reserved."""
UPLOAD_RANGE = range(1, 21)
