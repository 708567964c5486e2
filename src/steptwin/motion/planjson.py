"""Plans as plain data: numbers, lists and texts, from which anyone can compute positions for any moment.

A plan has ``start_ns`` (decimal text), ``base`` and ``final`` (pulses) and ``segments``. With u = seconds since the start less
the anchor, the position is

* ``base + c0 + c1·u + c2·u² + c3·u³`` in a segment ``[end_s, anchor_s, c0, c1, c2, c3, direction]``;
* ``base + centre + radius · cos((angle + turn · way) · 90°)`` in a segment of an arc, ``{"end_s", "direction", "way", "course",
  "half", "end_p"}``. Its ``way`` is a segment as above, with the way as polynomial, ``course`` ``[centre, radius, angle, turn]``;
* ``base + final`` after the last segment.

A segment holds until its ``end_s``, seconds since the start; an end or a limit that never comes is null. The velocity is the
derivative, in pulses per second. A plan whose drive does not give a pulse for every unit of position has ``microstepping`` (units
per pulse below a speed, above it, the speed) and ``divisions`` (position, units per pulse from there on) besides.

Traces and databases keep these keys: ``way`` is the travel along a path, ``course`` the curve of an axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from steptwin.controller import Nanos
from steptwin.datatypes import fitting, format_short
from steptwin.motion.divisions import Division, Microstepping, Plan, StepTrain
from steptwin.motion.paths import ArcProfile, ArcSegment, Circular
from steptwin.motion.profile import Profile, Segment

LONGEST_MOMENT = 19
"""Digits: moments have 63 bits."""


def plan_to_json(plan: Plan) -> dict[str, object]:
    """A plan as plain data, exactly."""
    if isinstance(plan, StepTrain):
        fine, coarse, limit = plan.microstepping
        grids = [fine, coarse, None if limit == inf else limit]
        return {**_profile_to_json(plan.profile), "microstepping": grids, "divisions": [list(one) for one in plan.divisions]}
    return _profile_to_json(plan)


def read_plan(data: Mapping[str, Any]) -> Plan:
    """The plan in plain data. Raises `TypeError`, `ValueError` or `LookupError` for what `plan_to_json` does not give."""
    profile = _profile(data)
    if "divisions" in data:
        divisions = tuple(Division(*fitting("a division", tuple(one), tuple[int, int])) for one in data["divisions"])
        fine, coarse, limit = fitting("microstepping", tuple(data["microstepping"]), tuple[int, int, float | None])
        return StepTrain(profile, Microstepping(fine, coarse, inf if limit is None else limit), divisions)
    return profile


def _profile_to_json(profile: Profile) -> dict[str, object]:
    segments = [_segment_to_json(segment) for segment in profile.segments]
    return {"start_ns": str(profile.start), "base": profile.base, "final": profile.final_p, "segments": segments}


def _segment_to_json(s: Segment | ArcSegment) -> object:
    end_s = None if s.end_s == inf else s.end_s
    if isinstance(s, Segment):
        return [end_s, s.anchor_s, s.c0, s.c1, s.c2, s.c3, s.direction]
    c = s.curve
    curve = [c.centre_p, c.radius_p, c.angle_q, c.turn_q]
    travel = _segment_to_json(s.travel)
    return {"end_s": end_s, "direction": s.direction, "way": travel, "course": curve, "half": s.half, "end_p": s.end_p}


def _profile(data: Mapping[str, Any]) -> Profile:
    start, base = _moment(data["start_ns"]), fitting("base", data["base"], int)
    final = fitting("final", data["final"], float)
    segments = data["segments"]
    if any(isinstance(segment, dict) for segment in segments):
        return ArcProfile(start, base, tuple(_arc(segment) for segment in segments), final)
    return Profile(start, base, tuple(_segment(segment) for segment in segments), final)


def _moment(text: object) -> Nanos:
    if not (isinstance(text, str) and text.isascii() and text.isdigit() and len(text) <= LONGEST_MOMENT):
        raise ValueError(f"start_ns is {format_short(text)}: expected nanoseconds as decimal text")
    return int(text)


def _segment(data: Sequence[Any]) -> Segment:
    end_s, *rest = fitting("a segment", tuple(data), tuple[float | None, float, float, float, float, float, int])
    return Segment(inf if end_s is None else end_s, *rest)


def _arc(data: Mapping[str, Any]) -> ArcSegment:
    end_s = fitting("end_s", data["end_s"], float | None)
    curve = Circular(*fitting("course", tuple(data["course"]), tuple[float, float, float, float]))
    direction, half = fitting("direction", data["direction"], int), fitting("half", data["half"], int)
    travel, end_p = _segment(data["way"]), fitting("end_p", data["end_p"], float)
    return ArcSegment(inf if end_s is None else end_s, direction, travel, curve, half, end_p)
