"""Jogging as a dead-man's switch.

The axis never gets a command to run without end. It repeatedly gets a bounded relative move (POS_REL, at the velocity of the
jog), just long enough for the hold time and the ramp. If it is held in time, it runs evenly; if not, because the button was
released, the program hangs or was killed, or the line was cut, it stops by itself.

Such a move runs at VMAX, whatever its distance, and the controller has no other bounded motion: that is why a jog sets VMAX.
Commands that leave VMAX alone (VEL_ABS, the JOG coils) run without end if the program dies.

Suffixes: ``_u`` configured units, ``_s`` seconds, ``_ns`` nanoseconds.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from types import TracebackType
from typing import Self

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import Overtaken, SentLate, TooLate
from steptwin.drivers.mic488.failures import NotReady, Unconfirmed
from steptwin.drivers.mic488.motion import MotionKind, MoveEnd, Reason, end_of, status_text
from steptwin.drivers.mic488.unit import ControlRegisters, Unit
from steptwin.drivers.mic488.waiting import dynamics
from steptwin.drivers.permission import HOLD_NS, Permission
from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.messages import Message, text_of
from steptwin.mic488.status import AxisStatus

HOLD_S = HOLD_NS / SECOND
"""Time an axis continues after the last `hold` before it brakes, s."""
HOLD_RANGE_S = (0.2, 2.0)
SINGLE = 2.0**-23
"""Relative precision of VMAX, a REAL."""
RENEWALS = 4
"""Number of renewals within the hold time."""
FASTER_THAN_VMAX = Message(
    "drivers.mic488.faster-than-vmax",
    "a jog of M{axis} at {speed:g} {unit}/s is faster than its VMAX, {vmax:g} {unit}/s (which a program that "
    "was killed while it jogged leaves at the velocity of its jog): set VMAX first",
)
TRIGGERED_BY_ANOTHER = Message(
    "drivers.mic488.triggered-by-another",
    "AXIS_CTR_MODE was set to TRIGGER by another program: M{axis} is no longer jogged",
)
MAY_HAVE_BEGUN = Message("drivers.mic488.may-have-begun", "may have begun to jog")
CANNOT_BE_HELD = Message("drivers.mic488.cannot-be-held", "cannot be held any more")
CANNOT_BE_STOPPED = Message("drivers.mic488.cannot-be-stopped", "cannot be stopped")
CANNOT_BE_REACHED = Message(
    "drivers.mic488.cannot-be-reached",
    "M{axis} {what}: the controller cannot be reached ({problem}). "
    "It stops by itself, at most {reach:g} {unit} after it was held last, {since_s:.2f} s ago",
)
WRONG_HOLD_TIME = Message("drivers.mic488.wrong-hold-time", "a hold time of {hold_s:g} s is outside {least:g} to {most:g} s")
JOG_IS_NOT_BEGUN = Message("drivers.mic488.jog-is-not-begun", "a jog is held inside its with block")


class AsyncMic488Jog:
    """A jog of one axis: ``async with axis.jog(5.0) as jog: while pressed(): await jog.hold()``.

    `hold` returns after a quarter of the hold time: call it again at once as long as the axis shall run. It returns False if
    the axis has stopped for another reason, which is in `end`. At the end of the block the axis ramps down, and VMAX, which a
    jog has to change, is restored. A killed program cannot restore it: VMAX then stays at the velocity of the jog. It is never
    raised, so that the axis is left slower, not faster: a jog faster than VMAX raises `NotReady`.
    """

    def __init__(
        self,
        unit: Unit,
        axis: int,
        velocity_u: float,
        hold_s: float,
        on_command: Callable[[MotionKind, float, ControlRegisters | None], None],
    ) -> None:
        least, most = HOLD_RANGE_S
        if not least <= hold_s <= most:
            raise Misuse(WRONG_HOLD_TIME(hold_s=hold_s, least=least, most=most))
        self._unit = unit
        self._axis = axis
        self._velocity_u = velocity_u
        self._hold_s = hold_s
        self._on_command = on_command
        self._renew_ns: Nanos = round(hold_s / RENEWALS * SECOND)
        # A jog begins at once or not at all: preparing it takes four exchanges, of which two may be repeated.
        self._begin_ns: Nanos = round(hold_s * SECOND) + 2 * unit.timeout_ns
        self._reach_u = 0.0
        self._vmax_u: float | None = None
        self._held_ns: Nanos | None = None  # when it was held last
        self._permission: Permission | None = None
        self.end: MoveEnd | None = None
        """Why the axis has stopped; None while it runs."""

    @property
    def reach_u(self) -> float:
        """The longest distance the axis moves after the last `hold`, in u."""
        return self._reach_u

    async def __aenter__(self) -> Self:
        unit, axis = self._unit, self._axis
        begin = unit.permission(axis, patience_ns=self._begin_ns)
        async with unit.lock():
            control = await unit.ready(axis)
            self._on_command(MotionKind.DISTANCE, self._velocity_u, control)
            _, _, _, dec, vmax = await dynamics(unit, axis)
            speed = abs(self._velocity_u)
            if speed > vmax * (1.0 + SINGLE):
                name = unit.unit_name(axis)
                raise NotReady(
                    unit.place,
                    FASTER_THAN_VMAX(axis=axis, speed=speed, vmax=vmax, unit=name),
                )
            self._reach_u = speed * self._hold_s + speed * speed / (2.0 * dec)
            if vmax != speed:
                self._vmax_u = vmax
                await unit.set_axis("VMAX", axis, speed, control.data_type)
        permission = unit.permission(axis, patience_ns=round(self._hold_s * SECOND), has_begun=True)
        try:
            await self._move(control, begin)
            permission.extend()
            self._permission = permission
        except Overtaken:
            self._held_ns, self._permission = unit.line.now(), begin
            self._stopped(Reason.STOPPED, "by this program")
        except SteptwinError as error:
            with contextlib.suppress(SteptwinError):
                await self._put_back()
            if isinstance(error, LineFailure) and not isinstance(error, SentLate):
                raise self._unconfirmed(MAY_HAVE_BEGUN(), error) from error
            raise
        return self

    async def hold(self) -> bool:
        """Let the axis run on; False when it has stopped. Raises `Unconfirmed` if the controller cannot be reached in time."""
        unit, permission = self._unit, self._permission
        if permission is None or self._held_ns is None:
            raise Misuse(JOG_IS_NOT_BEGUN())
        if self.end is not None:
            return False
        await unit.line.sleep((self._held_ns + self._renew_ns - unit.line.now()) / SECOND)
        while not permission.has_expired():
            try:
                control = await self._look()
                if permission.has_expired():
                    break  # the answer may be old
                self._judge(control.axes[self._axis - 1])
                if self.end is None:
                    await self._move(control, permission)
                    permission.extend()
            except Overtaken:
                self._stopped(Reason.STOPPED, "by this program")
            except (TooLate, SentLate):
                break
            except LineFailure as failure:
                if not permission.has_expired():
                    continue
                raise self._unconfirmed(CANNOT_BE_HELD(), failure) from failure
            return self.end is None
        # The operator was away: the axis must not continue afterwards without `hold`.
        self._not_held()
        return False

    async def _look(self) -> ControlRegisters:
        control = await self._unit.control(timeout_ns=self._exchange_ns())
        if control.triggered:
            raise NotReady(self._unit.place, TRIGGERED_BY_ANOTHER(axis=self._axis))
        return control

    def _exchange_ns(self) -> Nanos:
        """Time-out of an exchange, ns: short enough to repeat it within the hold time."""
        return min(self._unit.timeout_ns, self._renew_ns)

    async def _move(self, control: ControlRegisters, permission: Permission) -> None:
        """Send the move for the hold time from now on."""
        unit, axis = self._unit, self._axis
        distance = self._reach_u if self._velocity_u > 0.0 else -self._reach_u
        at = unit.line.now()
        async with unit.stopping_if_late(axis):
            await unit.set_axis(
                "POS_REL", axis, distance, control.data_type, permission=permission, timeout_ns=self._exchange_ns()
            )
        self._held_ns = at

    def _judge(self, status: int) -> None:
        """Find the end of the jog in the status of the axis."""
        if status == AxisStatus.POSITION:
            return
        if status in (AxisStatus.VELOCITY, AxisStatus.HOMING):
            self._stopped(Reason.DIVERTED, status_text(status))
            return
        reason = end_of(status)
        if reason is Reason.TARGET or status == AxisStatus.CORRECTION:
            reason = Reason.NOT_HELD
        self._stopped(reason, status_text(status) if reason is Reason.STOPPED else "")

    def _stopped(self, reason: Reason, detail: str) -> None:
        unit = self._unit
        held = self._held_ns or unit.line.now()
        self.end = MoveEnd(self._axis, reason, None, unit.unit_name(self._axis), (unit.line.now() - held) / SECOND, detail)

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            await self.release()
        except SteptwinError:
            if error is None or not isinstance(error, LineFailure):
                raise

    async def release(self) -> None:
        """Ramp down, and put VMAX back. Raises `Unconfirmed` if the controller cannot be reached."""
        unit = self._unit
        if self.end is None and self._held_ns is not None:
            try:
                # Not when it is too late: the axis is at rest then, and may be moved by another master.
                await unit.set_axis("VEL_ABS", self._axis, 0.0, unit.wording.data_type, permission=self._permission)
            except Overtaken:
                self._stopped(Reason.STOPPED, "by this program")
            except (TooLate, SentLate):
                self._not_held()
            except LineFailure as failure:
                raise self._unconfirmed(CANNOT_BE_STOPPED(), failure) from failure
            else:
                self._stopped(Reason.RELEASED, "")
                self._on_command(MotionKind.VELOCITY, 0.0, None)
        await self._put_back()

    def _not_held(self) -> None:
        held = self._held_ns or 0
        self._stopped(Reason.NOT_HELD, f"{(self._unit.line.now() - held) / SECOND:.2f} s since it was held")

    async def _put_back(self) -> None:
        vmax, self._vmax_u = self._vmax_u, None
        if vmax is not None and vmax != abs(self._velocity_u):
            await self._unit.set_axis("VMAX", self._axis, vmax, self._unit.wording.data_type)

    def _unconfirmed(self, what: str, failure: LineFailure) -> Unconfirmed:
        unit = self._unit
        name = unit.unit_name(self._axis)
        since = (unit.line.now() - (self._held_ns or unit.line.now())) / SECOND
        self._stopped(Reason.COMMUNICATION, str(failure))
        return Unconfirmed(
            CANNOT_BE_REACHED(axis=self._axis, what=what, problem=text_of(failure), reach=self._reach_u, unit=name, since_s=since)
        )
