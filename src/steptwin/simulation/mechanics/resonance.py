"""Resonance of a stepper motor in a band of speeds: its rotor vibrates about the field, ever more, until it loses it.

In the band the vibration grows as e^(growth·t), as if its damping were negative; outside it decays to what there always is. The
rotor loses the field when the vibration has the energy to leave it:

    T·λ/2π · (2·√(1 − r²) − 2·r·arccos r),

for a torque T with the electrical period λ and the share r of it that the motion needs. As the amplitude of a linear vibration
with this energy that is 4/π full steps for r = 0, and 0 for r = 1. Only the amplitude is followed, not the phase.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf, sqrt
from typing import NamedTuple

from steptwin.motion.exponential import decay, logarithm
from steptwin.motion.trig import QUARTER, arccosine


class Resonance(NamedTuple):
    """``low`` to ``high`` in pulses/s, ``growth`` and ``fading`` in 1/s; ``least`` is the vibration that there always is, in full
    steps."""

    low: float
    high: float
    growth: float
    fading: float
    least: float


class MotionPhase(NamedTuple):
    """A phase of a motion, s from the beginning of its profile: speed (pulses/s), and the share of the torque that it needs."""

    begin_s: float
    end_s: float
    speed: float
    use: float


class ResonanceInterval(NamedTuple):
    """From ``begin_s`` on the vibration, ``amplitude`` full steps then, grows with ``rate`` 1/s (negative: fades)."""

    begin_s: float
    amplitude: float
    rate: float

    def at(self, now_s: float, least: float) -> float:
        passed = abs(self.rate) * (now_s - self.begin_s)
        if self.rate > 0.0:
            return self.amplitude / max(decay(passed), 1e-300)
        return max(least, self.amplitude * decay(passed))


def limit(use: float) -> float:
    """The amplitude, full steps, with which the rotor leaves the field while the motion needs a share of the torque."""
    if use >= 1.0:
        return 0.0
    stiffness = sqrt(1.0 - use * use)
    barrier = 2.0 * (stiffness - use * arccosine(use) * QUARTER)
    return sqrt(max(2.0 * barrier / stiffness, 0.0)) / QUARTER


def resonance_intervals(
    of: Resonance, phases: Iterable[MotionPhase], amplitude: float
) -> Iterator[tuple[ResonanceInterval, float | None]]:
    """The vibration through phases of a motion, with the moment at which the rotor loses the field, which ends them."""
    for phase in phases:
        grows = of.low < phase.speed < of.high
        interval = ResonanceInterval(phase.begin_s, amplitude, of.growth if grows else -of.fading)
        if grows:
            times = limit(phase.use) / amplitude
            lost = phase.begin_s + (logarithm(times) / of.growth if times > 1.0 else 0.0)
            if lost < phase.end_s:
                yield interval, lost
                return
        yield interval, None
        amplitude = interval.at(phase.end_s, of.least) if phase.end_s < inf else of.least
