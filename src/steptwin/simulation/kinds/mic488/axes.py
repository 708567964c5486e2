"""How a MIC488 counts positions and encoders."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from steptwin.machine import Nanos
from steptwin.mic488.core import check_turn
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.inputs import index_input
from steptwin.simulation.kinds.kind import EncoderInputs
from steptwin.simulation.mechanics.lanes import AxisLane, plain_view
from steptwin.simulation.mechanics.scale import FULL_STEPS, DriveScale, GivenScale, exact_fraction


def scale(given: GivenScale, device: Mic488Device, number: int) -> DriveScale:
    axis = device.axes[number - 1]
    return DriveScale(
        pulses_per_rev=axis.config.mot_resol if given.pulses_per_rev is None else given.pulses_per_rev,
        full_steps=FULL_STEPS if given.full_steps is None else given.full_steps,
        unit=axis.config.unit_name,
        pulses_per_unit=exact_fraction(axis.gear),
        text=f"has axis {number} in {axis.config.unit_name}",
    )


def lanes(device: Mic488Device) -> Mapping[str, AxisLane]:
    """In configured units."""
    return {
        str(axis.number): plain_view(str(axis.number))._replace(unit=axis.config.unit_name, pulses_per_unit=axis.gear)
        for axis in device.axes
    }


def _counts_per_pulse(device: Mic488Device, number: int) -> Fraction:
    encoder = device.axes[number - 1].encoder
    return Fraction(encoder.enc_resol, encoder.mot_resol)


def _shown(device: Mic488Device, now: Nanos) -> list[dict[str, object]]:
    return [{"axis": a.number, "counts": a.encoder_counts(now), "turned_by": a.encoder.coupling.value} for a in device.axes]


ENCODERS: EncoderInputs[Mic488Device] = EncoderInputs(
    reader=lambda device: device,
    counts_per_pulse=_counts_per_pulse,
    index_input=lambda number: f"IN{index_input(number - 1) + 1}",
    shown=_shown,
    couple=lambda device, number, coupling, now: device.couple_encoder(number, Coupling(coupling), now),
    check_turn=check_turn,
)
