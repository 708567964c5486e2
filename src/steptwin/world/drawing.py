"""How an element is drawn: a track with what moves along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from steptwin.world.site import Terminal

ROD = "rod"
"""The one place is that of the end of a rod, which comes out of its body at 0."""
BELT = "belt"
"""Each place is that of the front of a workpiece on a belt that moves away from 0."""


class SensorZone(NamedTuple):
    """Where a sensor is on, mm; None where it has no end."""

    target: Terminal
    low: float | None
    high: float | None
    period: float | None = None


@dataclass(frozen=True, slots=True)
class Drawing:
    """A track from 0 to ``length`` mm."""

    shape: str
    """`ROD` or `BELT`."""
    length: float
    places: tuple[str, ...]
    """Signals of the element, mm along the track; NaN where there is nothing."""
    size: float = 0.0
    """Length of a body, mm: it ends so far before its place."""
    sensors: tuple[SensorZone, ...] = ()
