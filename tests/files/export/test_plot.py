from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from world_rig import Run

from steptwin.controller import SECOND, Nanos
from steptwin.files.export import write_trace
from steptwin.files.export.polyline import curve
from steptwin.files.export.tracetracks import sort_out
from steptwin.motion import MotionState, plan_position, plan_velocity
from steptwin.simulation.scheduler.trace import Trace, TraceRecord


def test_a_picture_names_every_channel(mic488: Run, tmp_path: Path) -> None:
    write_trace(mic488.trace, tmp_path / "one.svg", views=mic488.views, until=mic488.until)
    text = (tmp_path / "one.svg").read_text()
    for channel in (
        "m.M1 position",
        "m.M4 velocity",
        "m.IN20",
        "m.OUT3",
        "m.M2_EN",
        "m.AIN1",
        "m.x.switch1",
        "bus.tcp-1",
        "m.events",
    ):
        assert f">{channel}<" in text, channel
    assert ">mm/s<" in text
    assert ">max<" in text
    assert ">time (s)<" in text
    assert "IN9<" not in text


def test_channels_of_the_only_controller_need_no_prefix(tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(0, "m", "plan", "1", plan_position(MotionState(0, 0, 0.0, 0.0), 100, 100.0, 100.0, 100.0)))
    trace.add(TraceRecord(0, "m", "edge", "IN20", 1.0))
    trace.add(TraceRecord(5, "m", "edge", "IN20", 0.0))
    write_trace(trace, tmp_path / "one.svg")
    text = (tmp_path / "one.svg").read_text()
    for label in ("M1 position", "IN20", "m"):
        assert f">{label}<" in text, label


def test_long_names_are_not_cut_off(tmp_path: Path) -> None:
    trace = Trace()
    for name in ("a-machine-with-a-long-name", "b"):
        trace.add(TraceRecord(0, name, "plan", "1", plan_position(MotionState(0, 0, 0.0, 0.0), 100, 100.0, 100.0, 100.0)))
    write_trace(trace, tmp_path / "run.svg")
    begins = re.findall(r"translate\(([-\d.]+) [-\d.]+\)\">a-machine-with", (tmp_path / "run.svg").read_text())
    assert len(begins) == 2
    assert all(float(begin) > 0 for begin in begins)


@pytest.mark.parametrize("form", ["svg", "png"])
def test_a_picture_is_the_same_every_time(form: str, m1486: Run, tmp_path: Path) -> None:
    one, other = (write_trace(m1486.trace, tmp_path / f"{n}.{form}", views=m1486.views)[0] for n in (1, 2))
    assert one.read_bytes() == other.read_bytes()


def test_a_png_is_as_wide_as_a_page(m1486: Run, tmp_path: Path) -> None:
    write_trace(m1486.trace, tmp_path / "run.png", views=m1486.views)
    data = (tmp_path / "run.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width == 1800
    assert 300 < height < 900


def test_more_than_can_be_read_is_said_to_be_left_out(tmp_path: Path) -> None:
    trace = Trace()
    for n in range(18):
        trace.add(TraceRecord(0, f"m{n}", "plan", "1", plan_position(MotionState(0, 0, 0.0, 0.0), 100, 100.0, 100.0, 100.0)))
    write_trace(trace, tmp_path / "run.svg")
    assert "not shown: 2 axes, 0 channels" in (tmp_path / "run.svg").read_text()


def test_nothing_at_all_is_a_picture_too(tmp_path: Path) -> None:
    write_trace(Trace(["a"]), tmp_path / "run.svg")
    assert ">nothing moved or changed<" in (tmp_path / "run.svg").read_text()


@pytest.mark.parametrize(("seconds", "unit"), [(10, "time (s)"), (3600, "time (h:min:s)")])
def test_long_runs_have_clock_times(seconds: int, unit: str, tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(SECOND, "a", "edge", "OUT1", 1.0))
    write_trace(trace, tmp_path / "run.svg", until=seconds * SECOND)
    assert f">{unit}<" in (tmp_path / "run.svg").read_text()


def times_of(picture: Path) -> set[str]:
    return set(re.findall(r">(\d+)</text>", picture.read_text()))


def test_a_picture_ends_shortly_after_the_last_change_unless_asked_for_more(tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(SECOND, "a", "edge", "OUT1", 1.0))
    trace.add(TraceRecord(7 * SECOND, "a", "edge", "OUT1", 0.0))
    for second in range(60):
        trace.add(TraceRecord(second * SECOND, "b", "edge", "AIN1", float(second % 2)))
    write_trace(trace, tmp_path / "short.svg", ended=60 * SECOND)
    write_trace(trace, tmp_path / "long.svg", ended=60 * SECOND, until=60 * SECOND)
    assert times_of(tmp_path / "short.svg") & {"7", "8", "60"} == {"7"}
    assert "60" in times_of(tmp_path / "long.svg")


def test_a_motion_without_end_is_shown_to_the_end(tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(0, "a", "plan", "1", plan_velocity(MotionState(0, 0, 0.0, 0.0), 100.0, 100.0, 100.0)))
    write_trace(trace, tmp_path / "run.svg", ended=60 * SECOND)
    assert "60" in times_of(tmp_path / "run.svg")


def test_the_title_is_the_name_of_what_ran(mic488: Run, tmp_path: Path) -> None:
    write_trace(mic488.trace, tmp_path / "named.svg", views=mic488.views, title="bar <feeder>")
    assert ">bar &lt;feeder&gt;<" in (tmp_path / "named.svg").read_text()
    write_trace(mic488.trace, tmp_path / "plain.svg", views=mic488.views)
    assert ">m, bus, world<" in (tmp_path / "plain.svg").read_text()


@given(
    st.integers(-100_000, 100_000),
    st.floats(100.0, 50_000.0),
    st.floats(100.0, 50_000.0),
    st.floats(50.0, 64_000.0),
    st.integers(0, SECOND),
)
def test_curves_of_few_points_are_close_to_the_motion(target: int, acc: float, dec: float, speed: float, begin: Nanos) -> None:
    profile = plan_position(MotionState(0, 0, 0.0, 0.0), target, acc, dec, speed)
    trace = Trace()
    trace.add(TraceRecord(0, "a", "plan", "1", profile))
    assert profile.end is not None
    until = max(profile.end, begin) + SECOND
    points = curve(sort_out(trace, {}, begin, until).axes[0], begin, until)
    assert points.times[0] == begin
    assert points.times[-1] == until
    assert points.times == sorted(points.times)
    assert len(points.times) < 250
    reach = max(points.positions) - min(points.positions)
    for i, (t0, t1) in enumerate(zip(points.times, points.times[1:], strict=False)):
        middle = (t0 + t1) // 2
        between = points.positions[i] + (points.positions[i + 1] - points.positions[i]) * (middle - t0) / max(t1 - t0, 1)
        assert abs(between - profile.position(middle)) <= reach / 1000 + 1e-6
