"""Hints behind the commands: distances in full steps, times of moves, the memory taken."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from steptwin.controller import SECOND
from steptwin.explain.m1486 import move_duration
from steptwin.lsp.answers import Hint
from steptwin.lsp.m1486 import texts
from steptwin.m1486.check import ChipMemory
from steptwin.m1486.commanduse import Motion
from steptwin.m1486.flow import follow
from steptwin.m1486.lines import Interface
from steptwin.m1486.structure import streams
from steptwin.m1486.syntax import ParsedProgram
from steptwin.m1486.variants import Variant

MOST_COMMANDS = 1_000
"""Most commands of a program whose moves are timed: more than any chip holds."""


def hints(program: ParsedProgram, memory: Sequence[ChipMemory], variant: Variant, interface: Interface) -> Iterator[Hint]:
    """In no order."""
    for command in program.commands:
        steps = texts.steps_hint(command, variant)
        if steps:
            yield Hint(command.span.end, steps, "the distance in full steps")
    for chip in memory:
        yield from _memory(chip)
    if len(program.commands) <= MOST_COMMANDS:
        yield from _times(program, variant, interface)


def _memory(chip: ChipMemory) -> Iterator[Hint]:
    """At the end of each file, what it takes of the memory."""
    bits = 0
    whose = "the chip" if chip.address is None else f"chip {chip.address:X}"
    for taken in chip.commands:
        if taken.command.key == "[":
            bits = 0
        bits += taken.bits
        if taken.command.key == "]":
            yield Hint(taken.command.span.end, f"{bits} of {chip.limit} bits", f"command memory of {whose}")


def _times(program: ParsedProgram, variant: Variant, interface: Interface) -> Iterator[Hint]:
    """How long a move takes that begins with the same settings whenever it is made."""
    for stream in streams(program):
        for index, states in follow(stream, variant, interface).states.items():
            command = stream.commands[index]
            if command.use.motion is Motion.MOVE:
                known = {move_duration(state, variant) for state in states}
                if len(known) == 1 and (duration := known.pop()) is not None:
                    yield Hint(
                        command.span.end,
                        f"{duration / SECOND:.4g} s",
                        "time of the move with the settings it is always made with here",
                    )
