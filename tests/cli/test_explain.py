"""``steptwin explain``."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.cli import main

Run = Callable[..., tuple[int, str, str]]
EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAMS = sorted(path for path in EXAMPLES.rglob("*") if path.suffix in (".prg", ".m1486"))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """``steptwin explain`` with these arguments: exit code, standard output, standard error."""

    def run_explain(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", "explain", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_explain


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_all_examples_are_explained(run: Run, path: Path, tmp_path: Path) -> None:
    code, out, err = run(path)
    assert (code, err) == (0, "")
    assert "Flow\n" in out
    code, out, err = run(path, "--output", tmp_path / "flow.svg", "--json")
    assert (code, err) == (0, "")
    blocks = [block for program in json.loads(out)["programs"] for block in program["blocks"]]
    picture = ET.fromstring((tmp_path / "flow.svg").read_bytes())
    rectangles = picture.findall(".//{http://www.w3.org/2000/svg}g/{http://www.w3.org/2000/svg}rect")
    ends = sum(
        any(way["target"] is None for block in program["blocks"] for way in block["ways"])
        for program in json.loads(out)["programs"]
    )
    assert len(rectangles) == len(blocks) + ends


def test_a_picture_is_written_where_it_is_wanted(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "new" / "gate.svg"
    assert run(EXAMPLES / "mic488" / "gate.prg", "-o", path) == (0, f"{path}: 2 blocks\n", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["m1486/example1.m1486", "--firmware", "1.70"], "--firmware is not for M1486 programs"),
        (["mic488/gate.prg", "--variant", "B"], "--variant is not for WBC programs"),
        (["mic488/gate.csv"], "permitted are WBC programs (.prg) and M1486 programs"),
        (["mic488/gate.prg", "-o", "flow.png"], "cannot write flow.png: permitted is FILE.svg"),
        (["m1486/example1.m1486", "--variant", "Z"], "no M1486 variant is called 'Z'"),
    ],
)
def test_misuse(run: Run, arguments: list[str], message: str) -> None:
    code, out, err = run(EXAMPLES / arguments[0], *arguments[1:])
    assert (code, out) == (2, "")
    assert message in err


def test_a_program_with_errors_is_not_explained(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "wrong.prg"
    path.write_text("JUMP NOWHERE\n")
    code, out, err = run(path)
    assert (code, out) == (2, "")
    assert "steptwin check shows them" in err


def test_a_program_without_statements(run: Run, tmp_path: Path) -> None:
    for name in ("empty.prg", "empty.m1486"):
        (tmp_path / name).write_text("")
        code, out, err = run(tmp_path / name, "-o", tmp_path / "empty.svg", "--json")
        assert (code, err) == (0, ""), out
