"""Smooth motions as polynomials of the third degree, each from its begin to that of the next one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.simulation.space.pieces import Piece

LONGEST_NS: Nanos = 3600 * SECOND
"""So far an endless piece is looked at."""
SHORTEST_NS: Nanos = 1000
"""Shorter polynomials are not divided."""


class Cubic(NamedTuple):
    """``c0 + c1·s + c2·s² + c3·s³``, with s the seconds since ``begin``."""

    begin: Nanos
    c0: float
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0

    def at(self, now: float) -> float:
        s = (now - self.begin) / SECOND
        return self.c0 + s * (self.c1 + s * (self.c2 + s * self.c3))

    def slope(self, now: float) -> float:
        s = (now - self.begin) / SECOND
        return self.c1 + s * (2.0 * self.c2 + s * 3.0 * self.c3)

    def scaled(self, factor: float) -> Cubic:
        return Cubic(self.begin, *(factor * one for one in self[1:]))


def cubics_of(pieces: Iterable[Piece], slack: float) -> Iterator[Cubic]:
    """A motion as polynomials that are at most about ``slack`` from it, and exact where it is one."""
    for piece in pieces:
        if piece.end is None:
            yield from _divided(piece.at, piece.begin, piece.begin + LONGEST_NS, slack)
            return
        if piece.end > piece.begin:
            # A piece holds up to its end, but not there.
            yield from _divided(piece.at, piece.begin, max(piece.end - 1, piece.begin), slack)


def _divided(look: Callable[[Nanos], float], begin: Nanos, end: Nanos, slack: float) -> Iterator[Cubic]:
    width = end - begin
    found = _through(look, begin, width)
    if width > SHORTEST_NS and any(
        abs(found.at(t) - look(t)) > slack for t in (begin + width * k // 12 for k in (1, 3, 6, 9, 11))
    ):
        middle = begin + width // 2
        yield from _divided(look, begin, middle, slack)
        yield from _divided(look, middle, end, slack)
    else:
        yield found


def _through(look: Callable[[Nanos], float], begin: Nanos, width: Nanos) -> Cubic:
    """The polynomial through four values, which are a third of the width apart: Newton's form, by forward differences."""
    if width < 3:
        return Cubic(begin, look(begin))
    third = width // 3
    p0, p1, p2, p3 = (look(begin + k * third) for k in range(4))
    least = 1e-9 * max(abs(p0), abs(p3), 1.0)  # below are rounding errors
    d1, d2, d3 = p1 - p0, p2 - 2.0 * p1 + p0, p3 - 3.0 * p2 + 3.0 * p1 - p0
    d2, d3 = (0.0 if abs(one) < least else one for one in (d2, d3))
    h = third / SECOND
    return Cubic(begin, p0, (d1 - d2 / 2.0 + d3 / 3.0) / h, (d2 - d3) / (2.0 * h * h), d3 / (6.0 * h**3))
