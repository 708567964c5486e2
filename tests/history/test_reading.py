"""What is read back is what was: positions at any moment, levels, texts, runs; and what a user asks for wrongly."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from history_rig import BEGAN_US, RecordedWorld
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.history.reading import HistoryDatabase
from steptwin.simulation.script.steps import Note, Set
from steptwin.subject import commands as command
from steptwin.subject.commands import Enable, Move

CELL = """
[world]
name = "cell"
[[mic488]]
name = "table"
[[m1486]]
name = "drum"
"""
BEGAN = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=BEGAN_US)


@pytest.fixture
def kept(database: str) -> str:
    """Ten seconds: a motion of M1 from 1 s on, an edge at 2.5 s, a note at 3 s; then back to 1 s, and two more seconds."""
    made = RecordedWorld(CELL)
    subject = made.subject.inner
    subject.do(Enable("table", 1, on=True))
    made.run(1.0)
    subject.do(command.TakeSnapshot("one"))
    subject.do(Move("table", 1, to=2000.0))
    made.run(1.5)
    subject.do(Set((("table", "IN4", 1.0),)))
    made.run(0.5)
    subject.do(Note("halfway"))
    made.run(7.0)
    made.late_us = 9_000_000  # the wall clock goes on while the time of the world goes back
    subject.do(command.RestoreSnapshot("one"))
    made.run(2.0)
    made.end()
    made.written(database)
    return database


def at(seconds: float) -> datetime:
    return BEGAN + timedelta(seconds=seconds)


@settings(max_examples=20)
@given(
    moves=st.lists(st.tuples(st.integers(1, 40), st.integers(-3000, 3000)), min_size=1, max_size=5),
    step_ns=st.integers(1, 10**9),
)
def test_positions_at_any_moment(moves: list[tuple[int, int]], step_ns: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Against the positions that the world itself had, read at the same moments."""
    made = RecordedWorld(CELL)
    subject = made.subject.inner
    subject.do(Enable("table", 1, on=True))
    seen: list[float] = []
    step_s = max(0.01, step_ns / 1e9)
    for tenths, target in moves:
        subject.do(Move("table", 1, to=float(target)))
        for _ in range(tenths):
            made.world.run(for_=step_s)
            made.look()
            seen.append(made.world.read("table.M1.position"))
    made.end()
    url = f"sqlite:///{tmp_path_factory.mktemp('h') / 'h.db'}"
    made.written(url)
    with HistoryDatabase(url) as past:
        found = past.series("table.M1.position", every_s=round(step_s * 1e9) / 1e9)
    assert found.values[1 : len(seen)].tolist() == seen[: len(found) - 1][: len(seen) - 1]
    assert len(found) >= len(seen)


def test_runs(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        first, second = past.runs()
        assert (first.subject, first.is_virtual, first.began_ns, first.is_over) == ("cell", True, 0, True)
        assert (first.began, second.began) == (BEGAN, at(10.0))
        assert (second.began_ns, second.ended_ns, second.is_over) == (10**9, 3 * 10**9, True)
        assert past.run(-1) == second
        assert past.run(first.number) == first
        assert past.runs("hall") == []
        with pytest.raises(Misuse, match="run 99: there are 1 to 2, and -1 is the last one"):
            past.run(99)
        with pytest.raises(Misuse, match="run -3"):
            past.run(-3)


def test_positions_and_velocities_of_a_motion(kept: str) -> None:
    """1000 pulses/s after a second with 1000 pulses/s², 2000 pulses: 3 s."""
    with HistoryDatabase(kept) as past:
        run = past.runs()[0]
        found = past.series("table.M1.position", 0.0, 5.0, every_s=0.5, run=run.number)
        assert found.seconds.tolist() == pytest.approx([place / 2 for place in range(11)])
        assert found.values == pytest.approx([0, 0, 0, 125, 500, 1000, 1500, 1875, 2000, 2000, 2000], abs=1)
        assert found.unit == "imp"
        assert set(found.runs.tolist()) == {run.number}
        speeds = past.series("table.M1.velocity", 0.0, 5.0, every_s=0.5, run=run.number)
        assert speeds.values == pytest.approx([0, 0, 0, 500, 1000, 1000, 1000, 500, 0, 0, 0])
        assert speeds.unit == "imp/s"
        ends = past.series("table.M1.position", run=run.number)
        assert ends.seconds.tolist() == pytest.approx([0.0, 1.0, 1.0, 2.0, 3.0, 4.0, 10.0])


def test_an_interval_of_the_wall_clock(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        found = past.series("table.M1.position", at(2.0), at(3.0), every_s=0.25)
        assert found.at.astype("int64").tolist() == [BEGAN_US + round(1e6 * (2 + place / 4)) for place in range(5)]
        assert found.values == pytest.approx([500, 750, 1000, 1250, 1500], abs=1)
        local = (at(2.0).astimezone().replace(tzinfo=None), at(3.0).astimezone().replace(tzinfo=None))
        assert past.series("table.M1.position", *local, every_s=0.25).values.tolist() == found.values.tolist()
        assert len(past.series("table.M1.position", at(50.0), at(60.0), every_s=1.0)) == 0


def test_levels_and_texts(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        level = past.series("table.pins.IN4", run=1)
        assert level.values.tolist() == [0.0, 1.0]
        assert level.seconds.tolist() == pytest.approx([0.0, 2.5])
        assert not level.is_text
        sampled = past.series("table.pins.IN4", 2.0, 3.0, every_s=0.25, run=1)
        assert sampled.values.tolist() == [0.0, 0.0, 1.0, 1.0, 1.0]
        text = past.series("table.M1.status", run=1)
        assert text.is_text
        assert text.values.tolist()[-1] == "position reached"
        inside = past.series("table.M1.status", at(2.0), at(2.1))
        assert inside.values.tolist() == ["moving to position"]  # what held there
        assert past.series("table.pins.IN4", run=2).values.tolist() == [0.0]


def test_points_by_pattern(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        assert [point.name for point in past.points("*.position")] == [
            "drum.M1.position",
            *(f"table.M{axis}.position" for axis in (1, 2, 3, 4)),
        ]
        assert {(point.subject, point.unit, point.type) for point in past.points("table.M?.position")} == {
            ("cell", "imp", "number")
        }


def test_events(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        (note,) = [event for event in past.events(run=1) if event.kind == "note"]
        assert (note.at, note.time, note.text, note.content) == (at(3.0), 3 * 10**9, "note: halfway", {"note": "halfway"})
        assert [event.kind for event in past.events(at(2.9), at(3.1))] == ["note"]
        assert past.events(machine="drum") == []
        assert len(past.events(most=1)) == 1
        assert past.events(most=1)[0] == past.events()[-1]


def test_counts(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        counts = past.counts()
        assert list(counts) == ["samples", "motions", "events", "summaries"]
        assert counts["motions"] == 2 * 5 + 1


def test_what_is_not_there(kept: str, tmp_path: Path) -> None:
    with HistoryDatabase(kept) as past:
        with pytest.raises(Misuse, match=r"no point 'table\.M1\.positon' has been kept \(did you mean 'table\.M1\.position'\?\)"):
            past.series("table.M1.positon")
        with pytest.raises(Misuse, match="two dates, or seconds since the begin of the run"):
            past.series("table.M1.position", 1.0, 2.0)
        with pytest.raises(Misuse, match=r"has more than 2000000 values here"):
            past.series("table.M1.position", run=1, every_s=1e-6)
        with pytest.raises(Misuse, match=r"has more than 2000000 values here"):
            past.series("table.pins.IN4", run=1, every_s=1e-6)
    with pytest.raises(Misuse, match=r"nothing\.db does not exist"):
        HistoryDatabase("sqlite:///nothing.db", tmp_path)
    (tmp_path / "text.db").write_text("no database, but longer than nothing" * 10)
    with pytest.raises(OSError, match="file is not a database"):
        HistoryDatabase("sqlite:///text.db", tmp_path)


def test_values_are_arrays(kept: str) -> None:
    with HistoryDatabase(kept) as past:
        found = past.series("table.M1.position")
        assert (found.at.dtype, found.seconds.dtype, found.values.dtype) == ("datetime64[us]", np.float64, np.float64)
        assert len(found.at) == len(found.seconds) == len(found.runs) == len(found)
