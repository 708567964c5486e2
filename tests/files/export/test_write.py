"""Which files there are, what is refused, and what is left when something goes wrong."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from world_rig import Run

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.extras import libraries_of
from steptwin.files import export
from steptwin.files.export import FORMATS, bar, write_trace
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.tracetracks import sort_out
from steptwin.motion import MotionState, plan_position
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

TRACE = Trace(["a", "b"])
TRACE.add(TraceRecord(5, "a", "edge", "OUT1", 1.0))
TRACE.add(TraceRecord(9, "b", "edge", "OUT1", 1.0))


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> None:
    """No extra is installed."""
    monkeypatch.setattr(export, "lacking", libraries_of)


SHOWN = [name for name in FORMATS if name != "glb"]
"""Those of a trace without a machine in space."""


def test_the_suffix_of_a_file_says_its_format(tmp_path: Path) -> None:
    for name in SHOWN:
        path = tmp_path / f"x.{name}"
        assert write_trace(TRACE, path) == [path]
        assert path.stat().st_size > 0
    assert len(os.listdir(tmp_path)) == len(SHOWN)


def test_a_directory_gets_the_usual_ones_or_those_that_are_named(tmp_path: Path) -> None:
    assert write_trace(TRACE, tmp_path / "new" / "out") == [tmp_path / "new/out" / f"trace.{n}" for n in ("jsonl", "html", "png")]
    assert write_trace(TRACE, tmp_path, formats=["vcd", "csv", "vcd"]) == [tmp_path / "trace.vcd", tmp_path / "trace.csv"]


def test_a_format_without_its_libraries_is_refused_with_the_command_that_installs_them(tmp_path: Path, without: None) -> None:
    for name, extra in {"png": "plots", "svg": "plots", "vcd": "numbers", "csv": "numbers", "parquet": "parquet"}.items():
        with pytest.raises(Misuse, match=rf"^{name} needs .*pip install 'steptwin\[{extra}\]'$"):
            write_trace(TRACE, tmp_path / f"x.{name}")
    assert [path.name for path in write_trace(TRACE, tmp_path)] == ["trace.jsonl", "trace.html"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"where": "x.pdf"}, r"x.pdf: formats are jsonl, html"),
        ({"where": "x", "formats": ["pdf"]}, "no format 'pdf': formats are jsonl, html"),
        ({"where": "x.vcd", "formats": ["vcd", "csv"]}, "one file cannot be vcd and csv"),
        ({"where": "x.csv", "period": 0}, "period = 0 ns: must be 1 ns or more"),
        ({"where": "x.csv", "controllers": ["c"]}, "no controller 'c' in the trace: there are a, b"),
        ({"where": "x.csv", "begin": 9, "until": 3}, "ends at 3 ns and begins at 9 ns"),
    ],
)
def test_what_cannot_be_written_is_refused(arguments: dict[str, object], message: str, tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=message):
        write_trace(TRACE, **{**arguments, "where": tmp_path / str(arguments["where"])})  # type: ignore[arg-type]
    assert os.listdir(tmp_path) == []


def test_a_trace_that_was_not_kept_is_refused(tmp_path: Path) -> None:
    trace = Trace(keep=False)
    trace.add(TraceRecord(5, "a", "edge", "OUT1", 1.0))
    with pytest.raises(Misuse, match="kept nothing but its digest"):
        write_trace(trace, tmp_path)


def test_a_file_is_whole_or_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.csv"
    path.write_text("old")

    def breaks(*_: object) -> None:
        raise OSError(28, "no space left on device")

    monkeypatch.setattr("steptwin.files.export.tables.samples", breaks)
    with pytest.raises(Misuse, match=r"cannot write .*x\.csv: no space left on device"):
        write_trace(TRACE, path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["x.csv"]


def test_progress_goes_from_the_beginning_to_the_end(mic488: Run, tmp_path: Path) -> None:
    told: dict[str, list[Nanos]] = {}

    @contextmanager
    def watch(what: str, begin: Nanos, until: Nanos) -> Generator[TimeProgress]:
        assert (begin, until) == (SECOND, mic488.until)
        told[what] = []
        yield told[what].append

    write_trace(mic488.trace, tmp_path, formats=SHOWN, begin=SECOND, until=mic488.until, watch=watch)
    assert set(told) == {f"trace.{name}" for name in SHOWN}
    for name, moments in told.items():
        assert moments == sorted(moments), name
        assert moments, name


def test_there_is_no_bar_where_nobody_would_see_it(capsys: pytest.CaptureFixture[str]) -> None:
    with bar("x", 0, 10) as progress:
        progress(5)
    assert capsys.readouterr() == ("", "")


def test_before_its_first_change_a_pin_had_the_other_level_and_an_axis_stood() -> None:
    trace = Trace()
    trace.add(TraceRecord(5, "a", "edge", "IN1", 0.0))
    trace.add(TraceRecord(6, "a", "edge", "AIN1", 4.0))
    trace.add(TraceRecord(7, "a", "plan", "1", plan_position(MotionState(7, 30, 0.0, 0.0), 50, 100.0, 100.0, 100.0)))
    tracks = sort_out(trace, {})
    ain, in1 = tracks.pins
    assert [in1.level(t) for t in (0, 4, 5)] == [1.0, 1.0, 0.0]
    assert [ain.level(t) for t in (0, 5, 6)] == [None, None, 4.0]
    plan = tracks.axes[0].plan(0)
    assert plan.count(3) == 30
    assert tracks.until == trace_end(trace)


def trace_end(trace: Trace) -> Nanos | None:
    (plan,) = trace.plans()
    return plan.value.end  # type: ignore[attr-defined]


def test_pins_come_in_the_order_of_their_numbers() -> None:
    trace = Trace()
    for n in (10, 2, 1):
        trace.add(TraceRecord(5, "a", "edge", f"IN{n}", 1.0))
    assert [pin.pin for pin in sort_out(trace, {}).pins] == ["IN1", "IN2", "IN10"]
