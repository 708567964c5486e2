"""Motions as pieces: between two moments a position is smooth, with bounds of its speed and of the rate of its speed.

A piece gives the position at a moment as a function of the plan alone, whenever it is asked: what is found by it does not depend
on how often somebody has looked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import profile_of
from steptwin.motion.elastic import Response, ResponseInterval
from steptwin.motion.paths import ArcSegment
from steptwin.motion.trig import QUARTER
from steptwin.simulation.mechanics.belt import ConstantDrive
from steptwin.simulation.mechanics.cam import Cam
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.trajectory import Trajectory
from steptwin.simulation.mechanics.travel import Travel

FARTHEST_NS: Nanos = 1 << 55
"""A moment more than a year ahead counts as never."""

Range: TypeAlias = tuple[float, float]
"""Lowest and highest value."""


@dataclass(frozen=True, slots=True)
class Piece(ABC):
    """A smooth part of a motion, from ``begin`` up to but not at ``end`` (None: it does not end)."""

    begin: Nanos
    end: Nanos | None

    @abstractmethod
    def at(self, now: Nanos) -> float:
        """The position."""

    @abstractmethod
    def speed(self, begin: Nanos, end: Nanos) -> float:
        """The most that the speed is between two moments, per second."""

    @abstractmethod
    def bend(self, begin: Nanos, end: Nanos) -> Range:
        """Bounds of the second derivative between two moments, per second²."""


@dataclass(frozen=True, slots=True)
class StillPiece(Piece):
    position: float

    def at(self, now: Nanos) -> float:
        return self.position

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return 0.0

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        return 0.0, 0.0


@dataclass(frozen=True, slots=True)
class SteadyPiece(Piece):
    """A motion with the constant speed ``rate`` per second, whose whole ``place`` a part of a controller gives. With an
    ``acceleration`` per second² that is its greatest speed."""

    place: Callable[[Nanos], int]
    rate: float
    acceleration: float = 0.0

    def at(self, now: Nanos) -> float:
        return float(self.place(now))

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return abs(self.rate)

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        return self.acceleration, self.acceleration


@dataclass(frozen=True, slots=True)
class PlanPiece(Piece):
    """A segment of a profile that began at ``start``; ``zero`` is where its base is."""

    start: Nanos
    segment: Segment
    zero: float
    sign: int

    def at(self, now: Nanos) -> float:
        return self.zero + self.sign * self.segment.position((now - self.start) / SECOND)

    def speed(self, begin: Nanos, end: Nanos) -> float:
        s, start = self.segment, self.start
        return max(abs(s.velocity((begin - start) / SECOND)), abs(s.velocity((end - start) / SECOND)))

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        s = self.segment
        if s.c3 == 0.0:
            return 2.0 * self.sign * s.c2, 2.0 * self.sign * s.c2
        ends = [self.sign * (2.0 * s.c2 + 6.0 * s.c3 * ((t - self.start) / SECOND - s.anchor_s)) for t in (begin, end)]
        return min(ends), max(ends)


@dataclass(frozen=True, slots=True)
class ArcPiece(Piece):
    """As `PlanPiece`, for a segment along an arc."""

    start: Nanos
    segment: ArcSegment
    zero: float
    sign: int

    def at(self, now: Nanos) -> float:
        return self.zero + self.sign * self.segment.position((now - self.start) / SECOND)

    def _turning(self, begin: Nanos, end: Nanos) -> tuple[float, float]:
        """Bounds of the angular speed and its rate, rad."""
        travel, per_travel = self.segment.travel, abs(self.segment.curve.turn_q) * QUARTER
        times = [(t - self.start) / SECOND for t in (begin, end)]
        rate = max(abs(2.0 * travel.c2 + 6.0 * travel.c3 * (t - travel.anchor_s)) for t in times)
        return per_travel * max(abs(travel.velocity(t)) for t in times), per_travel * rate

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return self.segment.curve.radius_p * self._turning(begin, end)[0]

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        turning, rate = self._turning(begin, end)
        most = self.segment.curve.radius_p * (turning * turning + rate)
        return -most, most


@dataclass(frozen=True, slots=True)
class SwingingPiece(Piece):
    """A mass on a spring."""

    interval: ResponseInterval

    def at(self, now: Nanos) -> float:
        return self.interval.at(now)[0]

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return abs(self.interval.at(begin)[1]) + self.interval.bounds(begin, end)[0] * (end - begin) / SECOND

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        most = self.interval.bounds(begin, end)[0]
        return -most, most


class Gear(NamedTuple):
    """``up`` / ``down`` of what is driven per unit of what drives, and ``shift`` at 0. Whole numbers, so that a position that is
    whole stays so."""

    up: float
    down: float = 1.0
    shift: float = 0.0


def gear_of(factor: Fraction, shift: float = 0.0) -> Gear:
    up, down = factor.as_integer_ratio()
    return Gear(float(up), float(down), shift)


@dataclass(frozen=True, slots=True)
class GearedPiece(Piece):
    inner: Piece
    gear: Gear

    def at(self, now: Nanos) -> float:
        up, down, shift = self.gear
        return self.inner.at(now) * up / down + shift

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return self.inner.speed(begin, end) * abs(self.gear.up / self.gear.down)

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        (low, high), factor = self.inner.bend(begin, end), self.gear.up / self.gear.down
        return (low * factor, high * factor) if factor >= 0.0 else (high * factor, low * factor)


@dataclass(frozen=True, slots=True)
class SumPiece(Piece):
    parts: tuple[Piece, ...]

    def at(self, now: Nanos) -> float:
        return sum(part.at(now) for part in self.parts)

    def speed(self, begin: Nanos, end: Nanos) -> float:
        return sum(part.speed(begin, end) for part in self.parts)

    def bend(self, begin: Nanos, end: Nanos) -> Range:
        bends = [part.bend(begin, end) for part in self.parts]
        return sum(low for low, _ in bends), sum(high for _, high in bends)


class Motion(NamedTuple):
    """A position that changes by itself. ``version``: a value that changes whenever pieces become invalid; ``pieces`` gives those
    from a moment on, in order and without gaps, until one that does not end. ``is_still``: it never moves."""

    version: Callable[[], object]
    pieces: Callable[[Nanos], Iterator[Piece]]
    is_still: bool = False

    def at(self, now: Nanos) -> float:
        return next(self.pieces(now)).at(now)


def standing(position: float) -> Motion:
    """No motion: what always is at ``position``, such as a workpiece that lies at an angle."""
    return Motion(lambda: None, lambda now: iter((StillPiece(now, None, position),)), is_still=True)


def falling(begin: Nanos, end: Nanos, acceleration: float) -> Motion:
    """A way from rest at ``begin`` with an acceleration per second², up to ``end``, where it stands."""
    fall = PlanPiece(begin, end, begin, Segment(inf, 0.0, 0.0, 0.0, acceleration / 2.0, 0.0, 1), 0.0, 1)

    def pieces(now: Nanos) -> Iterator[Piece]:
        if now < end:
            yield replace(fall, begin=now)
        yield StillPiece(max(now, end), None, fall.at(end))

    return Motion(lambda: None, pieces)


# ---------------------------------------------------------------------- what moves in a controller


def pieces_of_trajectory(trajectory: Trajectory, now: Nanos) -> Iterator[Piece]:
    """The load of an axis between its whole pulses, in pulses."""
    profile = profile_of(trajectory.plan) if trajectory.coasting is None else trajectory.coasting
    sign, zero = trajectory.build.sign, trajectory.build.zero
    begun = [piece for piece in trajectory.sections if piece.begin <= now]
    pieces = [*begun[-1:], *trajectory.sections[len(begun) :]]
    for n, piece in enumerate(pieces):
        begin, end = max(piece.begin, now), pieces[n + 1].begin if n + 1 < len(pieces) else None
        if end is not None and end <= begin:
            continue
        if piece.load_follows:
            yield from pieces_of_profile(profile, begin, end, float(piece.load + zero), sign)
        else:
            yield StillPiece(begin, end, float(piece.load))


def pieces_of_profile(
    profile: Profile, begin: Nanos, end: Nanos | None = None, zero: float = 0.0, sign: int = 1
) -> Iterator[Piece]:
    """A profile between two moments, counted from ``zero`` in the direction ``sign``."""
    at, last = profile.start, inf if end is None else end
    for segment, segment_end in zip(profile.segments, profile.ends, strict=True):
        until = profile.start + segment_end
        if until > begin and at < last:
            kind: type[Any] = ArcPiece if isinstance(segment, ArcSegment) else PlanPiece
            upto = min(until, last)
            upto = None if upto == inf else int(upto)
            yield kind(max(at, begin), upto, profile.start, segment, zero + sign * profile.base, sign)
        if until == inf:
            return
        at = int(until)
    if at < last:
        yield StillPiece(max(at, begin), end, zero + sign * (profile.base + profile.final_p))


def pieces_of_travel(travel: Travel, now: Nanos) -> Iterator[Piece]:
    """A cylinder, on the grid of its travel."""
    way = travel.direction
    end = travel.full if way > 0 else 0
    arrival = None if way == 0 else travel.reaches(end, now, way)
    if arrival is None:
        yield StillPiece(now, None, float(travel.grid_position(now)))
        return
    yield SteadyPiece(now, arrival, travel.grid_position, travel.speed(way) * float(SECOND))
    yield StillPiece(arrival, None, float(end))


def pieces_of_drive(drive: ConstantDrive | RampedDrive, now: Nanos) -> Iterator[Piece]:
    """Motion by a drive with a speed, in its steps."""
    if isinstance(drive, RampedDrive) and now < (straight := drive.straight_from()):
        rate, acceleration = float(drive.whole_speed * SECOND), float(drive.acceleration * SECOND * SECOND)
        yield SteadyPiece(now, straight, drive.grid_position, rate, acceleration)
        now = straight
    if drive.runs:
        yield SteadyPiece(now, None, drive.grid_position, float(drive.whole_speed * SECOND))
    else:
        yield StillPiece(now, None, float(drive.grid_position(now)))


def pieces_of_response(response: Response, now: Nanos) -> Iterator[Piece]:
    """A mass that a drive moves through a spring, in pulses of the drive."""
    intervals = response.intervals
    for n, interval in enumerate(intervals):
        begin = interval.drive.begin if n else min(interval.drive.begin, now)
        end = intervals[n + 1].drive.begin if n + 1 < len(intervals) else None
        if end is None or end > max(begin, now):
            yield SwingingPiece(max(begin, now), end, interval)


def pieces_of_cam(cam: Cam, shaft: Iterable[Piece]) -> Iterator[Piece]:
    """A follower of a cam that ``shaft`` turns, in units of its lift. Endless while the shaft turns for ever."""
    for piece in shaft:
        begin, last = piece.begin, piece.begin + FARTHEST_NS if piece.end is None else piece.end
        while begin < last:
            here, ahead = piece.at(begin), piece.at(last - 1)
            low, high, rise, shift = cam.span(here, 1 if ahead >= here else -1)
            end = last if low <= ahead <= high else _leaves(piece, begin, last - 1, low, high)
            whole = piece.end is None and end == last
            yield GearedPiece(begin, None if whole else end, replace(piece, begin=begin), Gear(rise, 1.0, shift))
            begin = end


def _leaves(piece: Piece, low: Nanos, high: Nanos, least: float, most: float) -> Nanos:
    """When a piece that goes one way is outside of a range in which it is at ``low`` and no longer at ``high``."""
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if least <= piece.at(middle) <= most else (low, middle)
    return high


def geared(pieces: Iterable[Piece], gear: Gear) -> Iterator[Piece]:
    return (GearedPiece(piece.begin, piece.end, piece, gear) for piece in pieces)


def summed(parts: Sequence[Iterable[Piece]]) -> Iterator[Piece]:
    """The sum of motions that begin at one moment."""
    for begin, end, pieces in together(parts):
        yield SumPiece(begin, end, pieces)


def together(parts: Sequence[Iterable[Piece]]) -> Iterator[tuple[Nanos, Nanos | None, tuple[Piece, ...]]]:
    """Moments between which each of several motions, which begin at one moment, has one piece; those pieces."""
    streams = [iter(part) for part in parts]
    present = [next(stream) for stream in streams]
    begin = max((piece.begin for piece in present), default=0)
    while True:
        end = min((piece.end for piece in present if piece.end is not None), default=None)
        if end is None or end > begin:
            yield begin, end, tuple(present)
        if end is None:
            return
        begin = end
        present = [next(stream) if piece.end == end else piece for stream, piece in zip(streams, present, strict=True)]


def span(pieces: Iterable[Piece], most: int = 256, *, since: Nanos | None = None, until: Nanos | None = None) -> Range:
    """Bounds of all positions of a motion, or of those between two moments, with both; infinite where it does not end, or has
    more than so many pieces."""
    low, high = inf, -inf
    for n, piece in enumerate(pieces):
        if until is not None and piece.begin > until:
            break
        if n >= most:
            return -inf, inf
        begin, end = piece.begin if since is None else max(piece.begin, since), piece.end
        if until is not None and (end is None or end > until):
            end = until + 1
        if end is None:
            if piece.speed(begin, begin + FARTHEST_NS) > 0.0:
                return -inf, inf
            ends, more = [piece.at(begin)], 0.0
        elif begin < end:
            last = end - 1
            ends = [piece.at(begin), piece.at(last)]
            more = sag(*piece.bend(begin, last), last - begin)
        else:
            continue
        low, high = min(low, min(ends) - more), max(high, max(ends) + more)
    return low, high


def sag(least: float, most: float, width: Nanos) -> float:
    """How far a function with a second derivative between these can be from its chord over ``width``."""
    s = width / SECOND
    return max(abs(least), abs(most)) * s * s / 8.0


DROP_NM = 1e-6
"""Least distance that a motion goes back before that is found: more than the rounding errors of positions up to 10 m."""


def first_back(motion: Motion, now: Nanos, way: int, most: int = 256) -> Nanos | None:
    """A moment, ns, at which a motion has gone back from the way +1 or -1 by hardly more than `DROP_NM`, for the first time; None
    if never. After ``most`` pieces: one at which to look again."""
    for n, piece in enumerate(motion.pieces(now)):
        if n >= most:
            return piece.begin
        last = (piece.begin + FARTHEST_NS if piece.end is None else piece.end) - 1
        stretches = [(piece.begin, last)] if last > piece.begin and piece.speed(piece.begin, last) else []
        while stretches:
            begin, end = stretches.pop()
            gain, bend = way * (piece.at(end) - piece.at(begin)), 8.0 * sag(*piece.bend(begin, end), end - begin)
            if gain >= bend:  # it never goes back
                continue
            if gain + bend < -DROP_NM:  # it always does
                return begin
            if bend >= DROP_NM and end - begin > 1:
                middle = (begin + end) // 2
                stretches += [(middle, end), (begin, middle)]
    return None
