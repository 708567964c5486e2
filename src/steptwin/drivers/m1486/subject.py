"""An M1486 behind its driver, as a part of a subject (`steptwin.drivers.subject`).

A chip responds only at rest (M-28); while it moves, its values are unknown.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from steptwin.datasheet import Datasheet
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.driver import AsyncM1486
from steptwin.drivers.m1486.failures import Busy
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.subject import Action, Value
from steptwin.errors import Misuse, Refusal
from steptwin.m1486.datasheet import axis, datasheet_of
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.registers import UPLOADS
from steptwin.subject import commands as command
from steptwin.subject.events import Payload, SamplePayload, StatusPayload
from steptwin.world import script as steps

AXIS = 1
BUSY = StatusPayload("busy", "moves, waits or runs its program")
AT_REST = StatusPayload("at-rest", "is at rest")


class M1486Part:
    """Positions are in the driver's unit, from its origin; the points of the data sheet are in minimum microsteps."""

    line_kind = "m1486"

    def __init__(self, chip: AsyncM1486) -> None:
        self._chip = chip
        self.datasheet: Datasheet = replace(datasheet_of(chip.variant), axes=(axis(chip.variant, chip.unit, chip.scale_u),))
        self._paths = [*(point.path for point in self.datasheet.points), *(pin.name for pin in self.datasheet.pins)]
        self._units = {point.path.upper(): point.unit for point in self.datasheet.points}
        self._units |= {pin.name.upper(): pin.unit for pin in self.datasheet.pins}
        self._readers: dict[str, Callable[[], Awaitable[float]]] = {"COUNTER": chip.counter, "VARIABLE": chip.variable}
        self._readers |= {f"U{number}": partial(chip.byte, number) for number in UPLOADS}
        self._was_busy: bool | None = None
        self._counter: int | None = None

    @property
    def line(self) -> DriverLine[ChipRequest, bytes]:
        return self._chip.line

    @property
    def address(self) -> int | None:
        return self._chip.address

    # ------------------------------------------------------------------ points

    async def values(self, points: Sequence[str]) -> Mapping[str, Value]:
        """Counter, variable and uploads are known at rest. Levels of lines are unknown, because reading them would overwrite
        the internal variable, which a program may need."""
        for point in points:
            if point.upper() not in self._units:
                raise Misuse(f"{point!r} is not a point of an M1486: there are {', '.join(self._paths)}")
        return {point: (await self._value(point.upper()), self._units[point.upper()]) for point in points}

    async def _value(self, path: str) -> float | None:
        if path in ("MOVING", "VELOCITY"):
            return None if await self._chip.is_busy() else 0.0
        reader = self._readers.get(path)
        if reader is None:
            return None
        try:
            return float(await reader())
        except Busy:
            return None

    # ------------------------------------------------------------------ commands

    def actions(self) -> Mapping[type, Action]:
        return {
            command.Move: self._move,
            command.Jog: self._jog,
            command.StopAxes: self._stop,
            command.ControlProgram: self._program,
            steps.Send: self._send,
        }

    def _check_axis(self, axis: int | None) -> None:
        if axis not in (None, AXIS):
            raise Misuse(f"axis = {axis}: an M1486 has axis {AXIS} only")

    async def _move(self, wanted: command.Move) -> None:
        self._check_axis(wanted.axis)
        if wanted.to is not None:
            await self._chip.move_to(wanted.to)
        elif wanted.by is not None:
            await self._chip.move_by(wanted.by)

    async def _jog(self, wanted: command.Jog) -> None:
        self._check_axis(wanted.axis)
        if wanted.velocity == 0.0:
            raise Misuse("velocity = 0: the sign of the velocity is the direction; stop ends the motion")
        full_steps = abs(wanted.velocity) * self._chip.scale_u / FULL_STEP
        await self._chip.run(1 if wanted.velocity > 0.0 else -1, full_steps)

    async def _stop(self, wanted: command.StopAxes) -> None:
        self._check_axis(wanted.axis)
        await self._chip.stop()

    async def _program(self, wanted: command.ControlProgram) -> None:
        if wanted.action != "stop":
            raise Refusal(f"an M1486 has no command to {wanted.action} its program: only stop can be done")
        await self._chip.stop_program()

    async def _send(self, wanted: steps.Send) -> None:
        """Send whole commands, all checked before the first is sent; motions have commands of their own (ADR 12)."""
        *lines, rest = wanted.data.decode("latin-1").split("\r")
        if rest or not lines:
            raise Misuse("text: whole commands are sent to a device, each with CR behind it")
        for text in lines:
            self._chip.check_command(text)
        for text in lines:
            await self._chip.command(text)

    # ------------------------------------------------------------------ polling

    async def look(self, kinds: frozenset[str]) -> list[Payload]:
        busy = await self._chip.is_busy()
        found: list[Payload] = []
        if busy is not self._was_busy and self._was_busy is not None and "status" in kinds:
            found.append(BUSY if busy else AT_REST)
        self._was_busy = busy
        if busy or "sample" not in kinds:
            return found
        try:
            counter = await self._chip.counter()
        except Busy:  # it has begun to move meanwhile
            return found
        if counter != self._counter:
            self._counter = counter
            found.append(SamplePayload(str(AXIS), (counter - self._chip.origin_u) / self._chip.scale_u, self._chip.unit))
        return found
