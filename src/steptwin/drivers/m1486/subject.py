"""An M1486 behind its driver, as a part of a subject (`steptwin.drivers.subject`).

A chip responds only at rest (M-28); while it moves, its values are unknown.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from steptwin.controllerstate import ControllerState, DetailValue, ProgramActivity, StateAxis, StateProgram, StateStatus
from steptwin.datasheet import Datasheet
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.driver import AsyncM1486, ChipStatus
from steptwin.drivers.m1486.failures import Busy
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.sharedstate import FUNCTION_BYTES
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.subject import DeviceAction, RawEffect, ValueAndUnit
from steptwin.errors import Misuse, Refusal
from steptwin.m1486.datasheet import axis, datasheet_of
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.registers import UPLOADS
from steptwin.messages import Message
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.devicetwin import DeviceTwin
from steptwin.subject.payloads import Payload, SamplePayload, StatusPayload

_SELECTION = re.compile(rb"\s*[Xx]\s*([0-9A-Fa-f])\s*\r")
AXIS = 1
COUNTER = (1, 2, 3)
"""The bytes of the position counter, by the numbers of ``U``."""
FORMAT = "steptwin M1486 settings 1"
IS_ACTIVE = Message("drivers.m1486.is-active", "moves, waits or runs its program")
RESTS = Message("drivers.m1486.rests", "is at rest")
BUSY = StatusPayload("busy", IS_ACTIVE())
AT_REST = StatusPayload("at-rest", RESTS())
NO_TWIN = Message("drivers.no-twin-of-m1486", "no twin beside an M1486, whose position is unknown while it moves (M-28)")
UNKNOWN_POINT = Message("drivers.m1486.unknown-point", "{point!r} is not a point of an M1486: there are {names}")
ONE_AXIS_ONLY = Message("drivers.m1486.one-axis-only", "axis = {axis}: an M1486 has axis {only} only")
VELOCITY_ZERO_TO_RUN = Message(
    "drivers.m1486.velocity-zero-to-run", "velocity = 0: the sign of the velocity is the direction; stop ends the motion"
)
PROGRAM_CAN_ONLY_BE_STOPPED = Message(
    "drivers.m1486.program-can-only-be-stopped", "an M1486 has no command to {action} its program: only stop can be done"
)
ONLY_CHIP = Message("drivers.m1486.only-chip", "the only chip of its line")
OWN_CHIP = Message("drivers.m1486.own-chip", "chip {address:X}")
OTHER_CHIP_IS_SELECTED = Message(
    "drivers.m1486.other-chip-is-selected", "text: X{selected:X} selects another chip: this device is {own}"
)
NO_WHOLE_COMMANDS = Message(
    "drivers.m1486.no-whole-commands", "text: whole commands are sent to a device, each with CR behind it"
)


class M1486Part:
    """Positions are in the driver's unit, from its origin; the points of the data sheet are in minimum microsteps."""

    line_kind = "m1486"
    no_twin = NO_TWIN()

    def __init__(self, chip: AsyncM1486) -> None:
        self._chip = chip
        self.datasheet: Datasheet = replace(datasheet_of(chip.variant), axes=(axis(chip.variant, chip.unit, chip.scale_u),))
        self._paths = [*(point.path for point in self.datasheet.points), *(pin.name for pin in self.datasheet.pins)]
        self._units = {point.path.upper(): point.unit for point in self.datasheet.points}
        self._units |= {pin.name.upper(): pin.unit for pin in self.datasheet.pins}
        self._bytes = {"COUNTER": COUNTER, "VARIABLE": (4, 5, 6)} | {f"U{number}": (number,) for number in UPLOADS}
        self._was_busy: bool | None = None
        self._shown: SamplePayload | None = None

    @property
    def line(self) -> DriverLine[ChipRequest, bytes]:
        return self._chip.line

    @property
    def address(self) -> int | None:
        return self._chip.address

    answers_in_motion = False

    async def reconnect(self) -> None:
        await self._is_busy()

    async def _is_busy(self) -> bool:
        """Whether it moves, waits or runs its program. A chip at rest stays so until something is sent to it: then it only has to
        echo, which takes no command memory."""
        unit = self._chip._unit
        async with unit.turn():
            if unit.shared.is_at_rest:
                await unit.greet()
                return not unit.shared.is_at_rest
            if not unit.talk.owes(unit.address) and not unit.has_room_for_questions(1):
                return True
            return await unit.query_type() is None

    async def _read(self, numbers: Sequence[int]) -> int | None:
        """Bytes as a number; each is read once after a command, and none for which a program would be overwritten."""
        unit = self._chip._unit
        async with unit.turn():
            if not (unit.shared.readings.keys() >= set(numbers) or unit.has_room_for_questions(2 * len(numbers) + 1)):
                return None
            return int.from_bytes(bytes(await unit.reading(*numbers)), "little")

    # ------------------------------------------------------------------ points

    async def values(self, points: Sequence[str]) -> Mapping[str, ValueAndUnit]:
        """Counter, variable and uploads are known at rest: they are read once after each command. Levels of lines are unknown,
        because reading them would overwrite the internal variable, which a program may need."""
        units = {point: self.unit_of(point) for point in points}
        if await self._is_busy():  # asked once: it does not answer any of them
            return {point: (None, unit) for point, unit in units.items()}
        return {point: (await self._value(point.upper()), unit) for point, unit in units.items()}

    def unit_of(self, point: str) -> str:
        unit = self._units.get(point.upper())
        if unit is None:
            raise Misuse(UNKNOWN_POINT(point=point, names=list(self._paths)))
        return unit

    async def _value(self, path: str) -> float | None:
        """At rest."""
        if path in ("MOVING", "VELOCITY"):
            return 0.0
        numbers = self._bytes.get(path)
        if numbers is None:
            return None
        try:
            found = await self._read(numbers)
        except Busy:
            return None
        return None if found is None else float(found)

    async def state(self) -> ControllerState:
        """While it moves, waits or runs its program, only that is known."""
        sheet = self.datasheet
        status = None if await self._is_busy() else self._chip.known()
        words = AT_REST.words if status is not None else BUSY.words
        (described,) = sheet.axes
        present = StateAxis(
            number=described.number,
            name=described.name,
            unit=described.unit,
            position=None if status is None or not status.is_position_valid else status.position,
            velocity=None if status is None else 0.0,
            moving=None if status is None else False,
            enabled=None,
            encoder=None,
            status=StateStatus(text=words),
        )
        return ControllerState(
            kind=sheet.kind,
            variant=sheet.variant,
            time_s=None,
            status=StateStatus(text=words),
            program=StateProgram(state=None if status is None else ProgramActivity.STOPPED, text=words, variables={}),
            axes=(present,),
            pins={pin.name: None for pin in sheet.pins},
            details=dict.fromkeys((detail.name for detail in sheet.details), None) | _details(status),
        )

    # ------------------------------------------------------------------ commands

    def selected(self, data: bytes) -> int | None:
        found = _SELECTION.match(data)
        return None if found is None else int(found[1], 16)

    def effect_of(self, wanted: steps.Request | steps.Write) -> RawEffect:
        """It takes none."""
        return RawEffect.WRITE

    def ended_by(self, wanted: steps.Request | steps.Write) -> frozenset[int]:
        """It takes none."""
        return frozenset()

    async def ignoring(self, request: steps.Request) -> frozenset[int]:
        """It takes none."""
        return frozenset()

    def actions(self) -> Mapping[type, DeviceAction]:
        return {
            command.Move: self._move,
            command.Jog: self._jog,
            command.StopAxes: self._stop,
            command.StopAll: lambda _: self._chip.stop_program(),
            command.ControlProgram: self._program,
            steps.Send: self._send,
        }

    def _check_axis(self, axis: int | None) -> None:
        if axis not in (None, AXIS):
            raise Misuse(ONE_AXIS_ONLY(axis=axis, only=AXIS))

    async def _move(self, wanted: command.Move) -> None:
        self._check_axis(wanted.axis)
        if wanted.to is not None:
            await self._chip.move_to(wanted.to)
        elif wanted.by is not None:
            await self._chip.move_by(wanted.by)

    async def _jog(self, wanted: command.Jog) -> None:
        self._check_axis(wanted.axis)
        if wanted.velocity == 0.0:
            raise Misuse(VELOCITY_ZERO_TO_RUN())
        full_steps = abs(wanted.velocity) * self._chip.scale_u / FULL_STEP
        await self._chip.run(1 if wanted.velocity > 0.0 else -1, full_steps)

    async def _stop(self, wanted: command.StopAxes) -> object:
        self._check_axis(wanted.axis)
        return {"program": ProgramActivity.STOPPED.value if await self._chip.stop() else None}

    async def _program(self, wanted: command.ControlProgram) -> None:
        if wanted.action != "stop":
            raise Refusal(PROGRAM_CAN_ONLY_BE_STOPPED(action=wanted.action))
        await self._chip.stop_program()

    async def _send(self, wanted: steps.Send) -> None:
        """Send whole commands, all checked before the first is sent; motions have commands of their own (ADR 12). The driver
        selects the chip: ``X`` with its address may come first. Raises `Misuse`, also for that of another chip."""
        selected = self.selected(wanted.data)
        if selected not in (None, self.address):
            own = ONLY_CHIP() if self.address is None else OWN_CHIP(address=self.address)
            raise Misuse(OTHER_CHIP_IS_SELECTED(selected=selected, own=own))
        found = _SELECTION.match(wanted.data)
        *lines, rest = wanted.data[0 if found is None else found.end() :].decode("latin-1").split("\r")
        if rest or not lines:
            raise Misuse(NO_WHOLE_COMMANDS())
        await self._chip.commands(lines)

    # ------------------------------------------------------------------ polling

    async def look(self, kinds: frozenset[str]) -> list[Payload]:
        """While a chip is busy, its position is not known; nor is it after a motion that was stopped."""
        busy = await self._is_busy()
        found: list[Payload] = []
        if busy is not self._was_busy and self._was_busy is not None and "status" in kinds:
            found.append(BUSY if busy else AT_REST)
        self._was_busy = busy
        if "sample" in kinds:
            sample = await self._sample(busy=busy)
            if sample != self._shown:
                self._shown = sample
                found.append(sample)
        return found

    async def _sample(self, *, busy: bool) -> SamplePayload:
        if busy:
            return self.unknown()[0]
        position = None
        if self._chip.known().is_position_valid:
            try:
                await self._read(COUNTER)
            except Busy:  # it has begun to move meanwhile
                return self.unknown()[0]
            position = self._chip.known().position
        return SamplePayload(str(AXIS), position, self._chip.unit, 0.0)

    def unknown(self) -> list[SamplePayload]:
        return [SamplePayload(str(AXIS), None, self._chip.unit)]

    def forget(self) -> None:
        self._was_busy = self._shown = None

    # ------------------------------------------------------------------ what faces need besides

    def dead_man_jog(self, wanted: command.Jog) -> AsyncM1486Jog:
        self._check_axis(wanted.axis)
        return self._chip.jog(wanted.velocity)

    def configuration(self) -> None:
        """It has none."""

    async def twin(self, name: str) -> DeviceTwin:
        raise Refusal(self.no_twin)

    async def settings_text(self) -> str:
        """Known settings of the chip. S, A, V and others cannot be read, so only those are known that this driver has made."""
        if not await self._is_busy():
            for numbers in (COUNTER, (4, 5, 6), (14,), (15,), (16,), FUNCTION_BYTES):
                await self._read(numbers)
        status = asdict(self._chip.known())
        return json.dumps({"format": FORMAT, **status, "settings": asdict(self._chip.settings)}, indent=2)


def _details(status: ChipStatus | None) -> dict[str, DetailValue]:
    """Details that the uploads show."""
    if status is None:
        return {}
    return {
        "counter": status.counter_u,
        "counter_valid": status.is_position_valid,
        "variable": status.variable,
        "flags_on": _on(status.flags),
        "functions_on": _on(status.functions),
    }


def _on(states: Mapping[int, bool] | None) -> tuple[int, ...] | None:
    return None if states is None else tuple(number for number, on in states.items() if on)
