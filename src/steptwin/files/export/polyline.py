"""Motions as few points: at the ends of segments, and between them as many as the curve needs.

Suffixes: ``_p`` pulses, ``_s`` seconds from the start of a profile.
"""

from __future__ import annotations

from math import ceil, inf, sqrt
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.files.export.tracks import AxisTrack
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import profile_of
from steptwin.motion.paths import ArcSegment

_POSITION_STEPS = 2000
_SPEED_STEPS = 500
"""A straight line between two points is off by less than the range of all values divided by this."""
_MOST_POINTS = 200
"""Most points of one segment."""


class PolylineCurve(NamedTuple):
    """Points of position (pulses) and velocity (pulses/s), in time; two at one moment where the velocity jumps."""

    times: list[Nanos]
    positions: list[float]
    velocities: list[float]


class PolylineSection(NamedTuple):
    """A segment, or rest (None), from ``begin`` to ``end``."""

    profile: Profile
    segment: Segment | ArcSegment | None
    begin: Nanos
    end: Nanos

    def look(self, time: Nanos) -> tuple[float, float]:
        """Position and velocity at ``time``, which may be the end."""
        if self.segment is None:
            return self.profile.base + self.profile.final_p, 0.0
        t_s = (time - self.profile.start) / 1e9
        return self.profile.base + self.segment.position(t_s), self.segment.velocity(t_s)


def curve(track: AxisTrack, begin: Nanos, until: Nanos, resolution: Nanos = 0) -> PolylineCurve:
    """The motion of ``track`` from ``begin`` to ``until``. What happens within ``resolution`` gets no points between."""
    sections = [section for plan, a, b in track.intervals(begin, until) for section in sections_of(profile_of(plan), a, b)]
    ends = [(section.look(section.begin), section.look(section.end)) for section in sections]
    positions = [p for pair in ends for p, _ in pair]
    speeds = [v for pair in ends for _, v in pair]
    position_slack = _range(positions) / _POSITION_STEPS
    speed_slack = _range([0.0, *speeds]) / _SPEED_STEPS
    points = PolylineCurve([], [], [])
    for section, ((p0, v0), (p1, v1)) in zip(sections, ends, strict=True):
        _add(points, section.begin, p0, v0)
        if section.segment is not None and section.end - section.begin > resolution:
            count = _points(section, (p0, p1, position_slack), (v0, v1, speed_slack))
            if resolution:
                count = min(count, ceil((section.end - section.begin) / resolution))
            for i in range(1, count):
                time = section.begin + (section.end - section.begin) * i // count
                _add(points, time, *section.look(time))
        _add(points, section.end, p1, v1)
    return points


def sections_of(profile: Profile, begin: Nanos, until: Nanos) -> list[PolylineSection]:
    """Motion of ``profile`` from ``begin`` to ``until``, without gaps."""
    sections: list[PolylineSection] = []
    at = begin
    for segment, end_ns in zip(profile.segments, profile.ends, strict=True):
        end = until if end_ns == inf else min(profile.start + int(end_ns), until)
        if end > at:
            sections.append(PolylineSection(profile, segment, at, end))
            at = end
    if at < until:
        sections.append(PolylineSection(profile, None, at, until))
    return sections


def _points(section: PolylineSection, *curves: tuple[float, float, float]) -> int:
    """In how many equal parts to divide; each curve is the value at the beginning, at the end, and what may be missed."""
    most = 0.0
    for quarter in (1, 2, 3):
        values = section.look(section.begin + (section.end - section.begin) * quarter // 4)
        for value, (first, last, slack) in zip(values, curves, strict=True):
            if slack > 0.0:
                most = max(most, abs(value - first - (last - first) * quarter / 4) / slack)
    return min(max(ceil(sqrt(most)), 1), _MOST_POINTS)


def _add(points: PolylineCurve, time: Nanos, position: float, velocity: float) -> None:
    times, positions, velocities = points
    if times and times[-1] == time and velocities[-1] == velocity and positions[-1] == position:
        return
    times.append(time)
    positions.append(position)
    velocities.append(velocity)


def _range(values: list[float]) -> float:
    return max(values) - min(values) if values else 0.0
