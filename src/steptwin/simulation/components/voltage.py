"""The faults of what gives an analog input its voltage."""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import FaultCategory, number


class VoltageOutput(Protocol):
    is_broken: bool
    """Fault: its wire is broken."""
    offset: float
    """Fault: volts by which it is too high."""

    @property
    def name(self) -> str: ...

    def volts(self, now: Nanos) -> float:
        """The voltage that it gives."""
        ...

    def own_volts(self) -> float:
        """The voltage that it would give without faults."""
        ...


WIRE_IS_BROKEN = Message("simulation.wire-is-broken", "the wire of {name} is broken")
WIRE_IS_WHOLE = Message("simulation.wire-is-whole", "the wire of {name} is whole again")


def _break(active: ActiveFault, output: VoltageOutput, begins: bool, now: Nanos) -> str:
    output.is_broken = begins
    return (WIRE_IS_BROKEN if begins else WIRE_IS_WHOLE)(name=output.name)


READS_TOO_HIGH = Message("simulation.reads-too-high", "{name} reads {volts:g} V too high")
READS_TOO_LOW = Message("simulation.reads-too-low", "{name} reads {volts:g} V too low")
READS_RIGHT = Message("simulation.reads-right", "{name} reads right again")


def _drift(active: ActiveFault, output: VoltageOutput, begins: bool, now: Nanos) -> str:
    output.offset = active.fault.number("volts") if begins else 0.0
    if not begins:
        return READS_RIGHT(name=output.name)
    return (READS_TOO_LOW if output.offset < 0.0 else READS_TOO_HIGH)(name=output.name, volts=abs(output.offset))


def _is_wrong(active: ActiveFault, output: VoltageOutput, now: Nanos) -> bool:
    return output.volts(now) != output.own_volts()


BROKEN_WIRE = FaultKind(
    "broken-wire",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "The wire of an analog sensor is broken: 0 V.",
    effect=ElementEffect(_break, _is_wrong),
    faulty=FaultCategory.SENSOR,
)
DRIFT = FaultKind(
    "drift",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "An analog sensor reads too high or too low.",
    own=(number("volts", "Too high; negative: too low.", -10.0, 10.0, default=0.5),),
    effect=ElementEffect(_drift, _is_wrong),
    faulty=FaultCategory.SENSOR,
    tried=({"volts": 0.5}, {"volts": -0.5}),
)
