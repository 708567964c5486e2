"""A page with a timeline: one file without anything from outside that any browser opens, exact at every scale.

Motion goes into the page as plans, not as samples, so that the page shows single pulses.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html import escape
from importlib.resources import files
from typing import IO

from steptwin.controller import Nanos
from steptwin.files.export.polyline import PolylineSection, sections_of
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.tracetracks import TraceTracks
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.files.scene.recordedscene import RecordedScene
from steptwin.files.scene.scenescript import scene_script
from steptwin.motion.divisions import Plan, StepTrain, profile_of
from steptwin.motion.planjson import plan_to_json
from steptwin.simulation.scheduler.trace import TraceRecord

_SCRIPTS = ("model.js", "draw.js", "timeline.js")
_MOST_BYTES = 64
"""Most bytes of a frame in the page."""


def write_timeline(tracks: TraceTracks, file: IO[str], progress: TimeProgress, scene: RecordedScene | None = None) -> None:
    """``scene``: the machine in space beside it, where the script that draws it has been built."""
    script = None if scene is None else scene_script()
    names = tracks.title or ", ".join(tracks.controllers[:4]) + (" …" if len(tracks.controllers) > 4 else "")
    data = {
        "begin": tracks.begin,
        "span": tracks.until - tracks.begin,
        "controllers": tracks.controllers,
        "axes": [_axis(track, tracks, progress, i) for i, track in enumerate(tracks.axes)],
        "moved": [_moved(track, tracks) for track in tracks.moved],
        "pins": [_pin(pin, tracks) for pin in tracks.pins],
        "marks": [_mark(record, tracks.begin) for record in tracks.marks if record.time <= tracks.until],
        "scene": None if scene is None or script is None else scene.to_json(),
    }
    parts = {
        "title": escape(names),
        "style": _part("timeline.css"),
        "scene": script or "",
        "script": "".join(map(_part, _SCRIPTS)),
        # A "</script>" in a text must not end the script.
        "data": json.dumps(data, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"),
    }
    file.write(re.sub(r"/\*(\w+)\*/", lambda found: parts[found[1]], _part("timeline.html")))
    progress(tracks.until)


def _part(name: str) -> str:
    return (files("steptwin.files.export") / "page" / name).read_text("utf-8")


# ---------------------------------------------------------------------- axes


def _axis(track: AxisTrack, tracks: TraceTracks, progress: TimeProgress, number: int) -> dict[str, object]:
    """The coordinate; if they can differ, ``counted`` is the count since power-on, and ``true`` the position of the load."""
    progress(tracks.begin + (tracks.until - tracks.begin) * (number + 1) // (len(tracks.axes) + 1))
    coordinate, load = track.coordinate(), track.true()
    counted = {} if coordinate is None else {"counted": _motion(track, tracks)}
    return _motion(coordinate or track, tracks) | counted | ({} if load is None else {"true": _motion(load, tracks)})


def _motion(track: AxisTrack, tracks: TraceTracks) -> dict[str, object]:
    """The ``plans``, as `steptwin.motion.planjson` writes them, and flat ``pieces`` of them, six numbers each: begin (ns from
    that of the window), number of the plan and of its segment (-1: at rest), counted position, direction (0: no pulses), pulses
    of the profile for one STEP pulse.
    """
    plans: list[dict[str, object]] = []
    pieces: list[int] = []
    for plan, after, until in track.intervals(tracks.begin, tracks.until):
        profile = profile_of(plan)
        for section, grid, count in _divided(plan, after, until):
            number, direction = -1, 0
            if section.segment is not None:
                number, direction = profile.segments.index(section.segment), section.segment.direction
            pieces += [section.begin - tracks.begin, len(plans), number, count, direction, grid]
        plans.append(plan_to_json(profile))
    view = track.view
    return {
        "controller": track.controller, "name": view.name, "unit": view.unit, "scale": view.pulses_per_unit,
        "plans": plans, "pieces": pieces,
    }  # fmt: skip


def _moved(track: AxisTrack, tracks: TraceTracks) -> dict[str, object]:
    """As `_motion`, without pulses."""
    plans: list[dict[str, object]] = []
    pieces: list[int] = []
    for plan, after, _ in track.intervals(tracks.begin, tracks.until):
        pieces += [after - tracks.begin, len(plans), 0 if profile_of(plan).segments else -1, 0, 0, 1]
        plans.append(plan_to_json(plan))
    view = track.view
    return {
        "controller": track.controller,
        "name": view.name,
        "unit": view.unit,
        "scale": 1.0,
        "digits": 3,
        "plans": plans,
        "pieces": pieces,
    }


def _divided(plan: Plan, after: Nanos, until: Nanos) -> Iterator[tuple[PolylineSection, int, int]]:
    """(piece, grid, counted position where it begins); a piece ends where the division changes."""
    profile = profile_of(plan)
    cuts: list[Nanos] = []
    if isinstance(plan, StepTrain):
        changes = [profile.pulse_time(division.begin, profile.start) for division in plan.divisions[1:]]
        cuts = [time for time in changes if time is not None and after < time < until]
    for begin, end in zip([after, *cuts], [*cuts, until], strict=True):
        now = max(begin, profile.start)
        grid = plan.division(now).grid if isinstance(plan, StepTrain) else 1
        for section in sections_of(profile, begin, end):
            yield section, grid, plan.count(max(section.begin, profile.start))


# ---------------------------------------------------------------------- pins and marks


def _pin(pin: PinTrack, tracks: TraceTracks) -> dict[str, object]:
    begin = tracks.begin
    return {
        "controller": pin.controller,
        "name": pin.pin,
        "analog": pin.analog,
        "before": pin.level(begin),
        "changes": [x for time, level in pin.changes(begin, tracks.until) for x in (time - begin, level)],
    }


def _mark(record: TraceRecord, begin: Nanos) -> list[object]:
    """Moment (ns), controller, kind, subject, text."""
    value = record.value
    if isinstance(value, bytes):
        text = value[:_MOST_BYTES].hex(" ") + (f" … {len(value)} bytes" if len(value) > _MOST_BYTES else "")
    else:
        text = f"line {value}" if record.kind == "statement" else "" if value is None else str(value)
    return [record.time - begin, record.controller, record.kind, record.subject, text]
