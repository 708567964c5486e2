"""Belts of conveyors: their drives and the workpieces on them. Positions are whole steps of a grid: the resolution of a drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import ceil, floor
from typing import ClassVar, NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.state import Stateful

NANOMETRES = 10**6
"""In a millimetre."""


_ROUNDED_NM = 4
"""By so much two widths may be too large, and two places across be apart more, when both are halved and rounded."""


def nanometres(mm: float) -> int:
    """The whole number of nm nearest to a length in mm."""
    return floor(exact_fraction(mm) * NANOMETRES + Fraction(1, 2))


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

    @property
    def whole_speed(self) -> Fraction:
        """Its speed while it runs, steps/ns."""
        return Fraction(self._speed, self._divisor)

    def line(self, now: Nanos) -> tuple[Fraction, Fraction] | None:
        """Its position at 0 ns and its speed in steps/ns, as long as it moves straight on."""
        rate = self.whole_speed if self.runs else Fraction(0)
        return self._base - rate * self._begin, rate

    def straight_from(self) -> Nanos:
        """The moment, ns, from which it moves straight on."""
        return self._begin

    def lead_over(self, other: object) -> int | None:
        """How far it is ahead of another drive that moves as it does at any time; None if they move differently."""
        return None

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """As `MovingPart.reaches`."""
        if not self.runs or direction < 0 or position <= self.grid_position(after):
            return None
        distance = (position - self._base) * self._divisor
        return self._begin - (-distance // self._speed)


class Placed(NamedTuple):
    """A workpiece on the belt that moves it. Lengths and places are on the grid of that belt."""

    workpiece: Workpiece
    origin: int
    """Position of the belt at which it has its front at the beginning."""
    length: int
    marks: tuple[tuple[int, int], ...] = ()
    held: int | None = None
    """Where its front stands, while the belt does not move it."""
    came_from: str = ""
    """Name of the belt that moved it before, on which its rear may still be; empty where it was put on this one."""
    across: int = 0
    """How far its middle is left of the middle of the belt, nm."""
    yaw_q: float = 0.0
    """Quarter turns by which it is turned on the belt."""
    pusher: str = ""
    """Name of what pushes it across the belt; it is ``across`` while that is at 0."""

    def front(self, position: int) -> int:
        """The place of its front while the belt is at ``position``."""
        return position - self.origin if self.held is None else self.held

    @property
    def width(self) -> int:
        """How much of the width of the belt it takes, nm."""
        return self.workpiece.extent(self.yaw_q + 1.0)

    def zones(self, *, of_marks: bool) -> tuple[tuple[int, int], ...]:
        """Begin and end, from the front, of what a sensor sees: of it, or of its marks."""
        return self.marks if of_marks else ((0, self.length),)


class Bar(NamedTuple):
    """Something on the way of a workpiece, whose front stands at ``place``."""

    workpiece: str
    place: int
    by: str


class Near(NamedTuple):
    """Another belt of the line, whose workpieces may lie over this one, too. Lengths are in nm."""

    belt: Belt
    begin: int
    """Its beginning, from that of this belt."""
    low: int
    high: int
    """Its workpieces lie over this belt only between these places."""
    joins: int | None = None
    """The place of this belt where its way joins that over this belt; None: it leads over all of this belt."""
    after: str | None = None
    """The belt before it on the way over this one, if there is one."""

    @property
    def joining(self) -> int:
        """The place on its own grid where its way joins that over this belt."""
        return self.belt.from_nm((self.joins or 0) - self.begin)

    def has_all_of(self, placed: Placed) -> bool:
        """Whether one of its workpieces lies on the way over this belt, wherever it reaches."""
        return self.joins is None or (self.after is not None and placed.came_from in ("", self.after))


class Belt(Stateful):
    """A belt with the workpieces that it moves: those whose centres are over it.

    A workpiece reaches from its front backwards. It lies over every belt below it; `occupant` answers for all of them.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_down",
        "_itself",
        "_up",
        "across_at",
        "drive",
        "following",
        "is_in_the_way",
        "length",
        "name",
        "near",
        "own",
        "per_mm",
        "stride",
    )
    __slots__ = (*FIXED, "bars", "passings", "raised", "workpieces")

    def __init__(self, name: str, length: float, drive: BeltDrive, per_mm: Fraction) -> None:
        """``length`` in mm; ``per_mm``: steps of the grid of its drive."""
        self.name = name
        self.drive = drive
        self.per_mm = per_mm
        self._up, self._down = (per_mm / NANOMETRES).as_integer_ratio()
        self.length = self.to_grid(length)
        self.own = drive if isinstance(drive, ConstantDrive | RampedDrive) else None
        """Its drive, if it never goes back."""
        self.stride = 1 if self.own is None else self.own.stride
        """The most that it moves within a nanosecond."""
        self.following: Belt | None = None
        """The belt on which workpieces go on at its end."""
        self.near: tuple[Near, ...] = ()
        self._itself = Near(self, 0, 0, 0)
        self.workpieces: tuple[Placed, ...] = ()
        self.across_at: Callable[[Placed, Nanos], int] = lambda placed, now: placed.across
        """How far the middle of a workpiece is left of the middle of the belt, nm."""
        self.is_in_the_way: Callable[[Placed, Nanos], bool] = lambda placed, now: False
        """Whether something that pushes workpieces is where one is to lie."""
        self.bars: tuple[Bar, ...] = ()
        self.passings = 0
        """How often what is pushed or pushes has come beside a workpiece or a place for one, or before or behind it."""
        self.raised: tuple[int, ...] = ()
        """The places of the stops that are on."""

    # ------------------------------------------------------------------ places

    def to_grid(self, mm: float) -> int:
        """The step nearest to a length in mm."""
        return floor(exact_fraction(mm) * self.per_mm + Fraction(1, 2))

    def from_nm(self, nm: int) -> int:
        """The step nearest to a length in nm."""
        return (2 * nm * self._up + self._down) // (2 * self._down)

    def to_nm(self, steps: int) -> int:
        """The whole number of nm nearest to a length in steps."""
        return (2 * steps * self._down + self._up) // (2 * self._up)

    def position(self, now: Nanos) -> int:
        return self.drive.grid_position(now)

    def exit(self, placed: Placed) -> int:
        """The place of the front at which a workpiece leaves the belt: its centre is over the following one, or its front is at
        the end of the last one."""
        return self.length + (0 if self.following is None else placed.length // 2)

    def version(self) -> object:
        """A value that changes whenever predictions for the workpieces that it moves become invalid."""
        return self.drive.version(), self.workpieces

    def version_at(self, place: int) -> object:
        """A value that changes whenever predictions for what lies over a place become invalid."""
        return tuple(near.belt.version() for near, _, _ in self._views(place, place)) if self.near else self.version()

    # ------------------------------------------------------------------ workpieces

    def place(
        self, workpiece: Workpiece, front: int, now: Nanos, came_from: str = "", across: int = 0, yaw_q: float = 0.0
    ) -> Placed:
        """How a workpiece lies with its front at ``front``."""
        marks = tuple((self.from_nm(begin), self.from_nm(end)) for begin, end in workpiece.marks)
        length = self.from_nm(workpiece.extent(yaw_q))
        return Placed(workpiece, self.position(now) - front, length, marks, None, came_from, across, yaw_q)

    def put(self, placed: Placed) -> None:
        self.workpieces = (*self.workpieces, placed)

    def take(self, placed: Placed) -> None:
        self.workpieces = tuple(one for one in self.workpieces if one != placed)

    def hold(self, placed: Placed, front: int) -> None:
        """Let a workpiece stand with its front at ``front``, whatever the belt does."""
        self._replace(placed, placed._replace(held=front))

    def release(self, placed: Placed, position: int) -> None:
        """Let a workpiece that stood go on with the belt, which is at ``position``."""
        self._replace(placed, placed._replace(origin=position - placed.front(position), held=None))

    def push(self, placed: Placed, across: int, pusher: str) -> None:
        """Let something push a workpiece, or (an empty name) no longer. ``across`` as in `Placed`."""
        self._replace(placed, placed._replace(across=across, pusher=pusher))

    def _replace(self, placed: Placed, other: Placed) -> None:
        self.workpieces = tuple(other if one == placed else one for one in self.workpieces)

    # ------------------------------------------------------------------ occupancy

    def are_beside(self, one: Placed, belt: Belt, other: Placed, now: Nanos) -> bool:
        """Whether one of its workpieces and one of a belt can pass each other, because nothing across the belt is below both."""
        apart = abs(self.across_at(one, now) - belt.across_at(other, now))
        return apart > 0 and 2 * apart >= one.width + other.width - _ROUNDED_NM

    def firsts(self, now: Nanos) -> list[Placed]:
        """Those that come to the end of the belt next, the first one before: none of its workpieces is before one of them."""
        position, found = self.position(now), list[Placed]()
        ahead = sorted(self.workpieces, key=lambda one: one.front(position), reverse=True)
        for n, one in enumerate(ahead):
            if all(self.are_beside(one, self, other, now) for other in ahead[:n]):
                found.append(one)
        return found

    def occupant(
        self, low: int, high: int, now: Nanos, *, of_marks: bool = False, beside: Placed | None = None
    ) -> tuple[Belt, Placed] | None:
        """The workpiece, or one with a mark, over the stretch from ``low`` to ``high``, ends included, and the belt of it.
        ``beside``: another one, which must not be beside it.

        Those that this belt moves come first; of several of one belt it is the one that was put there first. What is before
        the beginning of this belt, or beyond its end, is on those before and behind it.
        """
        for near, first, last in self._views(low, high):
            position = near.belt.position(now)
            for one in near.belt.workpieces:
                begins, front = first if near.has_all_of(one) else max(first, near.joining), one.front(position)
                zones = one.zones(of_marks=of_marks) if begins <= last else ()
                if zones and beside is not None and self.are_beside(beside, near.belt, one, now):
                    continue
                if any(front - end <= last and front - begin >= begins for begin, end in zones):
                    return near.belt, one
        return None

    def next_change(self, place: int, now: Nanos, *, of_marks: bool = False) -> Nanos | None:
        """The moment, ns, at which the occupant of a place may become another one while nothing else happens."""
        moments = (
            next_change(near.belt.drive, *near.belt.edges(there, near.belt.position(now), of_marks=of_marks), now)
            for near, there, _ in self._views(place, place)
        )
        return min((moment for moment in moments if moment is not None), default=None)

    def _views(self, low: int, high: int) -> Iterator[tuple[Near, int, int]]:
        """A stretch as each belt has it whose workpieces may lie over it; the one that is on this belt comes first."""
        yield self._itself, max(low, 0), high
        for near in self.near:
            begin, end = self.to_nm(low), self.to_nm(high)
            if begin <= near.high and end >= near.low:
                yield near, near.belt.from_nm(begin - near.begin), near.belt.from_nm(end - near.begin)

    def edges(self, place: int, position: int, *, of_marks: bool = False) -> tuple[int | None, int | None]:
        """The next positions of the belt below and above ``position`` at which one of its workpieces may come to ``place``, or
        leave it."""
        below: int | None = None
        above: int | None = None
        for one in self.workpieces:
            if one.held is not None:
                continue
            front = one.origin + place
            for begin, end in one.zones(of_marks=of_marks):
                for edge in (front + begin - 1, front + begin, front + end, front + end + 1):
                    if edge < position and (below is None or edge > below):
                        below = edge
                    elif edge > position and (above is None or edge < above):
                        above = edge
        return below, above


def next_change(drive: BeltDrive, below: int | None, above: int | None, now: Nanos) -> Nanos | None:
    """The moment, ns, at which the belt reaches one of two positions, below and above its present one; None if never."""
    down = None if below is None else drive.reaches(below, now, -1)
    up = None if above is None else drive.reaches(above, now, 1)
    return up if down is None else down if up is None else min(up, down)
