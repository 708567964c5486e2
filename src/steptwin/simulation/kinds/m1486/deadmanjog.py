"""A dead-man jog of an M1486: a row of short moves (F or B), each of which begins when the one before it has ended.

G+ and G- are never used: nothing ends them. No move is cut short, because Kill makes the position counter wrong (M-16).
"""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.drive import speed_curve
from steptwin.m1486.microsteps import FULL_STEP, UNIT
from steptwin.m1486.present import describe_program
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand
from steptwin.m1486.variants import SLOWEST_JOG, Store
from steptwin.messages import Message, text_of
from steptwin.motion.ramps import longest_within
from steptwin.simulation.kinds.m1486.control import IS_NOT_AT_REST, IS_ON_NO_LINE, ONE_AXIS_ONLY, typed
from steptwin.simulation.script.control import Jog
from steptwin.simulation.script.deadmanjog import REST_NS, STOP_NS, Given

LINK_NS: Nanos = 100 * MILLISECOND
"""A move takes at most this, unless a single microstep takes longer."""
TYPED = 12
"""Characters that are typed for a move."""
LOOK_NS: Nanos = MILLISECOND
"""Period at which a chip that is not yet at rest is polled."""
PATIENCE_NS: Nanos = 2 * SECOND
"""A chip that is busy for so long does something else."""
WRONG_VELOCITY = Message("simulation.m1486.wrong-velocity", "velocity {velocity:g} {unit}/s, V{number}: {why}")
EEPROM_IS_NOT_JOGGED = Message(
    "simulation.m1486.eeprom-is-not-jogged", "{name}: {title} writes every command into its EEPROM, so it is not jogged"
)
LINE_IS_TOO_SLOW_TO_JOG = Message(
    "simulation.m1486.line-is-too-slow-to-jog", "{name}: a jog needs a line of at least {least} bit/s; this one has {baud} bit/s"
)


class M1486DeadManJog:
    """See `steptwin.simulation.script.deadmanjog.DeadManJog`. Raises `Misuse` for a velocity, `Refusal` for a chip that cannot be
    jogged now."""

    def __init__(self, chip: M1486Chip, line: str | None, wanted: Jog) -> None:
        name = wanted.controller
        if wanted.axis != 1:
            raise Misuse(ONE_AXIS_ONLY(controller=name, axis=wanted.axis))
        if line is None:
            raise Refusal(IS_ON_NO_LINE(controller=name))
        if chip.variant.store is Store.EEPROM:
            raise Refusal(EEPROM_IS_NOT_JOGGED(name=name, title=chip.variant.title))
        if chip.is_timed and chip.uart.baud < SLOWEST_JOG:
            raise Refusal(LINE_IS_TOO_SLOW_TO_JOG(name=name, least=SLOWEST_JOG, baud=chip.uart.baud))
        if not chip.is_idle():
            raise Refusal(IS_NOT_AT_REST(name=name, words=text_of(describe_program(chip, chip.now))))
        self.lasts_ns: Nanos = min(STOP_NS, REST_NS - TYPED * chip.uart.character_ns) - LINK_NS
        self._chip = chip
        self._line = line
        self._direction = 1 if wanted.velocity > 0.0 else -1
        self._velocity = round(abs(wanted.velocity) / (FULL_STEP * chip.variant.clock))
        why = out_of_range(ChipCommand("V", self._velocity), chip.variant)
        if why is not None:
            raise Misuse(WRONG_VELOCITY(velocity=wanted.velocity, unit=UNIT, number=self._velocity, why=text_of(why)))
        self._before = chip.drive.velocity
        self._distance_u = self._distance()
        self.over: str | None = None
        self._extended: Nanos | None = None
        self._begun: Nanos = 0
        self._target_u = 0
        self._due: Nanos | None = None

    def _distance(self) -> int:
        """Microsteps that a move with its ramps makes in the time of a link; one at least."""
        drive = self._chip.drive
        settings = drive.start_stop, drive.acceleration, drive.profile_speed, self._velocity
        curve = speed_curve(settings, drive.qualification, self._chip.variant.clock)
        return longest_within(LINK_NS, drive.grid_u, curve)

    # ------------------------------------------------------------------ as `DeadManJog`

    def extend(self, now: Nanos) -> Given:
        if self.over is not None:
            return ()
        is_first, self._extended = self._extended is None, now
        if is_first:
            return self._go(now, f"v{self._velocity}")
        return self.advance(now)

    def release(self, now: Nanos) -> Given:
        self.over = self.over or "let go"
        return self.advance(now)

    drop = release  # it has a move left that ends in time

    def cut(self) -> None:
        self.over = self.over or "stopped"

    def deadline(self) -> Nanos | None:
        return self._due

    def advance(self, now: Nanos) -> Given:
        """The next move where the one before has ended and there is time for it; else the end."""
        if self._due is None:
            return ()
        if not self._chip.is_idle():
            if now - self._begun > PATIENCE_NS:
                self.over, self._due = self.over or f"the chip {describe_program(self._chip, now)}", None
            else:
                self._due = max(self._chip.drive.deadline() or 0, now + LOOK_NS)
            return ()
        if self.over is None and self._chip.drive.true_u(now) != self._target_u:
            self.over = "stopped"
        if self.over is None and self._extended is not None and now <= self._extended + self.lasts_ns:
            return self._go(now)
        self.over, self._due = self.over or "lapsed", None
        return self._typed(f"v{self._before}")

    def _go(self, now: Nanos, *before: str) -> Given:
        self._begun, self._due = now, now + LOOK_NS
        self._target_u = self._chip.drive.true_u(now) + self._direction * self._distance_u
        return self._typed(*before, f"{'f' if self._direction > 0 else 'b'}{self._distance_u}", "r")

    def _typed(self, *texts: str) -> Given:
        return (typed(self._chip, self._line, *texts),)
