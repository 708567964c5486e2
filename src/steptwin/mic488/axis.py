"""One axis of a MIC488: its commands, how they are planned, limits, switches, and how a motion ends.

Suffixes: ``_p`` pulses (and pulses/s, pulses/s²), ``_u`` configured units, ``_ns`` moments and durations.

Three positions: the *motor* count is pulses since power-on and never jumps; profiles live in it. The *coordinate* is what
registers show: motor count plus ``offset_p`` (writing POS_ACT only moves the offset, MIC-13). The *true* position is that of
the shaft according to the encoder.
"""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.mic488.config import NO_INPUT, AxisConfig
from steptwin.mic488.encoder import Coupling, Encoder
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, wrapped_dint
from steptwin.mic488.homing import Homing
from steptwin.mic488.path import Path
from steptwin.mic488.position_control import PositionControl
from steptwin.mic488.status import LIMIT, AxisStatus
from steptwin.motion import MotionState, Profile, at_rest, plan_position, plan_stop, plan_velocity
from steptwin.motion.planner import LEAST, MOST
from steptwin.state import Plain, Stateful

MAX_SPEED_P = 64_000.0
"""Pulses/s an axis can give [1.74]; higher commanded speeds are clamped and reported."""

SLOWEST_RAMP_P = 0.01
"""Pulses/s²: 74 days to the highest speed. With less, a double could not resolve braking distances to a pulse."""

STRIDE_P = 2**32
"""Bound of a distance required by an encoder: more than any position register holds, small enough for planning."""

NEAR_P = 1e-6
"""A braking that would end this close behind a soft limit ends on it: more than rounding errors, less than any pulse."""


class AxisHost(Protocol):
    """The interface of the controller to an axis."""

    def input_active(self, number: int) -> bool:
        """State of input ``number`` (from 0) after polarity, before the filter (MIC-30)."""
        ...

    def axis_event(self, axis: int, code: str, detail: str, now: Nanos) -> None:
        """Record an event of ``axis`` (from 1)."""
        ...

    def drive_output(self, axis: int, on: bool, now: Nanos) -> None:
        """The EN output of ``axis`` (from 1) changed."""
        ...

    def path_limited(self, now: Nanos) -> None:
        """The soft limits of an axis on a path, or its coordinate, have been written."""
        ...

    def position_error(self, axis: int, now: Nanos) -> None:
        """``axis`` gave up correcting its position (status 5)."""
        ...


IS_NOT_ENABLED = Message("mic488.is-not-enabled", "{what} ignored: M{axis} is not enabled")
CANNOT_BRAKE = Message("mic488.cannot-brake", "M{axis} cannot brake before its soft limit")
VELOCITY_IS_CLAMPED = Message(
    "mic488.velocity-is-clamped", "M{axis}: {velocity:g} imp/s is more than the outputs give, {most:g} imp/s"
)
STOPPED_BY_LIMIT = Message("mic488.stopped-by-limit", "M{axis} stopped by {limit}")
IS_HOMED = Message("mic488.is-homed", "M{axis} is at its home position")
POSITION_COMMAND = Message("mic488.position-command", "position command")
VELOCITY_COMMAND = Message("mic488.velocity-command", "velocity command")
HOMING = Message("mic488.homing", "homing")


class Axis(Stateful):
    """Axis ``number`` (from 1) of a MIC488."""

    FIXED = ("config", "gear", "host", "number", "revision")
    __slots__ = (
        *FIXED,
        "_blocked_leg",
        "acc_p",
        "arrival",
        "control",
        "dec_p",
        "enabled",
        "encoder",
        "fall_p",
        "homing",
        "jogging",
        "limit_l_p",
        "limit_r_p",
        "offset_p",
        "path",
        "pending",
        "profile",
        "ramp_p",
        "rise_p",
        "speed_p",
        "status",
        "target_p",
        "velocity_p",
        "vmax_p",
    )

    def __init__(self, number: int, config: AxisConfig, host: AxisHost) -> None:
        self.number = number
        self.config = config
        self.host = host
        self.gear: float = config.gear
        self.profile: Profile = at_rest(0, 0)
        self.revision = 0
        """Counts replacements of ``profile``, so that mechanics notice."""
        follows = config.pos_ctrl_mode == PositionControl.ENCFOLLOW
        self.encoder = Encoder(config.enc_resol, config.mot_resol, Coupling.FREE if follows else Coupling.DRIVE)
        self.homing = Homing()
        self.control = PositionControl()
        self.acc_p: float
        """ACC, stored in pulses, whatever DATA_TYPE is (MIC-17), as are ``dec_p`` and ``vmax_p``."""
        self.dec_p: float
        """DEC."""
        self.vmax_p: float
        """VMAX."""
        self.limit_l_p: int
        """Left soft limit, a coordinate; `DINT_MIN` does not limit (MIC-12)."""
        self.limit_r_p: int
        """Right soft limit, a coordinate; `DINT_MAX` does not limit (MIC-12)."""
        self.offset_p: int
        """Coordinate at motor count 0."""
        self.jogging: int
        """Direction the JOG bits have started: +1, −1 or 0."""
        self.pending: dict[str, float]
        """Values (pulses) stored in TRIGGER mode, by kind: VEL_ABS, VEL_REL, POS_ABS, POS_REL (MIC-16)."""
        self.rise_p: float
        """ACC of the present motion (MIC-40)."""
        self.fall_p: float
        """DEC of the present motion (MIC-40)."""
        self.target_p: int
        """Motor position a position move goes to."""
        self.speed_p: float
        """Cruise speed of a position move."""
        self.velocity_p: float
        """Velocity a velocity move (or a homing) goes to."""
        self.ramp_p: float
        """Ramp of a velocity move (or a homing) while it slows down."""
        self.path: Path | None
        """The line, circle or arc on which the axis moves together with another axis."""
        self.enabled: bool
        """Whether the EN output is on."""
        self.status: AxisStatus
        """Status that the register shows."""
        self.arrival: AxisStatus
        """The status at the end of the profile; the present one if the axis rests or its motion has no end."""
        self._blocked_leg: tuple[Nanos, int] | None
        """Moment and direction at which the profile will turn towards an active limit switch."""
        self.power_on(0)

    @property
    def plan(self) -> Profile:
        """The source of pulses: the profile."""
        return self.profile

    def power_on(self, now: Nanos) -> None:
        """Registers as configured (MIC-27), drive off, position 0; the motor stays where it is."""
        config, gear = self.config, self.gear
        self.acc_p = min(max(config.acc * gear, LEAST), MOST)
        self.dec_p = min(max(config.dec * gear, LEAST), MOST)
        self.vmax_p = min(max(config.vel * gear, LEAST), MOST)
        self.limit_l_p = DINT_MIN
        self.limit_r_p = DINT_MAX
        self.jogging = 0
        self.pending = {}
        self._take_ramps()
        self.target_p = 0
        self.speed_p = self.vmax_p
        self.velocity_p = 0.0
        self.ramp_p = self.up_p
        self.path = None
        self.enabled = False
        self._rest(now, AxisStatus.OFF)
        motor = self.profile.count(now)
        self.offset_p = -motor
        self.encoder.set_counter(config.enc_offset, self.shaft(now))
        self.control.reference(self, now)

    def set_state(self, plain: Plain) -> None:
        """Set the state; a restored profile also counts as a replacement."""
        super().set_state(plain)
        self.revision += 1

    # ------------------------------------------------------------------ what it shows

    @property
    def can_move(self) -> bool:
        """Whether motion commands move it: with EN on, or where EN is not wired (MIC-8)."""
        return self.enabled or not self.config.en_wired

    @property
    def is_energised(self) -> bool:
        """Whether the motor has current, as far as the drive is switched by EN: always, where that is not wired."""
        return self.can_move

    def coordinate_p(self, now: Nanos) -> int:
        """Position register in pulses (MIC-14: the pulse count), a DINT that wraps."""
        coordinate = self.profile.count(now) + self.offset_p
        return coordinate if DINT_MIN <= coordinate <= DINT_MAX else wrapped_dint(coordinate)

    def shaft(self, now: Nanos) -> int:
        """Rotation of the encoder's shaft since power-on, in counts."""
        return self.encoder.shaft(self.profile.count(now), now)

    def encoder_counts(self, now: Nanos) -> int:
        return self.encoder.counter(self.shaft(now))

    # ------------------------------------------------------------------ time

    def deadline(self) -> Nanos | None:
        due = self.profile.end if self.arrival is not self.status else None
        leg = self._blocked_leg
        if leg is not None and (due is None or leg[0] < due):
            due = leg[0]
        tick = self.control.tick_ns
        if tick is not None and (due is None or tick < due):
            due = tick
        return due

    def advance(self, now: Nanos) -> None:
        """Execute what is due at ``now``, if anything; the controller calls this at each of the axis' deadlines, in order."""
        leg, end = self._blocked_leg, self.profile.end
        if leg is not None and leg[0] <= now:
            self._limit_stop(now, leg[1])
        elif end is not None and end <= now and self.arrival is not self.status:
            self._arrive(now)
        tick = self.control.tick_ns
        if tick is not None and tick <= now:
            self.control.tick(self, now)

    def _arrive(self, now: Nanos) -> None:
        """The profile has ended."""
        ended = self.profile
        rests = ended.counts[-1]
        self.profile = at_rest(now, ended.base + rests, ended.final_p - rests)
        self.revision += 1
        self.status = self.arrival
        self.homing.leg = Homing.NONE
        path, self.path = self.path, None
        self.control.arrived(self, now, corrects=path is None or path.has_arrival)

    def _rest(self, now: Nanos, status: AxisStatus) -> None:
        """Rest on the counted pulse with ``status``."""
        self._forget()
        self.profile = at_rest(now, self.profile.count(now))
        self.revision += 1
        self.status = self.arrival = status
        self._blocked_leg = None
        self.control.rested(self, now)

    def _forget(self) -> None:
        """End the present motion, because a new command replaces it."""
        self.jogging = 0
        self.path = None
        self.homing.leg = Homing.NONE
        self.control.stop()

    # ------------------------------------------------------------------ drive and stop

    def enable(self, now: Nanos) -> None:
        if self.enabled:
            return
        self.enabled = True
        if self.status is AxisStatus.OFF:
            self._rest(now, AxisStatus.ON)
            self.control.reference(self, now)
        self.host.drive_output(self.number, True, now)

    def disable(self, now: Nanos) -> None:
        """EN off: pulses stop at once, the position is kept, status 0 (MIC-9), also where EN is not wired."""
        if self.status is not AxisStatus.OFF:
            self._rest(now, AxisStatus.OFF)
        if self.enabled:
            self.enabled = False
            self.host.drive_output(self.number, False, now)

    def stop(self, now: Nanos) -> None:
        """Immediate stop without ramp, status 1 (MIC-10). A position error stays until the next motion command (MIC-26)."""
        if self.status not in (AxisStatus.OFF, AxisStatus.ERROR):
            self._rest(now, AxisStatus.ON)

    def brake(self, now: Nanos) -> None:
        """Ramp down to rest: with DEC out of a position move, with ACC out of velocity mode (MIC-29)."""
        self.jogging = 0
        if not self.profile.moving(now):
            return
        self._take_ramps()
        self.ramp_p = self.down_p if self.status is AxisStatus.POSITION else self.up_p
        self.velocity_p = 0.0
        self._forget()
        self._steer(AxisStatus.VELOCITY, now)

    def ready(self, what: Message, now: Nanos) -> bool:
        """Whether motion commands are executed: with EN off they are accepted and do nothing (MIC-8)."""
        if not self.can_move:
            self.host.axis_event(self.number, "drive-off", IS_NOT_ENABLED(what=what(), axis=self.number), now)
            return False
        if self.status is AxisStatus.OFF:
            self.control.reference(self, now)
        return True

    # ------------------------------------------------------------------ motion

    def move_to(self, coordinate_p: int, now: Nanos) -> None:
        """Position mode to ``coordinate_p``: ACC up, DEC down, VMAX cruise; stops on a soft limit (MIC-12)."""
        if self.ready(POSITION_COMMAND, now):
            state = self.state(now)
            self._move(state, coordinate_p - self.offset_p)

    def move_by(self, distance_p: int, now: Nanos) -> None:
        if self.ready(POSITION_COMMAND, now):
            state = self.state(now)
            self._move(state, state.count + distance_p)

    def _move(self, state: MotionState, target_p: int) -> None:
        """Position mode to the motor position ``target_p``."""
        self._forget()
        self.target_p = target_p
        self.speed_p = self._clamped(self.vmax_p, state.now)
        self._take_ramps()
        self._go(state)
        self.control.watch(self, state.now)

    def move_velocity(self, velocity_p: float, now: Nanos) -> None:
        """Velocity mode: ACC for speeding up and slowing down; ramped to 0 it ends with status 1 (MIC-11)."""
        if not self.ready(VELOCITY_COMMAND, now):
            return
        self._forget()
        self.run(self._clamped(velocity_p, now), AxisStatus.VELOCITY, now)
        self.control.watch(self, now)

    def change_velocity(self, difference_p: float, now: Nanos) -> None:
        self.move_velocity(self.profile.velocity(now) + difference_p, now)

    def jog(self, direction: int, on: bool, speed_p: float, now: Nanos) -> None:
        """A JOG bit was written: motion while it is on, ramp down when it goes off; of both bits the last write wins (MIC-18)."""
        if on:
            self.move_velocity(direction * abs(speed_p), now)
            self.jogging = direction if self.can_move else 0
        elif self.jogging == direction:
            self.brake(now)

    def home(self, velocity_p: float, now: Nanos) -> None:
        """Home at ``velocity_p``, the sign chooses the switch: − KL, + KR. Ends at position 0 with status 4.

        A velocity of 0 chooses no switch and does nothing (MIC-41).
        """
        velocity_p = self._clamped(velocity_p, now)
        if velocity_p != 0.0 and self.ready(HOMING, now):
            self._forget()
            self.homing.start(self, velocity_p, now)

    def follow_path(self, path: Path, profile: Profile, arrival: AxisStatus) -> None:
        """Take part in a line or arc, from rest or from elsewhere on it: ``profile`` starts now and respects the soft limits.

        ``arrival`` is the status at its end.
        """
        now = profile.start
        begins = self.path is None
        if begins:
            self._forget()
        self.path = path
        self.target_p = profile.base + profile.counts[-1]
        self.speed_p = self.cruise_p
        self._begin(profile, AxisStatus.POSITION, arrival)
        if begins and path.has_arrival:
            self.control.watch(self, now)

    def set_coordinate(self, coordinate_p: int, now: Nanos) -> None:
        """POS_ACT written: the coordinate shifts, a motion keeps its velocity and its remaining distance (MIC-13).

        Only the soft limits, which are coordinates, may end it elsewhere.
        """
        self.offset_p = coordinate_p - self.profile.count(now)
        if self.profile.moving(now):
            if self.edge(-1) is not None or self.edge(1) is not None:
                self._replan(now)
        elif self.status is not AxisStatus.CORRECTION and self.config.pos_ctrl_mode == PositionControl.ENCODER:
            self.control.reference(self, now)

    def set_limits(self, now: Nanos, *, left_p: int | None = None, right_p: int | None = None) -> None:
        """Soft limits in coordinates; a motion in progress respects the new ones at once."""
        if left_p is not None:
            self.limit_l_p = left_p
        if right_p is not None:
            self.limit_r_p = right_p
        self._replan(now)

    # ------------------------------------------------------------------ planning

    def run(self, velocity_p: float, status: AxisStatus, now: Nanos) -> None:
        """Run at ``velocity_p`` (already clamped) with ramps of ACC; towards a soft limit the motion is planned to stop on it."""
        self.velocity_p = velocity_p
        self._take_ramps()
        self.ramp_p = self.up_p
        self._steer(status, now)

    def follow(self, target_p: int, now: Nanos) -> None:
        """Move to motor position ``target_p``, as required by the encoder."""
        count = self.profile.count(now)
        self.target_p = count + min(max(target_p - count, -STRIDE_P), STRIDE_P)
        self.speed_p = self.cruise_p
        self._take_ramps()
        self._go(self.state(now))

    def creep(self, distance_p: int, now: Nanos) -> None:
        """A step of the correction of the position. Soft limits do not apply, since its target is within them."""
        state = MotionState.of(self.profile, now)
        distance_p = min(max(distance_p, -STRIDE_P), STRIDE_P)
        profile = plan_position(state, state.count + distance_p, self.up_p, self.down_p, self.cruise_p)
        self._begin(profile, AxisStatus.CORRECTION, AxisStatus.CORRECTION)

    @property
    def cruise_p(self) -> float:
        """VMAX, limited to the highest speed of the outputs."""
        return min(self.vmax_p, MAX_SPEED_P)

    @property
    def up_p(self) -> float:
        """ACC, limited to the range of planning."""
        return max(self.acc_p, SLOWEST_RAMP_P)

    @property
    def down_p(self) -> float:
        """DEC, limited to the range of planning."""
        return max(self.dec_p, SLOWEST_RAMP_P)

    def halt(self, now: Nanos) -> None:
        """Rest on the counted pulse between two legs of a homing."""
        self.profile = at_rest(now, self.profile.count(now))

    def _replan(self, now: Nanos) -> None:
        """Plan a motion anew from its present state, after a change of limits or coordinates."""
        if not self.profile.moving(now) or self.homing.passes_soft_limits:
            return
        if self.path is not None:
            self.host.path_limited(now)
        elif self.status is AxisStatus.POSITION:
            self._go(self.state(now))
        elif self.status in (AxisStatus.VELOCITY, AxisStatus.HOMING):
            self._steer(self.status, now)

    def _take_ramps(self) -> None:
        """Keep the present ramps for the motion being commanded (MIC-40)."""
        # As `up_p` and `down_p`, without their calls: each motion comes here.
        self.rise_p = max(self.acc_p, SLOWEST_RAMP_P)
        self.fall_p = max(self.dec_p, SLOWEST_RAMP_P)

    def _steer(self, status: AxisStatus, now: Nanos) -> None:
        """Change the velocity to ``velocity_p``, slowing down with ``ramp_p``."""
        state = self.state(now)
        ramp_p = self._braking(state, self.ramp_p)
        velocity_p = self.velocity_p
        direction = 1 if velocity_p > 0.0 else -1
        edge = None if velocity_p == 0.0 else self.edge(direction)
        if edge is None:
            self._begin(plan_velocity(state, velocity_p, self.rise_p, ramp_p), status, AxisStatus.ON)
        else:
            profile = self._to_edge(state, edge, direction, ramp_p, abs(velocity_p))
            self._begin(profile, status, LIMIT[direction])

    def _go(self, state: MotionState) -> None:
        """Position mode to ``target_p``, at most to the soft limit on the way."""
        dec_p = self._braking(state, self.fall_p)
        target, velocity = self.target_p, state.velocity
        rest = _rest_p(state, dec_p)
        for direction in (-1, 1):
            outward = (target - rest) * direction > 0.0 or velocity * direction > 0.0
            edge = self.edge(direction) if outward else None
            if edge is not None and (target - edge) * direction > 0:
                profile = self._to_edge(state, edge, direction, dec_p, self.speed_p)
                self._begin(profile, AxisStatus.POSITION, LIMIT[direction])
                return
        self._begin(plan_position(state, target, self.rise_p, dec_p, self.speed_p), AxisStatus.POSITION, AxisStatus.REACHED)

    def _to_edge(self, state: MotionState, edge: int, direction: int, dec_p: float, speed_p: float) -> Profile:
        """Come to rest on the soft limit ``edge``, or behind it if it is passed already or too near to brake before it."""
        if (_rest_p(state, dec_p) - edge) * direction > NEAR_P:
            return plan_stop(state, dec_p)
        return plan_position(state, edge, self.rise_p, dec_p, speed_p)

    def _braking(self, state: MotionState, dec_p: float) -> float:
        """``dec_p`` when it brakes before the soft limit ahead; else the hardest ramp, and an overrun if that is too late too."""
        velocity = state.velocity
        if velocity == 0.0:
            return dec_p
        direction = 1 if velocity > 0.0 else -1
        edge = self.edge(direction)
        if edge is None or (_rest_p(state, dec_p) - edge) * direction <= NEAR_P:
            return dec_p
        hardest = max(self.rise_p, self.fall_p)
        if (_rest_p(state, hardest) - edge) * direction > NEAR_P:
            self.overruns(state.now)
        return hardest

    def overruns(self, now: Nanos) -> None:
        """Report that the axis cannot brake before its soft limit."""
        self.host.axis_event(self.number, "overrun", CANNOT_BRAKE(axis=self.number), now)

    def edge(self, direction: int) -> int | None:
        """Soft limit in ``direction`` as motor position; None where nothing limits (MIC-12) or homing ignores it (MIC-30)."""
        limit, none = (self.limit_r_p, DINT_MAX) if direction > 0 else (self.limit_l_p, DINT_MIN)
        return None if limit == none or self.homing.passes_soft_limits else limit - self.offset_p

    def state(self, now: Nanos) -> MotionState:
        """The state from which a motion begins. A coordinate that has wrapped counts from its new value."""
        state = MotionState.of(self.profile, now)
        coordinate = state.count + self.offset_p
        if not DINT_MIN <= coordinate <= DINT_MAX:
            self.offset_p = wrapped_dint(coordinate) - state.count
        return state

    def _begin(self, profile: Profile, status: AxisStatus, arrival: AxisStatus) -> None:
        """Follow ``profile`` from now on with ``status``; ``arrival`` is the status at its end."""
        now = profile.start
        self.profile = profile
        self.revision += 1
        self.status = status
        self.arrival = arrival
        if self.config.limit_mode:
            self._guard_switches(now)
        else:
            self._blocked_leg = None
        if not profile.moving(now) and self.arrival is not self.status:
            self._arrive(now)

    def _clamped(self, velocity_p: float, now: Nanos) -> float:
        if abs(velocity_p) <= MAX_SPEED_P:
            return velocity_p if abs(velocity_p) >= LEAST else 0.0
        text = VELOCITY_IS_CLAMPED(axis=self.number, velocity=velocity_p, most=MAX_SPEED_P)
        self.host.axis_event(self.number, "speed-clamped", text, now)
        return MAX_SPEED_P if velocity_p > 0.0 else -MAX_SPEED_P

    # ------------------------------------------------------------------ switches

    def input_changed(self, number: int, active: bool, now: Nanos) -> None:
        """Input ``number`` (from 0) changed after polarity, before the filter."""
        if self.homing.leg != Homing.NONE:
            self.homing.input_changed(self, number, active, now)
        if number in (self.config.in_kl, self.config.in_kr):
            self._guard_switches(now)

    def _switch_blocks(self, direction: int) -> bool:
        """Whether an active limit switch forbids motion in ``direction``; the switch being homed to does not (MIC-30)."""
        number, bit = (self.config.in_kl, 1) if direction < 0 else (self.config.in_kr, 2)
        if not self.config.limit_mode & bit or number == NO_INPUT:
            return False
        if self.homing.leg != Homing.NONE and self.homing.sensor == number:
            return False
        return self.input_active(number)

    def _guard_switches(self, now: Nanos) -> None:
        """Stop if the profile moves into an active limit switch, or note the moment at which it will (MIC-12)."""
        self._blocked_leg = None
        blocked = [direction for direction in (-1, 1) if self._switch_blocks(direction)]
        for begin, direction in self.profile.legs(now) if blocked else ():
            if direction in blocked:
                if begin <= now:
                    self._limit_stop(now, direction)
                else:
                    self._blocked_leg = (begin, direction)
                return

    def _limit_stop(self, now: Nanos, direction: int) -> None:
        """A KL/KR switch stops at once (MIC-12)."""
        self._rest(now, LIMIT[direction])
        self.host.axis_event(self.number, "limit", STOPPED_BY_LIMIT(axis=self.number, limit="KR" if direction > 0 else "KL"), now)

    def input_active(self, number: int) -> bool:
        """State of input ``number`` (from 0) after polarity, before the filter (MIC-30)."""
        return self.host.input_active(number)

    # ------------------------------------------------------------------ homing

    def run_to_stop(self, velocity_p: float, now: Nanos) -> None:
        """HOME3: run while position control watches for the mechanical stop."""
        self.control.reference(self, now)
        self.run(velocity_p, AxisStatus.HOMING, now)
        self.control.watch(self, now)

    @property
    def seeks_stop(self) -> bool:
        """Whether the axis moves to a mechanical stop (HOME3)."""
        return self.homing.leg == Homing.TO_STOP

    def stop_reached(self, now: Nanos) -> None:
        """HOME3: the mechanical stop was found."""
        self.homing.stop_reached(self, now)

    def homed(self, now: Nanos) -> None:
        """The last leg of homing ends here: position 0, status 4 (MIC-30)."""
        self._rest(now, AxisStatus.REACHED)
        motor = self.profile.count(now)
        self.offset_p = -motor
        if self.homing.to_index:
            self.encoder.set_counter(self.config.enc_offset, self.shaft(now))
        self.control.reference(self, now)
        self.host.axis_event(self.number, "homed", IS_HOMED(axis=self.number), now)

    # ------------------------------------------------------------------ position control

    def begin_correction(self) -> None:
        """Position control found the shaft away from the target."""
        self.status = self.arrival = AxisStatus.CORRECTION

    def end_correction(self) -> None:
        """The shaft is within the tolerance of the target."""
        self.status = self.arrival = AxisStatus.REACHED

    def drop_lost_steps(self, lost_p: int) -> None:
        """``lost_p`` pulses did not turn the shaft: they leave the coordinate and are added to the way to the target."""
        self.offset_p -= lost_p
        self.target_p += lost_p

    def position_lost(self, now: Nanos) -> None:
        """Position control gave up: stop, status 5, and the coordinate becomes the encoder's (MIC-19)."""
        self._rest(now, AxisStatus.ERROR)
        self.offset_p += round(self.control.true_p(self, now)) - self.profile.count(now)
        self.control.reference(self, now)
        self.host.position_error(self.number, now)


def _rest_p(state: MotionState, dec_p: float) -> float:
    """Motor position at which braking with ``dec_p`` would end."""
    velocity = state.velocity
    return state.count + state.phase + velocity * abs(velocity) / (2.0 * dec_p)
