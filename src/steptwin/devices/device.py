"""A device behind its driver as a member of a composite subject: polled for watched values, reconnected after its line was lost.

Nothing that moves is repeated or kept for later: while the line is lost, commands are refused. After a stop has been
acknowledged, nothing begins that was asked for before: what waits when a stop arrives, and what arrives before its
acknowledgement, is refused. So the order in which requests of several clients are read after a pause does not matter.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass

from steptwin.controller import SECOND, Nanos
from steptwin.devices.digitalshadow import DigitalShadow, Known, ShadowState
from steptwin.devices.jog import LeasedJog
from steptwin.diagnostics import SourceText
from steptwin.drivers.subject import AsyncDeviceSubject, DevicePart, RawEffect
from steptwin.errors import LineFailure, Refusal, SteptwinError
from steptwin.eventloop import later
from steptwin.messages import Message, text_of
from steptwin.simulation.script import steps
from steptwin.simulation.script.control import Halt, ended
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, type_of
from steptwin.subject.contract import UNKNOWN, Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.jogs import ExtendableJog
from steptwin.subject.payloads import NOT_ENABLED, InputPayload, StatusPayload
from steptwin.subject.subscriptions import Filter, Subscriptions
from steptwin.tracing import span

POLL_S = 0.1
"""A device is polled at most this often, and at most half of the time."""
WATCHED_NS: Nanos = 2 * SECOND
"""A point that was not read for so long is asked for no more."""
RECONNECT_S = (0.5, 5.0)
"""Pause after the first failure, doubled after each further one, up to the second."""
MOST_WAITING = 16
"""Commands that wait for those before them; further ones are refused."""
PATIENCE_NS: Nanos = 5 * SECOND
"""A command that has waited longer for those before it is not sent."""
REGISTERS_NS: Nanos = 5 * SECOND
"""Settings of a device and of its digital shadow are compared so often, at rest."""
JOG_WAIT_S = 2.0
"""For the jog before of the same axis to end."""
LOOKS = (command.ReadPoints, command.ReadPins, command.Describe, command.Time, command.Encoders, command.ReadState)
WRITES = (steps.Write, steps.Request, steps.Send)
"""Commands that may change settings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceSurroundings:
    clock: Callable[[], Nanos]
    """The wall clock, which never goes back."""
    keep: Callable[[str, str], str]
    """Keeps the settings of a controller, a text of JSON; where they are. Raises `SteptwinError`."""
    on_internal: Callable[[Exception], object]
    check: Callable[[DevicePart, Command], object] = lambda device, wanted: None
    """Raises `Refusal` for a command that a device is not sent from here. Stops and jogs are not asked about."""


CONNECTION_IS_LOST = Message("devices.connection-is-lost", "{command} was not sent: the connection is lost ({lost})")
TOO_MANY_WAITING = Message("devices.too-many-waiting", "{command} was not sent: {most} commands wait already")
STOP_IS_BEING_EXECUTED = Message(
    "devices.stop-is-being-executed", "{command} was not sent: a stop is being executed; repeat it after that"
)
STOPPED_MEANWHILE = Message("devices.stopped-meanwhile", "{command} was not sent: a stop was requested meanwhile")
WAITED_TOO_LONG = Message("devices.waited-too-long", "{command} was not sent: it has waited more than {most_s} s; repeat it")
AXIS_IS_JOGGED = Message("devices.axis-is-jogged", "{name}: a twin can be made at rest: an axis is jogged")
JOGGED_ALREADY = Message("devices.jogged-already", "{name} axis {axis} is jogged already")
JOG_STOPPED_MEANWHILE = Message("devices.jog-stopped-meanwhile", "jog was not begun: a stop was requested meanwhile")
LINE_LOST = Message("devices.connection-lost", "connection lost: {why}")
LINE_FOUND = Message("devices.connected-again", "connected again")
MOTION_IGNORED = Message("devices.motion-ignored", "motion ignored: M{axis} is not enabled")
SETTINGS_KEPT = Message("devices.settings-kept", "settings before the first write are in {where}")


class ConnectedDevice:
    """Satisfies `steptwin.devices.composite.MemberSubject`. Its line is open."""

    def __init__(self, subject: AsyncDeviceSubject, device: DevicePart, around: DeviceSurroundings) -> None:
        self._subject = subject
        self._device = device
        self._around = around
        self.lost: str | None = None
        self._known: dict[str, Reading] = {}
        self._watched: dict[str, Nanos] = {}
        """Points, and when they were read last."""
        self._turn = asyncio.Lock()
        self._stops = 0
        self._stopping = 0
        """Stops that have not been acknowledged yet."""
        self._waiting = 0
        self._is_kept = False
        self._jogs: dict[int, LeasedJog] = {}
        self._jog_turns: dict[int, asyncio.Lock] = {}
        self._wanted = asyncio.Event()
        self._shadow: DigitalShadow | None = None
        self._registers_due: Nanos = 0
        self._polling = asyncio.get_running_loop().create_task(self._poll())

    @property
    def name(self) -> str:
        return self._subject.name

    @property
    def description(self) -> Description:
        return self._subject.description

    @property
    def subscribers(self) -> Subscriptions:
        return self._subject.subscribers

    def selected(self, data: bytes) -> int | None:
        """See `steptwin.drivers.subject.DevicePart.selected`."""
        return self._device.selected(data)

    def plans(self, what: Filter) -> list[Event]:
        return [event for event in self._subject.samples() if what.wants(event)]

    def read(self, *points: str) -> tuple[Reading, ...]:
        """The values of the last poll; asks for them from now on."""
        now = self._around.clock()
        units = {point: "" if point in self._known else self._subject.unit_of(point) for point in points}
        self._watched |= dict.fromkeys(points, now)
        return tuple(self._known.get(point) or Reading(point, None, unit, UNKNOWN) for point, unit in units.items())

    # ------------------------------------------------------------------ polling

    async def _poll(self) -> None:
        pause_s = RECONNECT_S[0]
        loop = asyncio.get_running_loop()
        while True:
            begun = loop.time()
            try:
                await self._look()
            except LineFailure as failure:
                self._lose(text_of(failure))
                await asyncio.sleep(pause_s)
                pause_s = min(2.0 * pause_s, RECONNECT_S[1])
                continue
            except SteptwinError as refusal:  # another controller is there, or none
                self._lose(text_of(refusal))
                await asyncio.sleep(RECONNECT_S[1])
                continue
            except Exception as error:  # noqa: BLE001  the others go on, and so does this one
                self._around.on_internal(error)
                await asyncio.sleep(RECONNECT_S[1])
                continue
            pause_s = RECONNECT_S[0]
            spent_s = loop.time() - begun
            self._wanted.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(max(POLL_S, spent_s)):
                    await self._wanted.wait()

    async def _look(self) -> None:
        """Poll watched values; a lost device is polled in any case."""
        oldest = self._around.clock() - WATCHED_NS
        self._watched = {point: at for point, at in self._watched.items() if at > oldest}
        if self._jogs and not self._device.answers_in_motion:
            return
        points = tuple(self._watched)
        if self.lost is not None:
            await self._device.reconnect()
            self._find()
        await self._subject.poll()
        found = await self._subject.read(*points) if points else ()
        self._known = {one.point: one for one in found}
        if self._shadow is not None:
            await self._compare(self._shadow)

    def _lose(self, why: str) -> None:
        self._known.clear()
        if self.lost is None:
            self._subject.forget()
            self._subject.publish(StatusPayload("line-lost", LINE_LOST(why=text_of(why))))
        self.lost = f"{self.name}: {why}"

    def _find(self) -> None:
        self.lost = None
        self._subject.publish(StatusPayload("line-found", LINE_FOUND()))

    # ------------------------------------------------------------------ commands

    async def do(self, wanted: Command, /) -> Result:
        """Waits for a `Later`."""
        return await later(self._do(wanted))

    async def _do(self, wanted: Command) -> Result:
        name = type_of(wanted).name
        with span(f"device {name}", {"command": name, "controller": self.name}, is_part=True):
            return await self._done(wanted)

    async def _done(self, wanted: Command) -> Result:
        try:
            if self._is_stop(wanted):
                return await self._stop(wanted)
            self._around.check(self._device, wanted)
            if self.lost is not None:
                raise LineFailure(CONNECTION_IS_LOST(command=type_of(wanted).name, lost=text_of(self.lost)))
            if type(wanted) in LOOKS or self._effect_of(wanted) is RawEffect.LOOK:
                return await self._subject.do(wanted)
            return await self._in_turn(wanted)
        finally:
            self._wanted.set()  # what it has changed is polled soon

    async def _stop(self, wanted: Command) -> Result:
        self._stops += 1
        self._stopping += 1
        try:
            for stop in self._stops_in(wanted):
                self._subject.publish(InputPayload("stop", stop.scope))
            self._cut_jogs(wanted)
            return await self._execute(wanted)
        finally:
            self._stopping -= 1

    def _is_stop(self, wanted: Command) -> bool:
        return _is_stop(wanted) or self._effect_of(wanted) is RawEffect.STOP

    def _stops_in(self, wanted: Command) -> list[Halt]:
        match wanted:
            case command.StopAxes(axis=axis):
                return [Halt(self.name, axis)]
            case command.ControlProgram(action=action):
                return [Halt(self.name, program=action)]
            case steps.Request() | steps.Write():
                return ended(self.name, self._device.ended_by(wanted))
            case _:
                return [Halt(self.name)]

    def _effect_of(self, wanted: Command) -> RawEffect | None:
        """The effect of a raw request or of a write of registers; None of other commands."""
        return self._device.effect_of(wanted) if isinstance(wanted, steps.Request | steps.Write) else None

    async def _in_turn(self, wanted: Command) -> Result:
        """One after the other, in the order in which they came."""
        self._refuse_while_stopping(wanted)
        stops, asked = self._stops, self._around.clock()
        if self._waiting >= MOST_WAITING:
            raise Refusal(TOO_MANY_WAITING(command=type_of(wanted).name, most=MOST_WAITING))
        self._waiting += 1
        try:
            await self._turn.acquire()
        finally:
            self._waiting -= 1
        try:
            self._refuse_late(wanted, stops, asked)
            if type(wanted) in WRITES and not self._is_kept:
                await self._keep_settings()
                self._refuse_late(wanted, stops, asked)  # that took its time, and a write may begin a motion
            if isinstance(wanted, steps.Request):
                ignoring = await self._ignoring(wanted)
                self._refuse_late(wanted, stops, asked)
                result = await self._execute(wanted)
                await self._report_ignored(wanted, ignoring)
                return result
            result = await self._execute(wanted)
            if type(wanted) is command.Move:
                self._look_away()
            return result
        finally:
            self._turn.release()

    async def _execute(self, wanted: Command) -> Result:
        """Also by the digital shadow."""
        begun = self._around.clock()
        result = await self._subject.do(wanted)
        if self._shadow is not None:  # before anything else is awaited: that would be lag, and may be cancelled
            self._shadow.did(wanted, begun, self._around.clock())
        return result

    async def _ignoring(self, request: steps.Request) -> frozenset[int]:
        """The axes that ignore a raw motion now, none where that is not known. Raises `LineFailure`."""
        try:
            return await self._device.ignoring(request)
        except Refusal:
            return frozenset()

    async def _report_ignored(self, request: steps.Request, before: frozenset[int]) -> None:
        """As a twin does it. ``before``: the axes that would have ignored it just before. Those that still do have ignored it: a
        program of the device, or another master, may have switched the drives of the others. It has been answered, whatever
        becomes of the reading of its drives."""
        after: frozenset[int] = frozenset()
        if before:
            with contextlib.suppress(LineFailure):
                after = await self._ignoring(request)
        for axis in sorted(before & after):
            self._subject.publish(StatusPayload(NOT_ENABLED, MOTION_IGNORED(axis=axis), (("axis", axis),)))

    def _refuse_while_stopping(self, wanted: Command) -> None:
        if self._stopping:
            raise Refusal(STOP_IS_BEING_EXECUTED(command=type_of(wanted).name))

    def _refuse_late(self, wanted: Command, stops: int, asked: Nanos) -> None:
        """Refuse what a stop has overtaken, and what was asked for too long ago."""
        if self._stops != stops:
            raise Refusal(STOPPED_MEANWHILE(command=type_of(wanted).name))
        if self._around.clock() - asked > PATIENCE_NS:
            raise Refusal(WAITED_TOO_LONG(command=type_of(wanted).name, most_s=PATIENCE_NS // SECOND))

    def _look_away(self) -> None:
        """The last values of a device that does not answer while it moves are out of date."""
        if not self._device.answers_in_motion:
            self._known.clear()
            self._subject.forget()

    async def _keep_settings(self) -> None:
        """Done once, before the first write. Raises `SteptwinError` where they cannot be kept; then nothing is written."""
        where = self._around.keep(self.name, await self._device.settings_text())
        self._is_kept = True
        self._subject.publish(StatusPayload("settings-kept", SETTINGS_KEPT(where=where)))

    async def settings(self) -> str:
        """Values that can be read and written, as JSON. Raises `LineFailure`."""
        async with self._turn:
            return await self._device.settings_text()

    def configuration(self) -> SourceText | None:
        """See `steptwin.drivers.subject.DevicePart.configuration`."""
        return self._device.configuration()

    # ------------------------------------------------------------------ the digital shadow

    async def begin_shadow(self) -> None:
        """Begin a digital shadow, in place of one that is there. Raises `Refusal`, `LineFailure`."""
        async with self._turn:
            if self._jogs:
                raise Refusal(AXIS_IS_JOGGED(name=self.name))
            twin = await self._device.twin(self.name)
            now = self._around.clock()
            self._shadow = DigitalShadow(self.name, self._subject.description.controllers[0].datasheet, twin, now)
            self._registers_due = now + REGISTERS_NS
        self._wanted.set()

    def end_shadow(self) -> None:
        self._shadow = None

    def shadow_state(self, after: Nanos) -> ShadowState | None:
        return None if self._shadow is None else self._shadow.state(after)

    async def _compare(self, shadow: DigitalShadow) -> None:
        """Not while a command is executed, of which the twin knows nothing yet."""
        async with self._turn:
            begun = self._around.clock()
            known = await self._read_known(shadow.points)
            is_at_rest = shadow.compare(known, begun, self._around.clock())
            if is_at_rest and self._around.clock() >= self._registers_due:
                known = await self._read_known(shadow.registers)
                shadow.compare_registers(known, self._around.clock())
                self._registers_due = self._around.clock() + REGISTERS_NS

    async def _read_known(self, points: tuple[str, ...]) -> Known:
        return {one.point: one.value for one in await self._subject.read(*points)}

    # ------------------------------------------------------------------ jogs

    async def begin_jog(self, wanted: command.Jog) -> ExtendableJog:
        return await later(self._begin_jog(wanted))

    async def _begin_jog(self, wanted: command.Jog) -> LeasedJog:
        if self.lost is not None:
            raise LineFailure(CONNECTION_IS_LOST(command="jog", lost=text_of(self.lost)))
        self._refuse_while_stopping(wanted)
        jog = self._device.dead_man_jog(wanted)
        stops = self._stops
        turn = self._jog_turns.setdefault(wanted.axis, asyncio.Lock())
        try:
            async with asyncio.timeout(JOG_WAIT_S):
                await turn.acquire()
        except TimeoutError:
            raise Refusal(JOGGED_ALREADY(name=self.name, axis=wanted.axis)) from None
        held = LeasedJog(jog, self._around.clock, self._report)
        try:
            if self._stops != stops:
                raise Refusal(JOG_STOPPED_MEANWHILE())
            self._jogs[wanted.axis] = held
            if self._shadow is not None:
                self._shadow.jogs(wanted.axis, on=True)
            self._look_away()
            await held.begin()
        except BaseException:
            self._end_jog(wanted.axis)
            raise
        held.on_end(lambda: self._end_jog(wanted.axis))
        return held

    def _cut_jogs(self, stopped: Command) -> None:
        """End the jogs of stopped axes, whoever holds them. Those that other stops end, their driver ends."""
        if not isinstance(stopped, command.StopAxes | command.StopAll):
            return
        axis = stopped.axis if isinstance(stopped, command.StopAxes) else None
        for held in [held for number, held in self._jogs.items() if axis in (None, number)]:
            held.cut()

    def _end_jog(self, axis: int) -> None:
        self._jogs.pop(axis, None)
        if self._shadow is not None:
            self._shadow.jogs(axis, on=False)
        self._jog_turns[axis].release()
        self._wanted.set()

    def _report(self, error: Exception) -> None:
        """Report an error of a jog for whose end no caller waits."""
        if isinstance(error, SteptwinError):
            self._subject.publish(StatusPayload("jog-failed", text_of(error)))
        else:
            self._around.on_internal(error)

    # ------------------------------------------------------------------ the end

    async def close(self) -> None:
        """Jogs end; then it is asked no more. Its line is left open."""
        for held in list(self._jogs.values()):
            held.drop()
            await held.ended()
        self._polling.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._polling


def _is_stop(wanted: Command) -> bool:
    match wanted:
        case command.StopAxes() | command.StopAll():
            return True
        case command.ControlProgram(action=action):
            return action != "start"
        case _:
            return False
