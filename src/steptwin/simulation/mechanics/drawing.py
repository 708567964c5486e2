"""How an element is drawn: a track with what moves along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from steptwin.simulation.toml.values import Terminal

ROD = "rod"
"""The one place is that of the end of a rod, which comes out of its body at 0."""
BELT = "belt"
"""Each place is that of the front of a workpiece on a belt that moves away from 0."""
SLIDE = "slide"
"""The one place is that of a slide on a rail."""
DIAL = "dial"
"""The one place is the angle of a hand, in the unit of which ``length`` is a turn."""
PLANE = "plane"
"""The two places are those of a tool in a plane, ``length`` wide and ``across`` high."""


class SensorZone(NamedTuple):
    """Where a sensor is on, along the track; None where it has no end."""

    target: Terminal
    low: float | None
    high: float | None
    period: float | None = None


@dataclass(frozen=True, slots=True)
class Drawing:
    """A track of ``length``, in the unit of its places."""

    shape: str
    """`ROD`, `BELT`, `SLIDE`, `DIAL` or `PLANE`."""
    length: float
    places: tuple[str, ...]
    """Signals of the element, places on the track; NaN where there is nothing."""
    size: float = 0.0
    """Length of a body: it ends so far before its place."""
    sensors: tuple[SensorZone, ...] = ()
    low: float = 0.0
    """Where the track begins."""
    across: float = 0.0
    across_low: float = 0.0
    """As ``length`` and ``low``, of the other direction of a plane; the width of a belt."""
    feeds: bool = False
    """Whether workpieces come onto a belt by themselves; they wait before its beginning."""


def rail(travel: tuple[float, float] | None, sensors: tuple[SensorZone, ...] = (), beyond: float = 0.0) -> Drawing:
    """A slide that an axis moves, up to ``beyond`` further; a rail of unknown length shows its sensors."""
    ends = [end for one in sensors for end in (one.low, one.high) if end is not None]
    low, high = travel or (min([0.0, *ends]), max([0.0, *ends]))
    room = beyond or (0.05 * (high - low) or 1.0 if travel is None else 0.0)
    return Drawing(SLIDE, high - low + 2.0 * room, ("position",), sensors=sensors, low=low - room)
