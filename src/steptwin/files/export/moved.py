"""Tracks of what axes move besides their loads, such as shafts and tools, from the true positions of the axes.

A trace does not have their motion, because it follows from that of the loads, as
`steptwin.simulation.mechanics.channels.MovedChannel` says, and from the edges that faults record.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import pairwise
from math import ceil, floor
from typing import NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.motion import Profile, Segment, at_rest
from steptwin.motion.divisions import profile_of
from steptwin.motion.elastic import DriveInterval, Response, ResponseInterval, Spring
from steptwin.simulation.mechanics.channels import LIFT_SHARE, SLIPS, SPRING_SHARE, STUCK, AxisChannel, MovedChannel
from steptwin.simulation.mechanics.loadmotion import polynomials

SLACK_P = 0.02
"""Cubics are at most this far from the motion (pulses of its axis)."""
_LEAST_NS: Nanos = 10_000
"""Shorter sections are not divided."""
_PER_SWING = 8

MotionLook: TypeAlias = Callable[[Nanos], tuple[float, float]]
"""Position and velocity (per s) at a moment."""


class MotionSection(NamedTuple):
    """A smooth motion from ``begin`` to ``end``. ``longest``: no cubic of it may be longer."""

    begin: Nanos
    end: Nanos
    look: MotionLook
    longest: Nanos | None = None


def moved_track(
    channel: MovedChannel, load: AxisTrack, other: AxisTrack | None, pins: Mapping[str, PinTrack], until: Nanos
) -> AxisTrack:
    """The motion from the first moment of ``load`` to ``until``, in the unit of the channel. ``load`` and ``other`` are those of
    `AxisTrack.load`; ``pins`` the edges of its controller, by subject."""
    if channel.spring is not None:
        sections = _swinging(channel, load, pins.get(f"{channel.name}.{SPRING_SHARE}"), until)
    elif other is not None:
        one = _driven(load, channel.per_pulse, pins.get(f"{channel.coupling}.{SLIPS}"), until)
        sections = _summed(
            one, _driven(other, channel.other_per_pulse, pins.get(f"{channel.other_coupling}.{SLIPS}"), until), channel.offset
        )
    else:
        sections = [
            _scaled(section, 1.0, channel.offset)
            for section in _driven(load, channel.per_pulse, pins.get(f"{channel.coupling}.{SLIPS}"), until)
        ]
        if channel.points:
            sections = _stuck([*_lifted(sections, channel.points, channel.turn)], channel.name, pins)
    track = AxisTrack(load.controller, AxisChannel(f"{channel.name} {channel.signal}", channel.unit))
    slack = SLACK_P * max(abs(channel.per_pulse), abs(channel.other_per_pulse)) * channel.steepest
    for section in sections:
        for begin, profile in _cubics(section, slack):
            track.times.append(begin)
            track.plans.append(profile)
    return track


# ---------------------------------------------------------------------- parts


def _driven(load: AxisTrack, per_pulse: float, coupling: PinTrack | None, until: Nanos) -> Iterator[MotionSection]:
    """Motion of a load behind a coupling that may slip."""
    return (_scaled(section, per_pulse, 0.0) for section in _slipping(_sections(load, until), coupling))


def _sections(load: AxisTrack, until: Nanos) -> Iterator[MotionSection]:
    """The load, in pulses."""
    for plan, after, end in load.intervals(load.times[0], until):
        profile = profile_of(plan)
        cuts = [profile.start + int(one) for one in profile.ends if after < profile.start + one < end]
        for begin, last in pairwise([after, *cuts, end]):
            yield MotionSection(begin, last, partial(_on_profile, profile, begin, last))


def _on_profile(profile: Profile, begin: Nanos, end: Nanos, now: Nanos) -> tuple[float, float]:
    """Position and velocity on the segment between two of its moments, also at its end, where the velocity may jump."""
    if begin - profile.start < 0 or (profile.end is not None and begin >= profile.end):
        return profile.base + profile.final_p, 0.0
    segment = profile.segments[bisect_right(profile.ends, begin - profile.start)]
    s = (now - profile.start) / SECOND
    return profile.base + segment.position(s), segment.velocity(s)


def _scaled(section: MotionSection, factor: float, offset: float) -> MotionSection:
    def look(now: Nanos) -> tuple[float, float]:
        p, v = section.look(now)
        return offset + factor * p, factor * v

    return section._replace(look=look)


def _standing(at: float) -> MotionLook:
    return lambda now: (at, 0.0)


def _cut(sections: Iterable[MotionSection], cuts: Iterable[Nanos]) -> Iterator[MotionSection]:
    moments = sorted(cuts)
    for section in sections:
        ends = [section.begin, *(moment for moment in moments if section.begin < moment < section.end), section.end]
        yield from (section._replace(begin=begin, end=end) for begin, end in pairwise(ends))


def _slipping(sections: Iterable[MotionSection], coupling: PinTrack | None) -> Iterator[MotionSection]:
    """A shaft stands while its coupling slips, and goes on from there."""
    held: float | None = None
    behind = 0.0
    for section in sections if coupling is None else _cut(sections, coupling.times):
        here = section.look(section.begin)[0]
        slips = coupling is not None and section.begin >= coupling.times[0] and bool(coupling.level(section.begin))
        if slips and held is None:
            held = here - behind
        elif not slips and held is not None:
            behind, held = here - held, None
        yield _scaled(section, 1.0, -behind) if held is None else section._replace(look=_standing(held))


def _lifted(sections: Iterable[MotionSection], points: tuple[tuple[float, float], ...], turn: float) -> Iterator[MotionSection]:
    """Motion of a cam with the angles of its shaft: lifts, linear between points, in every revolution."""
    around = [*points, (points[0][0] + turn, points[0][1])]
    for section in sections:
        for begin, end in pairwise([section.begin, *_corners(section, [angle for angle, _ in points], turn), section.end]):
            angle = section.look((begin + end) // 2)[0]
            first = floor((angle - points[0][0]) / turn) * turn
            n = min(max(bisect_right(around, angle - first, key=lambda point: point[0]), 1), len(around) - 1)
            (a0, y0), (a1, y1) = around[n - 1], around[n]
            slope = (y1 - y0) / (a1 - a0)
            yield _scaled(section._replace(begin=begin, end=end), slope, y0 - slope * (a0 + first))


def _corners(section: MotionSection, angles: list[float], turn: float) -> list[Nanos]:
    """When a part, which goes one way, passes any of the angles of a revolution."""
    low, high = sorted((section.look(section.begin)[0], section.look(section.end)[0]))
    rises = section.look(section.end)[0] >= section.look(section.begin)[0]
    found = set[Nanos]()
    for angle in angles:
        for n in range(ceil((low - angle) / turn), floor((high - angle) / turn) + 1):
            level = angle + n * turn
            before, after = section.begin, section.end
            while after - before > 1:
                middle = (before + after) // 2
                if (section.look(middle)[0] >= level) is rises:
                    after = middle
                else:
                    before = middle
            if section.begin < after < section.end:
                found.add(after)
    return sorted(found)


def _stuck(sections: list[MotionSection], name: str, pins: Mapping[str, PinTrack]) -> Iterator[MotionSection]:
    """A follower that is stuck, or whose cam is worn, by the edges of these faults."""
    stuck, worn = pins.get(f"{name}.{STUCK}"), pins.get(f"{name}.{LIFT_SHARE}")
    held: float | None = None
    for section in _cut(sections, [*(stuck.times if stuck else ()), *(worn.times if worn else ())]):
        share = 1.0 if worn is None or section.begin < worn.times[0] else worn.level(section.begin)
        its = _scaled(section, 1.0 if share is None else share, 0.0)
        if stuck is None or section.begin < stuck.times[0] or not stuck.level(section.begin):
            held = None
            yield its
            continue
        held = its.look(section.begin)[0] if held is None else held
        yield section._replace(look=_standing(held))


def _summed(load: Iterable[MotionSection], other: Iterable[MotionSection], offset: float) -> Iterator[MotionSection]:
    """Joint motion of two loads; before the first part of ``other`` that stands where it begins."""
    beside = [*other]
    begins = [section.begin for section in beside]
    for section in _cut(load, begins):
        i = bisect_right(begins, section.begin) - 1
        its = beside[i].look if i >= 0 else _standing(beside[0].look(begins[0])[0] if beside else 0.0)

        def look(now: Nanos, a: MotionLook = section.look, b: MotionLook = its) -> tuple[float, float]:
            (p, v), (q, w) = a(now), b(now)
            return offset + p + q, v + w

        yield section._replace(look=look)


def _swinging(channel: MovedChannel, load: AxisTrack, share: PinTrack | None, until: Nanos) -> Iterator[MotionSection]:
    """A carriage behind its axis, from rest; where the belt changes, it goes on as it moves there."""
    if channel.spring is None:
        return
    changes = (
        [] if share is None else [(time, channel.spring[0] * level) for time, level in share.changes(load.times[0] - 1, until)]
    )
    drives = [*_drives(load, until)]
    x, v = drives[0].p, 0.0
    ends = [load.times[0], *(time for time, _ in changes), until]
    for (begin, end), frequency in zip(pairwise(ends), [channel.spring[0], *(one for _, one in changes)], strict=True):
        spring = Spring(frequency, channel.spring[1])
        first = max(bisect_right(drives, begin, key=lambda drive: drive.begin) - 1, 0)
        now = drives[first]
        s = (begin - now.begin) / SECOND
        here = DriveInterval(begin, *now.at(begin), now.a + now.j * s, now.j)
        response = Response(spring, [here, *drives[first + 1 :]], x, v)
        begins = [interval.drive.begin for interval in response.intervals]
        for interval, last in zip(response.intervals, [*begins[1:], until], strict=True):
            if interval.drive.begin < end:
                yield _scaled(_swing(interval, min(last, end)), channel.per_pulse, 0.0)
        x, v = response.at(end)


def _swing(interval: ResponseInterval, end: Nanos) -> MotionSection:
    swings = interval.cosine_p or interval.sine_p
    longest = floor(SECOND / interval.spring.frequency / _PER_SWING) if swings else None
    return MotionSection(interval.drive.begin, end, interval.at, longest)


def _drives(load: AxisTrack, until: Nanos) -> Iterator[DriveInterval]:
    for plan, after, end in load.intervals(load.times[0], until):
        for at, p, v, a, j in polynomials(profile_of(plan), after, end):
            yield DriveInterval(at, p, v, a, j)


# ---------------------------------------------------------------------- cubics


def _cubics(section: MotionSection, slack: float) -> Iterator[tuple[Nanos, Profile]]:
    """Profiles of one cubic each that are no farther than ``slack`` from a part."""
    count = 1 if section.longest is None else max(ceil((section.end - section.begin) / section.longest), 1)
    ends = [section.begin + (section.end - section.begin) * n // count for n in range(count + 1)]
    open_sections = [*pairwise(ends)][::-1]
    while open_sections:
        begin, end = open_sections.pop()
        if end <= begin:
            continue
        profile = _cubic(begin, end, *section.look(begin), *section.look(end))
        quarters = [begin + (end - begin) * n // 4 for n in (1, 2, 3)]
        if end - begin > _LEAST_NS and any(abs(profile.position(now) - section.look(now)[0]) > slack for now in quarters):
            middle = (begin + end) // 2
            open_sections += [(middle, end), (begin, middle)]
        else:
            yield begin, profile


def _cubic(begin: Nanos, end: Nanos, p0: float, v0: float, p1: float, v1: float) -> Profile:
    """Hermite: both positions and velocities."""
    if p0 == p1 and not v0 and not v1:
        return at_rest(begin, 0, p0)
    s = (end - begin) / SECOND
    slope = (p1 - p0) / s
    c2, c3 = (3.0 * slope - 2.0 * v0 - v1) / s, (v0 + v1 - 2.0 * slope) / (s * s)
    return Profile(begin, 0, (Segment(s, 0.0, p0, v0, c2, c3, 1 if p1 >= p0 else -1),), p1)
