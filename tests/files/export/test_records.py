from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from world_rig import Run

from steptwin.errors import Misuse
from steptwin.files.export import read_trace, write_trace
from steptwin.files.export.records import _from_json, _to_json
from steptwin.motion import MotionState, plan_position, plan_velocity
from steptwin.motion.divisions import Microstepping, step_train
from steptwin.motion.paths import ArcProfile, Circular, circle
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

REST = MotionState(0, 0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["mic488", "m1486"])
def test_a_trace_read_back_is_the_one_that_was_written(name: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    run: Run = request.getfixturevalue(name)
    write_trace(run.trace, tmp_path / "run.jsonl", views=run.views, until=run.until)
    saved = read_trace(tmp_path / "run.jsonl")
    assert saved.trace.digest() == run.trace.digest()
    assert saved.views == run.views
    assert saved.until == run.until
    assert saved.trace.controllers == run.trace.controllers


def test_every_kind_of_value_comes_back(tmp_path: Path) -> None:
    move = plan_position(REST, 5000, 1000.0, 2000.0, 800.0)
    values: list[object] = [
        move,
        plan_velocity(REST, -300.0, 100.0, 100.0),
        step_train(move, 0, Microstepping(8, 64, 500.0)),
        step_train(move, 0, Microstepping(1, 1, float("inf"))),
        b"\x01\xff", "zażółć\n\"</script>", 7, -0.1, 1e300, 5e-324, True, None, (1, ("a", b"b"), move),
    ]  # fmt: skip
    trace = Trace(["first", "ł"])
    for time, value in enumerate(values):
        trace.add(TraceRecord(time, "ł", "event", "x", value))
    write_trace(trace, tmp_path, formats=["jsonl"])
    saved = read_trace(tmp_path)
    assert saved.trace.digest() == trace.digest()
    assert [type(record.value) for record in saved.trace] == [type(value) for value in values]


def test_arcs_come_back() -> None:
    arc = circle(500.0, 0.0, 500.0, 4.0)
    curve = Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length)
    travel = plan_position(REST, round(arc.length), 1000.0, 1000.0, 400.0)
    profile = curve.profile(travel, 0, None)
    back = _from_json(json.loads(json.dumps(_to_json(profile))))
    assert isinstance(back, ArcProfile)
    assert back == profile
    assert [back.position(t) for t in range(0, travel.end or 0, 10**8)] == [
        profile.position(t) for t in range(0, travel.end or 0, 10**8)
    ]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: [], "is empty: a trace begins with a line about itself"),
        (lambda lines: ["{}\n"], "x.jsonl:1: not the first line of a trace"),
        (lambda lines: ["nonsense\n"], "x.jsonl:1: not the first line of a trace"),
        (lambda lines: [lines[0].replace('"steptwin_trace":2', '"steptwin_trace":9')], "format 9: this version reads format 2"),
        (lambda lines: [*lines[:2], lines[2][:-9] + "\n"], "x.jsonl:3: not a record of a trace"),
        (lambda lines: [lines[0], lines[1].replace('"edge"', '"wedge"')], "x.jsonl:2: no kind of record 'wedge'"),
        (lambda lines: lines[:-1], "the records are not those that were written"),
        (lambda lines: [lines[0], lines[2], lines[1]], "x.jsonl:3: a: a record of 1 ns after one of 2 ns"),
    ],
)
def test_what_is_no_trace_is_refused(change: Callable[[list[str]], list[str]], message: str, tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(1, "a", "edge", "OUT1", 1.0))
    trace.add(TraceRecord(2, "a", "edge", "OUT1", 0.0))
    path = tmp_path / "x.jsonl"
    write_trace(trace, path)
    path.write_text("".join(change(path.read_text().splitlines(keepends=True))))
    with pytest.raises(Misuse, match=message):
        read_trace(path)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=r"cannot read .*no\.jsonl: no such file"):
        read_trace(tmp_path / "no.jsonl")
    (tmp_path / "bytes.jsonl").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(Misuse, match=r"bytes\.jsonl:1: not the first line of a trace"):
        read_trace(tmp_path / "bytes.jsonl")
