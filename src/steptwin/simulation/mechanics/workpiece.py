"""A workpiece, as it is wherever it lies."""

from __future__ import annotations

from math import floor
from typing import NamedTuple

from steptwin.motion.trig import cosine, sine


class Workpiece(NamedTuple):
    """Lengths in nm. Those without a width and a height are in no space."""

    name: str
    """Name of the conveyor or nest that it comes from, and its number there, from 1."""
    length: int
    mass: float = 0.0
    """kg."""
    marks: tuple[tuple[int, int], ...] = ()
    """Begin and end of each mark, from the front."""
    width: int = 0
    height: int = 0
    is_round: bool = False
    """An upright cylinder, whose diameter is its length and its width."""

    def extent(self, yaw_q: float) -> int:
        """Its length in a direction from which it is turned by quarter turns, in nm."""
        if self.is_round or not yaw_q:
            return self.length
        return floor(abs(cosine(yaw_q)) * self.length + abs(sine(yaw_q)) * self.width + 0.5)
