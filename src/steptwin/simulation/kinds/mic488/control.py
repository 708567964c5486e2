"""What a master writes to command a MIC488."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.messages import Message
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN
from steptwin.mic488.registers import AXES
from steptwin.mic488.slave import slave
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.kinds.kind import MotionEnds
from steptwin.simulation.kinds.mic488.writes import encode_write
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControllerCommand, ControlProgram, Enable, Halt, Home, Jog, Move, Seek, StopAxes

PROGRAM = {"stop": 0, "start": 1, "pause": 2}
"""PROGRAM_CTRL by action."""


def motion_ends(axis: str, line: str | None, seek: Seek | None) -> MotionEnds:
    """By the status, which is that of a motion as soon as the request that starts it has been answered."""
    busy = (AxisStatus.POSITION, AxisStatus.HOMING, AxisStatus.CORRECTION)
    over = " and ".join(f"{axis}.status != {status.value}" for status in busy)
    return MotionEnds(over, f"{axis}.status == {AxisStatus.REACHED.value}")


def _write(command: Any, register: str, value: float) -> do.Write:
    """A register of the axis of a command, by the rest of its name."""
    return do.Write(((command.machine, f"M{command.axis}_{register}", value),))


def _enable(device: Mic488Device, line: str | None, command: Enable) -> do.Write:
    return _write(command, "EN", float(command.on))


def _move(device: Mic488Device, line: str | None, command: Move) -> do.Write:
    if 1 <= command.axis <= AXES:
        _check_position(device.axes[command.axis - 1], command.by or 0.0 if command.to is None else command.to)
    return _write(command, "POS_REL", command.by or 0.0) if command.to is None else _write(command, "POS_ABS", command.to)


POSITION_IS_OUT_OF_RANGE = Message(
    "simulation.mic488.position-is-out-of-range", "move: {value:g} {unit}: permitted are {low:.12g}…{high:.12g} {unit}"
)


def _check_position(axis: Axis, value: float) -> None:
    """Raises `Misuse` for a position or distance that the controller ignores, because its pulses do not fit a DINT."""
    if not DINT_MIN <= value * axis.gear <= DINT_MAX:
        raise Misuse(
            POSITION_IS_OUT_OF_RANGE(value=value, unit=axis.config.unit_name, low=DINT_MIN / axis.gear, high=DINT_MAX / axis.gear)
        )


def _home(device: Mic488Device, line: str | None, command: Home) -> do.Write:
    return _write(command, "HOME", command.velocity)


def _jog(device: Mic488Device, line: str | None, command: Jog) -> do.Write:
    return _write(command, "VEL_ABS", command.velocity)


def _stop(device: Mic488Device, line: str | None, command: StopAxes) -> Halt:
    return Halt(command.machine, command.axis)


def _program(device: Mic488Device, line: str | None, command: ControlProgram) -> do.Write | Halt:
    if command.action != "start":
        return Halt(command.machine, program=command.action)
    return do.Write(((command.machine, "PROGRAM_CTRL", float(PROGRAM[command.action])),))


def halt(device: Mic488Device, wanted: Halt, now: Nanos) -> None:
    """By the registers by which a master does it, but where no fault of protocol or line comes between."""
    axes = range(1, AXES + 1) if wanted.axis is None else (wanted.axis,)
    stops = tuple((f"M{axis}_STOP", 1.0) for axis in axes)
    values = stops if wanted.program is None else (("PROGRAM_CTRL", float(PROGRAM[wanted.program])),)
    device.advance(now)
    for pdu in encode_write(device, values):
        slave(device.firmware.name, lenient=False).answer(device, pdu)


CONTROL: Mapping[type[ControllerCommand], Callable[[Mic488Device, str | None, Any], do.Write | Halt]] = {
    Enable: _enable,
    Move: _move,
    Home: _home,
    Jog: _jog,
    StopAxes: _stop,
    ControlProgram: _program,
}
"""Ranges are those of the registers."""
