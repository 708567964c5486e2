"""The motor record of an axis: its rules, for clients of EPICS.

A put that moves is over when the whole motion is. It fails for a motion that was refused, or that ended elsewhere and was not
stopped by a client of the record.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable

from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.gateways.epics.motorfields import FROZEN, GO, MOTOR_FIELDS, MOVE, PAUSE, STOP, StatusBit
from steptwin.gateways.epics.motorputs import FIXED, PUTS, put_setting
from steptwin.gateways.epics.motorstate import MotorState, RecordMotion
from steptwin.gateways.epics.records import LOST, FieldValue, Putter
from steptwin.gateways.sampling import Sample
from steptwin.simulation.script.steps import Write
from steptwin.subject.commands import Enable, Home, Jog, Move, StopAxes

_LOOK_AHEAD_S = 0.3
"""Of a jog: two looks at it, and the time that a jog takes to end."""


class MotorRecord(MotorState):
    """The record of an axis. Satisfies `Record` and `SampledRecord`."""

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
        machine = self._controller.name
        await self._controller.do(who, Write(tuple((machine, point, value) for point, value in rows)))
        await self._read_ramp()

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
