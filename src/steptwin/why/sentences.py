"""Actions, statements and frames in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from steptwin.diagnostics import visible
from steptwin.simulation.kinds.lines import LineWords
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.inputs import Bytes, Download, ExternalInput, SetVariable
from steptwin.simulation.world.plant import Plant
from steptwin.why.log import CauseLog, Executed
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

_WORDS: Mapping[type, Callable[[Any], str]] = {
    do.Set: lambda step: "sets " + ", ".join(f"{machine}.{pin.upper()} = {value:g}" for machine, pin, value in step.levels),
    do.Press: lambda step: f"presses {step.button}",
    do.Release: lambda step: f"releases {step.button}",
    do.Write: lambda step: "writes " + ", ".join(f"{machine}.{name} = {value:g}" for machine, name, value in step.values),
    do.PowerCycle: lambda step: f"switches {step.machine} off and on",
    Halt: lambda given: (
        f"stops {given.machine}"
        + (f".M{given.axis}" if given.axis is not None else "" if given.program is None else f"'s program ({given.program})")
    ),
    do.Turn: lambda step: f"turns the encoder of {step.machine}.M{step.axis} by {step.counts}",
    do.SetFault: lambda step: f"sets the fault {step.fault.name or step.fault.kind.name}",
    do.ClearFault: lambda step: f"clears the fault {step.name}",
    SetVariable: lambda given: f"sets the variable {given.name} = {given.value:g}",
    Download: lambda given: f"puts a text into {given.place}",
    Bytes: lambda given: f"sends {given.data.hex(' ')} from {given.place}",
}


def words_of(what: ExternalInput) -> str:
    """An action in words."""
    words = _WORDS.get(type(what))
    return type(what).__name__ if words is None else words(what)


def statement(log: CauseLog, executed: Executed) -> str:
    """A statement with its line: "line 12 `OUT3 = OFF`"."""
    if not log.is_of_present_text(executed):
        return "a statement of a program that was replaced since"
    programs, place = log.world.programs[executed.machine], executed.place
    found, source = programs.statements(place.text)[place.number], programs.texts[place.text]
    text = visible(source.text[found.start : found.end].strip())
    return f"line {found.line} `{text}`" if text else "the end of the program"


class Frames:
    """The frames of the lines of a world in words."""

    def __init__(self, world: Plant) -> None:
        self._told: list[FrameLine] = []
        self.words: dict[str, LineWords] = {
            spec.name: line_kinds()[spec.kind].words(world.lines[spec.name], "", self._told.append) for spec in world.spec.lines
        }

    def meaning(self, record: TraceRecord) -> str:
        """A request in words."""
        place, _, _ = record.subject.rpartition("/")
        self._told.clear()
        self.words[record.machine].frame(record.time, place, FrameDirection.IN, record.data())
        if self._told:
            return self._told[-1].meaning
        return record.data().decode("ascii", "backslashreplace")

    def reaches(self, record: TraceRecord, unit: int) -> bool:
        """Whether a record is a request that may change the controller with an address."""
        place, _, direction = record.subject.rpartition("/")
        return direction == FrameDirection.IN.value and unit in self.words[record.machine].changes(place, record.data())
