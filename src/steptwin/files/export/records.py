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
import struct
from collections.abc import Iterator, Mapping
from math import inf
from typing import IO, Any, NamedTuple

from steptwin.errors import Misuse
from steptwin.files.export.axes import AxisView, AxisViews, Mechanics, PhaseOutputs, StepOutputs
from steptwin.files.export.progress import Progress
from steptwin.files.plaintypes import fields_fit, fits, fitting, shown
from steptwin.machine import Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import Division, Microstepping, StepTrain
from steptwin.motion.paths import ArcProfile, ArcSegment, Circular
from steptwin.world.durations import LONGEST_NS as LATEST_NS
from steptwin.world.trace import KINDS, Record, Trace

FORMAT = 1
LONGEST_LINE = 4 << 20
"""Bytes of a line; a plan with thousands of segments has some 100 000."""
LONGEST_NUMBER = 20
"""Digits of a whole number, which has 64 bits at most."""
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


def read_records(file: IO[bytes], name: str) -> SavedTrace:
    """Raises `Misuse` with ``name`` and the line where it is not what `write_records` writes."""
    saved: SavedTrace | None = None
    for number, line in enumerate(_lines(file), 1):
        try:
            if len(line) > LONGEST_LINE:
                raise Misuse(f"a line of more than {LONGEST_LINE} bytes")
            data = json.loads(line, parse_int=_whole)
            if saved is None:
                saved = _head(data)
            else:
                saved.trace.add(_record(data))
        except Misuse as error:
            raise Misuse(f"{name}:{number}: {error}") from error
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError, struct.error) as error:
            what = "the first line" if saved is None else "a record"
            raise Misuse(f"{name}:{number}: not {what} of a trace") from error
    if saved is None:
        raise Misuse(f"{name} is empty: a trace begins with a line about itself")
    try:
        digest = saved.trace.digest()
    except (Misuse, ArithmeticError, struct.error):
        digest = ""
    if digest != saved.digest:
        raise Misuse(f"{name}: the records are not those that were written: their digest is not {shown(saved.digest)}")
    return saved


def _lines(file: IO[bytes]) -> Iterator[bytes]:
    while line := file.readline(LONGEST_LINE + 1):
        yield line


def _whole(text: str) -> int:
    if len(text) > LONGEST_NUMBER:
        raise ValueError(f"a number has {len(text)} digits")
    return int(text)


def _line(data: dict[str, Any]) -> str:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":")) + "\n"


def _head(data: dict[str, Any]) -> SavedTrace:
    if data["steptwin_trace"] != FORMAT:
        raise Misuse(f"a trace of format {shown(data['steptwin_trace'])}: this version reads format {FORMAT}")
    views: dict[tuple[str, str], AxisView] = {}
    for axis in data["axes"]:
        view = _view_from_json(axis)
        if not (fields_fit(view) and fields_fit(view.outputs) and view.pulses_per_unit):
            raise TypeError("axes")
        if view.mechanics is not None and not (fields_fit(view.mechanics) and view.mechanics.pulses_per_unit):
            raise TypeError("mechanics")
        views[fitting("machine", axis["machine"], str), fitting("axis", axis["axis"], str)] = view
    machines = fitting("machines", tuple(data["machines"]), tuple[str, ...])
    until = fitting("until_ns", data["until_ns"], int)
    if not 0 <= until <= LATEST_NS:
        raise Misuse(f"until_ns is {until}: permitted are 0 to {LATEST_NS}")
    title = fitting("title", data.get("title", ""), str)
    return SavedTrace(Trace(machines), views, until, fitting("digest", data["digest"], str), title)


def _record(data: dict[str, Any]) -> Record:
    kind = data["kind"]
    if kind not in KINDS:
        raise Misuse(f"no kind of record {shown(kind)}: kinds are {', '.join(KINDS)}")
    value = _from_json(data["value"])
    if not _is_value(kind, value):
        raise Misuse(f"{shown(value)} is no value of a record of kind {kind!r}")
    time = fitting("time_ns", data["time_ns"], int)
    if not 0 <= time <= LATEST_NS:
        raise Misuse(f"time_ns is {time}: permitted are 0 to {LATEST_NS}")
    return Record(time, fitting("machine", data["machine"], str), kind, fitting("subject", data["subject"], str), value)


def _is_value(kind: str, value: object) -> bool:
    """Whether exports can show the value in a record of this kind; those of other kinds are shown as text."""
    if kind == "plan":
        return isinstance(value, Profile | StepTrain)
    return kind not in _VALUES or fits(value, _VALUES[kind])


_VALUES: Mapping[str, Any] = {"load": tuple[tuple[int, bool, int], ...], "coordinate": int, "edge": float, "frame": bytes}


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
        divisions = tuple(Division(*fitting("a division", tuple(one), tuple[int, int])) for one in value["divisions"])
        fine, coarse, limit = fitting("microstepping", tuple(value["microstepping"]), tuple[int, int, float | None])
        return StepTrain(profile, Microstepping(fine, coarse, inf if limit is None else limit), divisions)
    return profile


def _profile_to_json(profile: Profile) -> dict[str, object]:
    segments = [_segment_to_json(segment) for segment in profile.segments]
    return {"start_ns": profile.start, "base": profile.base, "final": profile.final_p, "segments": segments}


def _profile_from_json(data: dict[str, Any]) -> Profile:
    start, base = fitting("start_ns", data["start_ns"], int), fitting("base", data["base"], int)
    final = fitting("final", data["final"], float)
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
    end_s, *rest = fitting("a segment", tuple(data), tuple[float | None, float, float, float, float, float, int])
    return Segment(inf if end_s is None else end_s, *rest)


def _arc_from_json(data: dict[str, Any]) -> ArcSegment:
    end_s = fitting("end_s", data["end_s"], float | None)
    course = Circular(*fitting("course", tuple(data["course"]), tuple[float, float, float, float]))
    direction, half = fitting("direction", data["direction"], int), fitting("half", data["half"], int)
    way, end_p = _segment_from_json(data["way"]), fitting("end_p", data["end_p"], float)
    return ArcSegment(inf if end_s is None else end_s, direction, way, course, half, end_p)


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
