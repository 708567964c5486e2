"""Waiting until axes are at rest, and finding why they stopped."""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.line import check_wait
from steptwin.drivers.mic488.failures import MoveFailed
from steptwin.drivers.mic488.motion import (
    MOVING,
    MotionCommand,
    MotionKind,
    MoveEnd,
    Reason,
    arrival,
    reason_of,
    status_text,
    travel_s,
)
from steptwin.drivers.mic488.unit import ControlRegisters, Unit
from steptwin.errors import LineFailure, Misuse
from steptwin.mic488.status import AxisStatus

POLL_S = 0.05
SHARED_NS: Nanos = 30 * MILLISECOND
"""Oldest status that several waits for the same controller share, ns."""
SETTLE_NS: Nanos = 100 * MILLISECOND
"""Time after a command during which the status may still be the earlier one, ns."""
MARGIN_S = 1.0
MARGIN = 1.2
"""A motion is overdue after this many times its computed duration, and the other margin."""
UNKNOWN_S = 60.0
"""Time-out of a motion whose duration cannot be computed, s: homing, or a motion begun by another program."""
CORRECTION_S = 5.0
"""Time for a correction of the position after a motion. The controller itself gives up sooner: 2 s without progress (ERR_TIME),
unless its configuration differs."""


class AxisWait:
    """Waits for one axis. ``motion``: its last command, if this driver sent it."""

    def __init__(self, unit: Unit, axis: int, motion: MotionCommand | None, timeout_s: float | None) -> None:
        self._unit = unit
        self._axis = axis
        self._motion = motion
        check_wait(timeout_s)
        self._begin = unit.line.now()
        self._limit: Nanos | None = None if timeout_s is None else self._begin + round(timeout_s * SECOND)
        self._is_computed = timeout_s is None
        self._corrects = False
        self._seen: list[float] = []
        """Positions of this motion, u."""

    @property
    def after(self) -> Nanos:
        """The time (ns) from which statuses are valid."""
        return self._begin if self._motion is None else self._motion.at

    async def judge(self, control: ControlRegisters) -> MoveEnd | None:
        """The end of the motion; None while it lasts."""
        status = control.axes[self._axis - 1]
        motion = self._motion
        if status in MOVING:
            if not self._seen and self._unit.gear(self._axis) is None and self._limit is not None and self._has_target:
                self._seen.append((await self._position())[0])
            now = self._unit.line.now()
            corrects = status == AxisStatus.CORRECTION  # which follows the motion that the time was computed of
            if self._limit is None or (self._is_computed and corrects is not self._corrects):
                self._limit = now + round(await self._time_out_s(status) * SECOND)
                self._corrects = corrects
            if control.at < self._limit:  # only a status read after the limit shows that it is exceeded
                return None
            return await self._end(Reason.OVERDUE, f"{status_text(status)} for {(now - self._begin) / SECOND:.1f} s")
        if motion is not None and status == motion.before and control.at < motion.at + SETTLE_NS:
            return None
        reason = reason_of(status, motion)
        return await self._end(reason, "" if reason is not Reason.STOPPED else status_text(status))

    async def _end(self, reason: Reason, detail: str) -> MoveEnd:
        unit, axis = self._unit, self._axis
        motion = self._motion
        position, name = await self._position()
        if reason is Reason.TARGET and motion is not None and motion.kind is MotionKind.POSITION:
            reason = arrival(motion.value_u, position, unit.gear(axis), self._seen)
            if reason is not Reason.TARGET:
                detail = f"the target was {motion.value_u:g} {name}"
        return MoveEnd(axis, reason, position, name, (unit.line.now() - self._begin) / SECOND, detail)

    @property
    def _has_target(self) -> bool:
        return self._motion is not None and self._motion.kind is MotionKind.POSITION

    async def _position(self) -> tuple[float, str]:
        """In units if these are known, with its unit."""
        unit = self._unit
        item = unit.item("POS_ACT", self._axis)
        control = unit.shared.control
        data_type = unit.wording.data_type if control is None else control.data_type
        value, name = unit.in_units(item, (await unit.read([item], data_type))[item], data_type)
        return float(value), name

    async def _time_out_s(self, status: int) -> float:
        """Longest remaining time of the motion, s."""
        unit, axis, motion = self._unit, self._axis, self._motion
        if status == AxisStatus.CORRECTION:
            known = unit.config.axes[axis - 1] if unit.config is not None else None
            patience_s = 0.0 if known is None else (known.enc_settle_ms + known.err_time_ms) / 1000.0 + MARGIN_S
            return max(CORRECTION_S, patience_s)
        if status == AxisStatus.HOMING:
            return UNKNOWN_S
        position, velocity, acc, dec, vmax = await dynamics(unit, axis)
        self._seen.append(position)
        if status == AxisStatus.VELOCITY:
            if motion is not None and motion.kind is MotionKind.VELOCITY and motion.value_u == 0.0:
                return MARGIN * abs(velocity) / acc + MARGIN_S
            raise Misuse(f"M{axis} runs in velocity mode and does not end by itself: give timeout_s")
        if motion is None or motion.kind not in (MotionKind.POSITION, MotionKind.DISTANCE):
            return UNKNOWN_S
        distance = motion.value_u - position if motion.kind is MotionKind.POSITION else motion.value_u
        duration = travel_s(distance, velocity, acc, dec, vmax)
        return UNKNOWN_S if duration is None else MARGIN * duration + MARGIN_S


async def dynamics(unit: Unit, axis: int) -> tuple[float, float, float, float, float]:
    """Position, velocity, ACC, DEC, VMAX of an axis: in units if these are known, else in pulses."""
    items = [unit.item(key, axis) for key in ("POS_ACT", "VEL_ACT", "ACC", "DEC", "VMAX")]
    data_type = unit.wording.data_type
    values = await unit.read(items, data_type)
    position, velocity, acc, dec, vmax = (float(unit.in_units(item, values[item], data_type)[0]) for item in items)
    return position, velocity, acc, dec, vmax


async def wait_for(unit: Unit, watches: dict[int, AxisWait], *, check: bool) -> dict[int, MoveEnd]:
    """Wait until all axes are at rest, or with ``check`` until one motion fails: then its `MoveFailed` is raised.

    A failing line ends the wait: with ``check`` it is raised, else it is the end of all axes that still move.
    """
    ends: dict[int, MoveEnd] = {}
    after = max(watch.after for watch in watches.values())
    begin = unit.line.now()
    while True:
        try:
            control = await unit.control(after)
            for axis, watch in watches.items():
                if axis not in ends:
                    end = await watch.judge(control)
                    if end is not None:
                        ends[axis] = end
        except LineFailure as failure:
            if check:
                raise
            seconds = (unit.line.now() - begin) / SECOND
            for axis in watches:
                name = unit.unit_name(axis)
                ends.setdefault(axis, MoveEnd(axis, Reason.COMMUNICATION, None, name, seconds, str(failure), failure))
        if check:
            for end in ends.values():
                if not end.ok:
                    raise MoveFailed(end)
        if len(ends) == len(watches):
            return ends
        await unit.line.sleep(POLL_S)
        after = unit.line.now() - SHARED_NS
