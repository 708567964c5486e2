"""Commands that a host types for an M1486, with what is refused before. Positions are in minimum microsteps."""

from __future__ import annotations

import re

from steptwin.errors import Misuse, Refusal
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.lines import LINES
from steptwin.m1486.memory import FileState
from steptwin.m1486.present import describe_program
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand
from steptwin.messages import Message, text_of
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Jog, Move, Seek

_LINE = re.compile(r"B([1-9][0-9]?)\Z")
UNKNOWN_LINE_TO_SEEK = Message(
    "simulation.m1486.unknown-line-to-seek", "seek {pin!r}: permitted are B{least} to B{most}, such as '-B8'"
)


def line_number(pin: str) -> int:
    """Number of a line of the chip that can be sought. Raises `Misuse`."""
    found = _LINE.match(pin)
    if found is None or int(found[1]) not in LINES:
        raise Misuse(UNKNOWN_LINE_TO_SEEK(pin=pin, least=LINES[0], most=LINES[-1]))
    return int(found[1])


def typed(chip: M1486Chip, line: str, *texts: str) -> do.Send:
    """Commands for this chip alone: it is selected by its address. A file that a stop has ended is closed before."""
    closing = ["]"] if chip.memory.file is FileState.REFUSED else []
    return do.Send(line, "".join(f"{text}\r" for text in (f"x{chip.address:X}", *closing, *texts)).encode("ascii"))


ONE_AXIS_ONLY = Message("simulation.m1486.one-axis-only", "{controller}: no axis {axis}: an M1486 has one, 1")
IS_ON_NO_LINE = Message("simulation.m1486.is-on-no-line", "{controller} is on no line, so no commands can be sent to it")


def typed_for(chip: M1486Chip, line: str | None, command: Move | Seek | Jog, *texts: str) -> do.Send:
    """Raises `Refusal` where nothing can be typed."""
    if command.axis != 1:
        raise Misuse(ONE_AXIS_ONLY(controller=command.controller, axis=command.axis))
    if line is None:
        raise Refusal(IS_ON_NO_LINE(controller=command.controller))
    return typed(chip, line, *texts)


IS_NOT_AT_REST = Message("simulation.m1486.is-not-at-rest", "{name} is not at rest ({words}): wait, or stop it")


def refuse_busy(chip: M1486Chip, name: str) -> None:
    """Refuse a command: what is typed now would be done at a moment, and from a place, that are not known."""
    if not chip.is_idle():
        raise Refusal(IS_NOT_AT_REST(name=name, words=text_of(describe_program(chip, chip.now))))


WHOLE_NUMBER_IS_NEEDED = Message("simulation.m1486.whole-number-is-needed", "{what}: a whole number is needed")
WRONG_OPERAND = Message("simulation.m1486.wrong-operand", "{what}: {why}")


def number(chip: M1486Chip, letter: str, value: float, what: str) -> str:
    """A command with its number. Raises `Misuse` for one that it does not take."""
    if value != int(value):
        raise Misuse(WHOLE_NUMBER_IS_NEEDED(what=what))
    why = out_of_range(ChipCommand(letter, int(value)), chip.variant)
    if why is not None:
        raise Misuse(WRONG_OPERAND(what=what, why=text_of(why)))
    return f"{letter.lower()}{int(value)}"


OFF_THE_GRID = Message("simulation.m1486.off-the-grid", "{what}: no multiple of {grid}, the microstep of M{microstep}")


def on_grid(chip: M1486Chip, distance: float, what: str) -> None:
    """Raises `Refusal` for a distance that the present microstep does not give."""
    if distance % chip.drive.grid_u:
        raise Refusal(OFF_THE_GRID(what=what, grid=chip.drive.grid_u, microstep=chip.drive.microstep))
