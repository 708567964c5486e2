"""How the axis of an M1486 is shown in a trace: in full steps."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.pins import WAVEFORM
from steptwin.m1486.signals import STEP_PULSE_NS
from steptwin.simulation.mechanics.lanes import AxisLane, PhaseOutputs, StepOutputs

AXIS = "1"
"""The subject of the plans of a chip's only axis."""


def lanes(chip: M1486Chip) -> Mapping[str, AxisLane]:
    outputs: StepOutputs | PhaseOutputs = PhaseOutputs(characteristic_pin=WAVEFORM)
    if chip.interface is STEP_DIRECTION:
        # The chip has DIRECTION itself.
        outputs = StepOutputs(dir=None, active_low=True, width_ns=STEP_PULSE_NS)
    return {AXIS: AxisLane("axis", "step", float(FULL_STEP), outputs)}
