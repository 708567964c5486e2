"""Read back with pyvcd's reader."""

from __future__ import annotations

import io
from bisect import bisect_right
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from vcd.reader import TokenKind, tokenize
from world_rig import Run

from steptwin.controller import SECOND, Nanos
from steptwin.files.export import vcd
from steptwin.files.export.progress import silent
from steptwin.files.export.tracetracks import TraceTracks, sort_out
from steptwin.files.export.vcdtext import changes_text
from steptwin.motion import MotionState, Profile, plan_position
from steptwin.motion.divisions import StepTrain
from steptwin.motion.waveforms import PERIOD, currents
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

Changes = dict[str, list[tuple[Nanos, object]]]
"""By name of the variable; the first is its value at the beginning."""


def dumped(tracks: TraceTracks) -> bytes:
    file = io.BytesIO()
    vcd.write_vcd(tracks, file, silent)
    return file.getvalue()


def read(text: bytes) -> Changes:
    names: dict[str, str] = {}
    changes: Changes = {}
    scope = ""
    now = -1
    for token in tokenize(io.BytesIO(text)):
        if token.kind is TokenKind.SCOPE:
            scope = token.scope.ident
        elif token.kind is TokenKind.VAR:
            name = f"{scope}.{token.var.reference}"
            assert name not in changes
            assert token.var.id_code not in names
            names[token.var.id_code] = name
            changes[name] = []
        elif token.kind is TokenKind.CHANGE_TIME:
            assert token.time_change > now
            now = token.time_change
        elif token.kind in {TokenKind.CHANGE_SCALAR, TokenKind.CHANGE_VECTOR, TokenKind.CHANGE_REAL, TokenKind.CHANGE_STRING}:
            assert not isinstance(token.data, int | str | None)
            changes[names[token.data.id_code]].append((now, token.data.value))  # type: ignore[union-attr]
    return changes


def recording_of(run: Run, begin: Nanos = 0, until: Nanos | None = None) -> TraceTracks:
    return sort_out(run.trace, run.views, begin, run.until if until is None else until)


def value_at(changes: list[tuple[Nanos, object]], now: Nanos) -> object:
    return changes[bisect_right(changes, now, key=lambda change: change[0]) - 1][1]


def plans_of(run: Run, axis: str) -> list[tuple[Nanos, Nanos, Any]]:
    """(begin, end, plan), straight from the trace."""
    records = [record for record in run.trace.plans() if record.subject == axis]
    ends = [record.time for record in records[1:]] + [run.until]
    return [(record.time, end, record.value) for record, end in zip(records, ends, strict=True)]


def pulses_one_by_one(profile: Profile, after: Nanos, until: Nanos) -> Iterator[Nanos]:
    while True:
        count = profile.count(after)
        following = [time for way in (1, -1) if (time := profile.pulse_time(count + way, after)) is not None]
        if not following or min(following) > until:
            return
        after = min(following)
        yield after


@pytest.fixture(scope="module")
def of_mic488(mic488: Run) -> Changes:
    return read(dumped(recording_of(mic488)))


@pytest.mark.parametrize("axis", "1234")
def test_pulses_and_directions_lead_where_the_profiles_do(axis: str, mic488: Run, of_mic488: Changes) -> None:
    steps, directions = of_mic488[f"m.M{axis}_STEP"], of_mic488[f"m.M{axis}_DIR"]
    assert steps[0] == (0, "0")
    assert all(now != before for (_, before), (_, now) in pairwise(steps))
    counted = 0
    moments: list[Nanos] = []
    for time, level in steps[1:]:
        if level == "1":
            # The direction stands before the pulse and as long as it lasts.
            assert value_at(directions, time - 1) == value_at(directions, time)
            counted += 1 if value_at(directions, time) == "1" else -1
            moments.append(time)
    passed = [plan.count(end) - plan.count(begin) for begin, end, plan in plans_of(mic488, axis)]
    assert counted == sum(passed) != 0
    assert moments == [time for begin, end, plan in plans_of(mic488, axis) for time in pulses_one_by_one(plan, begin, end)]


def test_pins_have_the_levels_of_the_trace(mic488: Run, of_mic488: Changes) -> None:
    names: set[str] = set()
    for record in mic488.trace.edges():
        changes = of_mic488[f"m.{record.subject.replace('.', '_')}"]
        if not record.subject.startswith("AIN") and record.time:
            assert value_at(changes, record.time - 1) != value_at(changes, record.time)
        assert float(str(value_at(changes, record.time))) == record.value
        names.add(record.subject)
    assert {"IN1", "IN7", "OUT3", "M4_EN", "AIN1"} <= names


def test_positions_are_those_of_the_profiles_in_units(mic488: Run, of_mic488: Changes) -> None:
    positions, plans = of_mic488["m.M1_position_mm"], plans_of(mic488, "1")
    for time, value in positions:
        profile = [plan for begin, _, plan in plans if begin <= time][-1]
        assert value == pytest.approx((profile.position(time) + mic488.origin_p("1", time)) / 100.0, abs=1e-6)
    assert len({value for _, value in positions}) > 30


def test_texts_are_shown_and_go_away(mic488: Run, of_mic488: Changes) -> None:
    frames = [record.value for record in mic488.trace.frames() if record.subject == "tcp-1/in"]
    shown = [str(value).replace("\\x20", " ") for _, value in of_mic488["bus.tcp-1_in"] if value]
    assert set(shown) == {frame.hex(" ") for frame in frames if isinstance(frame, bytes)}
    assert of_mic488["bus.tcp-1_in"][-1][1] == ""
    assert [str(v).replace("\\x20", " ") for _, v in of_mic488["m.events"] if v][-1] == "limit M3 stopped by KR"


def test_step_pulses_of_an_indexer_go_low_once_for_every_microstep(m1486: Run) -> None:
    changes = read(dumped(recording_of(m1486)))
    falls = [time for time, level in changes["i.STEP"][1:] if level == "0"]
    directions = changes["i.DIRECTION"]
    at, reached = 0, [0]
    for time in falls:
        plan = next(plan for begin, end, plan in plans_of(m1486, "1") if begin < time <= end)
        assert isinstance(plan, StepTrain)
        way = plan.count(time) - plan.count(time - 1)
        assert way in {8, -8, 64, -64}
        assert (value_at(directions, time) == "1") is (way < 0)
        at += way
        reached.append(at)
    assert max(reached) == 64_000
    assert at == 0
    assert len(falls) < 2 * 64_000 / 8


def test_phase_currents_follow_the_waveform_of_the_angle(m1486_with_converters: Run) -> None:
    run = m1486_with_converters
    changes = read(dumped(recording_of(run)))
    characteristics = [(0, 1.0)] + [(r.time, r.value) for r in run.trace.edges() if r.subject == "N"]
    moments = {time for phase in ("i.PHASE1", "i.PHASE2") for time, _ in changes[phase]} | set(
        range(0, run.until, run.until // 97)
    )
    plans = plans_of(run, "1")
    assert len(moments) > 3000
    for now in sorted(moments)[::17]:
        plan = next((plan for begin, end, plan in reversed(plans) if begin <= now), None)
        theta = plan.count(now) if isinstance(plan, StepTrain) else 0
        characteristic = [value for time, value in characteristics if time <= now][-1]
        both = tuple(signed(value_at(changes[name], now)) for name in ("i.PHASE1", "i.PHASE2"))
        assert both == currents(int(characteristic), theta % PERIOD)  # type: ignore[call-overload]


def signed(value: object) -> int:
    assert isinstance(value, int)
    return value - 256 if value > 127 else value


@pytest.mark.parametrize("name", ["mic488", "m1486", "m1486_with_converters"])
def test_the_size_of_the_windows_does_not_show(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    tracks = recording_of(request.getfixturevalue(name))
    whole = dumped(tracks)
    monkeypatch.setattr(vcd, "_WINDOW_CHANGES", 1000)
    assert dumped(tracks) == whole


@pytest.mark.parametrize("name", ["mic488", "m1486", "m1486_with_converters"])
def test_a_window_of_time_shows_what_the_whole_dump_does(name: str, request: pytest.FixtureRequest) -> None:
    run: Run = request.getfixturevalue(name)
    begin, until = run.until // 3 + 12_345, run.until * 2 // 3
    whole, part = read(dumped(recording_of(run))), read(dumped(recording_of(run, begin, until)))
    for variable, changes in part.items():
        if (
            "position" in variable
            or "since_power_on" in variable
            or "velocity" in variable
            or variable.endswith(("_in", "_out", "events", "inputs"))
        ):
            continue
        expected = whole[variable]
        assert changes[0] == (begin, value_at(expected, begin)), variable
        assert changes[1:] == [change for change in expected if begin < change[0] <= until], variable


def test_pulses_closer_than_their_width_are_kept_apart() -> None:
    trace = Trace()
    trace.add(TraceRecord(0, "a", "plan", "1", plan_position(MotionState(0, 0, 0.0, 0.0), 1000, 1e9, 1e9, 500_000.0)))
    levels = read(dumped(sort_out(trace, {}, until=SECOND)))["a.M1_STEP"][1:]
    assert [level for _, level in levels] == ["1", "0"] * 1000
    assert all(now > before for (before, _), (now, _) in pairwise(levels))


def test_names_and_texts_that_would_break_the_file() -> None:
    trace = Trace()
    trace.add(TraceRecord(1, "a machine.x", "edge", "IN 1", 1.0))
    trace.add(TraceRecord(2, "a machine.x", "event", "odd", "zażółć $end\n#5 \\"))
    changes = read(dumped(sort_out(trace, {}, until=SECOND)))
    assert changes["a_machine_x.IN_1"] == [(0, "0"), (1, "1")]
    text = str(changes["a_machine_x.events"][1][1])
    assert text.encode("latin-1").decode("unicode_escape").encode("latin-1").decode() == "odd zażółć $end\n#5 \\"


@given(
    st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 4)), max_size=60).map(sorted),
    st.lists(st.binary(min_size=1, max_size=60).filter(lambda b: b"\0" not in b and b"\n" not in b), min_size=5, max_size=5),
)
def test_text_made_of_many_changes_is_that_made_of_each(changes: list[tuple[int, int]], tokens: list[bytes]) -> None:
    lines = [token + b"\n" for token in tokens]
    expected, last = b"", None
    for time, token in changes:
        if time != last:
            expected += b"#%d\n" % time
        expected += lines[token]
        last = time
    if not changes:
        return
    times = np.array([time for time, _ in changes], dtype=np.int64)
    chosen = np.array([token for _, token in changes], dtype=np.intp)
    assert b"".join(changes_text(times, chosen, lines)) == expected


def test_without_texts_there_are_no_signals_of_type_string() -> None:
    trace = Trace()
    trace.add(TraceRecord(1, "a", "edge", "OUT1", 1.0))
    trace.add(TraceRecord(2, "a", "event", "note", "a text"))
    trace.add(TraceRecord(3, "a", "statement", "program", 7))
    tracks = sort_out(trace, {})
    file = io.BytesIO()
    vcd.write_vcd(tracks, file, silent, texts=False)
    assert b"$var string" in dumped(tracks)
    assert b"$var string" not in file.getvalue()
    assert b"$var integer" in file.getvalue()
