"""The motor side of the chip: settings of the next move, moves, seeks, forced stops, jog, the position counter.

``_u`` are minimum microsteps (full step/64). The true position counts from power-on and is never set; the position counter has
24 bits and is the true position plus an offset.
"""

from __future__ import annotations

import enum
from math import inf
from typing import ClassVar

from steptwin.controller import MICROSECOND, SECOND, Nanos
from steptwin.m1486.lines import Interface
from steptwin.m1486.microsteps import (
    DEFAULT_DISTANCE_U,
    DEFAULT_PROFILE,
    DEFAULT_VELOCITY,
    FULL_STEP,
    HIGHEST_SPEED,
    PAIRS,
    low_range_limit,
    microstep_size,
)
from steptwin.m1486.unit import MASK
from steptwin.m1486.variants import Variant
from steptwin.messages import Message
from steptwin.motion import Profile, at_rest
from steptwin.motion.divisions import Microstepping, StepTrain, forced_stop, step_train
from steptwin.motion.profile import cruise
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless
from steptwin.motion.waveforms import currents
from steptwin.state import Stateful

SEEK_LANDING_U = 4 * FULL_STEP
"""Function 52: a seek ends on a multiple of four full steps, one electrical period."""
JOG_NS: Nanos = 25 * MICROSECOND
"""M-18: a jog pulse gives one step, as fast as the chip steps at all (40 000 a second); pulses that come faster are missed."""


class MotionMode(enum.Enum):
    REST = "at rest"
    MOVE = "move"
    """F, B, G and H: the distance is known."""
    ENDLESS = "endless"
    """G+ and G-."""
    SEEK = "seek"
    JOG = "jog"


BUSY = frozenset({MotionMode.MOVE, MotionMode.ENDLESS, MotionMode.SEEK})
"""Motions of R and the seeks: they stall the compression, hold BOOST low and keep jog pulses out."""


def speed_curve(settings: tuple[float, float, float, float], qualification: int, clock: int) -> SpeedCurve:
    """The speed curve of a move with S, A, P and V, in minimum microsteps; ``clock`` is that of the variant."""
    start_stop, acceleration, profile, velocity = settings
    # M-34: V may ask for more than Q permits.
    top = min(velocity, HIGHEST_SPEED[qualification])
    unit = FULL_STEP * clock
    return SpeedCurve(float(start_stop * unit), float(acceleration * unit * clock), float(profile * unit), float(top * unit))


class WrongMove(Exception):
    """A move that cannot start; the text gives the reason."""


DISTANCE_OFF_THE_GRID = Message(
    "m1486.distance-off-the-grid", "the distance {distance} is not a multiple of {grid} (M{microstep})"
)
MICROSTEPS_AND_QUALIFICATION = Message(
    "m1486.microsteps-and-qualification", "M{microstep} and Q{qualification} do not go together"
)


class ChipDrive(Stateful):
    """The axis of a chip: a `steptwin.motioncontroller.Drive`."""

    FIXED: ClassVar[tuple[str, ...]] = ("_clock",)
    __slots__ = (
        *FIXED,
        "_curve",
        "acceleration",
        "characteristic",
        "distance_u",
        "endless",
        "grid_u",
        "is_energised",
        "is_stopping",
        "is_valid",
        "microstep",
        "motion",
        "offset_u",
        "profile_speed",
        "qualification",
        "revision",
        "start_stop",
        "train",
        "velocity",
    )
    offset_p = 0
    """0: traces show the count since power-on, because the position counter has its own scale and 24 bits (`counter_u`)."""

    def __init__(self, variant: Variant, interface: Interface) -> None:
        self._clock = variant.clock
        self.revision = 0
        self.is_energised = True
        self.reset_settings(variant, interface)
        self._curve = self._speed_curve()
        self.motion = MotionMode.REST
        self.is_stopping = False
        self.train = self._resting(0, 0)
        self.zero_counter(0)

    def reset_settings(self, variant: Variant, interface: Interface) -> None:
        """Settings after power-up and reset; speeds in full steps/s as commands give them."""
        self.start_stop = variant.start_stop
        self.acceleration = variant.acceleration
        self.profile_speed = DEFAULT_PROFILE
        self.velocity = DEFAULT_VELOCITY
        self.set_microstep(interface.microstep)
        self.qualification = 1
        self.characteristic = 1
        self.distance_u = DEFAULT_DISTANCE_U
        """The next move: its signed distance, or its direction if it is endless (else 0)."""
        self.endless = 0

    def set_acceleration(self, number: int) -> None:
        self.acceleration = number

    def set_start_stop(self, number: int) -> None:
        self.start_stop = number

    def set_profile_speed(self, number: int) -> None:
        self.profile_speed = number

    def set_velocity(self, number: int) -> None:
        self.velocity = number

    def set_qualification(self, number: int) -> None:
        self.qualification = number

    def set_characteristic(self, number: int) -> None:
        self.characteristic = number

    def set_microstep(self, microstep: int) -> None:
        self.microstep = microstep
        self.grid_u = microstep_size(microstep)

    # ------------------------------------------------------------------ where it is

    @property
    def plan(self) -> StepTrain:
        """The pulse train in force."""
        return self.train

    @property
    def profile(self) -> Profile:
        """Commanded true position, in minimum microsteps."""
        return self.train.profile

    @property
    def is_busy(self) -> bool:
        return self.motion in BUSY

    def true_u(self, now: Nanos) -> int:
        """The count of all pulses since power-on."""
        return self.train.count(now)

    def counter_u(self, now: Nanos) -> int:
        """The position counter. M-16: a move of known distance is in it from its start."""
        if self.motion is MotionMode.MOVE:
            return (self._final_u() + self.offset_u) & MASK
        return (self.true_u(now) + self.offset_u) & MASK

    def set_counter(self, value_u: int, now: Nanos) -> None:
        self.offset_u = value_u - self.true_u(now)
        self.is_valid = True

    def zero_counter(self, now: Nanos) -> None:
        self.set_counter(0, now)

    def currents(self, now: Nanos) -> tuple[int, int]:
        """Signed 7-bit currents of both phases; M-25: PHASE is high where they are negative."""
        return currents(self.characteristic, self.true_u(now))

    def deadline(self) -> Nanos | None:
        """When the motion ends."""
        return None if self.motion is MotionMode.REST else self.train.profile.end

    def _final_u(self) -> int:
        return self.train.profile.base + self.train.profile.counts[-1]

    # ------------------------------------------------------------------ specification of the next move

    def go_to(self, position_u: int, now: Nanos) -> None:
        """G and H (M-9, M-10): the distance is fixed here."""
        self.distance_u = position_u - self.counter_u(now)
        self.endless = 0

    def reverse(self) -> None:
        self.distance_u = -self.distance_u
        self.endless = -self.endless

    # ------------------------------------------------------------------ motion

    def run(self, now: Nanos) -> bool:
        """Start the move specified last; False if it leads nowhere. Raises `WrongMove`."""
        microstepping = self._microstepping()
        begin = self.true_u(now)
        self._curve = self._speed_curve()
        if self.endless:
            self._start(MotionMode.ENDLESS, step_train(plan_endless(now, begin, self.endless, self._curve), begin, microstepping))
            return True
        if self.distance_u % self.grid_u:
            raise WrongMove(DISTANCE_OFF_THE_GRID(distance=self.distance_u, grid=self.grid_u, microstep=self.microstep))
        if self.distance_u == 0:
            return False
        profile = plan_distance(now, begin, begin + self.distance_u, self._curve)
        self._start(MotionMode.MOVE, step_train(profile, begin, microstepping))
        return True

    def seek(self, direction: int, now: Nanos) -> None:
        """Run at start/stop speed until stopped. Raises `WrongMove`."""
        microstepping = self._microstepping()
        begin = self.true_u(now)
        speed = self._speed(self.start_stop)
        self._curve = SpeedCurve(speed, self._acceleration(), speed, speed)
        self._start(MotionMode.SEEK, step_train(plan_endless(now, begin, direction, self._curve), begin, microstepping))

    def force_stop(self, now: Nanos, landing_u: int | None) -> None:
        """End the motion with its ramp, and then on a multiple of ``landing_u`` (or wherever it ends)."""
        target_u = self._final_u() if self.motion is MotionMode.MOVE else None
        self._replace(forced_stop(self.train, now, self._curve, landing_u))
        self._keep_counter_at(target_u)
        self.is_stopping = True

    def stop_at_once(self, now: Nanos) -> None:
        """The pulses of a motion end, as at a reset."""
        target_u = self._final_u() if self.motion is MotionMode.MOVE else None
        self._replace(self._resting(now, self.true_u(now)))
        self._keep_counter_at(target_u)
        self.finish()

    def _keep_counter_at(self, target_u: int | None) -> None:
        """The counter keeps the target of an unfinished move and is invalid (M-16)."""
        if target_u is not None:
            self.offset_u += target_u - self._final_u()
            self.is_valid = False

    def jog(self, direction: int, now: Nanos) -> None:
        """One step. Called at rest only."""
        begin = self.true_u(now)
        end_s = JOG_NS / SECOND
        profile = Profile(now, begin, (cruise(0.0, end_s, 0.0, direction * self.grid_u / end_s),), float(direction * self.grid_u))
        self._start(MotionMode.JOG, step_train(profile, begin, Microstepping(self.grid_u, self.grid_u, inf)))

    def finish(self) -> None:
        """The motion has ended."""
        self.motion = MotionMode.REST

    def _start(self, motion: MotionMode, train: StepTrain) -> None:
        self.motion = motion
        self.is_stopping = False
        self._replace(train)

    def _replace(self, train: StepTrain) -> None:
        self.train = train
        self.revision += 1

    def _resting(self, now: Nanos, position_u: int) -> StepTrain:
        return step_train(at_rest(now, position_u), position_u, Microstepping(self.grid_u, self.grid_u, inf))

    # ------------------------------------------------------------------ settings in units of motion

    def _microstepping(self) -> Microstepping:
        """Raises `WrongMove` for divisions that do not go together (M-11)."""
        microstep, qualification = self.microstep, self.qualification
        if qualification not in PAIRS[microstep]:
            raise WrongMove(MICROSTEPS_AND_QUALIFICATION(microstep=microstep, qualification=qualification))
        return Microstepping(self.grid_u, microstep_size(qualification), self._speed(low_range_limit(microstep)))

    def _speed_curve(self) -> SpeedCurve:
        settings = self.start_stop, self.acceleration, self.profile_speed, self.velocity
        return speed_curve(settings, self.qualification, self._clock)

    def _speed(self, full_steps_per_s: float) -> float:
        return float(full_steps_per_s * FULL_STEP * self._clock)

    def _acceleration(self) -> float:
        return float(self.acceleration * FULL_STEP * self._clock * self._clock)
