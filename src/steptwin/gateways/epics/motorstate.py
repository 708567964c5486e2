"""What a motor record shows: the state of the axis, and whether the motion that it waits for is over."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass, field
from typing import Any

from steptwin.controllerstate import StatusLevel
from steptwin.datasheet import AxisDescription, Condition, Limits
from steptwin.errors import Refusal, SteptwinError
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.motorcoordinates import MotorCoordinates
from steptwin.gateways.epics.motorfields import MOTOR_FIELDS, MOVE, PAUSE, StatusBit
from steptwin.gateways.epics.records import (
    NO_ALARM,
    NOT_KNOWN,
    AlarmKind,
    AlarmSeverity,
    FieldQuantity,
    FieldRow,
    FieldValue,
    Putter,
    RecordAlarm,
)
from steptwin.machine import SECOND, Nanos
from steptwin.simulation.script.control import Halt
from steptwin.subject.commands import Jog
from steptwin.subject.contract import MachinePart
from steptwin.subject.following import Following
from steptwin.subject.payloads import InputPayload

ON_ITS_WAY = SECOND // 2
"""A motion that has not begun so long after its command does not begin any more."""
BETWEEN = SECOND // 10
"""The jog of a controller that only knows moves rests for less between two of them."""
RELATIVE = 1e-6
"""Registers have numbers of 32 bits."""
_ALARMS = {
    StatusLevel.OK.value: NO_ALARM,
    StatusLevel.WARNING.value: RecordAlarm(AlarmKind.STATE, AlarmSeverity.MINOR),
    StatusLevel.ERROR.value: RecordAlarm(AlarmKind.STATE, AlarmSeverity.MAJOR),
}
_STAT = MOTOR_FIELDS["STAT"].states


@dataclass(slots=True)
class RecordMotion:
    """What the record waits for. ``target``: dial position of a move; ``button``: the field that is 1 meanwhile."""

    target: float | None = None
    button: str | None = None
    is_stopped: bool = False
    is_paused: bool = False
    is_foreign: bool = False
    """It was begun by somebody else."""
    has_begun: bool = False
    """Whether it has been seen; a command can be on its way to the controller for a while."""
    rests_since: Nanos | None = None
    waiting: list[asyncio.Future[None]] = field(default_factory=list)

    def end(self, error: SteptwinError | None = None) -> None:
        for one in self.waiting:
            if not one.done():
                if error is None:
                    one.set_result(None)
                else:
                    one.set_exception(error)


class MotorState(MotorCoordinates):
    """The fields of the record ``name`` of an axis of ``part``."""

    def __init__(self, name: str, part: MachinePart, axis: AxisDescription, controller: EpicsController) -> None:
        super().__init__()
        self.alarm = NOT_KNOWN
        self.at_s = 0.0
        self._axis = axis
        self._place = f"{part.name} {axis.name}"
        self._controller = controller
        self._taken = {one.command for one in part.takes if one.axis == axis.number}
        self._index = [one.number for one in part.datasheet.axes].index(axis.number)
        self._conditions = _conditions(part, axis)
        self._motion: RecordMotion | None = None
        self._jog: tuple[Putter, Jog] | None = None
        self._beginning: tuple[Putter, str] | None = None
        """Who has asked for a jog that has not begun yet, by which button; None once it is let go of."""
        self._is_homed = False
        self._is_pausing = False
        self._inputs: Following | None = None
        """While a motion waits for Go."""
        self._has_not_aimed = True
        """Before the first sample VAL is not known."""
        self._ramp: tuple[float, ...] = ()
        step = math.nan if axis.pulses_per_unit is None else 1.0 / axis.pulses_per_unit
        texts = {"NAME": name, "DESC": self._place, "OUT": self._place, "EGU": axis.unit}
        self.values |= {"MRES": step, "ERES": step, "UREV": 200 * step, **texts}
        self.values["PREC"] = self.precision
        if axis.pulses_per_unit is not None:
            self.values["RDBD"] = step
        if axis.velocities is not None and axis.velocities.high is not None:
            self.values["VMAX"] = axis.velocities.high

    # ------------------------------------------------------------------ for channels

    @property
    def unit(self) -> str:
        return self._axis.unit

    @property
    def precision(self) -> int:
        """As many decimals as show a step."""
        if self._axis.pulses_per_unit is None:
            return 3
        return max(0, min(9, math.ceil(math.log10(self._axis.pulses_per_unit))))

    def unit_of(self, row: FieldRow) -> str:
        per = {FieldQuantity.PURE: "", FieldQuantity.VELOCITY: f"{self.unit}/s", FieldQuantity.TIME: "s"}
        return per.get(row.quantity, self.unit)

    def limits_of(self, row: FieldRow) -> Limits | None:
        """Of positions those of the record; where it has none, those of the axis."""
        if row.quantity is FieldQuantity.VELOCITY:
            return Limits(0.0, self._number("VMAX")) if self.values["VMAX"] else None
        if row.quantity not in (FieldQuantity.USER, FieldQuantity.DIAL):
            return None
        if not self._has_limits:
            return self._axis.positions if row.quantity is FieldQuantity.DIAL or self._has_no_offset else None
        low, high = ("LLM", "HLM") if row.quantity is FieldQuantity.USER else ("DLLM", "DHLM")
        return Limits(self._number(low), self._number(high))

    def field(self, name: str) -> FieldRow | None:
        return MOTOR_FIELDS.get(name)

    def value(self, name: str) -> FieldValue:
        return self.values[name]

    async def refresh(self) -> None:
        await self._controller.refresh()
        if not self._ramp:
            await self._read_ramp()

    async def _read_ramp(self) -> None:
        """VELO and ACCL from the controller; JVEL and HVEL begin with VELO."""
        if self._axis.velocity_point is None:
            return
        try:
            found = await self._controller.read((self._axis.velocity_point, *self._axis.ramp_points))
        except SteptwinError:
            return
        if None in found:
            return
        velocity, *ramp = (float(one or 0.0) for one in found)
        self._ramp = (velocity, *ramp)
        self.values |= {"VELO": velocity, "ACCL": velocity / ramp[0] if ramp and ramp[0] else 0.0}
        for name in ("JVEL", "HVEL"):
            self.values[name] = min(self._number(name) or velocity, velocity)
        await self.show()

    # ------------------------------------------------------------------ samples

    @property
    def is_busy(self) -> bool:
        return self._motion is not None or self._beginning is not None

    def _take(self, state: Any, time: Nanos, *, is_sure: bool) -> None:
        code, level = state["status"]["code"], state["status"]["level"]
        dial = state["position"]
        self.alarm = _ALARMS[level] if dial is not None else NOT_KNOWN
        before = self._number("DRBV")
        if dial is not None:
            self.values |= {"DRBV": dial, "RBV": self.user(dial), "RRBV": self._steps(dial)}
            self.values["DIFF"] = self._number("DVAL") - dial
        moves = self._moves(state)
        low, high = (code == limit for limit in self._axis.limit_codes or (math.nan, math.nan))
        way = state["velocity"] or self._number("DRBV") - before
        bits = StatusBit.DIRECTION * (way > 0.0) if way else int(self.values["MSTA"]) & StatusBit.DIRECTION
        for bit, is_set in (
            (StatusBit.DONE, not moves),
            (StatusBit.MOVING, moves),
            (StatusBit.PLUS_LIMIT, high),
            (StatusBit.POSITION, bool(state["enabled"])),
            (StatusBit.MINUS_LIMIT, low),
            (StatusBit.PROBLEM, level == StatusLevel.ERROR.value),
            (StatusBit.PRESENT, state["encoder"] is not None),
            (StatusBit.GAIN_SUPPORT, "enable" in self._taken),
            (StatusBit.HOMED, self._is_homed),
        ):
            bits |= bit * is_set
        ends = (int(low), int(high))
        self.values |= {"MSTA": bits, "MOVN": int(moves), "RLLS": ends[0], "RHLS": ends[1]}
        self.values |= {"LLS": ends[self._sign < 0], "HLS": ends[self._sign > 0], "CNEN": int(bool(state["enabled"]))}
        if not is_sure:
            return
        if self._motion is None:
            if moves:
                self._motion = RecordMotion(is_foreign=True, has_begun=True)
                self.values |= {"DMOV": 0, "ATHM": 0}
            elif dial is not None and not self.values["DMOV"]:
                self.values["DMOV"] = 1
            elif dial is not None and self._has_not_aimed:
                self._has_not_aimed = False
                self._aim(dial)
        elif moves:
            self._motion.has_begun, self._motion.rests_since = True, None
        elif self._is_over(self._motion, time, has_moved=dial is not None and dial != before):
            self._end(self._motion, state)

    def _is_over(self, motion: RecordMotion, time: Nanos, *, has_moved: bool) -> bool:
        """Of an axis that rests."""
        if motion.rests_since is None:
            motion.rests_since = time
        if time >= motion.rests_since + (ON_ITS_WAY if self._jog is not None or not motion.has_begun else BETWEEN):
            return True
        if motion.button in ("JOGF", "JOGR"):
            return False
        is_there = motion.target is not None and abs(self._number("DRBV") - motion.target) <= self._number("RDBD")
        return motion.has_begun or has_moved or is_there

    def _watch_stops(self) -> None:
        """From now on others may stop the motion that waits for Go."""
        if self._inputs is not None:
            self._inputs.close()
        self._inputs = self._controller.follow_inputs()

    def _see_stops(self) -> None:
        """End a motion that waits for Go if others have stopped its axis."""
        if self._inputs is None:
            return
        motion, (missed, events) = self._motion, self._inputs.take()
        if motion is not None and motion.is_paused:
            stops = {one.payload.value for one in events if isinstance(one.payload, InputPayload) and one.payload.what == "stop"}
            name = self._controller.name
            if not missed and stops.isdisjoint((Halt(name).scope, Halt(name, self._axis.number).scope)):
                return
            motion.is_stopped, motion.is_paused = True, False
            motion.end(Refusal(f"{self._place}: the motion was stopped while it waited for Go"))
        self._inputs.close()
        self._inputs = None

    def _moves(self, state: Any) -> bool:
        """Whether the axis moves; of a device whose status has no text for it: unless it says that it rests."""
        if state["moving"] is not None:
            return bool(state["moving"])
        condition = self._conditions.get(state["status"]["code"])
        return condition is None or condition is Condition.MOVING

    def _show_alarm(self) -> None:
        self.values |= {"STAT": _STAT.index(self.alarm.kind.name), "SEVR": self.alarm.severity.value}

    def _end(self, motion: RecordMotion, state: Any) -> None:
        """It stands."""
        if motion.is_paused:
            return
        self._motion = None
        self._has_not_aimed = False
        error: SteptwinError | None = None
        dial, level = self._number("DRBV"), state["status"]["level"]
        self.values["MISS"] = 0
        if motion.target is not None and not motion.is_stopped:
            if not self._has_arrived(motion.target, level):
                self.values["MISS"] = 1
                where = f"{self.user(dial):.9g} {self.unit}, not at {self.user(motion.target):.9g} {self.unit}"
                error = Refusal(f"{self._place}: the motion ended at {where}: {state['status']['text']}")
                if self.values["RHLS"] or self.values["RLLS"]:
                    self._aim(dial)
        else:
            self._aim(dial)
        if motion.button in ("HOMF", "HOMR") and not motion.is_stopped:
            self._is_homed = level == StatusLevel.OK.value
            self.values["ATHM"] = int(self._is_homed)
            self.values["MSTA"] = int(self.values["MSTA"]) | StatusBit.HOMED * self._is_homed
            if not self._is_homed:
                error = Refusal(f"{self._place}: homing ended: {state['status']['text']}")
        if motion.button is not None:
            self.values[motion.button] = 0
        if self._jog is not None:
            self._jog = None
            self._controller.end_jog(self)
        if not motion.is_foreign and self.values["SPMG"] == MOVE:
            self.values["SPMG"] = PAUSE
        self.values["DMOV"] = 1
        self._ramp = ()  # it may have been changed by others
        motion.end(error)

    def _has_arrived(self, target: float, level: str) -> bool:
        if math.isnan(self._number("MRES")):
            return level == StatusLevel.OK.value
        return abs(self._number("DRBV") - target) <= self._number("RDBD") + RELATIVE * abs(target)


def _conditions(part: MachinePart, axis: AxisDescription) -> dict[int, Condition]:
    try:
        return dict(part.datasheet.point(f"{axis.name}.status").conditions)
    except KeyError:
        return {}
