"""The numeric unit: internal variable, registers, arithmetic (manual chapter VII.7)."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.m1486.commands import DIVIDEND_LIMIT, FREE_DIVISORS
from steptwin.m1486.effects import CommandHost, Effect, Makers, WrongData
from steptwin.m1486.lines import line_group
from steptwin.m1486.registers import GENERAL, POSITION_REGISTER
from steptwin.m1486.unit import FROM_LINES, MASK
from steptwin.messages import Message

MAKERS = Makers()


@MAKERS.does("Load", computes=True)
def _load(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run(now: Nanos) -> int:
        unit.variable = number
        return following

    return run


@MAKERS.does("Move to register")
def _to_register(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        unit = chip.unit
        if number in GENERAL:
            chip.memory.set_register(number, unit.variable)
        elif number == POSITION_REGISTER:
            chip.drive.set_counter(unit.variable, now)
        else:
            unit.remainder = unit.variable & 0xFF
        return following

    return run


@MAKERS.does("Move from register")
def _from_register(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        unit = chip.unit
        if number in GENERAL:
            unit.variable = chip.memory.register(number)
        elif number == POSITION_REGISTER:
            unit.variable = chip.drive.counter_u(now)
        else:
            unit.variable = unit.remainder
        return following

    return run


NUMBER_NAMES_NO_LINES = Message(
    "m1486.number-names-no-lines",
    "{number} names no lines, and function 46 is ON: first line and count, such as 14, up to line 21",
)
NO_OPERAND_REGISTER = Message(
    "m1486.no-operand-register", "{number} is not an operand register, and function 58 is ON: permitted are 1 to 8"
)


def _indirect(chip: CommandHost, number: int, now: Nanos, *, low_byte: bool) -> int:
    """The operand if functions 46 and 58 turn its number into lines or a register."""
    if chip.unit.operand_source == FROM_LINES:
        lines = line_group(number)
        if lines is None:
            raise WrongData(NUMBER_NAMES_NO_LINES(number=number))
        return chip.read(lines, now)
    if number not in GENERAL:
        raise WrongData(NO_OPERAND_REGISTER(number=number))
    value = chip.memory.register(number)
    return value & 0xFF if low_byte else value


@MAKERS.does("Add", computes=True)
def _add(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run(now: Nanos) -> int:
        operand = _indirect(chip, number, now, low_byte=False) if unit.operand_source else number
        total = unit.variable + operand
        unit.carry = total > MASK
        unit.variable = total & MASK
        return following

    return run


@MAKERS.does("Subtract", computes=True)
def _subtract(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run(now: Nanos) -> int:
        operand = _indirect(chip, number, now, low_byte=False) if unit.operand_source else number
        difference = unit.variable - operand
        unit.carry = difference < 0
        unit.variable = difference & MASK
        return following

    return run


@MAKERS.does("Multiply", computes=True)
def _multiply(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run(now: Nanos) -> int:
        operand = _indirect(chip, number, now, low_byte=True) if unit.operand_source else number
        unit.variable = unit.variable * operand & MASK  # M-13
        return following

    return run


DIVISION_BY_ZERO = Message("m1486.division-by-zero", "division by 0")
DIVIDEND_IS_TOO_LARGE = Message(
    "m1486.dividend-is-too-large", "{variable} / {operand}: at most {most} can be divided, except by 2, 4, 8, 16, 32, 64"
)


@MAKERS.does("Divide", computes=True)
def _divide(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run(now: Nanos) -> int:
        operand = _indirect(chip, number, now, low_byte=True) if unit.operand_source else number
        if operand == 0:
            raise WrongData(DIVISION_BY_ZERO())
        if unit.variable > DIVIDEND_LIMIT and operand not in FREE_DIVISORS:
            raise WrongData(DIVIDEND_IS_TOO_LARGE(variable=unit.variable, operand=operand, most=DIVIDEND_LIMIT))
        unit.variable, remainder = divmod(unit.variable, operand)
        unit.remainder = remainder & 0xFF
        return following

    return run
