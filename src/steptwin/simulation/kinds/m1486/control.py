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
from steptwin.messages import Message, text_of
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


UNKNOWN_LINE_TO_SEEK = Message(
    "simulation.m1486.unknown-line-to-seek", "seek {pin!r}: permitted are B{least} to B{most}, such as '-B8'"
)


def _line_number(pin: str) -> int:
    """Of a line of the chip that can be sought. Raises `Misuse`."""
    found = _LINE.match(pin)
    if found is None or int(found[1]) not in LINES:
        raise Misuse(UNKNOWN_LINE_TO_SEEK(pin=pin, least=LINES[0], most=LINES[-1]))
    return int(found[1])


def typed(chip: M1486Chip, line: str, *texts: str) -> do.Send:
    """Commands for this chip alone: it is selected by its address. A file that a stop has ended is closed before."""
    closing = ["]"] if chip.memory.file is FileState.REFUSED else []
    return do.Send(line, "".join(f"{text}\r" for text in (f"x{chip.address:X}", *closing, *texts)).encode("ascii"))


ONE_AXIS_ONLY = Message("simulation.m1486.one-axis-only", "{machine}: no axis {axis}: an M1486 has one, 1")
IS_ON_NO_LINE = Message("simulation.m1486.is-on-no-line", "{machine} is on no line, so no commands can be sent to it")


def _typed(chip: M1486Chip, line: str | None, command: Any, *texts: str) -> do.Send:
    """Raises `Refusal` where nothing can be typed."""
    if command.axis not in (None, 1):
        raise Misuse(ONE_AXIS_ONLY(machine=command.machine, axis=command.axis))
    if line is None:
        raise Refusal(IS_ON_NO_LINE(machine=command.machine))
    return typed(chip, line, *texts)


IS_NOT_AT_REST = Message("simulation.m1486.is-not-at-rest", "{name} is not at rest ({words}): wait, or stop it")


def _refuse_busy(chip: M1486Chip, name: str) -> None:
    """What is typed now would be done at a moment, and from a place, that are not known."""
    if not chip.is_idle():
        raise Refusal(IS_NOT_AT_REST(name=name, words=text_of(program_words(chip, chip.now))))


POSITION = Message("simulation.m1486.position", "position {position:g} {unit}")
DISTANCE = Message("simulation.m1486.distance", "distance {distance:g} {unit}")
VELOCITY = Message("simulation.m1486.velocity", "velocity {velocity:g} {unit}/s, V{number:g}")
WHOLE_NUMBER_IS_NEEDED = Message("simulation.m1486.whole-number-is-needed", "{what}: a whole number is needed")
WRONG_OPERAND = Message("simulation.m1486.wrong-operand", "{what}: {why}")


def _number(chip: M1486Chip, letter: str, value: float, what: str) -> str:
    """A command with its number. Raises `Misuse` for one that it does not take."""
    if value != int(value):
        raise Misuse(WHOLE_NUMBER_IS_NEEDED(what=what))
    why = out_of_range(ChipCommand(letter, int(value)), chip.variant)
    if why is not None:
        raise Misuse(WRONG_OPERAND(what=what, why=text_of(why)))
    return f"{letter.lower()}{int(value)}"


OFF_THE_GRID = Message("simulation.m1486.off-the-grid", "{what}: no multiple of {grid}, the microstep of M{microstep}")


def _on_grid(chip: M1486Chip, distance: float, what: str) -> None:
    """Raises `Refusal` for a distance that the present microstep does not give."""
    if distance % chip.drive.grid_u:
        raise Refusal(OFF_THE_GRID(what=what, grid=chip.drive.grid_u, microstep=chip.drive.microstep))


COUNTER_SHOWS_THE_TARGET = Message(
    "simulation.m1486.counter-shows-the-target", "{machine} was stopped in a move: its counter does not show where it is (M-16)"
)


def _move(chip: M1486Chip, line: str | None, command: Move) -> do.Send:
    _refuse_busy(chip, command.machine)
    if command.to is not None:
        if not chip.drive.is_valid:
            raise Refusal(COUNTER_SHOWS_THE_TARGET(machine=command.machine))
        what = POSITION(position=command.to, unit=UNIT)
        text = "h" if command.to == 0 else _number(chip, "G", command.to, what)
        _on_grid(chip, command.to - chip.drive.counter_u(chip.now), what)
    else:
        distance = command.by or 0.0
        what = DISTANCE(distance=distance, unit=UNIT)
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
    velocity = _number(chip, "V", steps, VELOCITY(velocity=command.velocity, unit=UNIT, number=steps))
    return _typed(chip, line, command, velocity, "g+" if command.velocity > 0 else "g-", "r")


def _stop(chip: M1486Chip, line: str | None, command: StopAxes) -> Halt:
    return Halt(command.machine, command.axis)


PROGRAM_CAN_ONLY_BE_STOPPED = Message(
    "simulation.m1486.program-can-only-be-stopped",
    "{machine}: an M1486 has no command to {action} its program: only stop can be done",
)


def _program(chip: M1486Chip, line: str | None, command: ControlProgram) -> Halt:
    if command.action != "stop":
        raise Refusal(PROGRAM_CAN_ONLY_BE_STOPPED(machine=command.machine, action=command.action))
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
