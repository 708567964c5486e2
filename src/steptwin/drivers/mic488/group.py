"""Several axes that begin in the same instant (AXIS_CTR_MODE, manual 4.5)."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

from steptwin.drivers.mic488.axis import AsyncMic488Axis
from steptwin.drivers.mic488.failures import Unconfirmed
from steptwin.drivers.mic488.motion import MotionKind
from steptwin.drivers.mic488.unit import Unit, axis_mask, check_axis
from steptwin.errors import LineFailure, Misuse, SteptwinError

_REGISTERS = {
    MotionKind.POSITION: ("POS_ABS", "AXIS_POS_ABS_TRIG"),
    MotionKind.DISTANCE: ("POS_REL", "AXIS_POS_REL_TRIG"),
    MotionKind.VELOCITY: ("VEL_ABS", "AXIS_VEL_ABS_TRIG"),
}
DIRECT, TRIGGER = 0, 1


async def trigger(unit: Unit, axes: Mapping[int, AsyncMic488Axis], kind: MotionKind, values: Mapping[int, float]) -> None:
    """Store a value for each axis and start them with one write. The trigger itself is sent once only.

    Raises `Unconfirmed` when the axes have begun to move, but AXIS_CTR_MODE could not be set back to DIRECT.
    """
    if not values:
        raise Misuse("no axis is given")
    chosen = sorted(check_axis(axis) for axis in values)
    for axis in chosen:
        axes[axis].check(kind, values[axis])
    register, starter = _REGISTERS[kind]
    mode = unit.item("AXIS_CTR_MODE")
    permission = unit.permission(*chosen)
    async with unit.lock():
        control = await unit.ready(*chosen)
        try:
            async with unit.stopping_if_late(*chosen):
                await unit.write(mode, TRIGGER, permission=permission)
                for axis in chosen:
                    await unit.set_axis(register, axis, values[axis], control.data_type, permission=permission)
                await unit.write(unit.item(starter), axis_mask(chosen), permission=permission)
        except BaseException:
            with contextlib.suppress(SteptwinError):
                await unit.write(mode, DIRECT)
            raise
        for axis in chosen:
            axes[axis].register_command(kind, values[axis], control)
        try:
            await unit.write(mode, DIRECT)
        except LineFailure as failure:
            raise Unconfirmed(
                f"{' '.join(f'M{axis}' for axis in chosen)} began to move, but AXIS_CTR_MODE may still be TRIGGER, in which "
                f"every motion waits for a trigger: it could not be set back to DIRECT ({failure})"
            ) from failure
