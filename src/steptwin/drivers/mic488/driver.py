"""The driver of the MIC488 for asyncio. `steptwin.drivers.mic488.sync` is the one for threads."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from steptwin.controller import SECOND
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488 import identify, snapshot
from steptwin.drivers.mic488.axis import AsyncMic488Axis
from steptwin.drivers.mic488.failures import Unconfirmed
from steptwin.drivers.mic488.group import trigger
from steptwin.drivers.mic488.lines import AsyncModbusLine
from steptwin.drivers.mic488.motion import MotionKind, MoveEnd
from steptwin.drivers.mic488.program import AsyncMic488Program
from steptwin.drivers.mic488.unit import ALL_AXES, Unit, axis_mask, check_axis
from steptwin.drivers.mic488.user import AsyncUserRegisters
from steptwin.drivers.mic488.waiting import wait_for
from steptwin.drivers.modbus import ModbusQuery, check_unit, words
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse
from steptwin.inputfiles import read_bytes
from steptwin.messages import Message
from steptwin.mic488.config import ControllerConfig, read_config
from steptwin.mic488.describe import AxisScale
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.registermap import DataType, WriteEffect
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, INPUTS, OUTPUTS, register_map
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.mic488.values import PROGRAM, RegisterItem, RegisterValue, given_motions, halted, named, starts_program
from steptwin.wire import pdu

TIMEOUT_S = 0.3
TRIES = 3
_CHANGES = frozenset({"VEL_ABS", "VEL_REL", "POS_REL"})
"""Registers by which a value of 0 moves nothing."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Mic488Status:
    """The state of a controller. ``units``: units of the axes; ``imp`` (pulses) if DATA_TYPE is DINT and GEAR is unknown."""

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    units: tuple[str, ...]
    axes: tuple[int, ...]
    """M1_STATUS … M4_STATUS."""
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    controller: int | None
    """M_STATUS, None where the firmware has none."""
    program: int
    """PROGRAM_CTRL: 0 stopped, 1 running, 2 paused."""


def load_config(path: str | Path, firmware: str = DEFAULT_FIRMWARE) -> ControllerConfig:
    """The configuration in a ``.cfg`` file of the vendor's tool. Raises `Misuse` with all its errors."""
    return read_config(IniFile.parse(read_bytes(Path(path)), str(path)), firmware)


NO_OUTPUT = Message("drivers.mic488.no-output", "no output {number}: outputs are 1 to {most}")
STARTED_AGAIN = Message("drivers.mic488.started-again", "the program was paused, but runs: another master has started it again")
CAN_ONLY_BE_READ = Message("drivers.mic488.can-only-be-read", "{name} can only be read")


class AsyncMic488:
    """A MIC488 at an address (``/dev/ttyUSB0``, ``tcp://host:5020``, ``rtu-tcp://host:5021``) or on a line shared with others.

    ``firmware``: determined when not given. ``config``: the vendor tool's ``.cfg`` or its contents; without it units have no
    names and pulses are unknown, unless ``scales`` has the unit of each axis and its pulses per unit. ``observe``: DATA_TYPE is
    left as it is, so that opening changes nothing; else it is set to REAL. Motions work with both. ``log`` gets every frame in
    words. Nothing is sent before `open` (or ``async with``).
    """

    def __init__(
        self,
        where: str | DriverLine[ModbusQuery, bytes],
        unit: int = 1,
        *,
        baud: int = 38400,
        firmware: str | None = None,
        config: str | Path | ControllerConfig | None = None,
        scales: Sequence[tuple[str, float]] = (),
        timeout_s: float = TIMEOUT_S,
        observe: bool = False,
        log: Callable[[str], object] | None = None,
    ) -> None:
        if not 0.0 < timeout_s <= 60.0:
            raise Misuse(f"a time-out of {timeout_s:g} s is outside 0 to 60 s")
        self._own = isinstance(where, str)
        self.line: DriverLine[ModbusQuery, bytes] = self._own_line(where, baud, log) if isinstance(where, str) else where
        check_unit(unit, tcp=bool(self.line.shared.get("tcp")))
        self._firmware = firmware
        self._observe = observe
        if isinstance(config, str | Path):
            config = load_config(config, firmware or DEFAULT_FIRMWARE)
        registers = register_map(firmware or DEFAULT_FIRMWARE)
        known = [AxisScale(*scale) for scale in scales]
        self._unit = Unit(self.line, unit, registers, config, known, timeout_ns=round(timeout_s * SECOND), tries=TRIES)
        self._axes = {number: AsyncMic488Axis(self._unit, number) for number in ALL_AXES}
        self.program = AsyncMic488Program(self._unit)
        self.user = AsyncUserRegisters(self._unit)

    def _own_line(self, address: str, baud: int, log: Callable[[str], object] | None) -> DriverLine[ModbusQuery, bytes]:
        return AsyncModbusLine(address, baud=baud, log=log)

    def __repr__(self) -> str:
        return f"<AsyncMic488 unit {self.unit} on {self.line.place}, firmware {self.firmware}>"

    @property
    def unit(self) -> int:
        return self._unit.number

    @property
    def firmware(self) -> str:
        return self._unit.registers.firmware.name

    @property
    def config(self) -> ControllerConfig | None:
        return self._unit.config

    def axis(self, number: int) -> AsyncMic488Axis:
        """Axis 1 to 4."""
        return self._axes[check_axis(number)]

    # ------------------------------------------------------------------ opening

    async def open(self) -> None:
        """Open the line, determine the firmware, and set DATA_TYPE unless ``observe``. Raises `LineFailure` or `NoMic488`."""
        await self.line.open()
        try:
            await self.find_firmware()
            control = await self._unit.control()
            if control.data_type is not DataType.REAL and not self._observe:
                _log.warning("%s: unit %d: DATA_TYPE was DINT and is set to REAL", self.line.place, self.unit)
                await self._unit.write(self._unit.item("DATA_TYPE"), DataType.REAL)
                await self._unit.control()
        except BaseException:
            await self.close()
            raise

    async def find_firmware(self) -> None:
        """Determine the firmware again, unless it was given: another controller may have replaced the earlier one.

        Raises `LineFailure` or `NoMic488`.
        """
        if self._firmware is None:
            self._unit.use(register_map(await identify.firmware_of(self.line, self.unit, self._unit.timeout_ns)))

    async def close(self) -> None:
        """Close the line, unless it is shared. Axes are not stopped by it."""
        if self._own:
            await self.line.close()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self.close()

    # ------------------------------------------------------------------ looking

    async def status(self) -> Mic488Status:
        """Positions, velocities, statuses, inputs, outputs and M_STATUS, in four frames."""
        unit = self._unit
        control = await unit.control()
        data_type = control.data_type
        moving = unit.axis_items("POS_ACT") + unit.axis_items("VEL_ACT")
        values = await unit.read(moving, data_type)
        shown = [unit.in_units(item, values[item], data_type) for item in moving]
        return Mic488Status(
            positions=tuple(float(value) for value, _ in shown[:AXES]),
            velocities=tuple(float(value) for value, _ in shown[AXES:]),
            units=tuple(name for _, name in shown[:AXES]),
            axes=control.axes,
            inputs=await self.inputs(),
            outputs=await self.outputs(),
            controller=control.controller,
            program=control.program,
        )

    async def positions(self) -> tuple[float, ...]:
        """The positions of all axes at one moment, in u."""
        unit = self._unit
        data_type = unit.wording.data_type
        items = unit.axis_items("POS_ACT")
        values = await unit.read(items, data_type)
        return tuple(float(unit.in_units(item, values[item], data_type)[0]) for item in items)

    async def inputs(self) -> tuple[bool, ...]:
        """IN1 to IN20."""
        return await self._bits("IN", INPUTS)

    async def outputs(self) -> tuple[bool, ...]:
        """OUT1 to OUT8."""
        return await self._bits("OUT", OUTPUTS)

    async def _bits(self, key: str, count: int) -> tuple[bool, ...]:
        items = [self._unit.item(key, number) for number in range(1, count + 1)]
        values = await self._unit.read(items)
        return tuple(bool(values[item]) for item in items)

    async def set_output(self, number: int, on: bool) -> None:
        """Switch OUT1 to OUT8."""
        if not 1 <= number <= OUTPUTS:
            raise Misuse(NO_OUTPUT(number=number, most=OUTPUTS))
        await self._unit.write(self._unit.item("OUT", number), on)

    # ------------------------------------------------------------------ several axes

    async def enable(self, *axes: int) -> None:
        """Switch drives on in the same instant; without axes all four."""
        await self._unit.write(self._unit.item("M_ENABLE"), axis_mask(axes or ALL_AXES))

    async def disable(self, *axes: int) -> None:
        """Switch drives off in the same instant; without axes all four. It precedes all waiting requests."""
        await self._halt("M_DISABLE", axes, "switched off")

    async def stop(self, *axes: int) -> None:
        """Stop axes in the same instant, without ramp; without axes all four. It precedes all waiting requests."""
        await self._halt("M_STOP", axes, "stopped")

    async def stop_all(self) -> None:
        """Stop all axes at once, without ramp. A running program continues, and may move them again: see ``program.stop``."""
        await self.stop()

    async def halt(self) -> None:
        """Stop all axes and pause a running program. Drives stay on and hold their load; ``program.start`` goes on (WBC-9).

        Raises `Unconfirmed` if the program was not paused.
        """
        with self._unit.stopping(PROGRAM, *ALL_AXES):
            await self.stop()
            try:
                if await self.program.state() is not ProgramState.RUNNING:
                    return
            except LineFailure as failure:
                _log.warning("%s: whether a program runs is not known, and it is paused (%s)", self.line.place, failure)
            try:
                await self.program.pause()
            finally:
                await self.stop()  # the program may have begun a motion meanwhile
            if await self.program.state() is ProgramState.RUNNING:
                raise Unconfirmed(STARTED_AGAIN())

    async def _halt(self, key: str, axes: Sequence[int], what: str) -> None:
        chosen = [check_axis(axis) for axis in axes or ALL_AXES]
        await self._unit.stop(chosen, key, what)
        for axis in chosen:
            self._axes[axis].forget()

    async def move_together(self, positions: Mapping[int, float]) -> None:
        """Begin to move axes to positions (u) in the same instant: ``{1: 10.0, 2: 15.0}``."""
        await trigger(self._unit, self._axes, MotionKind.POSITION, positions)

    async def move_together_by(self, distances: Mapping[int, float]) -> None:
        """Begin to move axes by distances (u) in the same instant."""
        await trigger(self._unit, self._axes, MotionKind.DISTANCE, distances)

    async def run_together(self, velocities: Mapping[int, float]) -> None:
        """Begin to run axes at velocities (u/s) in the same instant."""
        await trigger(self._unit, self._axes, MotionKind.VELOCITY, velocities)

    async def wait(self, *axes: int, timeout_s: float | None = None, check: bool = True) -> dict[int, MoveEnd]:
        """Wait until axes (without any: all) are at rest; see `AsyncMic488Axis.wait`. A failed motion ends the wait."""
        chosen = [check_axis(axis) for axis in axes or ALL_AXES]
        return await wait_for(self._unit, {axis: self._axes[axis].watch(timeout_s) for axis in chosen}, check=check)

    async def set_jog_speed(self, velocity: float) -> None:
        """JOG_SPEED in u/s, which holds for all axes and the coils of `AsyncMic488Axis.jog_bit`."""
        await self._unit.write(self._unit.item("JOG_SPEED"), velocity)

    # ------------------------------------------------------------------ registers by name and raw

    async def get(self, *names: str) -> dict[str, RegisterValue]:
        """Values by name (``M1_POS_ACT``, ``OUT3``, ``USER_REGISTER[12]:real``), in units if these are known."""
        return {name: value for name, (value, _) in (await self.get_shown(*names)).items()}

    async def get_shown(self, *names: str) -> dict[str, tuple[RegisterValue, str]]:
        """As `get`, each with its unit."""
        unit = self._unit
        items = {name: named(unit.registers, name) for name in names}
        data_type = (await unit.control()).data_type
        values = await unit.read(items.values(), data_type)
        return {name: unit.in_units(item, values[item], data_type) for name, item in items.items()}

    async def set(self, name: str, value: float) -> None:
        """Write a register by name, in units where it has one. A motion register moves.

        Registers that act on every write are sent only once.
        """
        await self.set_all((name, value))

    async def set_all(self, *values: tuple[str, float], is_sure: bool = False) -> None:
        """`set` one after the other. Names are checked before the first is written. A stop of an axis meanwhile that is none of
        these values refuses what may move it and has not been written. ``is_sure``: a motion that the controller would ignore,
        because its drive is off, is not written but raises `NotReady`."""
        unit, own = self._unit, Counter[int]()
        chosen: list[tuple[RegisterItem, float, tuple[int, ...], tuple[int, ...], Permission | None]] = []
        for name, value in values:
            item = named(unit.registers, name)
            if not item.register.accepts:
                raise Misuse(CAN_ONLY_BE_READ(name=name))
            ended = unit.ended_by(item, value)
            moved = () if ended else _moved_by(item)
            chosen.append((item, value, ended, moved, unit.permission(*moved, own=own) if moved else None))
        for item, value, ended, moved, permission in chosen:
            key, data_type = item.register.key, DataType.REAL
            if not ended:
                control = await unit.control()
                data_type = control.data_type
                is_rest = value == 0 and key in _CHANGES
                if is_sure and item.register.axis in moved and not control.triggered and not is_rest:
                    unit.check_enabled(control, *moved)
            own.update(ended)
            async with unit.stopping_if_late(*moved, program=key == "PROGRAM_CTRL"):
                await unit.write(item, unit.travelling(item, value, data_type), data_type=data_type, permission=permission)

    def ended_by(self, name: str, value: float) -> tuple[int, ...]:
        """Motions that `set` with these ends: the numbers of axes, and 0 for the program.

        Such a write precedes all waiting requests. Raises `Misuse` for an unknown name."""
        return self._unit.ended_by(named(self._unit.registers, name), value)

    async def registers(self, address: int, count: int) -> tuple[int, ...]:
        """Raw holding registers."""
        return words(await self._unit.look(pdu.READ_HOLDING_REGISTERS, address, count))

    async def request(self, request: pdu.ModbusRequest) -> pdu.ModbusResponse:
        """Send any request and return its answer. A write is sent only once, unless its registers are known to permit
        repetition. What ends a motion precedes all waiting requests; another write that waits when a stop is requested is not
        sent: what it would begin is not known."""
        unit = self._unit
        if isinstance(request, pdu.ReadRequest) or halted(unit.registers, request):
            return pdu.answer(request, await unit.ask(request))
        async with unit.stopping_if_late(*ALL_AXES, program=starts_program(unit.registers, request)):
            return pdu.answer(request, await unit.ask(request, permission=unit.permission(*ALL_AXES)))

    async def ignoring(self, request: pdu.ModbusRequest) -> frozenset[int]:
        """The axes that ignore the motions of a request, because their drives are off now (MIC-8)."""
        unit = self._unit
        axes = given_motions(unit.registers, request)
        control = await unit.control() if axes else None
        if control is None or control.triggered:
            return frozenset()
        return frozenset(axis for axis in axes if control.axes[axis - 1] == AxisStatus.OFF)

    # ------------------------------------------------------------------ snapshots

    async def take_snapshot(self) -> snapshot.Mic488Snapshot:
        """Read all registers that can be read and written."""
        return await snapshot.take(self._unit)

    async def restore_snapshot(
        self, kept: snapshot.Mic488Snapshot, *, counters: bool = False, outputs: bool = False, dry_run: bool = False
    ) -> list[snapshot.SnapshotChange]:
        """Write the values that differ from a snapshot, and return the changes; with ``dry_run`` only return them.

        ``counters``: positions and encoder counters too; ``outputs``: OUT1 to OUT8 too.
        """
        if dry_run:
            return await snapshot.changes(self._unit, kept, counters=counters, outputs=outputs)
        return await snapshot.put_back(self._unit, kept, counters=counters, outputs=outputs)


def _moved_by(item: RegisterItem) -> tuple[int, ...]:
    """The axes that a write may move."""
    register = item.register
    if register.effect not in (WriteEffect.MOVE, WriteEffect.ADD):
        return ()
    return ALL_AXES if register.axis is None else (register.axis,)
