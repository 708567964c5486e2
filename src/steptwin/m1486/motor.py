"""What makes the motor move and stop: R, the seeks, K, LIMIT, jog; and what shows it: BOOST, Runsign, DIRECTION."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from steptwin.m1486.drive import SEEK_LANDING_U, Drive, Motion, WrongMove
from steptwin.m1486.effects import WrongData
from steptwin.m1486.functions import EDGE, FULLSTEP, FULLSTEPSS, LIMITOFF, RECOVER, RUNSIGN
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.pins import JOG_DIRECTION_LINE, seek_ends
from steptwin.machine import SECOND, Nanos
from steptwin.state import Stateful

if TYPE_CHECKING:
    from steptwin.m1486.chip import M1486


class Motor(Stateful):
    """The drive of a chip in the hands of its program and pins."""

    __slots__ = ("_chip", "_seek_line", "drive")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_chip"})

    def __init__(self, chip: M1486, drive: Drive) -> None:
        self._chip = chip
        self.drive = drive
        self._seek_line = 0

    def deadline(self) -> Nanos | None:
        return self.drive.deadline()

    # ------------------------------------------------------------------ commands

    def move(self) -> bool:
        """R. False if a motion is still in progress: then the command waits for its end."""
        chip, drive = self._chip, self.drive
        if self._must_wait():
            return False
        try:
            started = drive.run(chip.now)
        except WrongMove as wrong:
            raise WrongData(str(wrong)) from None
        if not started:
            return True
        if drive.motion is Motion.ENDLESS:
            self._started("moves", f"moves on in {'positive' if drive.endless > 0 else 'negative'} direction")
        else:
            duration = ((drive.profile.end or chip.now) - chip.now) / SECOND
            self._started("moves", f"moves {drive.distance_u:+d} to {drive.counter_u(chip.now)} in {duration:.6f} s")
        return True

    def seek(self, line: int, direction: int) -> bool:
        """A seek; it goes nowhere if the line has its end level already. False as for `move`."""
        chip = self._chip
        if self._must_wait():
            return False
        chip.refuse_occupied(line)
        if seek_ends(line, chip.io.levels[line]):
            return True
        try:
            self.drive.seek(direction, chip.now)
        except WrongMove as wrong:
            raise WrongData(str(wrong)) from None
        self._seek_line = line
        self._started("seeks", f"seeks B{line} in {'positive' if direction > 0 else 'negative'} direction")
        return True

    def _must_wait(self) -> bool:
        if self.drive.motion is Motion.REST:
            return False
        self._chip.program.wait_for_motion()
        return True

    def _started(self, code: str, text: str) -> None:
        chip = self._chip
        chip.event(code, text)
        chip.program.wait_for_motion()
        chip.io.set_output("BOOST", 0)
        self._show_direction()
        self.show_runsign()
        self.look_at_limit()

    def _show_direction(self) -> None:
        if self._chip.interface == STEP_DIRECTION:
            self._chip.io.set_output("DIRECTION", int(self.drive.train.direction < 0))

    def show_runsign(self) -> None:
        """Function 40."""
        chip = self._chip
        chip.io.set_runsign(int(not self.drive.is_busy) if chip.unit.on(RUNSIGN) else None)

    # ------------------------------------------------------------------ ends

    def ended(self) -> None:
        """The motion is over."""
        chip = self._chip
        was_jog = self.drive.motion is Motion.JOG
        self.drive.finish()
        if not was_jog:
            validity = "" if self.drive.is_valid else ", position not valid"
            chip.event("stands", f"stands at {self.drive.counter_u(chip.now)}{validity}")
            chip.io.set_output("BOOST", 1)
            self.show_runsign()
        chip.program.motion_ended()

    def stop_at_once(self) -> None:
        """The pulses end without a ramp: reset, shutdown."""
        if self.drive.motion is not Motion.REST:
            self.drive.stop_at_once(self._chip.now)
            self.ended()

    def _force_stop(self, why: str) -> None:
        """Down the ramp, and on to a full step by function 50."""
        chip, drive = self._chip, self.drive
        if drive.is_busy and not drive.is_stopping:
            chip.event("stops", f"stops: {why}")
            drive.force_stop(chip.now, FULL_STEP if chip.unit.on(FULLSTEP) else None)

    def kill(self) -> None:
        """K."""
        self._force_stop("Kill")
        if not self._chip.unit.on(RECOVER):
            self._chip.program.is_killed = True

    def line_changed(self, line: int, level: int) -> None:
        """A seek ends when its line says so; function 52 has it end on a multiple of four full steps."""
        chip, drive = self._chip, self.drive
        if drive.motion is Motion.SEEK and not drive.is_stopping and line == self._seek_line and seek_ends(line, level):
            drive.force_stop(chip.now, SEEK_LANDING_U if chip.unit.on(FULLSTEPSS) else None)

    # ------------------------------------------------------------------ LIMIT

    def limit_changed(self, level: int) -> None:
        chip = self._chip
        if level:
            chip.program.is_limited = False
        elif not chip.unit.on(LIMITOFF):
            self._trip()

    def look_at_limit(self) -> None:
        """LIMIT is low already: with function 43 OFF the level counts."""
        unit = self._chip.unit
        if not self._chip.io["LIMIT"] and not unit.on(LIMITOFF) and not unit.on(EDGE):
            self._trip()

    def _trip(self) -> None:
        self._force_stop("LIMIT")
        if not self._chip.unit.on(RECOVER):
            self._chip.program.is_limited = True

    # ------------------------------------------------------------------ jog

    def jog(self) -> None:
        """A falling edge of JOG: one step, unless the motor is moving."""
        chip = self._chip
        if self.drive.motion is Motion.REST:
            self.drive.jog(-1 if chip.io.levels[JOG_DIRECTION_LINE] else 1, chip.now)
            self._show_direction()
