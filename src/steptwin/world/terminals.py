"""What the pins of a machine are for: what wires, switches, buttons and sources may be joined to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.m1486.pins import CONTROL_PINS, LINE_PINS
from steptwin.m1486.pins import OUTPUT_PINS as CHIP_OUTPUTS
from steptwin.mic488.device import ANALOG_PINS, ENABLE_PINS, INPUT_PINS, OUTPUT_PINS, Mic488
from steptwin.world.kernel import PinName

DIGITAL_INPUT, ANALOG_INPUT, OUTPUT = "digital input", "analog input", "output"

_PINS: Mapping[type, Mapping[str, Sequence[str]]] = {
    Mic488: {DIGITAL_INPUT: (*INPUT_PINS,), ANALOG_INPUT: (*ANALOG_PINS,), OUTPUT: (*OUTPUT_PINS, *ENABLE_PINS, "ERR")},
    # User lines are both (manual chapter II).
    M1486: {DIGITAL_INPUT: (*LINE_PINS, *CONTROL_PINS), ANALOG_INPUT: (), OUTPUT: (*LINE_PINS, *CHIP_OUTPUTS)},
}


def check_terminal(machine: Mic488 | M1486, name: PinName, kind: str) -> None:
    """Raises `Misuse` unless a pin of ``machine`` is of that kind."""
    pins = _PINS[type(machine)][kind]
    if name.pin not in pins:
        there = ", ".join(pins) or "none"
        raise Misuse(f"{name} is no {kind}: {kind}s of {name.machine!r} are {there}")
