"""Homing HOME0–HOME4 (manual 4.4, MIC-20, MIC-21, MIC-30), leg by leg."""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import Nanos
from steptwin.mic488.config import NO_INPUT, AxisConfig
from steptwin.mic488.inputs import index_input
from steptwin.mic488.status import AxisStatus
from steptwin.state import Stateful

SLOW_PART = 0.2
SLOWEST_P = 1.0
"""MIC-21: later legs run at 20 % of the homing velocity, at least 1 pulse/s."""


class HomingAxis(Protocol):
    """The interface of an axis to its homing."""

    @property
    def number(self) -> int: ...
    @property
    def config(self) -> AxisConfig: ...
    def input_active(self, number: int) -> bool: ...
    def run(self, velocity_p: float, status: AxisStatus, now: Nanos) -> None: ...
    def run_to_stop(self, velocity_p: float, now: Nanos) -> None: ...
    def halt(self, now: Nanos) -> None: ...
    def homed(self, now: Nanos) -> None: ...


class Homing(Stateful):
    """A homing in progress."""

    NONE, TO_SENSOR, OFF_SENSOR, TO_STOP, TO_INDEX = range(5)
    """``leg``: none; to the sensor; until its signal ends; to the mechanical stop; to channel C of the encoder."""

    HOME0, HOME1, HOME2, HOME3, HOME4 = range(5)
    """``HomeMode``."""

    __slots__ = ("leg", "mode", "sensor", "velocity_p")

    def __init__(self) -> None:
        self.leg = Homing.NONE
        self.mode = Homing.HOME0
        self.sensor = NO_INPUT
        self.velocity_p = 0.0

    @property
    def to_index(self) -> bool:
        """Whether it ends on channel C of the encoder."""
        return self.mode in (Homing.HOME3, Homing.HOME4)

    @property
    def passes_soft_limits(self) -> bool:
        """Soft limits are ignored (MIC-30) unless there is no sensor that could end the way (MIC-20)."""
        if self.leg == Homing.NONE:
            return False
        return self.leg != Homing.TO_SENSOR or self.sensor != NO_INPUT

    def start(self, axis: HomingAxis, velocity_p: float, now: Nanos) -> None:
        """Begin at ``velocity_p``, not 0."""
        self.mode = axis.config.home_mode
        self.velocity_p = velocity_p
        self.sensor = axis.config.in_kl if velocity_p < 0.0 else axis.config.in_kr
        if self.mode == Homing.HOME3:
            self.leg = Homing.TO_STOP
            axis.run_to_stop(velocity_p, now)
            return
        self.leg = Homing.TO_SENSOR
        if self.sensor != NO_INPUT and axis.input_active(self.sensor):
            self._at_sensor(axis, now)
        else:
            axis.run(velocity_p, AxisStatus.HOMING, now)

    def input_changed(self, axis: HomingAxis, number: int, active: bool, now: Nanos) -> None:
        """A leg ends at the sensor, where its signal ends, or at channel C."""
        if self.leg == Homing.TO_SENSOR and number == self.sensor and active:
            self._at_sensor(axis, now)
        elif (self.leg == Homing.OFF_SENSOR and number == self.sensor and not active) or (
            self.leg == Homing.TO_INDEX and number == index_input(axis.number - 1) and active
        ):
            axis.homed(now)

    def stop_reached(self, axis: HomingAxis, now: Nanos) -> None:
        """HOME3: the mechanical stop; back to channel C."""
        self._next_leg(axis, Homing.TO_INDEX, -self._slow_p(), now)

    def _at_sensor(self, axis: HomingAxis, now: Nanos) -> None:
        if self.mode == Homing.HOME0:
            axis.homed(now)
        elif self.mode == Homing.HOME1:
            self._next_leg(axis, Homing.OFF_SENSOR, -self._slow_p(), now)
        elif self.mode == Homing.HOME2:
            self._next_leg(axis, Homing.OFF_SENSOR, self._slow_p(), now)
        else:
            self._next_leg(axis, Homing.TO_INDEX, -self._slow_p(), now)

    def _next_leg(self, axis: HomingAxis, leg: int, velocity_p: float, now: Nanos) -> None:
        """Stop without ramp, then begin the next leg slowly (MIC-30)."""
        self.leg = leg
        axis.halt(now)
        axis.run(velocity_p, AxisStatus.HOMING, now)

    def _slow_p(self) -> float:
        speed = max(abs(self.velocity_p) * SLOW_PART, SLOWEST_P)
        return speed if self.velocity_p > 0.0 else -speed
