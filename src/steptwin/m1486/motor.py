"""Control of the motor: R, the seeks, K, LIMIT, jog; and its signals: BOOST, Runsign, DIRECTION."""

from __future__ import annotations

from typing import ClassVar, Protocol

from steptwin.controller import SECOND, Fact, Nanos
from steptwin.m1486.drive import SEEK_LANDING_U, ChipDrive, MotionMode, WrongMove
from steptwin.m1486.effects import WrongData
from steptwin.m1486.functions import EDGE, FULLSTEP, FULLSTEPSS, LIMITOFF, RECOVER, RUNSIGN
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.pins import JOG_DIRECTION_LINE, ChipPins, seek_ends
from steptwin.m1486.unit import NumericUnit, counter_text
from steptwin.messages import Message, text_of
from steptwin.state import Stateful

AXIS: Fact = "axis", 1


class MovingProgram(Protocol):
    """The program, as far as motions make it wait."""

    is_killed: bool
    is_limited: bool

    def wait_for_motion(self) -> None: ...
    def motion_ended(self) -> None: ...


class MotorHost(Protocol):
    """The interface of a chip to its motor."""

    @property
    def interface(self) -> Interface: ...
    @property
    def unit(self) -> NumericUnit: ...
    @property
    def io(self) -> ChipPins: ...
    @property
    def program(self) -> MovingProgram: ...
    def refuse_occupied(self, line: int) -> None: ...
    def event(self, code: str, text: str, now: Nanos, *facts: Fact) -> None: ...


MOVES_ON_POSITIVE = Message("m1486.moves-on-positive", "moves on in positive direction")
MOVES_ON_NEGATIVE = Message("m1486.moves-on-negative", "moves on in negative direction")
SEEKS_POSITIVE = Message("m1486.seeks-positive", "seeks B{line} in positive direction")
SEEKS_NEGATIVE = Message("m1486.seeks-negative", "seeks B{line} in negative direction")
STANDS = Message("m1486.stands", "stands at {position}")
STANDS_NOT_VALID = Message("m1486.stands-not-valid", "stands at {position}, position not valid")
STOPS = Message("m1486.stops", "stops: {why}")
MOVES = Message("m1486.moves", "moves {distance:+d} to {target} in {duration:.6f} s")


class MotorControl(Stateful):
    """Controls the drive of a chip from its program and pins."""

    FIXED: ClassVar[tuple[str, ...]] = ("_chip",)
    __slots__ = (*FIXED, "_seek_line", "drive")

    def __init__(self, chip: MotorHost, drive: ChipDrive) -> None:
        self._chip = chip
        self.drive = drive
        self._seek_line = 0

    def deadline(self) -> Nanos | None:
        return self.drive.deadline()

    # ------------------------------------------------------------------ commands

    def move(self, now: Nanos) -> bool:
        """R. False if a motion is still in progress: then the command waits for its end."""
        drive = self.drive
        if self._must_wait():
            return False
        try:
            started = drive.run(now)
        except WrongMove as wrong:
            raise WrongData(text_of(wrong)) from None
        if not started:
            return True
        if drive.motion is MotionMode.ENDLESS:
            self._started(
                "moves",
                (MOVES_ON_POSITIVE if drive.endless > 0 else MOVES_ON_NEGATIVE)(),
                now,
                ("direction", drive.endless),
            )
        else:
            duration = ((drive.profile.end or now) - now) / SECOND
            text = MOVES(distance=drive.distance_u, target=counter_text(drive.counter_u(now)), duration=duration)
            self._started("moves", text, now, ("direction", 1 if drive.distance_u > 0 else -1), ("distance", drive.distance_u))
        return True

    @property
    def sought(self) -> int | None:
        """The line whose level ends the present motion; None if that is no seek."""
        return self._seek_line if self.drive.motion is MotionMode.SEEK else None

    def seek(self, line: int, direction: int, now: Nanos) -> bool:
        """A seek; it ends at once if the line already has its end level. False as for `move`."""
        chip = self._chip
        if self._must_wait():
            return False
        chip.refuse_occupied(line)
        if seek_ends(line, chip.io.levels[line]):
            return True
        try:
            self.drive.seek(direction, now)
        except WrongMove as wrong:
            raise WrongData(text_of(wrong)) from None
        self._seek_line = line
        text = (SEEKS_POSITIVE if direction > 0 else SEEKS_NEGATIVE)(line=line)
        self._started("seeks", text, now, ("direction", direction), ("line", line))
        return True

    def _must_wait(self) -> bool:
        if self.drive.motion is MotionMode.REST:
            return False
        self._chip.program.wait_for_motion()
        return True

    def _started(self, code: str, text: str, now: Nanos, *facts: Fact) -> None:
        chip = self._chip
        chip.event(code, text, now, AXIS, *facts)
        chip.program.wait_for_motion()
        chip.io.set_output("BOOST", 0, now)
        self._show_direction(now)
        self.show_runsign(now)
        self.look_at_limit(now)

    def _show_direction(self, now: Nanos) -> None:
        if self._chip.interface == STEP_DIRECTION:
            self._chip.io.set_output("DIRECTION", int(self.drive.train.direction < 0), now)

    def show_runsign(self, now: Nanos) -> None:
        """Function 40."""
        chip = self._chip
        chip.io.set_runsign(int(not self.drive.is_busy) if chip.unit.on(RUNSIGN) else None, now)

    # ------------------------------------------------------------------ ends

    def ended(self, now: Nanos) -> None:
        """The motion is over."""
        chip = self._chip
        was_jog = self.drive.motion is MotionMode.JOG
        self.drive.finish()
        if not was_jog:
            counter = self.drive.counter_u(now)
            facts = ("counter", counter), ("is_valid", self.drive.is_valid)
            text = (STANDS if self.drive.is_valid else STANDS_NOT_VALID)(position=counter_text(counter))
            chip.event("stands", text, now, AXIS, *facts)
            chip.io.set_output("BOOST", 1, now)
            self.show_runsign(now)
        chip.program.motion_ended()

    def stop_at_once(self, now: Nanos) -> None:
        """The pulses end without a ramp: reset, shutdown."""
        if self.drive.motion is not MotionMode.REST:
            self.drive.stop_at_once(now)
            self.ended(now)

    def _force_stop(self, why: str, now: Nanos) -> None:
        """Down the ramp, and on to a full step by function 50."""
        chip, drive = self._chip, self.drive
        if drive.is_busy and not drive.is_stopping:
            chip.event("stops", STOPS(why=why), now, AXIS, ("why", why))
            drive.force_stop(now, FULL_STEP if chip.unit.on(FULLSTEP) else None)

    def kill(self, now: Nanos) -> None:
        """K."""
        self._force_stop("Kill", now)
        if not self._chip.unit.on(RECOVER):
            self._chip.program.is_killed = True

    def line_changed(self, line: int, level: int, now: Nanos) -> None:
        """A seek ends at the level of its line; with function 52 it ends on a multiple of four full steps."""
        chip, drive = self._chip, self.drive
        if drive.motion is MotionMode.SEEK and not drive.is_stopping and line == self._seek_line and seek_ends(line, level):
            drive.force_stop(now, SEEK_LANDING_U if chip.unit.on(FULLSTEPSS) else None)

    # ------------------------------------------------------------------ LIMIT

    def limit_changed(self, level: int, now: Nanos) -> None:
        chip = self._chip
        if level:
            chip.program.is_limited = False
        elif not chip.unit.on(LIMITOFF):
            self._trip(now)

    def look_at_limit(self, now: Nanos) -> None:
        """LIMIT is low already: with function 43 OFF the level counts."""
        unit = self._chip.unit
        if not self._chip.io["LIMIT"] and not unit.on(LIMITOFF) and not unit.on(EDGE):
            self._trip(now)

    def _trip(self, now: Nanos) -> None:
        self._force_stop("LIMIT", now)
        if not self._chip.unit.on(RECOVER):
            self._chip.program.is_limited = True

    # ------------------------------------------------------------------ jog

    def jog(self, now: Nanos) -> None:
        """A falling edge of JOG: one step, unless the motor is moving."""
        chip = self._chip
        if self.drive.motion is MotionMode.REST:
            self.drive.jog(-1 if chip.io.levels[JOG_DIRECTION_LINE] else 1, now)
            self._show_direction(now)
