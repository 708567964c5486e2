"""A dead-man jog of a MIC488: relative moves, each as far as the axis gets until it is to brake, and then its braking distance.

A move runs at VMAX, so VMAX is the velocity of the jog for as long as that lasts, as with the driver
(`steptwin.drivers.mic488.jog`); it is never raised.
"""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXES, AXIS_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Jog
from steptwin.simulation.script.deadmanjog import STOP_NS, Given

SHORTEST_NS: Nanos = 160 * MILLISECOND
LONGEST_NS: Nanos = 250 * MILLISECOND
"""How long it goes on after it was extended: as long as its ramp leaves time before `STOP_NS`."""
LAPSED = "lapsed"
BEGIN_NS: Nanos = 200 * MILLISECOND
"""In which the first request gets over the line."""
OWN = frozenset({AxisStatus.POSITION, AxisStatus.REACHED, AxisStatus.CORRECTION})
"""Statuses of an axis during a jog; another status means that the axis was stopped or has another motion."""
SAME = 1e-6
"""Velocities that differ by less, as a fraction, are the same: they go through a REAL."""
UNKNOWN_AXIS = Message("simulation.mic488.unknown-axis", "{controller}: no axis {axis}: a MIC488 has 1 to {most}")
IS_NOT_ENABLED = Message("simulation.mic488.is-not-enabled", "{name} is not enabled: switch its drive on first")
HAS_A_POSITION_ERROR = Message("simulation.mic488.has-a-position-error", "{name} has a position error: stop it first")
PROGRAM_IS_RUNNING = Message(
    "simulation.mic488.program-is-running", "{controller} runs its program: pause or stop it before an axis is jogged"
)
WAITS_FOR_TRIGGERS = Message(
    "simulation.mic488.waits-for-triggers", "{controller} waits for triggers (AXIS_CTR_MODE), so an axis cannot be jogged"
)
WRONG_VELOCITY = Message(
    "simulation.mic488.wrong-velocity",
    "velocity = {velocity:g} {unit}/s: permitted are {least:g} to {most:g} {unit}/s (VMAX), but not 0",
)


class Mic488DeadManJog:
    """See `steptwin.simulation.script.deadmanjog.DeadManJog`. Raises `Misuse` for a velocity, `Refusal` for an axis that cannot
    be jogged now."""

    def __init__(self, device: Mic488Device, line: str | None, wanted: Jog) -> None:
        if not 1 <= wanted.axis <= AXES:
            raise Misuse(UNKNOWN_AXIS(controller=wanted.controller, axis=wanted.axis, most=AXES))
        self._device = device
        self._axis: Axis = device.axes[wanted.axis - 1]
        self._wanted = wanted
        self._check()
        axis = self._axis
        self._speed_p = abs(wanted.velocity) * axis.gear
        self._vmax_p = axis.vmax_p
        brake_ns = round(self._speed_p / axis.down_p * SECOND)
        self.lasts_ns: Nanos = min(max(STOP_NS - brake_ns, SHORTEST_NS), LONGEST_NS)
        self.over: str | None = None
        self._begun: Nanos | None = None
        self._brakes = False
        self._revision = self._axis.revision
        self._before: int | None = None
        """The revision of the axis when it was last extended: as long as it is the same, that request is on its way."""
        self._due: Nanos | None = None
        self._is_put_back = self._has_same_speed()

    def _check(self) -> None:
        wanted, axis = self._wanted, self._axis
        name = f"{wanted.controller} M{wanted.axis}"
        if not axis.can_move:
            raise Refusal(IS_NOT_ENABLED(name=name))
        if axis.status is AxisStatus.ERROR:
            raise Refusal(HAS_A_POSITION_ERROR(name=name))
        if self._device.program.state is ProgramState.RUNNING:
            raise Refusal(PROGRAM_IS_RUNNING(controller=wanted.controller))
        if self._device.trigger_mode:
            raise Refusal(WAITS_FOR_TRIGGERS(controller=wanted.controller))
        vmax = axis.vmax_p / axis.gear
        if not 0.0 < abs(wanted.velocity) <= vmax * (1.0 + SAME):
            unit = axis.config.unit_name
            raise Misuse(WRONG_VELOCITY(velocity=wanted.velocity, unit=unit, least=-vmax, most=vmax))

    def _has_same_speed(self) -> bool:
        return abs(self._axis.vmax_p - self._speed_p) <= SAME * self._speed_p

    # ------------------------------------------------------------------ as `DeadManJog`

    def extend(self, now: Nanos) -> Given:
        if self.over is not None:
            return ()
        axis = self._axis
        self._begun = now if self._begun is None else self._begun
        has_moved = axis.revision != self._revision
        if axis.status not in OWN and (has_moved or now - self._begun > BEGIN_NS):
            self.over = f"{self._wanted.controller} M{axis.number}: {AXIS_STATUS_TEXTS[axis.status]}"
            self._due = now
            return self.advance(now)
        self._due, self._before = now + STOP_NS, axis.revision
        set_vmax = () if self._has_same_speed() else (self._value("VMAX", self._speed_p / axis.gear),)
        return (do.Write((*set_vmax, self._value("POS_REL", self._distance(now)))),)

    def _distance(self, now: Nanos) -> float:
        """Where the axis comes to rest when it begins to brake after `lasts_ns`, in units from here."""
        axis = self._axis
        direction = 1.0 if self._wanted.velocity > 0.0 else -1.0
        before_p = max(direction * axis.profile.velocity(now), 0.0)
        lasts_s = self.lasts_ns / SECOND
        rising_s = min(max(self._speed_p - before_p, 0.0) / axis.up_p, lasts_s)
        top_p = min(before_p + axis.up_p * rising_s, self._speed_p)
        rise_p = 0.5 * (before_p + top_p) * rising_s
        way_p = rise_p + top_p * (lasts_s - rising_s) + top_p * top_p / (2.0 * axis.down_p)
        return direction * max(way_p, 1.0) / axis.gear

    def release(self, now: Nanos) -> Given:
        if self.over is not None:
            return ()
        self.over = "let go"
        if self._axis.status is AxisStatus.POSITION or self._axis.revision == self._before:  # what is sent now comes behind it
            self._due, self._brakes = now + STOP_NS, True
            return (do.Write((self._value("VEL_ABS", 0.0), *self._put_back())),)
        self._due = now
        return self.advance(now)

    def drop(self, now: Nanos) -> Given:
        due, is_over = self._due, self.over is not None
        given = self.release(now)
        if not is_over and self._due is not None:
            self.over, self._due = LAPSED, due
        return given

    def cut(self) -> None:
        self.over = self.over or "stopped"

    def deadline(self) -> Nanos | None:
        return self._due

    def advance(self, now: Nanos) -> Given:
        if self._due is None or now < self._due:
            return ()
        self._due = None
        if self.over is None:
            self.over = LAPSED
        is_own = self.over == LAPSED and self._axis.status in (AxisStatus.POSITION, AxisStatus.VELOCITY if self._brakes else None)
        stop = (self._value("STOP", 1.0),) if is_own and self._axis.profile.moving(now) else ()
        values = (*stop, *self._put_back())
        return (do.Write(values),) if values else ()

    def _put_back(self) -> tuple[tuple[str, str, float], ...]:
        if self._is_put_back:
            return ()
        self._is_put_back = True
        return (self._value("VMAX", self._vmax_p / self._axis.gear),)

    def _value(self, register: str, value: float) -> tuple[str, str, float]:
        return self._wanted.controller, f"M{self._axis.number}_{register}", value
