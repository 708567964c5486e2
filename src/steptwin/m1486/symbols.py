"""Every name in an M1486 program: labels by chip, I/O lines, functions, flags and registers."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Span
from steptwin.m1486.commands import ArgType, rows
from steptwin.m1486.commanduse import ChipState
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS
from steptwin.m1486.lines import LINES
from steptwin.m1486.structure import written_label
from steptwin.m1486.syntax import ChipCommand, JumpCondition, ParsedProgram
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use

_NAMED = ChipState.LINES | ChipState.FLAGS | ChipState.FUNCTIONS | ChipState.REGISTERS
"""State that the numbers of commands name."""
FLAGS = range(USER_FLAGS.start, CARRY + 1)


def by_chip(program: ParsedProgram) -> Iterator[tuple[int | None, ChipCommand]]:
    """The commands with the address of the chip that listens; None while all do, or there is only one."""
    listening: int | None = None
    for command in program.all_commands:
        if command.key in ("X", "XG"):
            listening = command.number
        yield listening, command


def label_key(chip: int | None, label: int) -> str:
    """Labels of different chips have nothing to do with each other."""
    return f"{'' if chip is None else f'{chip:X}:'}{label}"


def uses(program: ParsedProgram) -> Iterator[Use]:
    """In the order of the program."""
    for chip, command in by_chip(program):
        if command.key == "@" and command.number is not None:
            yield _label(chip, command.number, command.argument_span, SymbolRole.DEFINE)
            continue
        yield from _of_number(command)
        label = written_label(command)
        if label is not None:
            span = command.argument.label_span if isinstance(command.argument, JumpCondition) else command.argument_span
            yield _label(chip, label, span, SymbolRole.READ)


def _label(chip: int | None, label: int, span: Span, role: SymbolRole) -> Use:
    return Use(Symbol(SymbolKind.LABEL, label_key(chip, label), str(label)), span, role)


def _of_number(command: ChipCommand) -> Iterator[Use]:
    number = command.number
    if number is None:
        return
    role = SymbolRole.WRITE if any(spec.use.writes & _NAMED for spec in rows(command.key)) else SymbolRole.READ
    found = _symbol(command.key, number)
    if found is not None:
        yield Use(found, command.argument_span, role)


def _symbol(key: str, number: int) -> Symbol | None:
    kinds = {spec.kind for spec in rows(key)}
    if ArgType.REGISTER in kinds:
        return Symbol(SymbolKind.REGISTER, f"R{number}", f"register {number}")
    if not kinds & {ArgType.LINE, ArgType.FUNCTION, ArgType.FLAG, ArgType.CONDITION}:
        return None
    if number in LINES:
        return Symbol(SymbolKind.LINE, f"B{number}", f"B{number}")
    if number in FUNCTIONS:
        return Symbol(SymbolKind.FUNCTION, f"F{number}", f"function {number}")
    return Symbol(SymbolKind.VARIABLE, f"flag {number}", f"flag {number}") if number in FLAGS else None
