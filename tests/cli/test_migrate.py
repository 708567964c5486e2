"""``steptwin migrate``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from m1486_rig import Bench

from steptwin.cli import main

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """``steptwin migrate`` with these arguments: exit code, standard output, standard error."""

    def run_migrate(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", "migrate", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_migrate


CHIP = "[\n@70\nI1H20\nS200\nV800\nA6000\nW250\nF6400\nR\nJ70\n@20\nT1\n]\n"


def test_labels_and_numbers_of_another_type(run: Run, tmp_path: Path) -> None:
    """At 24 MHz speeds are twice, accelerations four times, times half as much (manual, chapter X)."""
    (tmp_path / "a.m1486").write_text(CHIP)
    code, out, err = run(tmp_path / "a.m1486", "--from", "B", "--to", "A2x", "-o", tmp_path / "b.m1486")
    assert (code, err) == (0, "")
    assert "labels 1 to 15, not to 80" in out
    assert out.endswith(f"8 changes, written to {tmp_path / 'b.m1486'}; errors left: 0\n")
    changed = (tmp_path / "b.m1486").read_text()
    assert changed == "[\n@2\nI1H1\nS100\nV400\nA1500\nW500\nF6400\nR\nJ2\n@1\nT1\n]\n"


def test_a_converted_program_moves_as_before(run: Run, tmp_path: Path) -> None:
    """Compared on two chips: the pulses and their times, but for the time of commands."""
    (tmp_path / "a.m1486").write_text("[\nS200\nV800\nA6000\nF6400\nR\n]\n")
    assert run(tmp_path / "a.m1486", "--to", "A2x", "-o", tmp_path / "b.m1486")[0] == 0
    moves = []
    for name, kind in (("a", "A"), ("b", "A2x")):
        bench = Bench(kind)
        bench.raw((tmp_path / f"{name}.m1486").read_text().replace("\n", "\r").encode())
        bench.finish()
        (begin, train) = next((begin, train) for begin, train in bench.trains if train.profile.segments)
        moves.append(((train.profile.end or 0) - begin, bench.true))
    assert moves[0] == moves[1]
    assert moves[0][1] == 6400


def test_numbers_out_of_range_stay_and_are_errors(run: Run, tmp_path: Path) -> None:
    """At 12 MHz V would have to be 32000, P beyond 7000 is no profile, half of W1 is not a time. P9000 is none at any clock."""
    (tmp_path / "a.m1486").write_text("[\nW500\nV16000\nA1000\nP5000\nR\nP9000\nR\n]\n")
    code, out, _ = run(tmp_path / "a.m1486", "--from", "A2x", "--to", "A")
    assert code == 1
    assert "V16000 would have to be V32000 on M1486A: permitted is 16 to 20 000 step/s" in out
    assert "P5000 would have to be P10000 on M1486A: permitted is 20 to 7000" in out
    assert "P9000 would" not in out
    assert "2 changes; errors left: 2\n" in out
    code, out, _ = run(tmp_path / "a.m1486", "--from", "A2x", "--to", "A", "--json")
    data = json.loads(out)
    assert data["text"] == "[\nW250\nV16000\nA4000\nP5000\nR\nP9000\nR\n]\n"
    assert [(left["code"], left["line"], left["column"]) for left in data["errors_left"]] == [("M140", 3, 2), ("M140", 5, 2)]
    (tmp_path / "b.m1486").write_text("[\nW1\nS20\n]\n")
    code, out, _ = run(tmp_path / "b.m1486", "--from", "A", "--to", "A2x")
    assert code == 1
    assert "S20 would have to be S10 on M1486A2x: permitted is 16 to 1950" in out


WBC = "CFGINT_IN1 = RIS\nPULSE(OUT1, 2)\n$I700 = 1\nEND\nHARDINT_IN1:\nRETURN\n"


def test_an_older_firmware(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.prg").write_text(WBC)
    code, out, err = run(tmp_path / "a.prg", "--to", "1.23", "--json")
    data = json.loads(out)
    assert (code, err) == (1, "")
    assert data["title"] == "from firmware 1.70 to 1.23"
    assert "500 user registers, not 2000" in data["differences"]
    assert data["text"] == WBC.replace("HARDINT", "INT")
    assert [(found["line"], found["code"]) for found in data["errors_left"]] == [(2, "W139"), (3, "W124")]


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("a.prg", ["--to", "B"], "firmware 'B' is not known"),
        ("a.m1486", ["--to", "1.40"], "no M1486 variant is called '1.40'"),
        ("a.cfg", ["--to", "1.40"], "permitted are WBC programs (.prg) and M1486 programs"),
    ],
)
def test_misuse(run: Run, tmp_path: Path, name: str, arguments: list[str], message: str) -> None:
    (tmp_path / name).write_text("END\n")
    code, out, err = run(tmp_path / name, *arguments)
    assert (code, out) == (2, "")
    assert message in err
