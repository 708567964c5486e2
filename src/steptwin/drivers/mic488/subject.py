"""A MIC488 behind its driver, as a part of a subject (`steptwin.drivers.subject`)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from steptwin.controllerstate import ControllerState, DetailValue, StateAxis, StateProgram, StateStatus
from steptwin.datasheet import AxisDescription, Datasheet
from steptwin.diagnostics import SourceText
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488.driver import ALL_AXES, AsyncMic488, Mic488Status
from steptwin.drivers.mic488.failures import ModbusRefusal, NotReady
from steptwin.drivers.mic488.jog import AsyncMic488Jog
from steptwin.drivers.mic488.motion import MOVING, status_text
from steptwin.drivers.mic488.program import ProgramState
from steptwin.drivers.mic488.snapshot import COUNTERS
from steptwin.drivers.modbus import ModbusQuery
from steptwin.drivers.subject import DeviceAction, RawEffect, ValueAndUnit
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.inputfiles import read_bytes
from steptwin.messages import Message, text_of
from steptwin.mic488.datasheet import datasheet_of
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.points import item_of
from steptwin.mic488.present import ACTIVITIES, axis_status, controller_status
from steptwin.mic488.registermap import DataType, Register, Space
from steptwin.mic488.registers import CONTROLLER_STATUS_TEXTS, register_map
from steptwin.mic488.status import AxisStatus
from steptwin.mic488.values import halted, named
from steptwin.nearmiss import NearMiss
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.devicetwin import DeviceTwin
from steptwin.subject.payloads import EdgePayload, Payload, SamplePayload, StatusPayload
from steptwin.wire import pdu

LINE, CONFIG = "line", "device.cfg"
"""Names in the world of a twin."""
MOST_NAMED = 9
"""Most points listed in a message."""
NO_CONFIGURATION = Message(
    "drivers.no-configuration", "a twin needs the configuration of the controller: connect it with config=FILE"
)
UNKNOWN_POINT = Message(
    "drivers.mic488.unknown-point", "no point {path!r}{hint}; there are {names} and more, {count} in all, and pins"
)
OTHER_UNIT = Message("drivers.mic488.other-unit", "unit = {unit}: this subject is the device with address {address}")
WRONG_PDU = Message("drivers.mic488.wrong-pdu", "pdu = {pdu}: {problem}")
ITS_PROGRAM = Message("drivers.mic488.its-program", "its program")
TWIN_NEEDS_REST = Message("drivers.mic488.twin-needs-rest", "{place}: a twin can be made at rest: {names} runs")


ANOTHER_CONTROLLER = Message(
    "drivers.mic488.another-controller", "another controller is there: firmware {firmware} instead of {before}"
)


class Mic488Part:
    """Positions are in configured units if the driver knows them; else pulses per unit are unknown."""

    line_kind = "modbus"

    def __init__(self, mic: AsyncMic488, config_file: str | None = None) -> None:
        self._mic = mic
        self._config_file = config_file
        self._registers = register_map(mic.firmware)
        scales = tuple((mic.axis(n).unit, mic.axis(n).gear) for n in ALL_AXES)
        self.datasheet: Datasheet = datasheet_of(mic.firmware, scales)
        self._points = {point.path.upper(): point for point in self.datasheet.points}
        self._pins = {pin.name: pin for pin in self.datasheet.pins}
        self._from_status = _from_status()
        self._last: Mic488Status | None = None
        self._shown: dict[int, SamplePayload] = {}

    @property
    def line(self) -> DriverLine[ModbusQuery, bytes]:
        return self._mic.line

    @property
    def address(self) -> int:
        return self._mic.unit

    answers_in_motion = True

    async def reconnect(self) -> None:
        before = self._mic.firmware
        await self._mic.find_firmware()
        if self._mic.firmware != before:
            raise NotReady(self.line.place, ANOTHER_CONTROLLER(firmware=self._mic.firmware, before=before))

    # ------------------------------------------------------------------ points

    async def values(self, points: Sequence[str]) -> Mapping[str, ValueAndUnit]:
        """The values of the data sheet that a register shows; the others are unknown."""
        derived = {point: self._from_status.get(point.upper()) for point in points}
        registers = {point: self._register(point) if how is None else how.register for point, how in derived.items()}
        names = tuple(dict.fromkeys(name for name in registers.values() if name is not None))
        shown = await self._mic.get_shown(*names) if names else {}
        found: dict[str, ValueAndUnit] = {}
        for point, name in registers.items():
            how = derived[point]
            if name is None or how is not None:
                value = None if name is None or how is None else float(how.holds(int(shown[name][0])))
                found[point] = value, self._unit(point)
            else:
                found[point] = float(shown[name][0]), shown[name][1]
        return found

    def _register(self, path: str) -> str | None:
        """The name of the register that shows a point, None without one. Raises `Misuse` for an unknown point."""
        item = item_of(self._registers, path)
        if item is not None:
            return item.name if item.register.reads else None
        point = self._points.get(path.upper())
        if point is not None and point.addresses:
            address = point.addresses[0]
            return self._registers.at(Space(address.space), int(address.place)).name
        if point is None and path.upper() not in self._pins:
            known = [each.path for each in self.datasheet.points]
            raise Misuse(
                UNKNOWN_POINT(
                    path=path, hint=NearMiss().hint(path, (*known, *self._pins)), names=known[:MOST_NAMED], count=len(known)
                )
            )
        return None

    def unit_of(self, point: str) -> str:
        register = self._register(point)
        item = None if register is None else named(self._registers, register)
        return self._unit(point) if item is None else item.register.unit(DataType.REAL, self._unit_name(item.register))

    def _unit_name(self, register: Register) -> str:
        return self._mic.axis(register.axis).unit if register.axis else "u"

    def _unit(self, path: str) -> str:
        found = self._points.get(path.upper()) or self._pins.get(path.upper())
        return "" if found is None else found.unit

    async def state(self) -> ControllerState:
        """The statement and variables of a program are unknown."""
        status, sheet = await self._mic.status(), self.datasheet
        pins = [pin.name for pin in sheet.pins]
        details = [name for name in _DETAILS.values() if item_of(self._registers, name) is not None]
        shown = await self.values((*pins, *(f"{axis.name}.encoder" for axis in sheet.axes), *details))
        known = {point: value for point, (value, _) in shown.items()}
        activity = ACTIVITIES.get(status.program)
        return ControllerState(
            kind=sheet.kind,
            variant=sheet.variant,
            time_s=None,
            status=StateStatus(text="unknown") if status.controller is None else controller_status(status.controller),
            program=StateProgram(
                state=activity, text=f"unknown state {status.program}" if activity is None else activity.value, variables={}
            ),
            axes=tuple(_axis(axis, status, known[f"{axis.name}.encoder"]) for axis in sheet.axes),
            pins={pin: known[pin] for pin in pins},
            details={detail.name: self._detail(known, _DETAILS.get(detail.name, "")) for detail in sheet.details},
        )

    def _detail(self, known: Mapping[str, float | None], name: str) -> DetailValue:
        """The value of a register as the state has it: a word where its values have words."""
        value = known.get(name)
        return None if value is None else self._registers.of(name).values.get(int(value), int(value))

    # ------------------------------------------------------------------ commands

    def actions(self) -> Mapping[type, DeviceAction]:
        return {
            command.Enable: self._enable,
            command.Move: self._move,
            command.Home: self._home,
            command.Jog: self._jog,
            command.StopAxes: self._stop,
            command.StopAll: lambda _: self._mic.halt(),
            command.ControlProgram: self._program,
            command.Encoders: self._encoders,
            steps.Write: self._write,
            steps.Request: self._request,
        }

    async def _enable(self, wanted: command.Enable) -> None:
        axis = self._mic.axis(wanted.axis)
        await (axis.enable() if wanted.on else axis.disable())

    async def _move(self, wanted: command.Move) -> None:
        axis = self._mic.axis(wanted.axis)
        if wanted.to is not None:
            await axis.move_to(wanted.to)
        elif wanted.by is not None:
            await axis.move_by(wanted.by)

    async def _home(self, wanted: command.Home) -> None:
        await self._mic.axis(wanted.axis).home(wanted.velocity)

    async def _jog(self, wanted: command.Jog) -> None:
        await self._mic.axis(wanted.axis).move_velocity(wanted.velocity)

    async def _stop(self, wanted: command.StopAxes) -> object:
        await (self._mic.stop_all() if wanted.axis is None else self._mic.axis(wanted.axis).stop())
        try:
            program = ACTIVITIES.get(await self._mic.program.state())
        except LineFailure:  # the stop itself was confirmed
            program = None
        return {"program": program and program.value}

    async def _program(self, wanted: command.ControlProgram) -> None:
        program = self._mic.program
        await {"start": program.start, "pause": program.pause, "stop": program.stop}[wanted.action]()

    async def _encoders(self, _: command.Encoders) -> object:
        return [{"axis": n, "counts": await self._mic.axis(n).encoder(), "turned_by": None} for n in ALL_AXES]

    async def _write(self, wanted: steps.Write) -> None:
        """Write registers one after the other."""
        await self._mic.set_all(*((name, value) for _, name, value in wanted.values), is_sure=True)

    def selected(self, data: bytes) -> None:
        """It takes no characters."""

    def effect_of(self, wanted: steps.Request | steps.Write) -> RawEffect:
        if isinstance(wanted, steps.Request) and wanted.pdu and wanted.pdu[0] in pdu.READS:
            return RawEffect.LOOK
        return RawEffect.STOP if self.ended_by(wanted) else RawEffect.WRITE

    def ended_by(self, wanted: steps.Request | steps.Write) -> frozenset[int]:
        if isinstance(wanted, steps.Write):
            each = [self._mic.ended_by(name, value) for _, name, value in wanted.values]
            return frozenset().union(*each) if all(each) else frozenset()
        try:
            return frozenset(halted(self._registers, pdu.decode_request(wanted.pdu)))
        except pdu.ModbusException:
            return frozenset()

    async def ignoring(self, request: steps.Request) -> frozenset[int]:
        try:
            return await self._mic.ignoring(pdu.decode_request(request.pdu))
        except pdu.ModbusException:
            return frozenset()

    async def _request(self, wanted: steps.Request) -> object:
        if wanted.unit != self.address:
            raise Misuse(OTHER_UNIT(unit=wanted.unit, address=self.address))
        try:
            request = pdu.decode_request(wanted.pdu)
        except pdu.ModbusException as error:
            raise Misuse(WRONG_PDU(pdu=wanted.pdu.hex(), problem=text_of(error.detail or error))) from None
        try:
            answer = await self._mic.request(request)
            return {"pdu": pdu.encode_response(answer).hex()}
        except ModbusRefusal as refused:
            return {"pdu": pdu.exception_pdu(wanted.pdu[0], refused.code).hex()}

    # ------------------------------------------------------------------ polling

    async def look(self, kinds: frozenset[str]) -> list[Payload]:
        status = await self._mic.status()
        before, self._last = self._last, status
        found: list[Payload] = []
        if "sample" in kinds:
            for axis, position in zip(ALL_AXES, status.positions, strict=True):
                sample = SamplePayload(str(axis), position, status.units[axis - 1], status.velocities[axis - 1])
                if sample != self._shown.get(axis):  # looks before may have been for other kinds
                    self._shown[axis] = sample
                    found.append(sample)
        if before is None:
            return found
        return found + [payload for payload in (*_edges(before, status), *_changes(before, status)) if payload.kind in kinds]

    def unknown(self) -> list[SamplePayload]:
        return [SamplePayload(str(axis), None, self._mic.axis(axis).unit) for axis in ALL_AXES]

    def forget(self) -> None:
        self._last = None
        self._shown.clear()

    # ------------------------------------------------------------------ what faces need besides

    def dead_man_jog(self, wanted: command.Jog) -> AsyncMic488Jog:
        return self._mic.axis(wanted.axis).jog(wanted.velocity)

    async def settings_text(self) -> str:
        """A snapshot, which `AsyncMic488.restore_snapshot` writes back."""
        return (await self._mic.take_snapshot()).to_json()

    def configuration(self) -> SourceText | None:
        if self._config_file is None:
            return None
        return IniFile.parse(read_bytes(Path(self._config_file)), Path(self._config_file).name).source

    @property
    def no_twin(self) -> str:
        return NO_CONFIGURATION() if self._config_file is None else ""

    async def twin(self, name: str) -> DeviceTwin:
        """With its registers, positions and drives. Programs cannot be read; pulses per unit are in no register (MIC-27)."""
        if self._config_file is None:
            raise Refusal(NO_CONFIGURATION())
        status = await self._mic.status()
        moving = [f"M{axis}" for axis, code in zip(ALL_AXES, status.axes, strict=True) if code in MOVING]
        if moving or status.program:
            raise Refusal(TWIN_NEEDS_REST(place=self.line.place, names=moving or ITS_PROGRAM()))
        snapshot = await self._mic.take_snapshot()
        shown = await self._mic.get_shown(*snapshot.values)
        # Values mean something only with the DATA_TYPE they were read with.
        names = sorted(shown, key=lambda register: register != "DATA_TYPE")
        user = [(f"USER_REGISTER[{number}]", float(word)) for number, word in enumerate(snapshot.user) if word]
        kinds = {register: self._registers.named(register).key for register in names}
        enabled = [axis for axis, code in zip(ALL_AXES, status.axes, strict=True) if code != AxisStatus.OFF]
        head = {"name": name, "line": LINE, "unit": self.address, "firmware": self._mic.firmware, "config": CONFIG}
        table = "\n".join(f"{key} = {json.dumps(value)}" for key, value in head.items())
        return DeviceTwin(
            f'[world]\nname = "twin"\n[[line]]\nname = "{LINE}"\nkind = "modbus"\n[[mic488]]\n{table}\n',
            {CONFIG: read_bytes(Path(self._config_file))},
            LINE,
            [*((register, float(shown[register][0])) for register in names), *user],
            enabled,
            [register for register in names if kinds[register] not in COUNTERS],
        )


class _FromStatus(NamedTuple):
    """A point that Mx_STATUS shows: its own register, if it has one, can only be written."""

    register: str
    holds: Callable[[int], bool]


def _from_status() -> Mapping[str, _FromStatus]:
    """By the upper-case path."""
    found: dict[str, _FromStatus] = {}
    for axis in ALL_AXES:
        name = f"M{axis}_STATUS"
        enabled = _FromStatus(name, _is_on)
        found |= {f"M{axis}.ENABLED": enabled, f"M{axis}_EN": enabled, f"M{axis}.MOVING": _FromStatus(name, MOVING.__contains__)}
    return found


def _is_on(status: int) -> bool:
    return status != AxisStatus.OFF


_DETAILS = {
    "data_type": "DATA_TYPE",
    "axis_control_mode": "AXIS_CTR_MODE",
    "program_bank": "PROG_BANK_SEL",
    "position_bank": "POS_BANK_SEL",
}
"""Registers from which the ``details`` of a state are read; there are too many user registers."""


def _axis(axis: AxisDescription, status: Mic488Status, encoder: float | None) -> StateAxis:
    index = axis.number - 1
    code = status.axes[index]
    return StateAxis(
        number=axis.number,
        name=axis.name,
        unit=status.units[index],
        position=status.positions[index],
        velocity=status.velocities[index],
        moving=code in MOVING,
        enabled=_is_on(code),
        encoder=None if encoder is None else round(encoder),
        status=axis_status(code),
    )


def _edges(before: Mic488Status, status: Mic488Status) -> list[Payload]:
    levels = (("IN", before.inputs, status.inputs), ("OUT", before.outputs, status.outputs))
    drives: list[Payload] = [
        EdgePayload(f"M{axis}_EN", float(_is_on(new)))
        for axis, (old, new) in enumerate(zip(before.axes, status.axes, strict=True), start=1)
        if _is_on(old) is not _is_on(new)
    ]
    return drives + [
        EdgePayload(f"{name}{number}", float(new))
        for name, olds, news in levels
        for number, (old, new) in enumerate(zip(olds, news, strict=True), start=1)
        if old != new
    ]


AXIS_STATUS = Message("drivers.mic488.axis-status", "M{axis}: {status}")
CONTROLLER_STATUS = Message("drivers.mic488.controller-status", "controller: {status}")
PROGRAM_STATE = Message("drivers.mic488.program-state", "program: {state}")


def _changes(before: Mic488Status, status: Mic488Status) -> list[Payload]:
    """Changes of the registers that show the state of the controller."""
    found: list[Payload] = [
        StatusPayload("axis-status", AXIS_STATUS(axis=axis, status=text_of(status_text(new))), (("axis", axis), ("status", new)))
        for axis, (old, new) in enumerate(zip(before.axes, status.axes, strict=True), start=1)
        if old != new
    ]
    if status.controller != before.controller and status.controller is not None:
        text = CONTROLLER_STATUS_TEXTS.get(status.controller, f"unknown status {status.controller}")
        found.append(
            StatusPayload("controller-status", CONTROLLER_STATUS(status=text_of(text)), (("status", status.controller),))
        )
    if status.program != before.program:
        known = {state.value: state.name.lower() for state in ProgramState}
        text = known.get(status.program, f"unknown state {status.program}")
        found.append(StatusPayload("program-state", PROGRAM_STATE(state=text_of(text)), (("state", status.program),)))
    return found
