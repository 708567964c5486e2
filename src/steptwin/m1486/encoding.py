"""Commands in the chip's memory: one byte for the letter, then the argument in as many bytes as its largest value needs
(manual chapter II, Memory). The length depends on the letter only.

The manual does not specify how an omitted argument, and the sign of ``G+``, differ from numbers (M-29): here the highest bit
of the first byte marks the internal variable as the argument; ``G+`` and ``G-`` are the two largest numbers of 24 bits, which
no position reaches. Low byte first.
"""

from __future__ import annotations

from typing import NamedTuple

from steptwin.m1486.commands import LETTERS, When, memory_bits, rows, takes_number, takes_variable
from steptwin.m1486.syntax import ChipCommand, JumpCondition

FROM_VARIABLE = 0x80
_ENDLESS = {"G+": 0xFFFFFF, "G-": 0xFFFFFE}
_ENDLESS_KEYS = {number: key for key, number in _ENDLESS.items()}

SIZES = {letter: memory_bits(letter) // 8 for letter in LETTERS if any(spec.when is When.QUEUED for spec in rows(letter))}
"""Bytes of one command, by its letter; letters that are never stored are missing."""
LONGEST = max(SIZES.values())


class Stored(NamedTuple):
    """A command read from memory, and how many bytes it takes."""

    command: ChipCommand
    size: int


def encode(command: ChipCommand) -> bytes:
    """The bytes of a command that is stored."""
    letter = command.key[0]
    first = ord(letter) | (FROM_VARIABLE if command.from_variable else 0)
    size = SIZES[letter] - 1
    argument = command.argument
    if isinstance(argument, JumpCondition):
        return bytes((first, argument.line, ord("H" if argument.high else "L"), argument.label))
    number = _ENDLESS.get(command.key, 0) if argument is None else argument
    return bytes((first,)) + number.to_bytes(size, "little")


def decode(raw: bytes) -> Stored | None:
    """The command that begins with ``raw[0]``; None where these bytes are no command, as when registers were written over it.

    ``raw`` holds `LONGEST` bytes. The range of the number is not checked.
    """
    letter = chr(raw[0] & ~FROM_VARIABLE)
    size = SIZES.get(letter)
    if size is None:
        return None
    if raw[0] & FROM_VARIABLE:
        return Stored(ChipCommand(letter), size) if takes_variable(letter) else None
    if letter == "I":
        level = chr(raw[2])
        return Stored(ChipCommand("I", JumpCondition(raw[1], level == "H", raw[3])), size) if level in "HL" else None
    if not takes_number(letter):
        return Stored(ChipCommand(letter), size)
    number = int.from_bytes(raw[1:size], "little")
    if letter == "G" and number in _ENDLESS_KEYS:
        return Stored(ChipCommand(_ENDLESS_KEYS[number]), size)
    return Stored(ChipCommand(letter, number), size)
