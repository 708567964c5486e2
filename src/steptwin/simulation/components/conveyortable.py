"""The table of a conveyor: its keys that need more than a row, its stops, and what must fit together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.beltsensor import SensorSpec
from steptwin.simulation.components.bodytable import SHAPES, color_value
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import Joint, TerminalComponentSpec
from steptwin.simulation.components.mount import MoverSpec
from steptwin.simulation.components.workpieces import size_of_workpiece
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.mechanics.belt import nanometres
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, table, tables_in
from steptwin.simulation.toml.values import (
    OUTPUT_PIN,
    NameOf,
    Terminal,
    flag,
    number,
    permitting,
    positive_time,
    time_value,
    word,
)

RUN, FEED = "RUN", "FEED"
BELT_STOP = "belt-stop"
"""Fault by which a belt stands although it should run."""


@table("[[conveyor.stop]]")
class StopSpec(TableSpec):
    """A stop that holds workpieces back."""

    at: float = key(number(0.0), "mm from the beginning of the belt, where fronts of workpieces stand")
    hold: Terminal | None = key(
        OUTPUT_PIN, "output connected to STOP1 (of the second STOP2 ...), which holds workpieces while it is on", default=None
    )


@permitting("list of numbers from 0")
def _mark_places(value: Any) -> tuple[float, ...]:
    if not isinstance(value, list):
        raise Misuse(f"{value!r}: expected a list of numbers, mm from the front")
    return tuple(number(0.0)(one) for one in value)


@table("[[conveyor]]")
class ConveyorSpec(TerminalComponentSpec, MoverSpec):
    length: float = key(number(0.0, above=True), "mm")
    speed: float | None = key(number(0.0, above=True), "mm/s while RUN is on", default=None)
    run: Terminal | None = key(
        OUTPUT_PIN, "with speed: output connected to RUN; without it a wire may be", default=None, needs="speed"
    )
    ramp_up: Nanos = key(time_value, "from rest to speed when RUN is switched on; default at once", default=0, needs="speed")
    ramp_down: Nanos = key(time_value, "from speed to rest when it is switched off; default at once", default=0, needs="speed")
    axis: str | None = key(NameOf("axis"), "the axis that moves the belt, instead of speed", default=None)
    mm_per_unit: float = key(number(0.0, above=True), "with axis: mm of the belt per unit of the axis", default=1.0, needs="axis")
    feed: Terminal | None = key(
        OUTPUT_PIN, "output connected to FEED, which puts a workpiece on when it is switched on", default=None
    )
    feed_every: Nanos | None = key(positive_time, "a workpiece comes after each such time", default=None)
    feed_waits: bool = key(
        flag, "whether one without room waits for it, and the time to the next one begins then; else it is missed", default=False
    )
    workpiece: tuple[float, ...] = key(
        size_of_workpiece,
        "mm: its length; in space [length, width, height] or [diameter, height]",
        default=(50.0, 50.0, 50.0),
    )
    workpiece_shape: str | None = key(
        word(*SHAPES), "what a workpiece looks like within its size; default a box, or a cylinder", default=None
    )
    workpiece_color: str | None = key(color_value, "of its picture: #RRGGBB", default=None)
    mass: float = key(number(0.0), "kg of a workpiece", default=0.0)
    marks: tuple[float, ...] = key(
        _mark_places, "mm from the front of a workpiece to each of its marks, such as [10, 35]", default=()
    )
    mark_width: float = key(number(0.0, above=True), "length of a mark, mm", default=2.0, needs="marks")
    next: str | None = key(NameOf("conveyor"), "the conveyor on which workpieces go on", default=None)
    width: float = key(number(0.0, above=True), "mm across, in space; its top face is at its origin", default=100.0, order=2)
    sensors: tuple[SensorSpec, ...] = tables_in("sensor", SensorSpec)
    stops: tuple[StopSpec, ...] = tables_in("stop", StopSpec)

    @property
    def holds_workpieces(self) -> bool:
        return True

    @property
    def turns_encoders(self) -> bool:
        return True

    @property
    def moves_others(self) -> bool:
        """Only its workpieces."""
        return False

    @property
    def terminals(self) -> Terminals:
        stops = tuple(stop_terminal(n) for n in range(1, len(self.stops) + 1))
        return Terminals(digital_inputs=((FEED,) if self.speed is None else (RUN, FEED)) + stops)

    @property
    def joints(self) -> Iterable[Joint]:
        if self.run is not None:
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
        if self.may_drop(described):
            yield from (("next", name) for name in described.holders)

    def may_drop(self, described: ElementSpecs) -> bool:
        """Whether its ``next`` may begin elsewhere, now or when something moves: then workpieces fall."""
        following = None if self.next is None else described.mounts.get(self.next)
        return following is not None and self.is_mounted and following.is_mounted

    def check(self, text: TomlText) -> None:
        if (self.speed is None) is (self.axis is None):
            text.wrong(self.path, "D007", "a conveyor needs one of speed and axis")
        if self.next == self.name:
            text.wrong((*self.path, "next"), "D007", f"{self.name} is followed by itself")
        for one in (*self.sensors, *self.stops):
            if one.at > self.length:
                text.wrong((*one.path, "at"), "D007", f"at = {one.at:g} is beyond length = {self.length:g}")
        for mark in self.marks:
            if mark + self.mark_width > self.workpiece[0]:
                message = f"a mark from {mark:g} to {mark + self.mark_width:g} mm is beyond workpiece = {self.workpiece[0]:g}"
                text.wrong((*self.path, "marks"), "D007", message)


def stop_terminal(n: int) -> str:
    return f"STOP{n}"


class NearSpec(NamedTuple):
    """A conveyor of the same line, as `Near` has its belt."""

    name: str
    begin: int
    low: int
    high: int
    joins: int | None
    after: str | None


def near_ones(name: str, conveyors: Mapping[str, ConveyorSpec]) -> tuple[NearSpec, ...]:
    """The conveyors before and behind one of which a workpiece may lie over it, or be in the way of one that leaves it."""
    longest = max(nanometres(spec.workpiece[0]) for spec in conveyors.values())

    def near(other: str, begin: int, joins: int | None, after: str | None) -> NearSpec:
        # On a coarse grid it is up to twice as long.
        end = begin + nanometres(conveyors[other].length)
        return NearSpec(other, begin, begin - 2 * longest, end + 2 * longest, joins, after)

    def before(of: str, end: int, joins: int | None, known: tuple[str, ...]) -> Iterator[NearSpec]:
        for spec in conveyors.values():
            if spec.next == of and spec.name not in known:
                begin = end - nanometres(spec.length)
                yield near(spec.name, begin, joins, None)
                if begin > (joins or 0) - longest:
                    yield from before(spec.name, begin, joins, (*known, spec.name))

    def behind() -> Iterator[NearSpec]:
        way, end = [name], nanometres(conveyors[name].length)
        most = end + 2 * longest
        while (following := conveyors[way[-1]].next) in conveyors and following not in way[1:] and end <= most:
            yield near(following, end, end, way[-1])
            yield from before(following, end, end, tuple(way))
            way.append(following)
            end += nanometres(conveyors[following].length)

    return (*before(name, 0, None, ()), *behind())
