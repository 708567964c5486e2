"""What a host types to command an M1486. Positions are in minimum microsteps, as in its data sheet."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from steptwin.errors import Misuse, Refusal
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.lines import LINES, SEEK_ENDS_LOW
from steptwin.m1486.memory import FileState
from steptwin.m1486.microsteps import FULL_STEP, UNIT
from steptwin.m1486.present import program_words
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand
from steptwin.machine import Nanos
from steptwin.simulation.kinds.kind import MotionEnds
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControllerCommand, ControlProgram, Halt, Jog, Move, Seek, StopAxes

_LINE = re.compile(r"B([1-9][0-9]?)\Z")


def motion_ends(axis: str, line: str | None, seek: Seek | None) -> MotionEnds:
    """What was typed has been executed, and no move was stopped before its end; a seek has come to its line."""
    name = axis.partition(".")[0]
    pending = "" if line is None else f" and {line}.idle"
    sought = ""
    if seek is not None:
        sought = f" and {name}.counter == 0 and {name}.{seek.pin} == {0 if _line_number(seek.pin) in SEEK_ENDS_LOW else 1}"
    return MotionEnds(f"not {name}.busy{pending}", f"{name}.valid{sought}")


def _line_number(pin: str) -> int:
    """Of a line of the chip that can be sought. Raises `Misuse`."""
    found = _LINE.match(pin)
    if found is None or int(found[1]) not in LINES:
        raise Misuse(f"seek {pin!r}: permitted are B{LINES[0]} to B{LINES[-1]}, such as '-B8'")
    return int(found[1])


def typed(chip: M1486Chip, line: str, *texts: str) -> do.Send:
    """Commands for this chip alone: it is selected by its address. A file that a stop has ended is closed before."""
    closing = ["]"] if chip.memory.file is FileState.REFUSED else []
    return do.Send(line, "".join(f"{text}\r" for text in (f"x{chip.address:X}", *closing, *texts)).encode("ascii"))


def _typed(chip: M1486Chip, line: str | None, command: Any, *texts: str) -> do.Send:
    """Raises `Refusal` where nothing can be typed."""
    if command.axis not in (None, 1):
        raise Misuse(f"{command.machine}: no axis {command.axis}: an M1486 has one, 1")
    if line is None:
        raise Refusal(f"{command.machine} is on no line, so no commands can be sent to it")
    return typed(chip, line, *texts)


def _refuse_busy(chip: M1486Chip, name: str) -> None:
    """What is typed now would be done at a moment, and from a place, that are not known."""
    if not chip.is_idle():
        raise Refusal(f"{name} is not at rest ({program_words(chip, chip.now)}): wait, or stop it")


def _number(chip: M1486Chip, letter: str, value: float, what: str) -> str:
    """A command with its number. Raises `Misuse` for one that it does not take."""
    if value != int(value):
        raise Misuse(f"{what}: a whole number is needed")
    why = out_of_range(ChipCommand(letter, int(value)), chip.variant)
    if why is not None:
        raise Misuse(f"{what}: {why}")
    return f"{letter.lower()}{int(value)}"


def _on_grid(chip: M1486Chip, distance: float, what: str) -> None:
    """Raises `Refusal` for a distance that the present microstep does not give."""
    if distance % chip.drive.grid_u:
        raise Refusal(f"{what}: no multiple of {chip.drive.grid_u}, the microstep of M{chip.drive.microstep}")


def _move(chip: M1486Chip, line: str | None, command: Move) -> do.Send:
    _refuse_busy(chip, command.machine)
    if command.to is not None:
        if not chip.drive.is_valid:
            raise Refusal(f"{command.machine} was stopped in a move: its counter does not show where it is (M-16)")
        what = f"position {command.to:g} {UNIT}"
        text = "h" if command.to == 0 else _number(chip, "G", command.to, what)
        _on_grid(chip, command.to - chip.drive.counter_u(chip.now), what)
    else:
        distance = command.by or 0.0
        what = f"distance {distance:g} {UNIT}"
        text = _number(chip, "F" if distance >= 0 else "B", abs(distance), what)
        _on_grid(chip, distance, what)
    return _typed(chip, line, command, text, "r")


def seek(chip: M1486Chip, line: str | None, command: Seek) -> do.Send:
    """At start/stop speed until the line has its end level; then the counter is 0."""
    _refuse_busy(chip, command.machine)
    return _typed(chip, line, command, f"{')' if command.direction > 0 else '('}{_line_number(command.pin)}", "c100")


def _jog(chip: M1486Chip, line: str | None, command: Jog) -> do.Send:
    """V is in full steps/s; a type for 24 MHz makes twice as many of them."""
    _refuse_busy(chip, command.machine)
    steps = abs(command.velocity) / (FULL_STEP * chip.variant.clock)
    velocity = _number(chip, "V", steps, f"velocity {command.velocity:g} {UNIT}/s, V{steps:g}")
    return _typed(chip, line, command, velocity, "g+" if command.velocity > 0 else "g-", "r")


def _stop(chip: M1486Chip, line: str | None, command: StopAxes) -> Halt:
    return Halt(command.machine, command.axis)


def _program(chip: M1486Chip, line: str | None, command: ControlProgram) -> Halt:
    if command.action != "stop":
        raise Refusal(f"{command.machine}: an M1486 has no command to {command.action} its program: only stop can be done")
    return Halt(command.machine, program=command.action)


def halt(chip: M1486Chip, wanted: Halt, now: Nanos) -> None:
    """Every stop ends motion and program: the memory has one row of commands, whether they were typed or belong to a program, and
    the chip has no pause."""
    chip.halt(now)


CONTROL: Mapping[type[ControllerCommand], Callable[[M1486Chip, str | None, Any], do.Send | Halt]] = {
    Move: _move,
    Jog: _jog,
    StopAxes: _stop,
    ControlProgram: _program,
}
"""It has no enable, its home is a line that is not known (`seek`), and programs begin at labels: characters go to its line."""
