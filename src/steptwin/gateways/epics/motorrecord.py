"""The motor record of an axis: its rules, for clients of EPICS.

A put that moves is over when the whole motion is. It fails for a motion that was refused, or that ended elsewhere and was not
stopped by a client of the record.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import StatusLevel
from steptwin.datasheet import AxisDescription, Condition, Limits
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.motorfields import (
    BUTTON_BITS,
    FROZEN,
    GO,
    MOTOR_FIELDS,
    MOVE,
    PAUSE,
    STOP,
    ProgressBit,
    StatusBit,
    first_values,
)
from steptwin.gateways.epics.motorputs import FIXED, PUTS, put_setting
from steptwin.gateways.epics.records import (
    LOST,
    NO_ALARM,
    NOT_KNOWN,
    AlarmKind,
    AlarmSeverity,
    FieldQuantity,
    FieldRow,
    FieldValue,
    Putter,
    RecordAlarm,
    RecordBase,
)
from steptwin.gateways.sampling import Sample
from steptwin.simulation.script.control import Halt
from steptwin.simulation.script.steps import Write
from steptwin.subject.commands import Enable, Home, Jog, Move, StopAxes
from steptwin.subject.contract import ControllerDescription
from steptwin.subject.payloads import InputPayload
from steptwin.subject.subscriptions import Subscription

ON_ITS_WAY = SECOND // 2
"""A motion that has not begun so long after its command does not begin any more."""
BETWEEN = SECOND // 10
"""The jog of a controller that only knows moves rests for less between two of them."""
RELATIVE = 1e-6
"""Registers have numbers of 32 bits."""
_LOOK_AHEAD_S = 0.3
"""Look-ahead of a jog: two samples of it, and the time that a jog takes to end."""
_ALARMS = {
    StatusLevel.OK.value: NO_ALARM,
    StatusLevel.WARNING.value: RecordAlarm(AlarmKind.STATE, AlarmSeverity.MINOR),
    StatusLevel.ERROR.value: RecordAlarm(AlarmKind.STATE, AlarmSeverity.MAJOR),
}
_STAT = MOTOR_FIELDS["STAT"].states


@dataclass(slots=True)
class RecordMotion:
    """Motion for which the record waits. ``target``: dial position of a move; ``button``: the field that is 1 meanwhile."""

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


class MotorRecord(RecordBase):
    """The record ``name`` of an axis of ``part``. Satisfies `Record` and `SampledRecord`.

    User coordinates are dial coordinates with DIR and OFF, raw ones are steps of MRES.
    """

    def __init__(self, name: str, part: ControllerDescription, axis: AxisDescription, controller: EpicsController) -> None:
        super().__init__()
        self.values = first_values()
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
        self._inputs: Subscription | None = None
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
        rates = {FieldQuantity.VELOCITY: f"{self.unit}/s", FieldQuantity.ACCELERATION: f"{self.unit}/s²"}
        per = {FieldQuantity.PURE: "", FieldQuantity.TIME: "s", **rates}
        return per.get(row.quantity, self.unit)

    def limits_of(self, row: FieldRow) -> Limits | None:
        """Limits: of positions those of the record; where it has none, those of the axis."""
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
        self.values |= {
            "VELO": velocity,
            "ACCL": velocity / ramp[0] if ramp and ramp[0] else 0.0,
            "JAR": ramp[0] if ramp else 0.0,
        }
        for name in ("JVEL", "HVEL"):
            self.values[name] = min(self._number(name) or velocity, velocity)
        await self.show()

    async def show(self) -> None:
        self.values["MIP"] = self._progress
        await super().show()

    @property
    def _progress(self) -> int:
        """MIP, as far as it is known."""
        motion = self._motion
        if motion is None:
            return BUTTON_BITS[self._beginning[1]] if self._beginning is not None else 0
        if motion.is_stopped or motion.is_paused:
            return ProgressBit.STOP
        if motion.is_foreign:
            return ProgressBit.EXTERNAL
        return ProgressBit.MOVE if motion.button is None else BUTTON_BITS[motion.button]

    # ------------------------------------------------------------------ coordinates

    def _number(self, name: str) -> float:
        return float(self.values[name])

    @property
    def _sign(self) -> int:
        return -1 if self.values["DIR"] else 1

    def user(self, dial: float) -> float:
        return dial * self._sign + self._number("OFF")

    def _dial(self, user: float) -> float:
        return (user - self._number("OFF")) * self._sign

    def _steps(self, dial: float) -> int:
        """0 where the step is not known."""
        step = self._number("MRES")
        return 0 if math.isnan(step) else max(-(2**31), min(2**31 - 1, round(dial / step)))

    def _aim(self, dial: float) -> None:
        self.values |= {"DVAL": dial, "VAL": self.user(dial), "RVAL": self._steps(dial), "DIFF": dial - self._number("DRBV")}

    def _show_limits(self) -> None:
        """HLM and LLM from those of the dial."""
        ends = sorted((self.user(self._number("DLLM")), self.user(self._number("DHLM"))))
        self.values |= {"LLM": ends[0], "HLM": ends[1]}

    @property
    def _has_limits(self) -> bool:
        return not self._number("DLLM") == self._number("DHLM") == 0.0

    @property
    def _has_no_offset(self) -> bool:
        """Whether positions of the user are those of the dial."""
        return not self.values["OFF"] and self._sign > 0

    def _is_outside(self, dial: float) -> bool:
        return self._has_limits and not self._number("DLLM") <= dial <= self._number("DHLM")

    def shift(self, offset: float) -> None:
        """OFF is put."""
        self.values["OFF"] = offset
        dial = self._number("DRBV")
        self.values["RBV"] = self.user(dial)
        self._aim(self._number("DVAL") if self.is_busy else dial)
        self._show_limits()

    def turn(self, direction: int) -> None:
        """DIR is put: VAL stays, by OFF, unless that is frozen."""
        val = self._number("VAL")
        self.values["DIR"] = direction
        self.shift(self._number("OFF") if self.values["FOFF"] == FROZEN else val - self._number("DVAL") * self._sign)

    def limit(self, name: str, value: float) -> None:
        """One of HLM, LLM, DHLM, DLLM is put."""
        if name in ("HLM", "LLM"):
            is_high = (name == "HLM") is (self._sign > 0)
            name, value = ("DHLM" if is_high else "DLLM"), self._dial(value)
        self.values[name] = value
        self._show_limits()
        self.values["LVIO"] = int(self._is_outside(self._number("DVAL")))

    # ------------------------------------------------------------------ samples

    async def take(self, sample: Sample, *, is_sure: bool) -> None:
        self.at_s = sample.at.timestamp()
        self._see_stops()
        if sample.state is None:
            self.alarm = LOST
            self.values["MSTA"] = int(self.values["MSTA"]) | StatusBit.COMM_ERROR
        else:
            self._take(sample.state["axes"][self._index], sample.time, is_sure=is_sure)
        self._show_alarm()
        if self._motion is not None and self._jog is not None:
            self._look_after_jog()
        await self.show()

    @property
    def is_busy(self) -> bool:
        return self._motion is not None or self._beginning is not None

    def _take(self, state: Any, time: Nanos, *, is_sure: bool) -> None:
        code, level = state["status"]["code"], state["status"]["level"]
        dial = state["position"]
        self.alarm = _ALARMS[level] if dial is not None else NOT_KNOWN
        before = self._number("DRBV")
        if dial is not None:
            self.values |= {"DRBV": dial, "RBV": self.user(dial), "RRBV": self._steps(dial), "UDF": 0}
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
        self.values |= {"MSTA": bits, "TDIR": bits & StatusBit.DIRECTION, "MOVN": int(moves), "RLLS": ends[0], "RHLS": ends[1]}
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
        """Whether the motion of an axis that rests has ended."""
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
        self._inputs = self._controller.subscribe_to_inputs()

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
        """The axis is at rest."""
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

    # ------------------------------------------------------------------ puts

    async def put(self, who: Putter, name: str, value: FieldValue) -> None:
        if isinstance(value, float) and not math.isfinite(value):
            raise Misuse(f"{name}: {value}: expected a number")
        try:
            await PUTS.get(name, put_setting)(self, who, name, value)
        finally:
            await self.show()

    async def _begin(self, motion: RecordMotion, act: Callable[[], Awaitable[None]]) -> asyncio.Future[None]:
        """Begin a motion; the result is there at its end. A motion that is being made becomes it: who waits for that waits for
        this."""
        shown = {name: self.values[name] for name in ("DMOV", "ATHM")}
        if motion.button is not None:
            self.values[motion.button] = 1
        self.values |= {"DMOV": 0, "ATHM": 0}
        await self.show()
        try:
            await act()
        except BaseException:
            self.values |= shown
            if motion.button is not None:
                self.values[motion.button] = 0
            raise
        before = self._motion
        if before is not None:
            motion.waiting = before.waiting
            if before.button is not None and before.button != motion.button:
                self.values[before.button] = 0
        if motion.button not in ("JOGF", "JOGR"):
            self._jog = self._beginning = None
            self._controller.replace_jog(self._axis.number)
        self._motion = motion
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        motion.waiting.append(over)
        await self._controller.refresh()
        return over

    async def move(self, who: Putter, user: float) -> None:
        """To a position. Raises `SteptwinError`."""
        dial = self._dial(user)
        if self.values["SPMG"] == STOP:
            raise Refusal(f"{self._place}: SPMG is Stop")
        self.values["LVIO"] = int(self._is_outside(dial))
        if self.values["LVIO"]:
            ends = f"{self._number('LLM'):.9g} to {self._number('HLM'):.9g} {self.unit}"
            raise Misuse(f"{self._place}: {user:.9g} {self.unit}: permitted are {ends} (LLM, HLM)")
        before = self._number("DVAL")
        self._aim(dial)
        if self.values["SPMG"] == PAUSE:
            await self._wait_paused(who, dial)
            return
        try:
            over = await self._begin(RecordMotion(target=dial), lambda: self._go(who, dial))
        except SteptwinError:
            self._aim(before)
            raise
        await over

    async def _go(self, who: Putter, dial: float) -> None:
        await self._controller.do(who, Move(self._controller.name, self._axis.number, to=dial))

    async def _wait_paused(self, who: Putter, dial: float) -> None:
        self._controller.check_may_change(who)
        motion = self._motion or RecordMotion()
        self._see_stops()
        motion.target, motion.is_paused, self._motion = dial, True, motion
        self._watch_stops()
        self.values["DMOV"] = 0
        over = asyncio.get_running_loop().create_future()
        motion.waiting.append(over)
        await self.show()
        await over

    async def home(self, who: Putter, button: str) -> None:
        """In the direction of the button, in dial coordinates."""
        self._check_goes()
        if self._motion is not None and self._motion.button in ("HOMF", "HOMR"):
            raise Refusal(f"{self._place}: it is homing")
        velocity = abs(self._number("HVEL")) * (1 if button == "HOMF" else -1)
        if not velocity:
            raise Misuse(f"{self._place}: HVEL is 0")
        wanted = Home(self._controller.name, self._axis.number, velocity)
        await (await self._begin(RecordMotion(button=button), lambda: self._controller.do(who, wanted)))

    async def jog(self, who: Putter, button: str) -> None:
        self._check_goes()
        velocity = abs(self._number("JVEL")) * self._sign * (1 if button == "JOGF" else -1)
        if not velocity:
            raise Misuse(f"{self._place}: JVEL is 0")
        if self._beginning is not None:
            raise Refusal(f"{self._place}: a jog is being begun")
        wanted = Jog(self._controller.name, self._axis.number, velocity)
        if self._runs_out(velocity):
            self.values["LVIO"] = 1
            raise Misuse(f"{self._place}: a jog would leave {self._number('LLM'):.9g} to {self._number('HLM'):.9g} {self.unit}")
        self.values["LVIO"] = 0

        beginning = self._beginning = who, button

        async def begin() -> None:
            if self._beginning is not beginning:
                raise Refusal(f"{self._place}: the jog was let go of before it began")
            await self._controller.jog(self, who, wanted)
            self._jog = who, wanted

        try:
            over = await self._begin(RecordMotion(button=button), begin)
        finally:
            if self._beginning is beginning:
                self._beginning = None
        await over

    def _check_goes(self) -> None:
        if self.values["SPMG"] in (STOP, PAUSE):
            raise Refusal(f"{self._place}: SPMG is {MOTOR_FIELDS['SPMG'].states[int(self.values['SPMG'])]}")

    def _runs_out(self, velocity: float) -> bool:
        """Whether a jog has to be stopped now so that it ends within the limits."""
        margin = velocity * (self._number("ACCL") / 2.0 + _LOOK_AHEAD_S)
        there = self._number("DRBV") + margin
        return self._has_limits and (there > self._number("DHLM") if velocity > 0.0 else there < self._number("DLLM"))

    def _look_after_jog(self) -> None:
        if self._jog is None or self._beginning is not None:
            return
        _, wanted = self._jog
        if self._runs_out(wanted.velocity):
            self.values["LVIO"] = 1
            self._end_jog()
            return
        try:
            self._controller.extend_jog(self, wanted)
        except SteptwinError:
            self._end_jog()

    async def end_jog(self, button: str) -> None:
        """JOGF or JOGR is put to 0."""
        begins = self._beginning is not None and self._beginning[1] == button
        if not begins and (self._motion is None or self._motion.button != button):
            return
        self._end_jog()
        await self._controller.refresh()

    def _end_jog(self) -> None:
        self._jog = self._beginning = None
        self._controller.end_jog(self)

    async def leave(self, circuit: object) -> None:
        """A jog ends with the connection of its client."""
        if any(one is not None and one[0].circuit == circuit for one in (self._beginning, self._jog)):
            self._end_jog()

    async def stop(self, who: Putter) -> None:
        await self._controller.do(who, StopAxes(self._controller.name, self._axis.number))
        await self._controller.refresh()

    def stopped(self, axis: int | None) -> None:
        if axis not in (None, self._axis.number):
            return
        self._beginning = None
        if self._motion is None or self._is_pausing:
            return
        self._jog = None
        self._motion.is_stopped, self._motion.is_paused = True, False

    async def pause(self, who: Putter, state: int) -> None:
        """SPMG is put."""
        if state in (MOVE, GO):
            self._controller.check_may_change(who)
        self._see_stops()
        motion, before = self._motion, self.values["SPMG"]
        self.values["SPMG"] = state
        if motion is None:
            if state == STOP:
                self._aim(self._number("DRBV"))
            return
        if state == PAUSE and motion.target is not None:
            if motion.is_paused:
                return
            motion.is_paused = self._is_pausing = True
            try:
                await self.stop(who)
            finally:
                self._is_pausing = False
                self._watch_stops()
        elif state in (STOP, PAUSE):
            await self.stop(who)
        elif motion.is_paused and motion.target is not None:
            try:
                await self._go(who, motion.target)
            except SteptwinError:
                self.values["SPMG"] = before
                raise
            motion.is_stopped = motion.is_paused = False
            await self._controller.refresh()

    # ------------------------------------------------------------------ settings

    async def write_ramp(self, who: Putter, velocity: float, seconds: float) -> None:
        """VELO and ACCL; a change of VELO keeps ACCL. Raises `SteptwinError`."""
        axis = self._axis
        if axis.velocity_point is None:
            raise Refusal(f"{self._place}: no register has its velocity")
        if velocity <= 0.0 or seconds < 0.0:
            raise Misuse(f"{self._place}: {velocity:g} {self.unit}/s, {seconds:g} s: permitted are numbers above 0")
        rows = [(axis.velocity_point, velocity)]
        if seconds:
            rows += [(point, velocity / seconds) for point in axis.ramp_points]
        controller = self._controller.name
        await self._controller.do(who, Write(tuple((controller, point, value) for point, value in rows)))
        await self._read_ramp()

    def synchronize(self) -> None:
        """SYNC is put: VAL becomes RBV."""
        if self.is_busy:
            raise Refusal(f"{self._place}: it moves")
        self._aim(self._number("DRBV"))

    def set_position(self, user: float) -> None:
        """RBV becomes ``user``, by OFF; nothing moves."""
        if self._motion is not None:
            raise Refusal(f"{self._place}: it moves")
        if self.values["FOFF"] == FROZEN:
            raise Refusal(f"{self._place}: OFF is frozen (FOFF), and {FIXED}")
        self.shift(user - self._number("DRBV") * self._sign)

    async def enable(self, who: Putter, *, on: bool) -> None:
        if "enable" not in self._taken:
            raise Refusal(f"{self._place}: the controller does not switch its drive")
        await self._controller.do(who, Enable(self._controller.name, self._axis.number, on=on))
        await self._controller.refresh()

    def check_setting(self, who: Putter) -> None:
        self._controller.check_may_change(who)


def _conditions(part: ControllerDescription, axis: AxisDescription) -> dict[int, Condition]:
    try:
        return dict(part.datasheet.point(f"{axis.name}.status").conditions)
    except KeyError:
        return {}
