"""``[history]`` of a served world, moved by a foreign Modbus master, and what ``steptwin history`` shows of it."""

from __future__ import annotations

import csv
import json
import os
import sqlite3
from pathlib import Path

import pytest
from gateway_rig import served
from minimalmodbus import Instrument
from tests.conftest import run_command, until

CELL = """
[world]
name = "cell"
[[line]]
name = "bus"
pty = "line"
[[mic488]]
name = "table"
line = "bus"
unit = 1
[history]
database = "sqlite:///h.db"
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the history of two runs: in the first one a master switches M1 on, in the second one none does."""
    folder = tmp_path_factory.mktemp("cell")
    for is_moved in (True, False):
        with served(CELL, folder, "--speed", "1") as points:
            assert points["history"]["url"] == "sqlite:///h.db"
            if is_moved:
                master = Instrument(str(folder / points["pty"]["path"]), 1)
                line = master.serial
                assert line is not None
                line.baudrate = 38400
                master.write_bit(2000, 1)  # M1_EN
                until(lambda: _levels(folder) == [0.0, 1.0], "the edge has been kept")
                line.close()
    return folder


def _levels(folder: Path) -> list[float]:
    file = sqlite3.connect(folder / "h.db")
    try:
        wanted = "SELECT value FROM sample JOIN point ON point.id = point_id WHERE name = 'table.pins.M1_EN' ORDER BY sample.id"
        return [value for (value,) in file.execute(wanted)]
    finally:
        file.close()


def shown(folder: Path, *arguments: str) -> tuple[int, str]:
    found = run_command(("history", str(folder / "h.db"), *arguments), dict(os.environ))
    return found.returncode, found.stdout + found.stderr


def test_overview(kept: Path) -> None:
    code, text = shown(kept)
    assert code == 0
    lines = text.splitlines()
    assert lines[0].startswith("sqlite:///")
    assert [line.split()[:2] for line in lines[1:3]] == [["run", "1"], ["run", "2"]]
    assert "virtual s cell" in lines[1]
    assert "goes on" not in text
    assert "  table.M1: enabled, encoder, position [imp], status, status_code, status_level" in lines
    listed = json.loads(shown(kept, "--json")[1])
    assert [run["over"] for run in listed["runs"]] == [True, True]
    assert {"subject": "cell", "name": "table.M1.position", "unit": "imp", "type": "number"} in listed["points"]


def test_writes_and_the_traffic_of_the_line(kept: Path) -> None:
    code, text = shown(kept, "--writes", "--run", "1")
    assert code == 0
    assert [line.split(" s  ")[1] for line in text.splitlines()] == ["table      pty: write M1_EN = ON"]
    assert json.loads(shown(kept, "--events", "--run", "1", "--json")[1])[-1]["kind"] == "write"
    assert shown(kept, "--writes", "--run", "2") == (0, "")
    rows = json.loads(shown(kept, "bus.requests", "--run", "1", "--json")[1])
    assert rows[-1]["value"] == 1.0


def test_values(kept: Path) -> None:
    code, text = shown(kept, "table.pins.M1_EN", "--run", "1")
    assert code == 0
    first, second = text.splitlines()
    assert first.endswith("run 1      0.000000 s  table.pins.M1_EN  0")
    assert second.endswith(" s  table.pins.M1_EN  1")
    rows = json.loads(shown(kept, "table.pins.M1_EN", "table.status", "--run", "1", "--json")[1])
    assert [(row["point"], row["value"]) for row in rows] == [
        ("table.pins.M1_EN", 0.0),
        ("table.status", "ok"),
        ("table.pins.M1_EN", 1.0),
    ]
    assert all(row["time"].endswith("Z") for row in rows)


def test_files(kept: Path, tmp_path: Path) -> None:
    from pyarrow import parquet

    code, text = shown(kept, "table.pins.M1_*", "--run", "1", "--output", str(tmp_path / "x.csv"))
    assert (code, text) == (0, f"{tmp_path / 'x.csv'}: 2 values of 1 points\n")
    with (tmp_path / "x.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["run"], row["point"], row["value"], row["unit"]) for row in rows] == [
        ("1", "table.pins.M1_EN", "0.0", ""),
        ("1", "table.pins.M1_EN", "1.0", ""),
    ]
    assert shown(kept, "table.pins.M1_EN", "table.status", "--run", "1", "-o", str(tmp_path / "x.parquet"))[0] == 0
    table = parquet.read_table(tmp_path / "x.parquet").to_pylist()
    assert [(row["point"], row["value"], row["text"]) for row in table] == [
        ("table.pins.M1_EN", 0.0, None),
        ("table.pins.M1_EN", 1.0, None),
        ("table.status", None, "ok"),
    ]
    assert [row["time"].isoformat(timespec="seconds")[:19] + "Z" for row in table] == [row["time"][:19] + "Z" for row in rows] + [
        rows[0]["time"][:19] + "Z"
    ]
    for name in ("x.svg", "x.png"):
        assert shown(kept, "table.M1.position", "table.pins.M1_EN", "-o", str(tmp_path / name))[0] == 0
    assert "table.M1.position" in (tmp_path / "x.svg").read_text()
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


def test_comparison_of_runs(kept: Path, tmp_path: Path) -> None:
    """The runs are of different length; their shared part differs from the edge on."""
    code, text = shown(kept, "table.M1.position", "table.M2.*", "--run", "1", "--with", "2")
    assert (code, text.splitlines()[-1]) == (0, "7 points are alike")
    code, text = shown(kept, "table.pins.M1_EN", "--run", "2", "--with", "2", "-o", str(tmp_path / "pair.svg"))
    assert code == 0
    assert (tmp_path / "pair.svg").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("table.M1.positon",), "no point 'table.M1.positon' has been kept (did you mean 'table.M1.position'?)"),
        (("x*",), "no point fits 'x*': 'steptwin history DATABASE' lists them"),
        (("--run", "7"), "run 7: there are 1 to 2, and -1 is the last one"),
        (("--from", "soon", "table.status"), "'soon': expected a time since the begin of the run, such as '10 s', or a date"),
        (("--from", "2 s", "--to", "1 s", "table.status"), "--to 1 s: this is before --from 2 s"),
        (("--from", "2026-01-01", "--to", "1 s"), "give two dates, or two times since the begin of a run"),
        (("--every", "0", "table.status"), "--every 0: must be more than 0"),
        (("table.status", "-o", "x.doc"), "--output x.doc: permitted are NAME.csv, NAME.parquet, NAME.png, NAME.svg"),
        (("-o", "x.csv"), "--output x.csv: name the points to write"),
        (("table.status", "-o", "x.svg"), "table.status has texts: a picture shows numbers"),
        (("table.M1.position", "-o", "/dev/null/x.svg"), "cannot write /dev/null/x.svg"),
    ],
)
def test_what_cannot_be_shown(arguments: tuple[str, ...], message: str, kept: Path) -> None:
    code, text = shown(kept, *arguments)
    assert code == 2
    assert message in text
    assert text.count("\n") == 1


def test_databases_that_are_none(tmp_path: Path) -> None:
    found = run_command(("history", str(tmp_path / "nothing.db")), dict(os.environ))
    assert (found.returncode, found.stderr) == (2, f"steptwin: {tmp_path / 'nothing.db'} does not exist\n")
    found = run_command(("history", "postgresql://127.0.0.1:9/plant"), dict(os.environ))
    assert found.returncode == 3
    assert found.stderr.startswith("steptwin: postgresql://127.0.0.1:9/plant: connection failed")
