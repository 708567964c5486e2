"""Coverage as commands report it: targets, paths, all kinds of files that are run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.coverage import CoverageReports
from steptwin.languages.run_m1486 import M1486Run
from steptwin.languages.run_m1486 import run as run_m1486
from steptwin.languages.run_wbc import WbcRun
from steptwin.languages.run_wbc import run as run_wbc
from steptwin.languages.run_world import WorldRun
from steptwin.languages.run_world import run as run_world
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.running import up

PROGRAM = "IF IN1 = 1\nOUT1 = ON\nENDIF\nEND\n"
"""Two of three statements are executed, and one of two ways of the branch."""
WORLD = '[world]\nname = "w"\n[[mic488]]\nname = "m"\nprogram = "parts/p.prg"\nstart = true\n'
ROW = ["3", "1", "2", "1", "60.0", "%", "2,", "1->2"]


@pytest.fixture
def controller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The description of a world, below the present directory, with a program below itself."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site" / "parts").mkdir(parents=True)
    (tmp_path / "site" / "parts" / "p.prg").write_text(PROGRAM)
    (tmp_path / "site" / "w.toml").write_text(WORLD)
    return Path("site/w.toml")


def rows(lines: list[str]) -> dict[str, list[str]]:
    """Of a table, by file."""
    shown = "\n".join(lines).rpartition("missing\n")[2].splitlines()
    return {line.split()[0]: line.split()[1:] for line in shown if line}


def test_a_world_names_its_files_from_the_present_directory(controller: Path) -> None:
    out: list[str] = []
    targets = ("-", "out/c.info", "out/c.html", "out/c.json")
    assert run_world(WorldRun(world=controller, limit=SECOND, coverage=targets), out.append, out.append)
    assert rows(out) == {"site/parts/p.prg": ROW}
    assert "SF:site/parts/p.prg\n" in Path("out/c.info").read_text()
    assert json.loads(Path("out/c.json").read_text())["summary"]["missed"] == 1
    assert "<title>Coverage of programs</title>" in Path("out/c.html").read_text()
    assert {f"wrote {Path(target)}" for target in targets[1:]} <= set("\n".join(out).splitlines())


def test_a_world_in_real_time(controller: Path, capfd: pytest.CaptureFixture[str]) -> None:
    stop = '[[script]]\nname = "end"\nat = "0.5 s"\nsteps = [{ stop = "done" }]\n'
    controller.write_text(WORLD + stop)
    assert up(UpOptions(world=controller, live=LiveOptions(speed="max"), is_closed=True, coverage=("-", "c.json")))
    shown = capfd.readouterr().out
    assert json.loads(Path("c.json").read_text())["summary"]["missed"] == 1
    assert re.search(r"site/parts/p\.prg +3 +1 +2 +1 +60\.0 %", shown)
    assert "wrote c.json" in shown


def test_a_program_of_a_mic488(controller: Path) -> None:
    out: list[str] = []
    assert run_wbc(WbcRun(program=Path("site/parts/p.prg"), coverage=("-",)), out.append, out.append)
    assert rows(out) == {"site/parts/p.prg": ROW}


def test_a_program_of_a_mic488_whose_statements_take_no_time(controller: Path) -> None:
    out: list[str] = []
    run_wbc(WbcRun(program=Path("site/parts/p.prg"), statement_time=0, coverage=("-",)), out.append, out.append)
    assert rows(out) == {"site/parts/p.prg": ROW}


@pytest.mark.parametrize("variant", ["A", "E1"])
def test_a_program_of_an_m1486_that_a_host_types_or_that_is_stored(variant: str, controller: Path) -> None:
    """In the memory of an E1 it is stored before power-on; an A has to be typed to."""
    Path("c.m1486").write_text("[\n:0\nL2\n+1\nE\nI1L1\nW1\n@1\nW1\n]\n")
    out: list[str] = []
    run_m1486(M1486Run(program=Path("c.m1486"), variant=variant, coverage=("-",)), out.append, out.append)
    assert rows(out) == {"c.m1486": ["7", "0", "4", "1", "90.9", "%", "6->9"]}


def test_without_targets_nothing_is_observed(controller: Path) -> None:
    out: list[str] = []
    reports = CoverageReports(())
    run_wbc(WbcRun(program=Path("site/parts/p.prg")), out.append, out.append)
    assert reports.write(out.append) == []
    assert list(reports.coverage) == []
    assert not any("statements" in line for line in out)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("cover.xml", r"coverage in cover\.xml: the name must end with \.info, \.html, \.json; - prints a table"),
        ("cover", r"must end with"),
        ("taken.json/c.json", r"cannot write taken\.json"),
    ],
)
def test_targets_that_cannot_be_written_are_refused_before_the_run(target: str, message: str, controller: Path) -> None:
    Path("taken.json").write_text("")
    with pytest.raises(Misuse, match=message):
        run_world(WorldRun(world=controller, coverage=(target,)), print, print)
