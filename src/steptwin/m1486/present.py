"""The present state of an M1486, and that of its program as text."""

from __future__ import annotations

from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import (
    ProgramActivity,
    StateAxis,
    StateProgram,
    StateReader,
    StateStatus,
    StatusLevel,
)
from steptwin.datasheet import AxisDescription, Datasheet
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.datasheet import datasheet
from steptwin.m1486.details import DETAILS
from steptwin.m1486.drive import MotionMode
from steptwin.m1486.encoding import decode
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.pins import LINE_PINS
from steptwin.m1486.program import WaitReason
from steptwin.m1486.syntax import ChipCommand

_MOTIONS = {MotionMode.MOVE: "move", MotionMode.ENDLESS: "endless move", MotionMode.SEEK: "seek"}


def describe_program(chip: M1486Chip, now: Nanos) -> str:
    """The state of a chip's program as text."""
    program = chip.program
    if chip.is_shut_down:
        return "shut down"
    if program.is_killed:
        return "stopped by Kill (C75 lets it go on)"
    if program.is_limited:
        return "stopped by LIMIT"
    if program.waiting is WaitReason.MOTION:
        return f"waits for the end of the {_MOTIONS.get(chip.drive.motion, 'motion')}"
    if program.waiting is WaitReason.LINE:
        return f"waits until B{program.line} is {'high' if program.line_level else 'low'}"
    if program.in_progress(now) is not None:
        return f"waits {(program.ready - now) / SECOND:.3f} s more"
    return "has nothing to do" if program.is_at_end else "runs"


def present_command(chip: M1486Chip, now: Nanos) -> ChipCommand | None:
    """The command of the program that is in progress, or else comes next; None at the end of the memory in use."""
    place = chip.program.in_progress(now)
    if place is None and chip.program.pc == chip.memory.end:
        return None
    stored = decode(chip.memory.fetch(chip.program.pc if place is None else place))
    return None if stored is None else stored.command


def velocity(chip: M1486Chip, now: Nanos) -> float:
    """Commanded velocity in full steps per second."""
    return 0.0 if chip.drive.motion is MotionMode.REST else chip.drive.profile.velocity(now) / FULL_STEP


def _activity(chip: M1486Chip, now: Nanos) -> ProgramActivity:
    program = chip.program
    if chip.is_shut_down:
        return ProgramActivity.STOPPED
    if program.is_held:
        return ProgramActivity.PAUSED
    if program.in_progress(now) is not None:
        return ProgramActivity.WAITING
    return ProgramActivity.STOPPED if program.is_at_end else ProgramActivity.RUNNING


class M1486State(StateReader[M1486Chip]):
    """The position is the sum of the pulses so far, as the point ``position``; `details` have the counter."""

    details = DETAILS

    def datasheet(self, chip: M1486Chip) -> Datasheet:
        return datasheet(chip)

    def status(self, chip: M1486Chip, now: Nanos) -> StateStatus:
        if chip.is_shut_down or chip.program.is_held:
            return StateStatus(text=describe_program(chip, now), level=StatusLevel.WARNING)
        return StateStatus(text="ok")

    def program(self, chip: M1486Chip, now: Nanos) -> StateProgram:
        command = present_command(chip, now)
        return StateProgram(
            state=_activity(chip, now),
            text=describe_program(chip, now),
            statement=None if command is None else str(command),
            variables={},
        )

    def axis(self, chip: M1486Chip, described: AxisDescription, now: Nanos) -> StateAxis:
        """The state of the axis. Whether its drive is on is unknown: the chip does not switch it."""
        drive = chip.drive
        return StateAxis(
            number=described.number,
            name=described.name,
            unit=described.unit,
            position=float(drive.true_u(now)),
            velocity=velocity(chip, now) * FULL_STEP,
            moving=drive.motion is not MotionMode.REST,
            enabled=None,
            encoder=None,
            status=StateStatus(text=drive.motion.value),
        )

    def pins(self, chip: M1486Chip, now: Nanos) -> dict[str, float]:
        """Their levels at ``now``: those of the driver interface follow the pulses, between which the chip has nothing to do."""
        levels = dict(chip.pins())
        levels |= {name: float(chip.level(line, now)) for name, line in LINE_PINS.items() if line in chip.interface.occupied}
        return levels

    def pin(self, chip: M1486Chip, name: str, now: Nanos) -> float:
        line = LINE_PINS.get(name)
        if line is None or line not in chip.interface.occupied:
            return chip.pin(name)
        return float(chip.level(line, now))


state_of = M1486State()
