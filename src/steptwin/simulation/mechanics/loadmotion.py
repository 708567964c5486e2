"""The motion of the load of an axis between whole pulses, as polynomials of time."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import profile_of
from steptwin.motion.elastic import DriveInterval
from steptwin.simulation.mechanics.trajectory import Trajectory

LOOK_NS: Nanos = 1_000_000
"""Motions along arcs are no polynomials: their acceleration is taken as constant for so long."""
MOST_LOOKS = 100_000
"""Limit of the parts of an arc."""


def load_intervals(trajectory: Trajectory, now: Nanos) -> Iterator[DriveInterval]:
    """The motion of the load of an axis from a moment on."""
    profile = profile_of(trajectory.plan) if trajectory.coasting is None else trajectory.coasting
    sign, zero = trajectory.build.sign, trajectory.build.zero
    begun = [section for section in trajectory.sections if section.begin <= now]
    sections = [*begun[-1:], *trajectory.sections[len(begun) :]]
    for n, section in enumerate(sections):
        begin = max(section.begin, now)
        end = sections[n + 1].begin if n + 1 < len(sections) else None
        if not section.load_follows:
            yield DriveInterval(begin, float(section.load), 0.0, 0.0, 0.0)
            continue
        offset = section.load + zero
        for at, p, v, a, j in polynomials(profile, begin, end):
            yield DriveInterval(at, offset + sign * p, sign * v, sign * a, sign * j)


def polynomials(profile: Profile, begin: Nanos, end: Nanos | None) -> Iterator[tuple[Nanos, float, float, float, float]]:
    """Moment, position, velocity, acceleration and jerk at the beginning of each part of a profile between two moments."""
    at = profile.start
    for segment, segment_end in zip(profile.segments, profile.ends, strict=True):
        until = None if segment_end == inf else profile.start + int(segment_end)
        if (until is None or until > begin) and (end is None or at < end):
            yield from _of_segment(profile, segment, max(at, begin), until if end is None or (until and until < end) else end)
        at = at if until is None else until
    if profile.end is not None and (end is None or profile.end < end):
        yield max(profile.end, begin), profile.base + profile.final_p, 0.0, 0.0, 0.0


def _of_segment(profile: Profile, s: Any, begin: Nanos, end: Nanos | None) -> Iterator[tuple[Nanos, float, float, float, float]]:
    t = (begin - profile.start) / SECOND
    if isinstance(s, Segment):
        u = t - s.anchor_s
        yield begin, profile.base + s.position(t), s.velocity(t), 2.0 * s.c2 + 6.0 * s.c3 * u, 6.0 * s.c3
        return
    for look in range(MOST_LOOKS):
        now = begin + look * LOOK_NS
        if end is not None and now >= end:
            return
        t, step = (now - profile.start) / SECOND, LOOK_NS / SECOND
        v = s.velocity(t)
        yield now, profile.base + s.position(t), v, (s.velocity(t + step) - v) / step, 0.0
