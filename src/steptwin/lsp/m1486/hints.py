"""What is written behind the commands: distances in full steps, times of moves, the memory taken."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from steptwin.errors import Misuse
from steptwin.lsp.answers import Hint
from steptwin.lsp.m1486 import texts
from steptwin.m1486.check import ChipMemory
from steptwin.m1486.drive import speed_curve
from steptwin.m1486.flow import Settings, follow
from steptwin.m1486.lines import Interface
from steptwin.m1486.microsteps import HIGHEST_SPEED
from steptwin.m1486.structure import streams
from steptwin.m1486.syntax import ParsedProgram
from steptwin.m1486.variants import Variant
from steptwin.machine import SECOND
from steptwin.motion.ramps import plan_distance

MOST_COMMANDS = 1_000
"""Of a program whose moves are timed: more than any chip holds."""


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
            if command.key == "R":
                known = {_seconds(state, variant) for state in states}
                if len(known) == 1 and (seconds := known.pop()) is not None:
                    yield Hint(
                        command.span.end, f"{seconds:.4g} s", "time of the move with the settings it is always made with here"
                    )


def _seconds(state: Settings, variant: Variant) -> float | None:
    settings = state.start_stop, state.acceleration, state.profile, state.velocity
    if None in settings or state.qualification not in HIGHEST_SPEED or state.distance is None:
        return None
    start_stop, acceleration, profile, velocity = (number or 0 for number in settings)
    try:
        curve = speed_curve((start_stop, acceleration, profile, velocity), state.qualification, variant.clock)
        plan = plan_distance(0, 0, state.distance, curve)
    except Misuse:
        return None
    return None if plan.end is None else plan.end / SECOND
