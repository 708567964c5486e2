"""The potential of a torque that repeats with the angle of a rotor: the field of a stepper motor at rest, or its detent.

The torque is T·sin(2π·x/λ) towards the middle of each well, the period λ in pulses. A constant torque R, of load and friction,
acts against the motion. Nothing else damps, so the travel of a rotor follows from its energy: what it needs to leave a well is

    T·λ/2π · (2·√(1 − r²) + r·(π + 2·arcsin r)),  r = R/T,

and R·λ for each further one. Between wells the model gives the rotor its mean energy.
"""

from __future__ import annotations

from math import ceil, floor, sqrt
from typing import NamedTuple

from steptwin.motion.trig import PI, QUARTER, arcsine


class PeriodicPotential(NamedTuple):
    """A sine of ``torque`` N·m with ``period`` pulses, and its potential wells."""

    torque: float
    period: float

    @property
    def half(self) -> float:
        """Half of the energy between the bottom of a well and its edge, N·m·pulses."""
        return self.torque * self.period / (2.0 * PI)

    def nearest(self, position: float) -> int:
        """The whole place of the well nearest to a position; one of them is at 0."""
        return round(floor(position / self.period + 0.5) * self.period)

    def deep(self, resisting: float) -> float:
        """How much lower than between wells its energy is at the place of rest against ``resisting`` N·m."""
        r = min(abs(resisting) / self.torque, 1.0) if self.torque else 1.0
        return self.half * sqrt(1.0 - r * r)

    def to_leave(self, resisting: float) -> float:
        """The energy that leaves a well from the place of rest of a motion against ``resisting`` N·m; negative: that drives."""
        if self.torque <= 0.0:
            return 0.0
        r = min(max(resisting / self.torque, -1.0), 1.0)
        return max(0.0, self.half * (2.0 * sqrt(1.0 - r * r) + r * (PI + 2.0 * arcsine(r) * QUARTER)))

    def passed(self, energy: float, resisting: float) -> int | None:
        """How many wells a rotor with ``energy`` N·m·pulses leaves one after the other; None: it does not come to rest."""
        left = energy - self.to_leave(resisting)
        if left <= 0.0:
            return 0
        return None if resisting <= 0.0 else ceil(left / (resisting * self.period))

    def catches_below(self, inertia: float, resisting: float) -> float:
        """The mean speed, pulses/s, below which a rotor does not leave the well that it is in."""
        return sqrt(2.0 * self.deep(resisting) / inertia)
