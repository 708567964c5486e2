"""Belts one behind the other: how far the first workpiece of a belt can go before one that another belt moves.

Workpieces that one belt moves keep their distances. Between two belts they change, and a workpiece goes on unless it would touch:
where both belts move at constant speeds, or with one axis, the place where it would is calculated, and there is none if the one
ahead is quick enough. Otherwise it may go up to where the rear of the one ahead is at present, and again from there. All follows
from the motions alone: whoever looks earlier, or again, finds the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import ceil
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.mechanics.belt import NANOMETRES, Belt, Near, Placed

_SLACK_NM = 2
"""Rounding of a distance between workpieces of two belts."""
_LEAST_GAP = 1
"""Steps of a grid between workpieces that touch."""


class Ahead(NamedTuple):
    """A workpiece ahead of the first one of a belt, on the grid of that belt."""

    near: Near
    placed: Placed
    rear: int
    """The place of its rear, or where its way joins while that is on another one."""
    is_joining: bool
    """Whether its rear is still on another way."""


def ahead_of(belt: Belt, first: Placed, now: Nanos) -> Iterator[Ahead]:
    """The workpieces that other belts move, on the way of the first one of a belt."""
    beyond = belt.to_nm(first.front(belt.position(now)))
    for near in belt.near:
        if near.joins is None:
            continue
        position, joining = near.belt.position(now), belt.from_nm(near.joins)
        for one in near.belt.workpieces:
            if one.workpiece.name == first.workpiece.name:
                continue
            front = one.front(position)
            rear = _rear(belt, near, front - one.length)
            if near.has_all_of(one):
                if belt.are_beside(first, near.belt, one, now):
                    continue
                yield Ahead(near, one, rear, is_joining=False)
            elif near.after is not None:
                yield Ahead(near, one, max(rear, joining), is_joining=rear < joining)
            elif _is_first(near.belt.to_nm(front) + near.begin - near.joins, one, beyond - near.joins):
                yield Ahead(near, one, joining, is_joining=True)


def _rear(belt: Belt, near: Near, place: int) -> int:
    """A place of another belt on the grid of this one."""
    return belt.from_nm(near.belt.to_nm(place) + near.begin)


def _is_first(beyond: int, placed: Placed, other: int) -> bool:
    """Whether a workpiece has come to where two ways join, and not after the other one. Both as nm beyond that place."""
    return (beyond > 0 or (beyond == 0 and placed.held is None)) and beyond >= other


def limit(belt: Belt, first: Placed, now: Nanos) -> int | None:
    """The place up to which the first workpiece of a belt can go before those that others move; None: as far as it likes.

    One that stands goes on behind one that is at least as quick, or when there is room for half of it.
    """
    front, clear = first.front(belt.position(now)), belt.exit(first)
    places: list[int] = []
    for ahead in ahead_of(belt, first, now):
        if ahead.rear > clear:
            continue
        place = ahead.rear if ahead.is_joining else ahead.rear - _LEAST_GAP
        motions = None if ahead.is_joining or ahead.placed.held is not None else _motions(belt, first, ahead, now)
        if first.held is not None:
            if motions is not None and 0 < motions.front_rate <= motions.rear_rate:
                continue
            places.append(place if place >= _goes_on_at(first, front, clear) else front)
        elif motions is None:
            places.append(place)
        elif (touch := motions.touch(belt.to_nm(clear))) is not None:
            places.append(motions.position(touch) - first.origin)
    return min(places, default=None)


def _goes_on_at(first: Placed, front: int, clear: int) -> int:
    """Up to where there must be room for a workpiece that stands."""
    return min(front + first.length // 2, clear)


class _Motions(NamedTuple):
    """Two workpieces that move in straight lines, over time or over the position of the drive that moves both. In nm."""

    front: Fraction
    """That of the one behind, at 0."""
    front_rate: Fraction
    rear: Fraction
    """That of the one ahead, at 0."""
    rear_rate: Fraction
    position: Callable[[int], int]
    """The position of the belt that moves the one behind."""

    def touch(self, clear: int) -> int | None:
        """Where the one behind has come up to the one ahead; None if it does not before its front is at ``clear``."""
        if self.front_rate <= 0:
            return None
        end = (clear - self.front) / self.front_rate
        if self.rear + self.rear_rate * end >= clear - _SLACK_NM or self.front_rate <= self.rear_rate:
            return None
        return ceil((self.rear - self.front) / (self.front_rate - self.rear_rate))


def _motions(belt: Belt, first: Placed, ahead: Ahead, now: Nanos) -> _Motions | None:
    """The motions of two workpieces that their belts move; None unless both are straight."""
    other, placed = ahead.near.belt, ahead.placed
    here: tuple[Fraction, Fraction] | None
    there: tuple[Fraction, Fraction] | None
    position: Callable[[int], int]
    if belt.drive is other.drive:
        here, there, position = (Fraction(0), Fraction(1)), (Fraction(0), Fraction(1)), int
    elif belt.own is None or other.own is None:
        return None
    elif (further := other.own.lead_over(belt.own)) is not None:
        here, there, position = (Fraction(0), Fraction(1)), (Fraction(further), Fraction(1)), int
    else:
        here, there, position = belt.own.line(now), other.own.line(now), belt.drive.grid_position
    if here is None or there is None:
        return None
    step, its_step = NANOMETRES / belt.per_mm, NANOMETRES / other.per_mm
    return _Motions(
        (here[0] - first.origin) * step,
        here[1] * step,
        (there[0] - placed.origin - placed.length) * its_step + ahead.near.begin,
        there[1] * its_step,
        position,
    )


def pushed_against(belt: Belt, first: Placed, now: Nanos) -> Ahead | None:
    """The workpiece that another belt has moved back against the first one of this belt."""
    front = first.front(belt.position(now))
    for ahead in ahead_of(belt, first, now):
        other = ahead.near.belt
        slack = belt.stride + _LEAST_GAP + belt.from_nm(other.to_nm(other.stride + 1) + _SLACK_NM)
        if ahead.rear < front - slack:
            return ahead
    return None


def next_look(belt: Belt, first: Placed, now: Nanos) -> tuple[int | None, Nanos | None]:
    """Up to which place of its front, and until when, ns, the limit of the first workpiece holds while nothing else happens."""
    front, clear = first.front(belt.position(now)), belt.exit(first)
    places = [belt.from_nm(near.joins) for near in belt.near if near.joins is not None and near.after is None]
    moments: list[Nanos | None] = []
    for ahead in ahead_of(belt, first, now):
        other, drive = ahead.near.belt, ahead.near.belt.drive
        if ahead.placed.held is not None or ahead.near.after is None:
            continue
        if ahead.rear > clear:
            if other.own is None:
                moments.append(drive.reaches(_back_at(belt, ahead, clear), now, -1))
            continue
        if first.held is not None:
            moments.append(drive.reaches(_forth_at(belt, ahead, _goes_on_at(first, front, clear) + _LEAST_GAP), now, 1))
        if ahead.is_joining:
            moments.append(drive.reaches(_forth_at(belt, ahead, ahead.rear), now, 1))
        straight = [one.own.straight_from() for one in (belt, other) if one.own is not None]
        moments += [moment for moment in straight if moment > now]
        if other.own is None:
            half = max((ahead.rear - front) // 2, 1)
            places.append(front + half)
            moments.append(drive.reaches(_back_at(belt, ahead, ahead.rear - half), now, -1))
    return (
        min((place for place in places if place > front), default=None),
        min((moment for moment in moments if moment is not None), default=None),
    )


def _forth_at(belt: Belt, ahead: Ahead, place: int) -> int:
    """The least position of the other belt at which the rear of its workpiece is at a place of this one or beyond."""
    low, high = _around(belt, ahead, place)
    while low < high:
        middle = (low + high) // 2
        if _rear_at(belt, ahead, middle) >= place:
            high = middle
        else:
            low = middle + 1
    return low


def _back_at(belt: Belt, ahead: Ahead, place: int) -> int:
    """The greatest position of the other belt at which the rear of its workpiece is at a place of this one or before."""
    return _forth_at(belt, ahead, place + 1) - 1


def _rear_at(belt: Belt, ahead: Ahead, position: int) -> int:
    return _rear(belt, ahead.near, position - ahead.placed.origin - ahead.placed.length)


def _around(belt: Belt, ahead: Ahead, place: int) -> tuple[int, int]:
    """Positions of the other belt between which the rear of its workpiece comes to a place of this one."""
    other = ahead.near.belt
    middle = ahead.placed.origin + ahead.placed.length + other.from_nm(belt.to_nm(place) - ahead.near.begin)
    most = other.from_nm(belt.to_nm(1) + _SLACK_NM) + 2
    return middle - most, middle + most
