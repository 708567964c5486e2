"""The program memory of an M1486 in a world: one file, in RAM or EEPROM."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from steptwin.controllerstate import ProgramActivity
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, Refusal
from steptwin.m1486.check import check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of, unpack
from steptwin.m1486.memory import StoredFile
from steptwin.m1486.present import program_words, state_of
from steptwin.m1486.structure import streams
from steptwin.m1486.syntax import ParsedProgram, parse
from steptwin.m1486.variants import Store
from steptwin.messages import Message, MessageText
from steptwin.simulation.kinds.kind import TextContext, text_of
from steptwin.simulation.kinds.m1486.build import sound
from steptwin.simulation.kinds.m1486.table import M1486Spec
from steptwin.simulation.kinds.programtexts import Destination, Downloading, ProgramText, TextLanguage
from steptwin.simulation.script import steps as do

if TYPE_CHECKING:
    from steptwin.explain.model import MemoryPart

PLACE = "program"
COMMANDS = TextLanguage("m1486", ".m1486", "program", has_statements=True, is_typed=True)
_AT_WORK = (ProgramActivity.RUNNING, ProgramActivity.WAITING)


def given_text(spec: M1486Spec, context: TextContext) -> SourceText | None:
    """What the description gives, if anything."""
    return None if spec.program is None else SourceText(spec.program, text_of(context, spec.program))


def texts(spec: M1486Spec, chip: M1486Chip, context: TextContext) -> tuple[ProgramText, ...]:
    """See `steptwin.simulation.kinds.kind.ControllerKind.texts`. Commands in a memory have no text: it is the one that was given
    or put there last. It does not run where another program has been typed since."""
    source = context.downloaded(spec.name, PLACE) or given_text(spec, context)
    is_empty = source is None
    source = source or SourceText(PLACE, "")
    checked = check(source.text, chip.variant, chip.interface)
    is_there = not is_empty and checked.is_sound and _is_in(chip, unpack(image_of(checked.program, chip.variant), chip.variant))
    is_running = is_there and state_of(chip, chip.now).program.state in _AT_WORK
    findings = checked.diagnostics
    return (
        ProgramText(
            place=PLACE,
            language=COMMANDS,
            source=source,
            check=lambda: findings,
            memory=lambda text: _memory(chip, text),
            is_empty=is_empty,
            is_running=is_running,
        ),
    )


def _memory(chip: M1486Chip, text: str) -> Sequence[MemoryPart]:
    """In whole bytes. What stands in no file is downloaded as one."""
    from steptwin.explain.model import MemoryPart  # only on request

    program, errors = parse(text)
    stream = next((one for one in streams(program) if one.address in (None, chip.address)), None)
    if errors or stream is None:
        return []
    bits = max((file.bits for file in stream.files), default=stream.bits)
    store = "EEPROM" if chip.variant.store is Store.EEPROM else "command memory"
    return [MemoryPart(store, -(-bits // 8), chip.variant.memory_bits // 8, "bytes")]


def _is_in(chip: M1486Chip, file: StoredFile | None) -> bool:
    """Whether the file that a restart begins is this one."""
    begin = chip.memory.begin
    return file is not None and begin is not None and chip.memory.holds(begin, file)


NO_COMMANDS = Message("simulation.m1486.no-commands", "{name} has no commands")
CANNOT_BE_TYPED_TO = Message("simulation.m1486.cannot-be-typed-to", "{machine} is on no line, so nothing can be typed to it")
RECEIVES_NOTHING = Message("simulation.m1486.receives-nothing", "{machine} is {words}, so it receives nothing")


def download(chip: M1486Chip, to: Destination, source: SourceText) -> Downloading:
    """See `steptwin.simulation.kinds.kind.ControllerKind.download`. A host types it: Kill, which stops with the ramp; Reset,
    which ends the program and empties the memory; the file in ``[ ]``, which runs as soon as it is there (chapter II, Memory)."""
    program = sound(source, chip.variant, chip.interface).program
    if not program.all_commands:
        raise Misuse(NO_COMMANDS(name=source.name))
    image_of(program, chip.variant)
    if to.line is None:
        raise Refusal(CANNOT_BE_TYPED_TO(machine=to.machine))
    if chip.is_shut_down:
        raise Refusal(RECEIVES_NOTHING(machine=to.machine, words=MessageText(program_words(chip, chip.now))))
    return Downloading(typed=tuple(_typed(chip, to.machine, to.line, program)))


def _typed(chip: M1486Chip, machine: str, line: str, program: ParsedProgram) -> Iterator[do.Step]:
    """An EEPROM takes its time for Reset and for each command."""
    commands = [str(command).lower() for command in program.all_commands]
    if commands[0] != "[":
        commands = ["[", *commands, "]"]
    yield from _line(chip, line, f"x{chip.address:X}\rk\r\\\r")
    yield do.Until(f"not {machine}.moving")
    yield do.Wait(chip.variant.erase_ns)
    for command in commands:
        yield from _line(chip, line, f"{command}\r")
        yield do.Wait(chip.variant.write_ns)


def _line(chip: M1486Chip, line: str, text: str) -> Iterator[do.Step]:
    yield do.Send(line, text.encode("ascii"))
    yield do.Wait(len(text) * chip.uart.character_ns)
