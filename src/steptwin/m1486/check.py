"""Check an M1486 program: all errors and warnings, and the command memory it uses."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.diagnostics import Diagnostic, Severity, in_order
from steptwin.m1486.argument_rules import argument_rules, free_labels
from steptwin.m1486.flow_rules import flow_rules
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.position_rules import position_rules
from steptwin.m1486.structure import CommandStream, stored_bits, streams
from steptwin.m1486.structure_rules import structure_rules
from steptwin.m1486.syntax import ChipCommand, Parsed, ParsedProgram, parse
from steptwin.m1486.variants import DEFAULT, Variant


@dataclass(frozen=True, slots=True)
class CheckedChipProgram:
    """The result: the parsed program, the findings in text order, the memory of each chip."""

    program: ParsedProgram
    diagnostics: list[Diagnostic]
    memory: list[ChipMemory]

    @property
    def is_sound(self) -> bool:
        """True if there is no error; there may be warnings."""
        return not any(d.severity is Severity.ERROR for d in self.diagnostics)


@dataclass(frozen=True, slots=True)
class ChipMemory:
    """Command memory, in bits, that one chip's commands take.

    A file in ``[ ]`` must fit ``limit`` as a whole; commands outside pass through the ring and never fill it.
    """

    address: int | None
    """None for a program without ``X``."""
    limit: int
    total: int
    files: tuple[int, ...]
    """Bits of each file in ``[ ]``, in order."""
    commands: tuple[CommandSize, ...]


@dataclass(frozen=True, slots=True)
class CommandSize:
    command: ChipCommand
    bits: int
    in_file: bool


def check(text: str, variant: Variant = DEFAULT, interface: Interface = STEP_DIRECTION) -> CheckedChipProgram:
    """Check the text of a program for one variant and driver interface, as if started after power-up. Never raises."""
    return check_parsed(parse(text), variant, interface)


def check_parsed(parsed: Parsed, variant: Variant, interface: Interface) -> CheckedChipProgram:
    """As `check`, of a text that has been read."""
    program, found = parsed
    diagnostics = list(found)
    labels = free_labels(program.all_commands, variant)
    for command in program.all_commands:
        diagnostics += argument_rules(command, variant, interface, labels)
    chips = streams(program)
    for stream in chips:
        diagnostics += structure_rules(stream, variant)
        diagnostics += flow_rules(stream, variant, interface)
        diagnostics += position_rules(stream, variant)
    # Commands that several chips receive are checked for each of them.
    return CheckedChipProgram(program, in_order(dict.fromkeys(diagnostics)), [memory_of(s, variant) for s in chips])


def memory_of(stream: CommandStream, variant: Variant) -> ChipMemory:
    commands = tuple(
        CommandSize(command, stored_bits(command), stream.in_file[index] is not None)
        for index, command in enumerate(stream.commands)
    )
    files = tuple(file.bits for file in stream.files)
    return ChipMemory(stream.address, variant.memory_bits, stream.bits, files, commands)
