"""One axis of a MIC488: its commands. Planning, limits and ends of motions, names and suffixes: `steptwin.mic488.axis_motion`."""

from __future__ import annotations

from steptwin.machine import Nanos
from steptwin.mic488.axis_motion import AxisMotion
from steptwin.mic488.path import Path
from steptwin.mic488.position_control import PositionControl
from steptwin.mic488.status import AxisStatus
from steptwin.motion import Profile


class Axis(AxisMotion):
    """Axis ``number`` (from 1) of a MIC488."""

    __slots__ = ()

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

    def ready(self, what: str, now: Nanos) -> bool:
        """Whether motion commands are executed: with EN off they are accepted and do nothing (MIC-8)."""
        if not self.can_move:
            self.host.axis_event(self.number, "drive-off", f"{what} ignored: M{self.number} is not enabled", now)
            return False
        if self.status is AxisStatus.OFF:
            self.control.reference(self, now)
        return True

    # ------------------------------------------------------------------ motion

    def move_to(self, coordinate_p: int, now: Nanos) -> None:
        """Position mode to ``coordinate_p``: ACC up, DEC down, VMAX cruise; stops on a soft limit (MIC-12)."""
        self.move_by(coordinate_p - self.coordinate_p(now), now)

    def move_by(self, distance_p: int, now: Nanos) -> None:
        if not self.ready("position command", now):
            return
        self._forget()
        self.target_p = self.profile.count(now) + distance_p
        self.speed_p = self._clamped(self.vmax_p, now)
        self._take_ramps()
        self._go(now)
        self.control.watch(self, now)

    def move_velocity(self, velocity_p: float, now: Nanos) -> None:
        """Velocity mode: ACC for speeding up and slowing down; ramped to 0 it ends with status 1 (MIC-11)."""
        if not self.ready("velocity command", now):
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
        if velocity_p != 0.0 and self.ready("homing", now):
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
