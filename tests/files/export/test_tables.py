from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from pyarrow import parquet
from world_rig import Run

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import tables, write_trace
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

PERIOD = 7 * MILLISECOND


@pytest.fixture(scope="module")
def rows(mic488: Run, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    write_trace(mic488.trace, path, views=mic488.views, until=mic488.until, period=PERIOD)
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_there_is_a_row_for_every_period_and_a_column_for_everything(rows: list[dict[str, str]], mic488: Run) -> None:
    assert [float(row["time_s"]) for row in rows] == [n * PERIOD / SECOND for n in range(mic488.until // PERIOD + 1)]
    pins = {f"m.{record.subject}" for record in mic488.trace.edges()}
    motion = {f"m.M{n}_{what}" for n in range(1, 5) for what in ("position_mm", "velocity_mm_s", "since_power_on_mm")}
    assert set(rows[0]) == pins | motion | {"time_s"}


@pytest.mark.parametrize("axis", "1234")
def test_samples_are_the_profiles_exactly(axis: str, rows: list[dict[str, str]], mic488: Run) -> None:
    plans = [record for record in mic488.trace.plans() if record.subject == axis]
    speeds = set()
    for n, row in enumerate(rows):
        profile: object = [record.value for record in plans if record.time <= n * PERIOD][-1]
        counted: float = profile.position(n * PERIOD)  # type: ignore[attr-defined]
        assert float(row[f"m.M{axis}_since_power_on_mm"]) == counted / 100.0
        position = (counted + mic488.origin_p(axis, n * PERIOD)) / 100.0
        assert float(row[f"m.M{axis}_position_mm"]) == pytest.approx(position, abs=1e-9)
        assert float(row[f"m.M{axis}_velocity_mm_s"]) == profile.velocity(n * PERIOD) / 100.0  # type: ignore[attr-defined]
        speeds.add(row[f"m.M{axis}_velocity_mm_s"])
    assert len(speeds) > 4


def test_samples_have_the_levels_of_their_moment(rows: list[dict[str, str]], mic488: Run) -> None:
    for pin in ("IN20", "OUT2", "AIN1"):
        edges = [record for record in mic488.trace.edges() if record.subject == pin]
        for n, row in enumerate(rows):
            before = [record.value for record in edges if record.time <= n * PERIOD]
            assert row[f"m.{pin}"] == ("" if pin == "AIN1" else "0") if not before else float(row[f"m.{pin}"]) == before[-1]
        assert len({row[f"m.{pin}"] for row in rows}) > 1


def test_parquet_has_the_same_columns(rows: list[dict[str, str]], mic488: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    write_trace(mic488.trace, path, views=mic488.views, until=mic488.until, period=PERIOD)
    table = parquet.read_table(path)
    assert table.column_names == list(rows[0])
    for name in table.column_names:
        values = table.column(name).to_pylist()
        assert values == [None if row[name] == "" else float(row[name]) for row in rows]


def test_parts_of_a_table_make_up_the_whole(mic488: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    options = {"views": mic488.views, "period": 10 * MILLISECOND}
    write_trace(mic488.trace, tmp_path / "one.csv", **options)  # type: ignore[arg-type]
    monkeypatch.setattr(tables, "_ROWS", 77)
    write_trace(mic488.trace, tmp_path / "other.csv", **options)  # type: ignore[arg-type]
    assert (tmp_path / "one.csv").read_text() == (tmp_path / "other.csv").read_text()


def test_a_moment_is_a_table_of_one_row(tmp_path: Path) -> None:
    trace = Trace()
    trace.add(TraceRecord(5, "a", "edge", "AIN1", 2.5))
    write_trace(trace, tmp_path / "x.csv", begin=5, until=5)
    assert (tmp_path / "x.csv").read_text() == "time_s,a.AIN1\n5e-09,2.5\n"
    assert math.isclose(5e-09, 5 / SECOND)
