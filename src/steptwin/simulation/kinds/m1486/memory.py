"""The program memory of an M1486 in a world: one file, in RAM or EEPROM."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from steptwin.diagnostics import SourceText
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.memory import StoredFile
from steptwin.m1486.structure import streams
from steptwin.m1486.syntax import ParsedProgram, parse
from steptwin.m1486.variants import Store
from steptwin.simulation.kinds.kind import TextContext, text_of
from steptwin.simulation.kinds.m1486.table import M1486Spec
from steptwin.simulation.kinds.programtexts import TextLanguage
from steptwin.simulation.script import steps as do

if TYPE_CHECKING:
    from steptwin.explain.model import MemoryUse

PLACE = "program"
COMMANDS = TextLanguage("m1486", ".m1486", "program", has_statements=True, is_typed=True)


def given_text(spec: M1486Spec, context: TextContext) -> SourceText | None:
    """Text that the description gives, if any."""
    return None if spec.program is None else SourceText(spec.program, text_of(context, spec.program))


def parts(chip: M1486Chip, text: str) -> Sequence[MemoryUse]:
    """In whole bytes. What stands in no file is downloaded as one."""
    from steptwin.explain.model import MemoryUse  # only on request

    program, errors = parse(text)
    stream = next((one for one in streams(program) if one.address in (None, chip.address)), None)
    if errors or stream is None:
        return []
    bits = max((file.bits for file in stream.files), default=stream.bits)
    store = "EEPROM" if chip.variant.store is Store.EEPROM else "command memory"
    return [MemoryUse(store, -(-bits // 8), chip.variant.memory_bits // 8, "bytes")]


def is_in(chip: M1486Chip, file: StoredFile | None) -> bool:
    """Whether the file that a restart begins is this one."""
    begin = chip.memory.begin
    return file is not None and begin is not None and chip.memory.holds(begin, file)


def typed_program(chip: M1486Chip, controller: str, line: str, program: ParsedProgram) -> Iterator[do.Step]:
    """An EEPROM takes its time for Reset and for each command."""
    commands = [str(command).lower() for command in program.all_commands]
    if commands[0] != "[":
        commands = ["[", *commands, "]"]
    yield from _line(chip, line, f"x{chip.address:X}\rk\r\\\r")
    yield do.Until(f"not {controller}.moving")
    yield do.Wait(chip.variant.erase_ns)
    for command in commands:
        yield from _line(chip, line, f"{command}\r")
        yield do.Wait(chip.variant.write_ns)


def _line(chip: M1486Chip, line: str, text: str) -> Iterator[do.Step]:
    yield do.Send(line, text.encode("ascii"))
    yield do.Wait(len(text) * chip.uart.character_ns)
