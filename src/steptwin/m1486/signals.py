"""Signals of the driver interface on its pins: STEP pulses, data for the converters. Projections of the motion, not state."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from steptwin.controller import Nanos
from steptwin.motion.divisions import StepTrain
from steptwin.motion.waveforms import currents

if TYPE_CHECKING:
    from steptwin.motion.pulses import PulseTimes

STEP_PULSE_NS: Nanos = 1_800
"""Chapter IV: a STEP pulse is at least this long, and data are valid for at least this long before STROBE goes low."""
DATA_VALID_NS: Nanos = 960

_FIRST_D1, _FIRST_D2, _PHASE2 = 8, 10, 17
"""Lines that are data pins: B8 and B9 share D1.0 and D1.1, B10 to B16 share D2.0 to D2.6, B17 shares PHASE2."""


class Strobe(NamedTuple):
    """One value for the dual converter, taken over when STROBE goes low."""

    time: Nanos
    channel: int
    """1 or 2: DIR is 0 for channel 1 and 1 for channel 2."""
    magnitude: int
    phase: int
    """Level of PHASE2; M-25: high is negative current."""


def step_pulses(train: StepTrain, after: Nanos, until: Nanos) -> PulseTimes:
    """Moments at which STEP goes low, with ``after`` < time <= ``until`` (int64 ns)."""
    from steptwin.motion.pulses import step_times

    return step_times(train, after, until)


def strobes(train: StepTrain, characteristic: int, after: Nanos, until: Nanos) -> Iterator[Strobe]:
    """Strobes of the Dual DAC interface for the steps with ``after`` < time <= ``until``: both channels for each, in turn."""
    position = train.count(after)
    intervals = train.intervals()
    _, end, grid = next(intervals)
    for moment in step_pulses(train, after, until).tolist():
        while end is not None and (end - position) * train.direction <= 0:
            _, end, grid = next(intervals)
        position += grid * train.direction
        for channel, current in enumerate(currents(characteristic, position), start=1):
            yield Strobe(moment + (2 * channel - 1) * DATA_VALID_NS, channel, abs(current), phase_level(current))


def phase_level(current: int) -> int:
    """M-25."""
    return int(current < 0)


def data_level(line: int, phases: tuple[int, int]) -> int:
    """Level of a line that the interface occupies, between two steps. Dual DAC leaves channel 2 on its pins."""
    first, second = phases
    if line == _PHASE2:
        return phase_level(second)
    if line >= _FIRST_D2:
        return abs(second) >> line - _FIRST_D2 & 1
    return abs(first) >> line - _FIRST_D1 & 1
