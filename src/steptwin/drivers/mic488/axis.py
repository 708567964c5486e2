"""One axis of a MIC488."""

from __future__ import annotations

from math import isfinite

from steptwin.drivers.mic488.failures import unconfirmed
from steptwin.drivers.mic488.jog import HOLD_S, AsyncMic488Jog
from steptwin.drivers.mic488.motion import MotionCommand, MotionKind, MoveEnd
from steptwin.drivers.mic488.unit import URGENT_TRIES, ControlRegisters, Unit, check_axis
from steptwin.drivers.mic488.waiting import AxisWait, wait_for
from steptwin.errors import LineFailure, Misuse
from steptwin.messages import Message
from steptwin.mic488.axis import MAX_SPEED_P
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN

_KEYS = {
    MotionKind.POSITION: "POS_ABS",
    MotionKind.DISTANCE: "POS_REL",
    MotionKind.VELOCITY: "VEL_ABS",
    MotionKind.HOMING: "HOME",
}
HOMING_WITHOUT_VELOCITY = Message(
    "drivers.mic488.homing-without-velocity", "homing of M{number} at 0 {unit}/s: the sign of the velocity chooses the switch"
)
JOG_WITHOUT_VELOCITY = Message("drivers.mic488.jog-without-velocity", "a jog of M{number} at 0 {unit}/s does not move")
WRONG_DIRECTION = Message("drivers.mic488.wrong-direction", "direction {direction}: permitted are 1 and -1")
NO_NUMBER = Message("drivers.mic488.no-number", "M{number}: {value_u} {unit} is not a {kind}")
OUT_OF_RANGE = Message(
    "drivers.mic488.out-of-range",
    "M{number}: {kind} {value_u:g} {unit} is outside {low:.6g}…{high:.6g} {unit} ({least:.0f}…{most:.0f} pulses)",
)


class AsyncMic488Axis:
    """Axis ``number`` (from 1). Positions, velocities and accelerations are in its configured unit: u, u/s, u/s²."""

    def __init__(self, unit: Unit, number: int) -> None:
        self._unit = unit
        self.number = check_axis(number)
        self._motion: MotionCommand | None = None

    def __repr__(self) -> str:
        return f"<AsyncMic488Axis M{self.number} of unit {self._unit.number} on {self._unit.place}>"

    @property
    def unit(self) -> str:
        """Name of the configured unit; ``u`` if unknown."""
        return self._unit.unit_name(self.number)

    @property
    def gear(self) -> float | None:
        """Pulses per unit; None if unknown."""
        return self._unit.gear(self.number)

    # ------------------------------------------------------------------ what it does

    async def status(self) -> int:
        """Mx_STATUS, see `steptwin.mic488.status.AxisStatus`."""
        return (await self._unit.control()).axes[self.number - 1]

    async def position(self) -> float:
        """Counted position in u."""
        return await self._value_in_units("POS_ACT")

    async def velocity(self) -> float:
        """Present velocity in u/s."""
        return await self._value_in_units("VEL_ACT")

    async def encoder(self) -> int:
        """Counter of the axis' encoder, in encoder pulses."""
        item = self._unit.item("ENC_IMP", self.number)
        return int((await self._unit.read([item]))[item])

    async def _value_in_units(self, key: str) -> float:
        unit = self._unit
        item = unit.item(key, self.number)
        data_type = (await unit.control()).data_type
        value, _ = unit.in_units(item, (await unit.read([item], data_type))[item], data_type)
        return float(value)

    # ------------------------------------------------------------------ drive and settings

    async def enable(self) -> None:
        """Switch the drive on."""
        await self._unit.write(self._unit.item("EN", self.number), True)

    async def disable(self) -> None:
        """Switch the drive off: pulses end at once. It precedes all waiting requests."""
        await self._halt("EN", on=False, what="switched off")

    async def set_position(self, position_u: float) -> None:
        """Set the counted position. The axis does not move; a motion in progress keeps its distance (MIC-13)."""
        await self._store("POS_ACT", position_u)

    async def set_ramp(self, *, acc: float | None = None, dec: float | None = None, velocity: float | None = None) -> None:
        """Set ACC, DEC (u/s²) and VMAX (u/s), each above 0, for the motions that follow; they are lost at power-off."""
        for key, value in (("ACC", acc), ("DEC", dec), ("VMAX", velocity)):
            if value is not None:
                if key == "VMAX":
                    self.check(MotionKind.VELOCITY, value)
                await self._store(key, value)

    async def set_limits(self, *, left: float | None = None, right: float | None = None) -> None:
        """Set the soft limits POSLIM_L and POSLIM_R in u; they are lost at power-off."""
        for key, value in (("POSLIM_L", left), ("POSLIM_R", right)):
            if value is not None:
                await self._store(key, value)

    async def _store(self, key: str, value_u: float) -> None:
        control = await self._unit.control()
        await self._unit.set_axis(key, self.number, value_u, control.data_type)

    # ------------------------------------------------------------------ motion

    async def move_to(self, position_u: float) -> None:
        """Begin to move to a position, with ACC, DEC and VMAX. `wait` waits for the end.

        Raises `Misuse` for a position outside the register, `NotReady` if the drive is off.
        """
        self.check(MotionKind.POSITION, position_u)
        await self._begin(MotionKind.POSITION, position_u)

    async def move_by(self, distance_u: float) -> None:
        """Begin to move by a distance from the present position.

        It is sent only once: if its answer is lost, it is unknown whether the axis moves, and `NoAnswer` is raised with
        ``uncertain``.
        """
        self.check(MotionKind.DISTANCE, distance_u)
        await self._begin(MotionKind.DISTANCE, distance_u)

    async def move_velocity(self, velocity_u: float) -> None:
        """Run at a velocity (u/s) until the next command; 0 ramps down."""
        self.check(MotionKind.VELOCITY, velocity_u)
        await self._begin(MotionKind.VELOCITY, velocity_u)

    async def home(self, velocity_u: float) -> None:
        """Begin homing at this velocity: negative towards the switch KL, positive towards KR. Sent only once, as `move_by`."""
        self.check(MotionKind.HOMING, velocity_u)
        if velocity_u == 0.0:
            raise Misuse(HOMING_WITHOUT_VELOCITY(number=self.number, unit=self.unit))
        await self._begin(MotionKind.HOMING, velocity_u)

    async def _begin(self, kind: MotionKind, value_u: float) -> None:
        unit = self._unit
        permission = unit.permission(self.number)
        async with unit.lock(), unit.stopping_if_late(self.number):
            control = await unit.ready(self.number)
            self._motion = None
            await unit.set_axis(_KEYS[kind], self.number, value_u, control.data_type, permission=permission)
            self.register_command(kind, value_u, control)

    def register_command(self, kind: MotionKind, value_u: float, control: ControlRegisters | None) -> None:
        """Register a motion command; ``control`` is the state before it."""
        before = -1 if control is None else control.axes[self.number - 1]
        self._motion = MotionCommand(kind, value_u, self._unit.line.now(), before)

    async def wait(self, timeout_s: float | None = None, *, check: bool = True) -> MoveEnd:
        """Wait until the axis is at rest, and return why.

        Without ``timeout_s`` the time is computed from the motion; for homing it is a minute. Raises `MoveFailed` unless the
        motion ended as intended, and a `LineFailure` if the line fails; with ``check`` false both are returned as the end. A
        motion in velocity mode needs ``timeout_s``.
        """
        watch = AxisWait(self._unit, self.number, self._motion, timeout_s)
        return (await wait_for(self._unit, {self.number: watch}, check=check))[self.number]

    def watch(self, timeout_s: float | None) -> AxisWait:
        return AxisWait(self._unit, self.number, self._motion, timeout_s)

    async def stop(self) -> None:
        """Stop at once, without ramp. It precedes all waiting requests.

        Motions of this axis that wait for the line are not begun. Raises `Unconfirmed`.
        """
        await self._halt("STOP", on=True, what="stopped")

    async def _halt(self, key: str, *, on: bool, what: str) -> None:
        unit = self._unit
        with unit.stopping(self.number):
            try:
                await unit.write(unit.item(key, self.number), on, urgent=True, most_attempts=URGENT_TRIES)
            except LineFailure as failure:
                raise unconfirmed(f"M{self.number}", what, failure) from failure
        self.forget()

    def forget(self) -> None:
        """Forget the present motion, which was ended on purpose."""
        self._motion = None

    # ------------------------------------------------------------------ jogging

    def jog(self, velocity_u: float, *, hold_s: float = HOLD_S) -> AsyncMic488Jog:
        """Run at a velocity (u/s) while it is held: a dead-man's switch. See `AsyncMic488Jog`.

        ``hold_s``: time the axis continues without `hold` before it brakes by itself, 0.2 to 2 s.
        """
        self.check(MotionKind.VELOCITY, velocity_u)
        if velocity_u == 0.0:
            raise Misuse(JOG_WITHOUT_VELOCITY(number=self.number, unit=self.unit))
        return AsyncMic488Jog(self._unit, self.number, velocity_u, hold_s, self.register_command)

    async def jog_bit(self, direction: int, on: bool) -> None:
        """Write the coil JOG_PLUS (direction +1) or JOG_MINUS (−1): the axis runs at JOG_SPEED **until the coil is written OFF**.

        Nothing stops it when this program or the line fails; `jog` is the safe way.
        """
        if direction not in (1, -1):
            raise Misuse(WRONG_DIRECTION(direction=direction))
        unit = self._unit
        item = unit.item("JOG_PLUS" if direction > 0 else "JOG_MINUS", self.number)
        if not on:
            await unit.write(item, False, urgent=True, most_attempts=URGENT_TRIES)
            return
        permission = unit.permission(self.number)
        async with unit.lock(), unit.stopping_if_late(self.number):
            await unit.ready(self.number)
            self._motion = None
            await unit.write(item, True, permission=permission)

    # ------------------------------------------------------------------ ranges

    def check(self, kind: MotionKind, value_u: float) -> None:
        """Raises `Misuse` for a position outside the register or a velocity outside the outputs, if GEAR is known."""
        gear = self._unit.gear(self.number)
        is_velocity = kind in (MotionKind.VELOCITY, MotionKind.HOMING)
        unit = f"{self.unit}/s" if is_velocity else self.unit
        if not isfinite(value_u):
            raise Misuse(NO_NUMBER(number=self.number, value_u=value_u, unit=unit, kind=kind.value))
        if gear is None:
            return
        least, most = (-MAX_SPEED_P, MAX_SPEED_P) if is_velocity else (DINT_MIN, DINT_MAX)
        if not least <= value_u * gear <= most:
            raise Misuse(
                OUT_OF_RANGE(
                    number=self.number,
                    kind=kind.value,
                    value_u=value_u,
                    unit=unit,
                    low=least / gear,
                    high=most / gear,
                    least=least,
                    most=most,
                )
            )
