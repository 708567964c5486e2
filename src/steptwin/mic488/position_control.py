"""Position control with an encoder: correction (ENCODER), following (ENCFOLLOW), and watching for a blocked drive.

A control loop, re-planned every 10 ms while it is active; inactive it costs nothing. Drive and encoder are compared from a
*reference* on, a pair of motor count and encoder shaft that are taken to agree. Tolerance, settling and giving up: MIC-19.
"""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import MILLISECOND, Nanos
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Encoder
from steptwin.mic488.status import AxisStatus
from steptwin.motion import Profile
from steptwin.state import Stateful

PERIOD_NS: Nanos = 10 * MILLISECOND

STOP_LAG_REVOLUTIONS = 0.05
"""HOME3: the mechanical stop is found when the encoder lags the drive by this much of a revolution, and the tolerance."""


class ControlledAxis(Protocol):
    """The interface of an axis to its position control. Motor positions in pulses."""

    @property
    def config(self) -> AxisConfig: ...
    @property
    def encoder(self) -> Encoder: ...
    @property
    def profile(self) -> Profile: ...
    @property
    def status(self) -> AxisStatus: ...
    @property
    def target_p(self) -> int: ...
    @property
    def can_move(self) -> bool: ...
    @property
    def seeks_stop(self) -> bool: ...
    def shaft(self, now: Nanos) -> int: ...
    def follow(self, target_p: int, now: Nanos) -> None: ...
    def creep(self, distance_p: int, now: Nanos) -> None: ...
    def begin_correction(self) -> None: ...
    def end_correction(self) -> None: ...
    def drop_lost_steps(self, lost_p: int) -> None: ...
    def position_lost(self, now: Nanos) -> None: ...
    def stop_reached(self, now: Nanos) -> None: ...


class PositionControl(Stateful):
    """The control loop of one axis."""

    OFF, ENCODER, ENCFOLLOW = range(3)
    """``PosCtrlMode``."""

    REACTION_NONE, REACTION_STOP, REACTION_PROGRAM, REACTION_OUT8 = range(4)
    """``ErrCtrlMode``: NONE, ERRMODE0, ERRMODE1, ERRMODE2."""

    __slots__ = ("_best_p", "_following", "_progress_ns", "_ref_motor", "_ref_shaft", "_shaft", "tick_ns")

    def __init__(self) -> None:
        self.tick_ns: Nanos | None = None
        """The next moment at which the loop runs."""
        self._following = False
        self._shaft = 0
        self._progress_ns: Nanos = 0
        """The moment at which the shaft was at ``_shaft``, or the correction reached ``_best_p``."""
        self._best_p = 0.0

    @property
    def is_following(self) -> bool:
        """Whether the axis goes where its encoder says (ENCFOLLOW)."""
        return self._following

    def reference(self, axis: ControlledAxis, now: Nanos) -> None:
        """Take the present positions of drive and encoder as equal."""
        self._ref_motor = axis.profile.count(now)
        self._ref_shaft = axis.shaft(now)

    def true_p(self, axis: ControlledAxis, now: Nanos) -> float:
        """The motor position according to the encoder."""
        shaft = axis.shaft(now)
        return self._ref_motor + axis.encoder.pulses(shaft - self._ref_shaft)

    def stop(self) -> None:
        """End the control because of a command."""
        self.tick_ns = None
        self._following = False

    # ------------------------------------------------------------------ when the loop runs

    def watch(self, axis: ControlledAxis, now: Nanos) -> None:
        """Watch a motion that may lose steps. An encoder coupled to the drive without loss cannot disagree."""
        is_controlled = axis.config.pos_ctrl_mode == self.ENCODER or axis.seeks_stop
        if is_controlled and not axis.encoder.agrees and axis.profile.moving(now):
            self._expect_progress(axis, now)
            self.tick_ns = _next_tick(now)

    def encoder_moved(self, axis: ControlledAxis, now: Nanos) -> None:
        """The shaft was turned or its coupling changed from outside."""
        if axis.config.pos_ctrl_mode != self.ENCFOLLOW or axis.seeks_stop:
            if axis.status is not AxisStatus.CORRECTION:
                self.watch(axis, now)
        elif axis.can_move and (self._following or not axis.profile.moving(now)):
            # Turning during a commanded motion is not followed; see `rested`.
            self._following = True
            if self.tick_ns is None:
                self.tick_ns = _next_tick(now)

    def rested(self, axis: ControlledAxis, now: Nanos) -> None:
        """The axis is at rest, from which ENCFOLLOW follows."""
        if axis.config.pos_ctrl_mode == self.ENCFOLLOW and not self._following:
            self.reference(axis, now)

    def arrived(self, axis: ControlledAxis, now: Nanos, *, corrects: bool) -> None:
        """A motion has ended as planned: after a position move, compare with the encoder."""
        self.rested(axis, now)
        if axis.config.pos_ctrl_mode != self.ENCODER or not corrects:
            return
        self.tick_ns = None
        missing_p = abs(axis.target_p - self.true_p(axis, now))
        if axis.status is AxisStatus.REACHED and axis.encoder.counts(missing_p) > axis.config.enc_tolerance:
            axis.begin_correction()
            self._best_p = missing_p
            self.tick_ns = self._progress_ns = now + axis.config.enc_settle_ms * MILLISECOND

    def _expect_progress(self, axis: ControlledAxis, now: Nanos) -> None:
        self._progress_ns = now
        self._shaft = axis.shaft(now)

    # ------------------------------------------------------------------ the loop

    def tick(self, axis: ControlledAxis, now: Nanos) -> None:
        self.tick_ns = None
        if axis.seeks_stop:
            self._seek_stop(axis, now)
        elif self._following:
            self._follow(axis, now)
        elif axis.status is AxisStatus.CORRECTION:
            self._correct(axis, now)
        elif axis.profile.moving(now):
            self._supervise(axis, now)

    def _seek_stop(self, axis: ControlledAxis, now: Nanos) -> None:
        lag = axis.encoder.counts(abs(axis.profile.count(now) - self.true_p(axis, now)))
        if lag > max(STOP_LAG_REVOLUTIONS * axis.encoder.enc_resol, axis.config.enc_tolerance):
            axis.stop_reached(now)
        else:
            self.tick_ns = now + PERIOD_NS

    def _follow(self, axis: ControlledAxis, now: Nanos) -> None:
        shaft = axis.shaft(now)
        if shaft != self._shaft:
            self._shaft = shaft
            self.tick_ns = now + PERIOD_NS
        target = round(self.true_p(axis, now))
        if target != axis.profile.count(now) or axis.profile.moving(now):
            axis.follow(target, now)

    def _correct(self, axis: ControlledAxis, now: Nanos) -> None:
        # Steps that did not reach the shaft are not counted: the coordinate becomes the true one again. Less than a count is
        # no loss: the shaft counts whole ones.
        true_p = self.true_p(axis, now)
        away_p = abs(axis.target_p - true_p)
        lost = axis.profile.count(now) - round(true_p)
        if axis.encoder.counts(abs(lost)) >= 1.0:
            axis.drop_lost_steps(lost)
            self._ref_motor += lost
        missing = axis.target_p - axis.profile.count(now)
        within = axis.encoder.counts(abs(missing)) <= axis.config.enc_tolerance
        if within and not axis.profile.moving(now):
            axis.end_correction()
            return
        if away_p < self._best_p:
            self._best_p = away_p
            self._progress_ns = now
        elif not within and self._given_up(axis, now):
            axis.position_lost(now)
            return
        self.tick_ns = now + PERIOD_NS
        axis.creep(missing if within else _part(missing, axis.config.kp), now)

    def _supervise(self, axis: ControlledAxis, now: Nanos) -> None:
        """A drive blocked for ERR_TIME is an error [1.74]."""
        if axis.shaft(now) != self._shaft:
            self._expect_progress(axis, now)
        elif self._given_up(axis, now):
            axis.position_lost(now)
            return
        self.tick_ns = now + PERIOD_NS

    def _given_up(self, axis: ControlledAxis, now: Nanos) -> bool:
        patience = axis.config.err_time_ms * MILLISECOND
        return now - self._progress_ns >= patience and axis.config.err_ctrl_mode != self.REACTION_NONE


def _part(missing_p: int, kp: float) -> int:
    """The step of a correction: ``kp`` % of the missing distance, at least a pulse and at most all of it."""
    part = round(missing_p * min(kp, 100.0) / 100.0)
    return part or (1 if missing_p > 0 else -1)


def _next_tick(now: Nanos) -> Nanos:
    return (now // PERIOD_NS + 1) * PERIOD_NS
