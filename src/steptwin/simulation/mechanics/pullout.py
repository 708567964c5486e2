"""Whether a rotor keeps its field where the torque that the motion needs changes at once, or exceeds the curve for a moment.

A rotor that lags behind its field by x moves about it as

    inertia · x″ = need − T·sin(2π·x/λ),

with the electrical period λ. Where ``need`` changes at once, the rotor swings over to its new place of rest, and leaves its
period if it has the energy for it: without load at 0.7246 of T. A ramp that ends before the rotor is half a period behind may be
steeper. The energy decides the first; where a phase of the motion is shorter than a swing, the equation is solved step by step.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from steptwin.motion import Profile, Segment
from steptwin.motion.trig import PI, arcsine, cosine, sine
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.potential import PeriodicPotential

_SMALL = 0.5
"""Below this share of the torque no change of it loses the field: from −0.537 to 0.537 is the first one that does."""
_STEPS = 64
"""Steps of the solution for each period of the swing."""
_LOOKS = 8
"""After so many steps the energy is checked."""
_LONGEST = 20
"""Swings after which a rotor that has neither been held nor lost counts as lost."""


class Lag(NamedTuple):
    """How far the rotor is behind its field, pulses of the mechanics, and how fast it falls behind, pulses/s."""

    pulses: float
    speed: float


class Pullout(NamedTuple):
    """A ``motor`` with the electrical period ``period_p`` in pulses, while its field follows ``profile``.

    ``sign`` is the direction of the mechanics for positive pulses. Moments are seconds of the profile, torques N·m.
    """

    motor: StepperMotor
    period_p: int
    sign: int
    profile: Profile

    def period_s(self, torque: float) -> float:
        """The period of the rotor's own swing about the field, s."""
        return sqrt(2.0 * PI * self.period_p * self.motor.inertia / torque) if torque > 0.0 else inf

    def lag(self, torque: float, need: float) -> float:
        """How far behind it rests while the motion needs ``need``, pulses."""
        share = 1.0 if need >= torque else -1.0 if need <= -torque else need / torque
        return 0.25 * self.period_p * arcsine(share)

    def need(self, s: Segment, t: float) -> float:
        """Torque that the motion needs at ``t``."""
        return self.motor.need_at(s, t, self.sign)

    def torque(self, s: Segment, t: float) -> float:
        return max(self.motor.torque(abs(s.velocity(t))), 0.0)

    def holds(self, torque: float, need: float, at: Lag) -> bool:
        """Whether the energy of the rotor does not suffice to leave its period while ``torque`` and ``need`` stay."""
        if abs(need) >= torque:
            return False
        field, side = PeriodicPotential(torque, float(self.period_p)), 1.0 if need >= 0.0 else -1.0
        rest, x = side * self.lag(torque, need), side * at.pulses
        if not -0.5 * self.period_p < x + rest < 0.5 * self.period_p:
            return False
        swing = 0.5 * self.motor.inertia * at.speed * at.speed
        raised = field.half * (cosine(rest * 4.0 / self.period_p) - cosine(x * 4.0 / self.period_p)) - abs(need) * (x - rest)
        return swing + raised < field.to_leave(-abs(need))

    def after_step(self, part: int, begin_s: float, before: float) -> float | None:
        """The moment from which the rotor is held again after the torque needed has changed at ``begin_s``, from ``before`` to
        that of segment ``part``; None if it loses the field."""
        s = self.profile.segments[part]
        torque, need = self.torque(s, begin_s), self.need(s, begin_s)
        if max(abs(before), abs(need)) < _SMALL * torque:
            return begin_s
        at, moves_s = Lag(self.lag(torque, before), 0.0), begin_s
        if s.velocity(begin_s) == 0.0:
            at, moves_s = self.started(s, begin_s, at)
        is_held, is_short = self.holds(torque, need, at), s.end_s - begin_s < self.period_s(torque)
        if is_held and not is_short:
            return begin_s
        if is_short and not is_held and self.motor.start_p is not None:
            return s.end_s if self.motor.follows(s.velocity(s.end_s) - s.velocity(begin_s)) else None
        return self.solved(part, moves_s, at)

    def started(self, s: Segment, begin_s: float, at: Lag) -> tuple[Lag, float]:
        """Lag and moment at which a rotor that friction holds at rest begins to move, the field having begun at ``begin_s``."""
        pull = self.motor.load + self.sign * s.direction * self.motor.friction
        acceleration = self.sign * 2.0 * s.c2
        way = (self.lag(self.torque(s, begin_s), pull) - at.pulses) / acceleration if acceleration else 0.0
        waits_s = sqrt(max(2.0 * way, 0.0))
        if begin_s + waits_s >= s.end_s:
            return at, begin_s
        return Lag(at.pulses + acceleration * max(way, 0.0), acceleration * waits_s), begin_s + waits_s

    def after_lack(self, part: int, begin_s: float) -> float | None:
        """The same after the moment at which the motion comes to need more than there is, slowly."""
        s = self.profile.segments[part]
        return self.solved(part, begin_s, Lag(self.lag(self.torque(s, begin_s), self.need(s, begin_s)), 0.0))

    def solved(self, part: int, begin_s: float, at: Lag) -> float | None:
        """The moment from which the rotor stays in its period, by Runge and Kutta; None if it is half a period away before."""
        period_s = self.period_s(self.motor.holding)
        step_s, t, steps, held = period_s / _STEPS, begin_s, 0, False
        for s in self.profile.segments[part:]:
            is_begun = True
            while t < s.end_s:
                if is_begun or steps % _LOOKS == 0:
                    held, is_begun = self.holds(self.torque(s, t), self.need(s, t), at), False
                    if held and s.end_s - t >= period_s:
                        return t
                if steps > _LONGEST * _STEPS:
                    return t if held else None
                until = min(t + step_s, s.end_s)
                at, t, steps = self._next(s, t, until, at), until, steps + 1
                if abs(at.pulses) >= 0.5 * self.period_p:
                    return None
        return t if self.holds(self.motor.holding, self.motor.load, at) else None

    def _next(self, s: Segment, t: float, until: float, at: Lag) -> Lag:
        h, (x, v), middle = until - t, at, 0.5 * (t + until)
        a = self._acceleration(s, t, x)
        b = self._acceleration(s, middle, x + 0.5 * h * v)
        c = self._acceleration(s, middle, x + 0.5 * h * (v + 0.5 * h * a))
        d = self._acceleration(s, until, x + h * (v + 0.5 * h * b))
        return Lag(x + h * (v + h * (a + b + c) / 6.0), v + h * (a + 2.0 * (b + c) + d) / 6.0)

    def _acceleration(self, s: Segment, t: float, x: float) -> float:
        return (self.need(s, t) - self.torque(s, t) * sine(4.0 * x / self.period_p)) / self.motor.inertia
