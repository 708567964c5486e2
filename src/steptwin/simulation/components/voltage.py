"""The faults of what gives an analog input its voltage."""

from __future__ import annotations

from typing import Protocol

from steptwin.machine import Nanos
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number


class VoltageOutput(Protocol):
    is_broken: bool
    """Fault: its wire is broken."""
    offset: float
    """Fault: volts by which it is too high."""

    @property
    def name(self) -> str: ...


def _break(active: ActiveFault, output: VoltageOutput, begins: bool, now: Nanos) -> str:
    output.is_broken = begins
    return f"the wire of {output.name} is {'broken' if begins else 'whole again'}"


def _drift(active: ActiveFault, output: VoltageOutput, begins: bool, now: Nanos) -> str:
    output.offset = active.fault.number("volts") if begins else 0.0
    return f"{output.name} reads {output.offset:+g} V" if begins else f"{output.name} reads right again"


BROKEN_WIRE = FaultKind(
    "broken-wire",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "The wire of an analog sensor is broken: 0 V.",
    effect=ElementEffect(_break),
)
DRIFT = FaultKind(
    "drift",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "An analog sensor reads too high or too low.",
    own=(number("volts", "Too high; negative: too low.", -10.0, 10.0, default=0.5),),
    effect=ElementEffect(_drift),
)
