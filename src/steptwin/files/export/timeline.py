"""A page with a timeline: one file without anything from outside that any browser opens, exact at every scale.

Motion goes into the page as plans, not as samples, so that the page can be looked at down to single pulses.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html import escape
from importlib.resources import files
from typing import IO

from steptwin.controller import Nanos
from steptwin.files.export.polyline import PolylinePiece, pieces_of
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.recording import Recording
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.motion.divisions import Plan, StepTrain, profile_of
from steptwin.motion.plain import plain_plan
from steptwin.simulation.scheduler.trace import TraceRecord

_SCRIPTS = ("model.js", "draw.js", "timeline.js")
_MOST_BYTES = 64
"""Most bytes of a frame in the page."""


def write_timeline(recording: Recording, file: IO[str], progress: TimeProgress) -> None:
    names = recording.title or ", ".join(recording.controllers[:4]) + (" …" if len(recording.controllers) > 4 else "")
    data = {
        "begin": recording.begin,
        "span": recording.until - recording.begin,
        "controllers": recording.controllers,
        "axes": [_axis(track, recording, progress, i) for i, track in enumerate(recording.axes)],
        "moved": [_moved(track, recording) for track in recording.moved],
        "pins": [_pin(pin, recording) for pin in recording.pins],
        "marks": [_mark(record, recording.begin) for record in recording.marks if record.time <= recording.until],
    }
    parts = {
        "title": escape(names),
        "style": _part("timeline.css"),
        "script": "".join(map(_part, _SCRIPTS)),
        # A "</script>" in a text must not end the script.
        "data": json.dumps(data, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"),
    }
    file.write(re.sub(r"/\*(\w+)\*/", lambda found: parts[found[1]], _part("timeline.html")))
    progress(recording.until)


def _part(name: str) -> str:
    return (files("steptwin.files.export") / "page" / name).read_text("utf-8")


# ---------------------------------------------------------------------- axes


def _axis(track: AxisTrack, recording: Recording, progress: TimeProgress, number: int) -> dict[str, object]:
    """The coordinate; if they can differ, ``counted`` is the count since power-on, and ``true`` the position of the load."""
    progress(recording.begin + (recording.until - recording.begin) * (number + 1) // (len(recording.axes) + 1))
    coordinate, load = track.coordinate(), track.true()
    counted = {} if coordinate is None else {"counted": _motion(track, recording)}
    return _motion(coordinate or track, recording) | counted | ({} if load is None else {"true": _motion(load, recording)})


def _motion(track: AxisTrack, recording: Recording) -> dict[str, object]:
    """The ``plans``, as `steptwin.motion.plain` writes them, and flat ``pieces`` of them, six numbers each: begin (ns from that
    of the window), number of the plan and of its segment (-1: at rest), counted position, direction (0: no pulses), pulses of
    the profile for one STEP pulse.
    """
    plans: list[dict[str, object]] = []
    pieces: list[int] = []
    for plan, after, until in track.intervals(recording.begin, recording.until):
        profile = profile_of(plan)
        for piece, grid, count in _divided(plan, after, until):
            number, direction = -1, 0
            if piece.segment is not None:
                number, direction = profile.segments.index(piece.segment), piece.segment.direction
            pieces += [piece.begin - recording.begin, len(plans), number, count, direction, grid]
        plans.append(plain_plan(profile))
    view = track.view
    return {
        "controller": track.controller, "name": view.name, "unit": view.unit, "scale": view.pulses_per_unit,
        "plans": plans, "pieces": pieces,
    }  # fmt: skip


def _moved(track: AxisTrack, recording: Recording) -> dict[str, object]:
    """As `_motion`, without pulses."""
    plans: list[dict[str, object]] = []
    pieces: list[int] = []
    for plan, after, _ in track.intervals(recording.begin, recording.until):
        pieces += [after - recording.begin, len(plans), 0 if profile_of(plan).segments else -1, 0, 0, 1]
        plans.append(plain_plan(plan))
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


def _divided(plan: Plan, after: Nanos, until: Nanos) -> Iterator[tuple[PolylinePiece, int, int]]:
    """(piece, grid, counted position where it begins); a piece ends where the division changes."""
    profile = profile_of(plan)
    cuts: list[Nanos] = []
    if isinstance(plan, StepTrain):
        changes = [profile.pulse_time(division.begin, profile.start) for division in plan.divisions[1:]]
        cuts = [time for time in changes if time is not None and after < time < until]
    for begin, end in zip([after, *cuts], [*cuts, until], strict=True):
        now = max(begin, profile.start)
        grid = plan.division(now).grid if isinstance(plan, StepTrain) else 1
        for piece in pieces_of(profile, begin, end):
            yield piece, grid, plan.count(max(piece.begin, profile.start))


# ---------------------------------------------------------------------- pins and marks


def _pin(pin: PinTrack, recording: Recording) -> dict[str, object]:
    begin = recording.begin
    return {
        "controller": pin.controller,
        "name": pin.pin,
        "analog": pin.analog,
        "before": pin.level(begin),
        "changes": [x for time, level in pin.changes(begin, recording.until) for x in (time - begin, level)],
    }


def _mark(record: TraceRecord, begin: Nanos) -> list[object]:
    """Moment (ns), controller, kind, subject, text."""
    value = record.value
    if isinstance(value, bytes):
        text = value[:_MOST_BYTES].hex(" ") + (f" … {len(value)} bytes" if len(value) > _MOST_BYTES else "")
    else:
        text = f"line {value}" if record.kind == "statement" else "" if value is None else str(value)
    return [record.time - begin, record.controller, record.kind, record.subject, text]
