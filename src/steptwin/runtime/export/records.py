"""A trace as JSON lines: all that was recorded, exactly, one record a line; and back.

The first line says what the file is: a title, names of the machines, how their axes are shown, the end of the run, the digest.
Every other line is a record: ``time_ns``, ``machine``, ``kind``, ``subject``, ``value``. The value of a plan is its profile:
moments in nanoseconds, positions in pulses, and for each segment ``[end_s, anchor_s, c0, c1, c2, c3, direction]`` with
position = base + c0 + c1·u + c2·u² + c3·u³, u = seconds since ``start_ns`` − anchor_s; an end or a limit that never
comes is null. A segment of an arc is ``{"way": [its segment], "course": [centre_p, radius_p, angle_q, turn_q], …}`` with
position = base + centre + radius · cos((angle + turn · way) · 90°). Bytes are ``{"hex": …}``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from math import inf
from typing import IO, Any, NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import Division, Microstepping, StepTrain
from steptwin.motion.paths import ArcProfile, ArcSegment, Circular
from steptwin.runtime.export.axes import AxisView, AxisViews, Mechanics, PhaseOutputs, StepOutputs
from steptwin.runtime.export.progress import Progress
from steptwin.world.trace import KINDS, Record, Trace

FORMAT = 1
_PROGRESS_EVERY = 5000


class SavedTrace(NamedTuple):
    """What a file of JSON lines says."""

    trace: Trace
    views: dict[tuple[str, str], AxisView]
    until: Nanos
    """When the run ended."""
    digest: str
    title: str


def write_records(trace: Trace, views: AxisViews, file: IO[str], progress: Progress, *, title: str, until: Nanos) -> None:
    axes = [{"machine": machine, "axis": axis, **_view_to_json(view)} for (machine, axis), view in views.items()]
    head = {
        "steptwin_trace": FORMAT,
        "title": title,
        "machines": trace.machines,
        "until_ns": until,
        "digest": trace.digest(),
        "axes": axes,
    }
    file.write(_line(head))
    for i, (time, machine, kind, subject, value) in enumerate(trace):
        file.write(_line({"time_ns": time, "machine": machine, "kind": kind, "subject": subject, "value": _to_json(value)}))
        if i % _PROGRESS_EVERY == 0:
            progress(time)


def read_records(lines: Iterable[str], name: str) -> SavedTrace:
    """Raises `Misuse` with ``name`` and the line where they are not what `write_records` writes."""
    saved: SavedTrace | None = None
    for number, line in enumerate(lines, 1):
        try:
            data = json.loads(line)
            if saved is None:
                saved = _head(data)
            else:
                saved.trace.add(_record(data))
        except (LookupError, TypeError, ValueError) as error:
            what = error if isinstance(error, Misuse) else f"not {'the first line' if saved is None else 'a record'} of a trace"
            raise Misuse(f"{name}:{number}: {what}") from error
    if saved is None:
        raise Misuse(f"{name} is empty: a trace begins with a line about itself")
    if saved.trace.digest() != saved.digest:
        raise Misuse(f"{name}: the records are not those that were written: their digest is not {saved.digest}")
    return saved


def _line(data: dict[str, Any]) -> str:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":")) + "\n"


def _head(data: dict[str, Any]) -> SavedTrace:
    if data["steptwin_trace"] != FORMAT:
        raise Misuse(f"a trace of format {data['steptwin_trace']}: this version reads format {FORMAT}")
    views = {(axis["machine"], axis["axis"]): _view_from_json(axis) for axis in data["axes"]}
    return SavedTrace(Trace(data["machines"]), views, data["until_ns"], data["digest"], data.get("title", ""))


def _record(data: dict[str, Any]) -> Record:
    kind = data["kind"]
    if kind not in KINDS:
        raise Misuse(f"no kind of record {kind!r}: kinds are {', '.join(KINDS)}")
    return Record(data["time_ns"], data["machine"], kind, data["subject"], _from_json(data["value"]))


# ---------------------------------------------------------------------- values


def _to_json(value: object) -> object:
    if isinstance(value, StepTrain):
        fine, coarse, limit = value.microstepping
        grids = (fine, coarse, None if limit == inf else limit)
        return {**_profile_to_json(value.profile), "microstepping": grids, "divisions": value.divisions}
    if isinstance(value, Profile):
        return _profile_to_json(value)
    if isinstance(value, bytes):
        return {"hex": value.hex()}
    if isinstance(value, tuple):
        return [_to_json(item) for item in value]
    return value


def _from_json(value: Any) -> object:
    if isinstance(value, list):
        return tuple(_from_json(item) for item in value)
    if not isinstance(value, dict):
        return value
    if "hex" in value:
        return bytes.fromhex(value["hex"])
    profile = _profile_from_json(value)
    if "divisions" in value:
        divisions = tuple(Division(*division) for division in value["divisions"])
        fine, coarse, limit = value["microstepping"]
        return StepTrain(profile, Microstepping(fine, coarse, inf if limit is None else limit), divisions)
    return profile


def _profile_to_json(profile: Profile) -> dict[str, object]:
    segments = [_segment_to_json(segment) for segment in profile.segments]
    return {"start_ns": profile.start, "base": profile.base, "final": profile.final_p, "segments": segments}


def _profile_from_json(data: dict[str, Any]) -> Profile:
    start, base, final = data["start_ns"], data["base"], data["final"]
    if any(isinstance(segment, dict) for segment in data["segments"]):
        return ArcProfile(start, base, tuple(_arc_from_json(segment) for segment in data["segments"]), final)
    return Profile(start, base, tuple(_segment_from_json(segment) for segment in data["segments"]), final)


def _segment_to_json(s: Segment | ArcSegment) -> object:
    end_s = None if s.end_s == inf else s.end_s
    if isinstance(s, Segment):
        return end_s, s.anchor_s, s.c0, s.c1, s.c2, s.c3, s.direction
    c = s.course
    course = (c.centre_p, c.radius_p, c.angle_q, c.turn_q)
    way = _segment_to_json(s.way)
    return {"end_s": end_s, "direction": s.direction, "way": way, "course": course, "half": s.half, "end_p": s.end_p}


def _segment_from_json(data: list[Any]) -> Segment:
    end_s, *rest = data
    return Segment(inf if end_s is None else end_s, *rest)


def _arc_from_json(data: dict[str, Any]) -> ArcSegment:
    end_s, way, course = data["end_s"], _segment_from_json(data["way"]), Circular(*data["course"])
    return ArcSegment(inf if end_s is None else end_s, data["direction"], way, course, data["half"], data["end_p"])


def _view_to_json(view: AxisView) -> dict[str, object]:
    data = {**view._asdict(), "outputs": view.outputs._asdict()}
    del data["mechanics"]
    return data if view.mechanics is None else {**data, "mechanics": view.mechanics._asdict()}


def _view_from_json(data: dict[str, Any]) -> AxisView:
    outputs = dict(data["outputs"])
    made: StepOutputs | PhaseOutputs
    if "phases" in outputs:
        first, second = outputs.pop("phases")
        made = PhaseOutputs((first, second), **outputs)
    else:
        made = StepOutputs(**outputs)
    mechanics = Mechanics(**data["mechanics"]) if "mechanics" in data else None
    return AxisView(data["name"], data["unit"], data["pulses_per_unit"], made, mechanics)
