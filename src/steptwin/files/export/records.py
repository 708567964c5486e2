"""A trace as JSON lines: all that was recorded, exactly, one record a line; and back.

The first line is the head of the file: a title, the controllers, how their axes are shown, the end of the run, the digest.
A file that is written while a world runs has the end of the run and the digest in its last line; one that was cut has none.
Every other line is a record: ``time_ns``, ``machine``, ``kind``, ``subject``, ``value``, and ``facts`` where its text has some.
Lines with ``scene``, behind the first one, are the machine in space (`steptwin.files.scene.recordedscene`); they are not part of
the digest. The value of a plan is as `steptwin.motion.planjson` has it; bytes are ``{"hex": …}``.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import IO, Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.datatypes import fields_fit, fits, fitting, format_short
from steptwin.durations import LONGEST_NS as LATEST_NS
from steptwin.errors import Misuse
from steptwin.files.export.progress import TimeProgress
from steptwin.files.scene.recordedscene import RecordedScene, read_scene
from steptwin.motion import Profile
from steptwin.motion.divisions import StepTrain
from steptwin.motion.planjson import plan_to_json, read_plan
from steptwin.simulation.mechanics.channels import AxisChannel, AxisViews, Mechanics, MovedChannel, PhaseOutputs, StepOutputs
from steptwin.simulation.scheduler.trace import KINDS, Trace, TraceRecord

FORMAT = 2
LONGEST_LINE = 4 << 20
"""Bytes of a line; a plan with thousands of segments has some 100 000."""
LONGEST_NUMBER = 20
"""Digits of a whole number, which has 64 bits at most."""
_PROGRESS_EVERY = 5000


class SavedTrace(NamedTuple):
    """The content of a file of JSON lines."""

    trace: Trace
    views: dict[tuple[str, str], AxisChannel]
    until: Nanos
    """When the run ended."""
    digest: str
    title: str
    scene: RecordedScene | None = None


def write_records(
    trace: Trace,
    views: AxisViews,
    file: IO[str],
    progress: TimeProgress,
    *,
    title: str,
    until: Nanos,
    scene: RecordedScene | None = None,
) -> None:
    file.write(_line({**_head_of(trace, views, title), "until_ns": until, "digest": trace.digest()}))
    for line in () if scene is None else scene.lines():
        file.write(_line(line))
    for i, record in enumerate(trace):
        file.write(record_line(record))
        if i % _PROGRESS_EVERY == 0:
            progress(record.time)


def begin_records(trace: Trace, views: AxisViews, title: str) -> str:
    """The first line of a file that is written while a world runs: its end is in the last one, `end_records`."""
    return _line({**_head_of(trace, views, title), "until_ns": None, "digest": None})


def end_records(trace: Trace, until: Nanos) -> str:
    return _line({"until_ns": until, "digest": trace.digest()})


def record_line(record: TraceRecord) -> str:
    time, controller, kind, subject, value, facts = record
    line = {"time_ns": time, "machine": controller, "kind": kind, "subject": subject, "value": _to_json(value)}
    return _line({**line, "facts": dict(facts)} if facts else line)


def _head_of(trace: Trace, views: AxisViews, title: str) -> dict[str, object]:
    axes = [{"machine": controller, "axis": axis, **_view_to_json(view)} for (controller, axis), view in views.items()]
    return {"steptwin_trace": FORMAT, "title": title, "machines": trace.controllers, "axes": axes}


def read_records(file: IO[bytes], name: str) -> SavedTrace:
    """Read a file of `write_records`. Raises `Misuse` with ``name`` and the line of an error."""
    saved: SavedTrace | None = None
    is_open, latest = False, 0  # whether the end of the run is still to be written
    for number, line in enumerate(_lines(file), 1):
        try:
            if len(line) > LONGEST_LINE:
                raise Misuse(f"a line of more than {LONGEST_LINE} bytes")
            if is_open and not line.endswith(b"\n"):
                break  # it was being written when its process was ended
            data = json.loads(line, parse_int=_whole)
            if saved is None:
                is_open = data.get("until_ns", 0) is None
                saved = _head({**data, "until_ns": 0, "digest": ""} if is_open else data)
            elif "scene" in data:
                if saved.scene is None:
                    saved = saved._replace(scene=read_scene(data["scene"]))
                else:
                    saved.scene.add_line(data)
            elif is_open and "kind" not in data:
                saved, is_open = saved._replace(until=_until(data), digest=fitting("digest", data["digest"], str)), False
            else:
                record = _record(data)
                saved.trace.add(record)
                latest = max(latest, record.time)
        except Misuse as error:
            raise Misuse(f"{name}:{number}: {error}") from error
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError, struct.error) as error:
            what = "the first line" if saved is None else "a record"
            raise Misuse(f"{name}:{number}: not {what} of a trace") from error
    if saved is None:
        raise Misuse(f"{name} is empty: a trace begins with a line about itself")
    if is_open:  # the run was cut
        return saved._replace(until=latest)
    try:
        digest = saved.trace.digest()
    except (Misuse, ArithmeticError, struct.error):
        digest = ""
    if digest != saved.digest:
        raise Misuse(f"{name}: the records are not those that were written: their digest is not {format_short(saved.digest)}")
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
        raise Misuse(f"a trace of format {format_short(data['steptwin_trace'])}: this version reads format {FORMAT}")
    views: dict[tuple[str, str], AxisChannel] = {}
    for axis in data["axes"]:
        view = _view_from_json(axis)
        if not (fields_fit(view) and fields_fit(view.outputs) and view.pulses_per_unit):
            raise TypeError("axes")
        if view.mechanics is not None and not (
            fields_fit(view.mechanics) and view.mechanics.pulses_per_unit and all(map(_is_moved, view.mechanics.moved))
        ):
            raise TypeError("mechanics")
        views[fitting("machine", axis["machine"], str), fitting("axis", axis["axis"], str)] = view
    controllers = fitting("machines", tuple(data["machines"]), tuple[str, ...])
    title = fitting("title", data.get("title", ""), str)
    return SavedTrace(Trace(controllers), views, _until(data), fitting("digest", data["digest"], str), title)


def _until(data: dict[str, Any]) -> Nanos:
    until = fitting("until_ns", data["until_ns"], int)
    if not 0 <= until <= LATEST_NS:
        raise Misuse(f"until_ns is {until}: permitted are 0 to {LATEST_NS}")
    return until


def _record(data: dict[str, Any]) -> TraceRecord:
    kind = data["kind"]
    if kind not in KINDS:
        raise Misuse(f"no kind of record {format_short(kind)}: kinds are {', '.join(KINDS)}")
    value = _from_json(data["value"])
    if not _is_value(kind, value):
        raise Misuse(f"{format_short(value)} is not a value of a record of kind {kind!r}")
    time = fitting("time_ns", data["time_ns"], int)
    if not 0 <= time <= LATEST_NS:
        raise Misuse(f"time_ns is {time}: permitted are 0 to {LATEST_NS}")
    facts = tuple((fitting("facts", name, str), fitting("facts", one, _FACT)) for name, one in data.get("facts", {}).items())
    return TraceRecord(
        time, fitting("machine", data["machine"], str), kind, fitting("subject", data["subject"], str), value, facts
    )


def _is_value(kind: str, value: object) -> bool:
    """Whether exports can show the value in a record of this kind; those of other kinds are shown as text."""
    if kind in ("plan", "free"):
        return isinstance(value, Profile | StepTrain)
    return kind not in _VALUES or fits(value, _VALUES[kind])


_FACT = int | float | str | bool | None
_VALUES: Mapping[str, Any] = {"load": tuple[tuple[int, bool, int], ...], "coordinate": int, "edge": float, "frame": bytes}


# ---------------------------------------------------------------------- values


def _to_json(value: object) -> object:
    if isinstance(value, Profile | StepTrain):
        return plan_to_json(value)
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
    return bytes.fromhex(value["hex"]) if "hex" in value else read_plan(value)


def _view_to_json(view: AxisChannel) -> dict[str, object]:
    data = {**view._asdict(), "outputs": view.outputs._asdict()}
    del data["mechanics"]
    if view.mechanics is None:
        return data
    mechanics = {**view.mechanics._asdict(), "moved": [channel._asdict() for channel in view.mechanics.moved]}
    return {**data, "mechanics": mechanics}


def _view_from_json(data: dict[str, Any]) -> AxisChannel:
    outputs = dict(data["outputs"])
    made: StepOutputs | PhaseOutputs
    if "phases" in outputs:
        first, second = outputs.pop("phases")
        made = PhaseOutputs((first, second), **outputs)
    else:
        made = StepOutputs(**outputs)
    mechanics: Mechanics | None = None
    if "mechanics" in data:
        its = {**data["mechanics"]}
        moved = tuple(_moved_from_json(channel) for channel in its.pop("moved", ()))
        mechanics = Mechanics(**its, moved=moved)
    return AxisChannel(data["name"], data["unit"], data["pulses_per_unit"], made, mechanics)


def _moved_from_json(data: dict[str, Any]) -> MovedChannel:
    plain = {key: _tuples(value) for key, value in data.items()}
    return MovedChannel(**plain)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _is_moved(channel: MovedChannel) -> bool:
    """Whether a channel from a file is one that can be computed."""
    angles = [angle for angle, _ in channel.points] if fields_fit(channel) else []
    rises = all(a < b for a, b in pairwise(angles)) and (not angles or angles[-1] - angles[0] < channel.turn)
    swings = channel.spring is None or (channel.spring[0] > 0.0 and 0.0 < channel.spring[1] < 1.0)
    return fields_fit(channel) and (channel.per_pulse != 0.0 or channel.other_per_pulse != 0.0) and rises and swings
