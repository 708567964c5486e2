"""The table of a conveyor: its keys that need more than a row, its stops, and what must fit together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.simulation.components.beltsensor import SensorSpec
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import BoardSpec, Joint
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.toml.reader import Key, TomlText, optional
from steptwin.simulation.toml.sense import TableRows
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, permitting

RUN, FEED = "RUN", "FEED"


@dataclass(frozen=True, slots=True, kw_only=True)
class StopSpec:
    """A stop that holds workpieces back."""

    at: float
    hold: Terminal | None
    path: Path = ()


STOP = TableRows(
    written="[[conveyor.stop]]",
    keys=(
        Key("at", number(0.0), "mm from the beginning of the belt, where fronts of workpieces stand"),
        optional(OUTPUT_PIN, "hold", "output joined to STOP1 (of the second STOP2 ...), which holds workpieces while it is on"),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConveyorSpec(BoardSpec):
    length: float
    speed: float | None
    run: Terminal | None
    axis: str | None
    mm_per_unit: float
    feed: Terminal | None
    feed_every: Nanos | None
    workpiece: float
    mass: float
    marks: tuple[float, ...]
    mark_width: float
    next: str | None
    sensors: tuple[SensorSpec, ...]
    stops: tuple[StopSpec, ...]

    @property
    def terminals(self) -> Terminals:
        stops = tuple(stop_terminal(n) for n in range(1, len(self.stops) + 1))
        return Terminals(digital_inputs=((FEED,) if self.speed is None else (RUN, FEED)) + stops)

    @property
    def joints(self) -> Iterable[Joint]:
        if self.run is not None and self.speed is not None:
            yield Joint("run", RUN, self.run)
        if self.feed is not None:
            yield Joint("feed", FEED, self.feed)
        for n, stop in enumerate(self.stops):
            if stop.hold is not None:
                yield Joint("stop", stop_terminal(n + 1), stop.hold)

    def others(self, described: ElementSpecs) -> Iterable[tuple[str, str]]:
        if self.axis is not None:
            yield "axis", self.axis
        if self.next is not None:
            yield "next", self.next

    def check(self, text: TomlText) -> None:
        if (self.speed is None) is (self.axis is None):
            text.wrong(self.path, "D007", "a conveyor needs one of speed and axis")
        if self.next == self.name:
            text.wrong((*self.path, "next"), "D007", f"{self.name} is followed by itself")
        for one in (*self.sensors, *self.stops):
            if one.at > self.length:
                text.wrong((*one.path, "at"), "D007", f"at = {one.at:g} is beyond length = {self.length:g}")
        for mark in self.marks:
            if mark + self.mark_width > self.workpiece:
                message = f"a mark from {mark:g} to {mark + self.mark_width:g} mm is beyond workpiece = {self.workpiece:g}"
                text.wrong((*self.path, "marks"), "D007", message)


@permitting("list of numbers from 0")
def mark_places(value: Any) -> tuple[float, ...]:
    if not isinstance(value, list):
        raise Misuse(f"{value!r}: expected a list of numbers, mm from the front")
    return tuple(number(0.0)(one) for one in value)


def stop_terminal(n: int) -> str:
    return f"STOP{n}"
