"""Belts of conveyors: their drives and the workpieces on them. Positions are whole steps of a grid: the resolution of a drive."""

from __future__ import annotations

from fractions import Fraction
from math import ceil
from typing import ClassVar, NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.state import Stateful


class BeltDrive(Protocol):
    """The drive of a belt: a `steptwin.simulation.logic.contacts.MovingPart`."""

    def version(self) -> object: ...
    def grid_position(self, now: Nanos) -> int: ...
    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None: ...


class ConstantDrive(Stateful):
    """A drive with a constant forward speed while it is switched on, without ramps. A step of its grid is 1 pm, so that 1 mm/s is
    one step per nanosecond."""

    FIXED: ClassVar[tuple[str, ...]] = ("_divisor", "_speed", "stride")
    __slots__ = (*FIXED, "_base", "_begin", "runs")

    def __init__(self, speed: Fraction, now: Nanos) -> None:
        """``speed`` in mm/s."""
        self._speed, self._divisor = speed.as_integer_ratio()
        self.stride = ceil(speed)
        """The most that it moves within a nanosecond."""
        self._base = 0
        self._begin = now
        self.runs = False

    def run(self, runs: bool, now: Nanos) -> None:
        if runs is not self.runs:
            self._base, self._begin, self.runs = self.grid_position(now), now, runs

    def version(self) -> object:
        return self._begin, self.runs

    def grid_position(self, now: Nanos) -> int:
        return self._base + (self._speed * (now - self._begin) // self._divisor if self.runs else 0)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """As `MovingPart.reaches`."""
        if not self.runs or direction < 0 or position <= self.grid_position(after):
            return None
        distance = (position - self._base) * self._divisor
        return self._begin - (-distance // self._speed)


class Workpiece(NamedTuple):
    """A workpiece on a belt. ``origin``: position of the belt at which the workpiece has its front at the beginning."""

    name: str
    """Name of the conveyor that was fed with it, and its number there, from 1."""
    origin: int
    length: int
    mass: float = 0.0
    """kg."""
    marks: tuple[tuple[int, int], ...] = ()
    """Begin and end of each mark, from the front."""
    held: int | None = None
    """Where its front stands, while the belt does not move it."""

    def front(self, belt: int) -> int:
        """The place of its front while the belt is at ``belt``."""
        return belt - self.origin if self.held is None else self.held

    def zones(self, *, of_marks: bool) -> tuple[tuple[int, int], ...]:
        """Begin and end, from the front, of what a sensor sees: of it, or of its marks."""
        return self.marks if of_marks else ((0, self.length),)


class Load(Stateful):
    """The workpieces on a belt."""

    __slots__ = ("workpieces",)

    def __init__(self) -> None:
        self.workpieces: tuple[Workpiece, ...] = ()

    def version(self) -> object:
        """A value that changes with every change of the workpieces."""
        return self.workpieces

    def put(self, workpiece: Workpiece) -> None:
        self.workpieces = (*self.workpieces, workpiece)

    def take(self, workpiece: Workpiece) -> None:
        self.workpieces = tuple(one for one in self.workpieces if one != workpiece)

    def hold(self, workpiece: Workpiece, front: int) -> None:
        """Let a workpiece stand with its front at ``front``, whatever the belt does."""
        self._replace(workpiece, workpiece._replace(held=front))

    def release(self, workpiece: Workpiece, belt: int) -> None:
        """Let a workpiece that stood go on with the belt, which is at ``belt``."""
        self._replace(workpiece, workpiece._replace(origin=belt - workpiece.front(belt), held=None))

    def _replace(self, workpiece: Workpiece, other: Workpiece) -> None:
        self.workpieces = tuple(other if one == workpiece else one for one in self.workpieces)

    def covering(self, position: int, belt: int, *, of_marks: bool = False) -> Workpiece | None:
        """The workpiece over ``position``, or with a mark there, while the belt is at ``belt``; of several the one put there
        first."""
        for one in self.workpieces:
            behind = one.front(belt) - position
            if any(begin <= behind <= end for begin, end in one.zones(of_marks=of_marks)):
                return one
        return None

    def edges(self, position: int, belt: int, *, of_marks: bool = False) -> tuple[int | None, int | None]:
        """The next positions of the belt below and above ``belt`` at which `covering` may change."""
        below: int | None = None
        above: int | None = None
        for one in self.workpieces:
            if one.held is not None:
                continue
            front = one.origin + position
            for begin, end in one.zones(of_marks=of_marks):
                for place in (front + begin - 1, front + begin, front + end, front + end + 1):
                    if place < belt and (below is None or place > below):
                        below = place
                    elif place > belt and (above is None or place < above):
                        above = place
        return below, above


def next_change(drive: BeltDrive, below: int | None, above: int | None, now: Nanos) -> Nanos | None:
    """The moment, ns, at which the belt reaches one of two positions, below and above its present one; None if never."""
    down = None if below is None else drive.reaches(below, now, -1)
    up = None if above is None else drive.reaches(above, now, 1)
    return up if down is None else down if up is None else min(up, down)
