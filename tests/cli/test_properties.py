"""``steptwin run WORLD --property``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shell import Shell
from slides import slide

WORLD = (
    slide()
    + """
[[script]]
name = "move"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { write = { "table.M1_POS_ABS" = 100.0 } },
  { wait = "3 s" },
  { set = { "table.IN1" = 1 } },
]
"""
)


@pytest.fixture
def world(tmp_path: Path) -> str:
    path = tmp_path / "slide.toml"
    path.write_text(WORLD, encoding="utf-8")
    return str(path)


def test_a_property_that_holds_has_its_distance(shell: Shell, world: str) -> None:
    out = shell("run", world, "--for", "4s", "--property", "always x.position < 120")
    assert shell.code == 0
    assert "property holds, robustness 0.1: always x.position < 120\n" in out  # 20 of 200 mm


def test_a_violation_has_its_moment_and_exit_code_1(shell: Shell, world: str) -> None:
    out = shell("run", world, "--for", "4s", "--property", "never table.IN1")
    assert shell.code == 1
    (line,) = [one for one in out.splitlines() if one.startswith("property ")]
    assert line == "property violated at 3 s, robustness -1: never table.IN1: table.IN1 is not 0 at 3 s"


def test_one_of_several_properties_is_enough_for_exit_code_1(shell: Shell, world: str) -> None:
    out = shell("run", world, "--for", "4s", "--property", "eventually table.IN1", "--property", "always x.position < 90")
    assert shell.code == 1
    assert [one.split(",")[0].partition(" at ")[0] for one in out.splitlines() if one.startswith("property ")] == [
        "property holds",
        "property violated",
    ]


def test_json_has_verdicts_and_measures(shell: Shell, world: str) -> None:
    cycle = "time between table.M1.moving and not table.M1.moving <= 3 s"
    told = json.loads(shell("run", world, "--for", "4s", "--property", "never table.IN1", "--property", cycle, "--json"))
    assert shell.code == 1
    first, second = told["properties"]
    assert first == {
        "property": "never table.IN1",
        "holds": False,
        "robustness": -1.0,
        "time_s": 3.0,
        "why": "table.IN1 is not 0 at 3 s",
    }
    assert (second["property"], second["holds"]) == (cycle, True)
    assert second["robustness"] == pytest.approx(0.3, abs=0.001)  # 0.9 of 3 s are left
    assert told["measures"][f"{cycle} cycles"] == 1
    assert told["measures"][f"{cycle} max"] == pytest.approx(2.1, abs=0.001)


def test_json_of_a_run_that_keeps_its_property(shell: Shell, world: str) -> None:
    told = json.loads(shell("run", world, "--for", "4s", "--property", "always x.position < 120", "--json"))
    assert shell.code == 0
    (verdict,) = told["properties"]
    assert verdict["holds"] is True
    assert verdict["robustness"] == pytest.approx(0.1)
    assert verdict["why"] == ""


def test_a_ready_property(shell: Shell, world: str) -> None:
    out = shell("run", world, "--for", "4s", "--property", "stops-within 1 s after table.M1.moving")
    assert shell.code == 1
    assert "property violated" in out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("allways x.position < 3", "column 1: no word or signal 'allways' (did you mean 'always'?)"),
        ("always x.position <", "'always x.position <' ends too early: expected a signal or a number"),
        ("after table.IN1 within 3 x.position > 1", "column 26: found 'x.position', expected a unit of time"),
        ("always x.positon < 3", "no signal 'x.positon' (did you mean 'position'?)"),
        ("always x.position < 3 V", "3 V is compared with 'mm'"),
        ("no-colision", "no ready property 'no-colision' (did you mean 'no-collision'?)"),
        ("no-collision", "this world has no [[collision]]"),
        ("stops-within after table.IN1", "expected TIME after CONDITION"),
        ("", "ends too early"),
    ],
)
def test_a_wrong_text_is_one_line_that_names_the_place(shell: Shell, world: str, text: str, message: str) -> None:
    assert shell("run", world, "--for", "1s", "--property", text) == ""
    assert shell.code == 2
    assert shell.errors.startswith("steptwin: property '")
    assert message in shell.errors
    assert shell.errors.count("\n") == 1


def test_a_program_has_no_properties(shell: Shell) -> None:
    program = Path(__file__).parents[2] / "examples" / "mic488" / "press.prg"
    assert shell("run", str(program), "--property", "never IN1") == ""
    assert shell.code == 2
    assert f"--property is for worlds: {program} is a program" in shell.errors
