"""Recording what M1486 chips do, and how their axes are shown in a trace."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.files.export.axes import AxisView, PhaseOutputs, StepOutputs
from steptwin.m1486.chip import M1486, Event
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.signals import STEP_PULSE_NS
from steptwin.machine import Edge, Nanos
from steptwin.world.trace import Record, Recorder

AXIS = "1"
"""The subject of the plans of a chip's only axis."""
CHARACTERISTIC_PIN = "N"
"""Not a pin: its edges say which waveform the phase currents follow."""


class ChipRecorder:
    """Tells ``record`` what one chip does. ``look`` is to be called whenever the chip says that it has changed."""

    def __init__(self, name: str, chip: M1486, record: Recorder) -> None:
        self._name = name
        self._chip = chip
        self._record = record
        self._revision = chip.drive.revision
        self._characteristic = chip.drive.characteristic

    def look(self) -> None:
        drive, now = self._chip.drive, self._chip.now
        if drive.revision != self._revision:
            self._revision = drive.revision
            self._record(Record(now, self._name, "plan", AXIS, drive.train))
        if drive.characteristic != self._characteristic:
            self._characteristic = drive.characteristic
            self._record(Record(now, self._name, "edge", CHARACTERISTIC_PIN, float(drive.characteristic)))

    def edge(self, edge: Edge) -> None:
        self._record(Record(edge.time, self._name, "edge", edge.pin, edge.value))

    def event(self, event: Event) -> None:
        self._record(Record(event.time, self._name, "event", event.code, event.text))

    def input(self, now: Nanos, pin: str, level: float) -> None:
        self._record(Record(now, self._name, "input", pin, level))


def chip_views(chips: Mapping[str, M1486]) -> dict[tuple[str, str], AxisView]:
    """The axes of chips (by name), in full steps; for `steptwin.files.export.write_trace`."""
    return {(name, AXIS): _view(chip) for name, chip in chips.items()}


def _view(chip: M1486) -> AxisView:
    outputs: StepOutputs | PhaseOutputs = PhaseOutputs(characteristic_pin=CHARACTERISTIC_PIN)
    if chip.interface is STEP_DIRECTION:
        # The chip has DIRECTION itself.
        outputs = StepOutputs(dir=None, active_low=True, width_ns=STEP_PULSE_NS)
    return AxisView("axis", "step", float(FULL_STEP), outputs)
