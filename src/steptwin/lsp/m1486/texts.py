"""Meanings of commands and numbers of the M1486, in words: for hovers, completions and hints."""

from __future__ import annotations

from steptwin.m1486.commands import CommandSpec, When, find, grouped, range_text, rows, takes_variable
from steptwin.m1486.commanduse import Wait
from steptwin.m1486.functions import CARRY, default, function
from steptwin.m1486.lines import SEEK_ENDS_LOW, SHARED_PINS, Interface
from steptwin.m1486.microsteps import FULL_STEP, UNIT
from steptwin.m1486.registers import REGISTERS
from steptwin.m1486.structure import stored_bits
from steptwin.m1486.syntax import ChipCommand
from steptwin.m1486.variants import Variant
from steptwin.symbols import SymbolKind, Use


def spec_of(command: ChipCommand, variant: Variant) -> CommandSpec | None:
    """The row of the command table that a command means, or could mean."""
    found = find(command.key, command.number, variant)
    if found is not None:
        return found
    return next(iter(rows(command.key)), None)


def command_text(command: ChipCommand, variant: Variant) -> str:
    """Markdown about a command as it is written."""
    spec = spec_of(command, variant)
    if spec is None:
        return ""
    lines = [f"```m1486\n{command}\n```", f"**{spec.name}** {spec.effect}"]
    if command.from_variable:
        lines.append("The internal variable is used as the number.")
    takes = range_text(spec, variant)
    if takes != "nothing":
        lines.append(f"Takes {takes}.")
    if command.number is not None and spec.unit == UNIT:
        lines.append(f"{grouped(command.number)} minimum microsteps are {_full_steps(command.number)}.")
    bits = stored_bits(command)
    memory = f"{bits} bits of command memory" if bits else "no command memory"
    acts = "" if spec.when is When.QUEUED else f"; acts {spec.when.value}"
    lines.append(f"It needs {memory}{acts}.")
    return "\n\n".join([*lines, f"*Manual, chapter {spec.section}*"])


def letter_text(spec: CommandSpec, variant: Variant) -> str:
    """Markdown about a row of the command table."""
    takes = range_text(spec, variant)
    variable = " Without a number: the internal variable." if takes_variable(spec.key) else ""
    shown = "" if takes == "nothing" else f"\n\nTakes {takes}.{variable}"
    return f"**{spec.name}** {spec.effect}{shown}\n\n*Manual, chapter {spec.section}*"


def _full_steps(number: int) -> str:
    whole, rest = divmod(number, FULL_STEP)
    if not rest:
        return f"{grouped(whole)} full step{'' if whole == 1 else 's'}"
    return f"{number / FULL_STEP:.10g} full steps"


def steps_hint(command: ChipCommand, variant: Variant) -> str:
    """A distance in full steps, where that is easier to read."""
    spec = find(command.key, command.number, variant)
    if spec is None or spec.unit != UNIT or command.number is None:
        return ""
    return _full_steps(command.number)


def number_text(use: Use, command: ChipCommand, interface: Interface) -> str:
    """Markdown about the line, function, flag or register that a number names."""
    symbol = use.symbol
    number = int("".join(c for c in symbol.key.rpartition(":")[2] if c.isdigit()))
    match symbol.kind:
        case SymbolKind.LABEL:
            return f"Label {symbol.text}."
        case SymbolKind.REGISTER:
            found = next((register for register in REGISTERS if register.number == number), None)
            return f"There is no register {number}." if found is None else f"Register {number}, {found.bits} bits: {found.name}."
        case SymbolKind.LINE:
            return line_text(number, command, interface)
        case SymbolKind.FUNCTION:
            return function_text(number)
        case _:
            return f"Flag {number}, the carry: + and - set and clear it." if number == CARRY else f"User flag {number}."


def line_text(number: int, command: ChipCommand, interface: Interface) -> str:
    text = f"Line B{number}."
    if number in SHARED_PINS:
        text += f" Its pin is also {SHARED_PINS[number]}."
    if number in interface.occupied:
        text += f" The {interface.title} interface needs the pin."
    if command.use.waits is Wait.SEEK:
        text += f" A seek ends when it is {'low' if number in SEEK_ENDS_LOW else 'high'}."
    return text


def function_text(number: int) -> str:
    found = function(number)
    if not found.name:
        return f"Function {number} is reserved."
    state = "ON" if default(number) else "OFF"
    return f"Function {number}, {found.name}.\n\nON: {found.on}. OFF: {found.off}. After power-up: {state}."
