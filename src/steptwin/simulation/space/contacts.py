"""When two bodies begin or cease to overlap while everything moves as planned, to the nanosecond.

An interval of time is left out where nothing can change in it: bodies that are apart along one direction at both of its ends are
apart in all of it, but for what the motion bends away from a straight line, which the plans bound. Other intervals are divided,
down to a nanosecond: where motions in straight lines meet or part, and otherwise in halves. Bodies that slide along each other do
not bend towards each other, however near they are, and cost one look.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.motion.trig import QUARTER, cosine, length, sine
from steptwin.simulation.space.bodies import (
    OVERLAP_NM,
    Body,
    Placed,
    Unit,
    apart_along_axis,
    gap,
    gap_along,
    most_apart,
    outline,
)
from steptwin.simulation.space.frames import Step, Z, along, in_plane, path, turning_axis
from steptwin.simulation.space.pieces import FARTHEST_NS, Piece, StillPiece, sag, together

NOISE_NM = 1e-5
"""More than the rounding errors of positions up to 10 m."""
MOST_LOOKS = 4000
"""Looks of one search. What it has not come to by then is left to the next one."""

TURNS_AHEAD_NS = 10 * SECOND
"""Time for which what turns is searched at once: each turn costs looks, and homing, a turn without an end, is stopped soon."""
BESIDE_NM = 2.0
"""So far before and behind a place that is calculated one looks: positions are whole."""
BESIDE_NS = 4
"""The same for a moment."""
MOST_CALCULATED = 4
"""So often in a row the moment to look at next is calculated: just before and behind where boxes about two bodies begin to
overlap, and where they cease to. Then it is the middle."""
UPRIGHT: Unit = (0.0, 0.0, 1.0)


class Look(NamedTuple):
    """Nothing changes before ``at``; then it does, if ``changes``, or a search has to go on from there. None: never."""

    at: Nanos | None
    changes: bool = False


NEVER = Look(None)


class Pair:
    """Two bodies whose contacts are searched for. Raises `Misuse` where they turn in a way that is not calculated."""

    __slots__ = ("axis", "centres", "moving", "outlines", "steps")

    def __init__(self, one: Body, other: Body) -> None:
        self.steps = path(one.frame, other.frame)
        about = turning_axis(self.steps)
        self.axis = Z if about is None else about
        self.outlines = outline(one, self.axis), outline(other, self.axis)
        self.centres = in_plane(one.centre, self.axis), in_plane(other.centre, self.axis)
        self.moving = {n: motion for n, step in enumerate(self.steps) if (motion := step.motion) and not motion.is_still}
        """By the number of the step."""

    @property
    def is_constant(self) -> bool:
        """Whether nothing between them ever moves: then nothing has to be searched for."""
        return not self.moving

    def version(self) -> object:
        """Another value whenever what was found may no longer be true."""
        return tuple(motion.version() for motion in self.moving.values())

    def overlap(self, now: Nanos) -> bool:
        pieces = [next(motion.pieces(now)) for motion in self.moving.values()]
        return _Stretch(self, pieces, now, now).look(now).apart < OVERLAP_NM

    def next_change(self, now: Nanos, most: int = MOST_LOOKS, *, overlap: bool | None = None) -> Look:
        """The first moment after ``now`` at which they overlap; where they do now, at which they no longer do. ``overlap``:
        whether they do now, if that is known."""
        if self.is_constant:
            return NEVER
        if overlap is None:
            overlap = self.overlap(now)
        left = most
        for begin, end, pieces in together([motion.pieces(now) for motion in self.moving.values()]):
            first, last = max(begin, now + 1), (begin + FARTHEST_NS if end is None else end) - 1
            if first <= last:
                interval = _Stretch(self, pieces, first, last)
                found = interval.first_apart(left) if overlap else interval.first_overlap(left)
                left -= interval.looks
                if found.at is not None:
                    return found
                if left <= 0 and end is not None:
                    return Look(last)
        return NEVER


class _Spot(NamedTuple):
    """Two bodies at a moment, seen from one frame, and their `Gap`."""

    now: Nanos
    placed: tuple[Placed, Placed]
    apart: float
    direction: Unit


class _Side(NamedTuple):
    """A direction that does not turn, across a side of either body, and how far their centres are from each other along it where
    they touch."""

    way: Unit
    reach: float

    def shift(self, spot: _Spot) -> float:
        """How far the second body is from the first one."""
        (u, v, w), (one, other) = self.way, spot.placed
        return (other.place[0] - one.place[0]) * u + (other.place[1] - one.place[1]) * v + (other.place[2] - one.place[2]) * w


class _Slide(NamedTuple):
    """A joint that moves the second body along ``way``, seen from the first."""

    way: Unit
    piece: Piece


class _Bounds(NamedTuple):
    """How fast a body may be in the plane, how its motion may bend, and how far from the origin it may be."""

    speed: float
    bend: float
    far: float


class _Stretch:
    """A time in which each joint between the bodies of a pair goes through one piece: from ``begin`` to ``end``, with both."""

    __slots__ = ("_begin", "_common", "_end", "_pieces", "_positions", "_sides", "_slides", "_turns", "_ways", "looks", "pair")

    def __init__(self, pair: Pair, pieces: Sequence[Piece], begin: Nanos, end: Nanos) -> None:
        self.pair = pair
        self._begin, self._end = begin, end
        self.looks = 0
        present = dict(zip(pair.moving, pieces, strict=True))
        self._pieces = {n: piece for n, piece in present.items() if not isinstance(piece, StillPiece)}
        self._positions = [
            present[n].at(begin) if n in present else 0.0 if step.motion is None else step.motion.at(begin)
            for n, step in enumerate(pair.steps)
        ]
        """Positions of all joints; those that move are replaced."""
        turning = [n for n in self._pieces if pair.steps[n].turns]
        self._turns = bool(turning)
        self._common = self._ways_from(sum(step.is_back for step in pair.steps))
        """To both bodies from the last frame that both are on: where rounding errors would decide whether they overlap, they are
        those from there, whenever and from wherever a search began."""
        views = (self._ways_from(split) for n in turning for split in (n, n + 1))
        self._ways = min(self._common, *views, key=self._bend_of) if turning else self._common
        """From the frame between them from which they are seen: that from which their ways are straightest."""
        self._slides = [*self._find_slides()]
        self._sides: tuple[_Side, ...] = ()

    # ------------------------------------------------------------------ search

    def first_overlap(self, most: int) -> Look:
        if self._turns and self._is_out_of_reach():
            return NEVER
        return self._first(most, overlap=True)

    def first_apart(self, most: int) -> Look:
        return self._first(most, overlap=False)

    def _first(self, most: int, *, overlap: bool) -> Look:
        stays = self._stays_apart if overlap else self._stays_over
        begin, end = self.look(self._begin), self.look(self._end)
        self._sides = self._find_sides(begin)
        is_straight = not self._turns and all(piece.bend(self._begin, self._end) == (0.0, 0.0) for piece in self._pieces.values())
        calculated = MOST_CALCULATED if is_straight else 0
        last = min(self._end, self._begin + TURNS_AHEAD_NS)
        if self._turns and last < self._end and not stays(begin, end):
            end = self.look(last)
        ahead, last = [(begin, end, calculated)], end.now
        while ahead:
            begin, end, left = ahead.pop()
            if (begin.apart < OVERLAP_NM) is overlap:
                return Look(begin.now, changes=True)
            if begin.now == end.now or stays(begin, end):
                continue
            if end.now - begin.now == 1:
                if (end.apart < OVERLAP_NM) is overlap:
                    return Look(end.now, changes=True)
                continue
            if self.looks >= most:
                return Look(begin.now)
            at = self._near_change(begin, end, overlap=overlap) if left else None
            middle = self.look((begin.now + end.now) // 2 if at is None else at)
            ahead += (middle, end, calculated if at is None else left - 1), (begin, middle, calculated if at is None else 0)
        return NEVER if last == self._end else Look(last)

    def _find_sides(self, spot: _Spot) -> tuple[_Side, ...]:
        one, other = spot.placed
        upright = _Side(UPRIGHT, one.outline.half_w + other.outline.half_w)
        if self._turns:
            return (upright,)
        sides = dict.fromkeys((*one.sides, *other.sides))
        return (upright, *(_Side(way, one.half_along(*way[:2]) + other.half_along(*way[:2])) for way in sides))

    def _near_change(self, begin: _Spot, end: _Spot, *, overlap: bool) -> Nanos | None:
        """A moment just before they begin to overlap, or to be apart; just behind, if that is hardly after ``begin``. Straight
        lines tell it: they overlap where they do along all directions. None where these tell nothing."""
        comes: list[tuple[float, float]] = []
        goes: list[tuple[float, float]] = []
        for side in self._sides:
            first, last = side.shift(begin), side.shift(end)
            for apart, then in ((first - side.reach, last - side.reach), (-first - side.reach, -last - side.reach)):
                if (apart < OVERLAP_NM) is not (then < OVERLAP_NM):
                    found = (OVERLAP_NM - apart) / (then - apart), BESIDE_NM / abs(then - apart)
                    (goes if apart < OVERLAP_NM else comes).append(found)
        found = max(comes) if overlap and comes else min(goes, default=None)
        if found is None:
            return None
        share, beside = (one * (end.now - begin.now) for one in found)
        at, near = begin.now + int(share), BESIDE_NS + int(beside)
        if at - begin.now > 2 * near:
            return at - near
        return at + near if end.now - at > 2 * near else None

    def _stays_apart(self, begin: _Spot, end: _Spot) -> bool:
        """Whether they are apart along one direction all the time."""
        for way in {begin.direction, end.direction}:
            apart = min(gap_along(way, *begin.placed), gap_along(way, *end.placed))
            if apart > OVERLAP_NM + NOISE_NM and apart - self._sag(way, begin.now, end.now) > OVERLAP_NM + NOISE_NM:
                return True
        for side in self._sides:
            first, last = side.shift(begin), side.shift(end)
            apart = max(min(first, last), -max(first, last)) - side.reach
            if apart > OVERLAP_NM + NOISE_NM and apart - self._sag(side.way, begin.now, end.now) > OVERLAP_NM + NOISE_NM:
                return True
        return False

    def _stays_over(self, begin: _Spot, end: _Spot) -> bool:
        """Whether they overlap all the time."""
        most = OVERLAP_NM - NOISE_NM
        if max(begin.apart, end.apart) >= most:
            return False
        if not self._turns:
            return self._most_apart(begin, end) < most
        ends = [apart_along_axis(*spot.placed) for spot in (begin, end)]
        if max(ends) + self._sag((0.0, 0.0, 1.0), begin.now, end.now) >= most:
            return False
        for n, split in ((0, 0), (1, len(self.pair.steps))):
            bend = self._bounds(1 - n, begin.now, end.now, self._ways_from(split)).bend
            over = most_apart(begin.placed[n], begin.placed[1 - n], end.placed[n], end.placed[1 - n])
            if over + sag(-bend, bend, end.now - begin.now) >= most:
                return False
        return True

    def _most_apart(self, begin: _Spot, end: _Spot) -> float:
        """The most that they are apart while neither of them turns: along each direction a convex function of the way."""

        def apart(way: Unit) -> float:
            back = -way[0], -way[1], -way[2]
            most = max(gap_along(one, *spot.placed) for one in (way, back) for spot in (begin, end))
            return most + self._sag(way, begin.now, end.now)

        one, other = begin.placed
        radius = one.outline.radius + other.outline.radius
        if radius:
            across = length(*(max(apart(way) + radius, 0.0) for way in (other if one.outline.radius else one).sides)) - radius
        else:
            across = max(map(apart, (*one.sides, *other.sides)))
        return max(across, apart((0.0, 0.0, 1.0)))

    def _sag(self, way: Unit, begin: Nanos, end: Nanos) -> float:
        """The most by which they may come nearer to each other along a direction than at both moments."""
        if self._turns and not way[2]:
            most = sum(self._bounds(n, begin, end).bend for n in (0, 1))
            return sag(-most, most, end - begin)
        least = most = 0.0
        for slide, piece in self._slides:
            share = slide[0] * way[0] + slide[1] * way[1] + slide[2] * way[2]
            if share:
                bends = [share * bend for bend in piece.bend(begin, end)]
                least, most = least + min(bends), most + max(bends)
        return sag(least, most, end - begin)

    def _is_out_of_reach(self) -> bool:
        """Whether one body stands farther from the place about which the other one turns than that reaches."""
        for split in (at for n in self._pieces if self.pair.steps[n].turns for at in (n, n + 1)):
            ways = self._ways_from(split)
            for n in (0, 1):
                if any(step in self._pieces for step, _ in ways[n]):
                    continue
                u, v = self._placed(n, ways[n], self._positions).corner_from(0.0, 0.0)
                near = length(u, v) - self.pair.outlines[n].radius
                if near > self._bounds(1 - n, self._begin, self._end, ways).far:
                    return True
        return False

    # ------------------------------------------------------------------ where they are

    def look(self, now: Nanos) -> _Spot:
        self.looks += 1
        positions = self._positions.copy()
        for n, piece in self._pieces.items():
            positions[n] = piece.at(now)
        placed = self._both(self._ways, positions)
        apart, way = gap(*placed)
        if abs(apart - OVERLAP_NM) < NOISE_NM:
            apart = gap(*self._both(self._common, positions)).apart
        return _Spot(now, placed, apart, way)

    def _both(self, ways: tuple[_Way, _Way], positions: Sequence[float]) -> tuple[Placed, Placed]:
        return self._placed(0, ways[0], positions), self._placed(1, ways[1], positions)

    def _placed(self, body: int, way: _Way, positions: Sequence[float]) -> Placed:
        at = along([step for _, step in way], [positions[n] for n, _ in way], self.pair.axis)[-1]
        return Placed.at(self.pair.outlines[body], self.pair.centres[body], at)

    def _ways_from(self, split: int) -> tuple[_Way, _Way]:
        """To both bodies from the frame behind so many steps from the first one."""
        steps = [*enumerate(self.pair.steps)]
        return [(n, step.reverse()) for n, step in reversed(steps[:split])], steps[split:]

    def _find_slides(self) -> Iterator[_Slide]:
        axis = self.pair.axis
        for way, side in zip(self._ways, (-1, 1), strict=True):
            placements = along([step for _, step in way], [self._positions[n] for n, _ in way], axis)[1:]
            for (n, step), placement in zip(way, placements, strict=True):
                if n not in self._pieces or step.joint is None or step.turns:
                    continue
                direction = [0.0, 0.0, 0.0]
                direction[step.joint.along.axis] = side * step.joint.along.sign * (-1.0 if step.is_back else 1.0)
                u, v, w = in_plane(direction, axis)
                c, s = cosine(placement.angle_q), sine(placement.angle_q)
                yield _Slide((c * u - s * v, s * u + c * v, w), self._pieces[n])

    # ------------------------------------------------------------------ bounds

    def _bend_of(self, ways: tuple[_Way, _Way]) -> float:
        end = min(self._end, self._begin + MILLISECOND)
        return sum(self._bounds(n, self._begin, end, ways).bend for n in (0, 1))

    def _bounds(self, body: int, begin: Nanos, end: Nanos, ways: tuple[_Way, _Way] | None = None) -> _Bounds:
        """Bounds of the motion of a body, seen from the frame between them: from the body inwards, each joint adds its own."""
        u, v, _ = self.pair.centres[body]
        speed, bend, far = 0.0, 0.0, length(u, v) + self.pair.outlines[body].reach
        for n, step in reversed((self._ways if ways is None else ways)[body]):
            u, v, _ = in_plane(step.frame.at, self.pair.axis)
            origin, piece = length(u, v), self._pieces.get(n)
            slides = step.joint is not None and not step.turns and step.joint.along.axis != self.pair.axis
            its_speed = its_bend = 0.0
            if piece is not None:
                least, most = piece.bend(begin, end)
                its_speed, its_bend = piece.speed(begin, end), max(-least, most)
            if slides:
                ends = (piece.at(begin), piece.at(end)) if piece is not None else (self._positions[n],)
                origin += max(map(abs, ends)) + sag(-its_bend, its_bend, end - begin)
                speed, bend = speed + its_speed, bend + its_bend
            far += origin if step.is_back else 0.0
            if step.turns:
                turning = its_speed * QUARTER
                bend += 2.0 * turning * speed + (its_bend * QUARTER + turning * turning) * far
                speed += turning * far
            far += 0.0 if step.is_back else origin
        return _Bounds(speed, bend, far)


_Way = list[tuple[int, Step]]
"""Steps with their numbers."""
