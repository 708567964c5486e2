"""Jogging a chip as a dead-man's switch: a row of short moves (F or B), each of which begins when the one before it has ended.

G+ and G- are never used: nothing ends them. No move is cut short, because Kill makes the position counter wrong (M-16). If the
program dies or the line is cut, the chip completes its present move and gets no further one.

No move is begun later than the hold time after the last answer of the chip that belongs to the move before: the echo of its R, or
the letter that tells its end. So a program that was suspended for longer begins none (ADR 12).
"""

from __future__ import annotations

from contextlib import suppress
from types import TracebackType
from typing import Protocol, Self

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.exchange import Overtaken, SentLate, TooLate
from steptwin.drivers.m1486.download import begin
from steptwin.drivers.m1486.motion import ChipMotion
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.drivers.m1486.unit import ChipUnit
from steptwin.drivers.m1486.waiting import wait_for
from steptwin.drivers.permission import HOLD_NS, Permission
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.unit import MASK
from steptwin.m1486.variants import SLOWEST_JOG, Store, Variant
from steptwin.messages import Message

LINK_S = 0.15
"""A move is as long as the velocity of the jog makes in this time; it lasts longer by its ramps."""
MOST_NS: Nanos = 250 * MILLISECOND
"""A move with slow ramps is shorter: its end has to be known, and the next one begun, within the hold time."""
PREPARING = 100
"""Most characters on the line until the first move begins."""
RELEASED = "released"
"""The end of a jog that was held no longer."""
NOT_HELD = f"not held within {HOLD_NS / SECOND:g} s of the last answer: the program was suspended, or the line is slow"
"""The end of a jog that was held too late."""
PATIENCE_NS: Nanos = 2 * SECOND
"""A move that lasts longer is not one of a jog: LIMIT or Kill holds the chip."""
VELOCITY_ZERO = Message("drivers.m1486.velocity-zero", "velocity = 0: the sign of the velocity is the direction")
EEPROM_IS_NOT_JOGGED = Message(
    "drivers.m1486.eeprom-is-not-jogged", "{title} writes every command into its EEPROM, so it is not jogged"
)
LINE_IS_TOO_SLOW_TO_JOG = Message(
    "drivers.m1486.line-is-too-slow-to-jog",
    "{place}: a jog needs a line of at least {least} bit/s: with {baud} bit/s the commands of "
    "the next move take longer than the {hold_s:g} s within which it has to begin",
)
JOG_IS_NOT_BEGUN = Message("drivers.m1486.jog-is-not-begun", "a jog is held inside its with block")


class JoggedChip(Protocol):
    """The part of `steptwin.drivers.m1486.driver.AsyncM1486` that a jog needs."""

    unit: str
    scale_u: float
    _unit: ChipUnit

    @property
    def variant(self) -> Variant: ...

    @property
    def settings(self) -> ChipSettings: ...

    async def configure(self, *, velocity: int | None = None) -> None: ...

    def _in_units(self, counter_u: int) -> float: ...


class AsyncM1486Jog:
    """A jog at ``velocity`` (units/s): ``async with jog: while pressed(): await jog.hold()``.

    `hold` waits for the end of the present move and begins the next one; False when the motor was stopped otherwise: see
    `end`. After the last `hold` the motor moves `reach` at most. V is that of the jog while it lasts, and is put back where it
    was known. Raises `Misuse` for a velocity that V cannot have, `Refusal` for E types, which write every command into their
    EEPROM, and for a line slower than 1200 bit/s.
    """

    def __init__(self, chip: JoggedChip, velocity: float) -> None:
        if not velocity:
            raise Misuse(VELOCITY_ZERO())
        if chip.variant.store is Store.EEPROM:
            raise Refusal(EEPROM_IS_NOT_JOGGED(title=chip.variant.title))
        self._chip = chip
        self._unit = unit = chip._unit
        if unit.talk.baud < SLOWEST_JOG:
            raise Refusal(
                LINE_IS_TOO_SLOW_TO_JOG(place=unit.place, least=SLOWEST_JOG, baud=unit.talk.baud, hold_s=HOLD_NS / SECOND)
            )
        self._direction = 1 if velocity > 0.0 else -1
        self._velocity = round(abs(velocity) * chip.scale_u / (FULL_STEP * chip.variant.clock))
        self._before = chip.settings.velocity
        self._distance_u = 0
        self._counter: int  # after the present move
        self._permission: Permission | None = None
        """For the next move: one for the whole jog."""
        self.end: str | None = None

    @property
    def reach(self) -> float:
        """The longest distance that the motor moves after the last `hold`, in the unit of the chip."""
        return self._distance_u / self._chip.scale_u

    async def __aenter__(self) -> Self:
        unit, chip = self._unit, self._chip
        # A jog begins at once or not at all.
        begun = unit.permission(HOLD_NS + 2 * unit.timeout_ns + unit.talk.wire_ns(PREPARING))
        try:
            await chip.configure(velocity=self._velocity)
            self._distance_u = self._link_u()
            async with unit.turn():
                self._counter = await unit.read_number(1)
                permission = Permission(unit.line.now, HOLD_NS, begun.is_stopped)
                if begun.has_expired():
                    raise TooLate(f"{unit.name}: jog", begun.patience_ns)
                await self._go(permission)
        except SteptwinError:
            with suppress(SteptwinError):
                await self._put_back()
            raise
        self._permission = permission
        return self

    async def _put_back(self) -> None:
        """Put V back where it was before the jog, if that was known."""
        if self._before is not None and self._chip.settings.velocity != self._before:
            await self._chip.configure(velocity=self._before)

    def _link_u(self) -> int:
        chip = self._chip
        grid_u = chip.settings.grid_u
        speed_u = self._velocity * FULL_STEP * chip.variant.clock
        longest_u = chip.settings.longest_u(MOST_NS, chip.variant, self._unit.shared.interface or STEP_DIRECTION)
        return min(round(speed_u * LINK_S / grid_u) * grid_u, longest_u)  # V16, the least, makes 2.4 steps

    async def hold(self) -> bool:
        """See the class. Raises `LineFailure`; the motor then stops by itself."""
        permission = self._permission
        if permission is None:
            raise Misuse(JOG_IS_NOT_BEGUN())
        if self.end is not None:
            return False
        async with self._unit.turn():
            if await self._unit.query_type(PATIENCE_NS) is None:
                self.end = f"the chip {self._unit.why_busy()}"
                return False
            permission.extend()  # the move has ended
            if permission.is_stopped():
                self.end = "stopped"
            elif permission.has_expired():
                self.end = NOT_HELD
            else:
                try:
                    await self._go(permission)
                except TooLate:
                    self.end = NOT_HELD
                except (Overtaken, SentLate) as failure:
                    self.end = str(failure)
        return self.end is None

    async def _go(self, permission: Permission) -> None:
        move_u = self._direction * self._distance_u
        self._counter = self._counter + move_u & MASK
        await self._unit.send(f"{'f' if move_u > 0 else 'b'}{self._distance_u}")
        duration_s = self._chip.settings.travel_s(move_u, self._chip.variant)
        await begin(self._unit, "r", ChipMotion.MOVE, permission, target_u=self._counter, duration_s=duration_s)
        permission.extend()  # the move has begun

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Wait for the end of the present move, and put V back."""
        try:
            end = await wait_for(self._unit, None, self._chip.unit, self._chip._in_units, check=False)
            self.end = self.end or (RELEASED if end.ok else str(end))
            await self._put_back()
        except SteptwinError:
            if error is None:
                raise
