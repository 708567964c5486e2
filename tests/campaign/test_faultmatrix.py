"""Fault matrices of examples, checked by hand, and how effects are told."""

from __future__ import annotations

import csv
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.campaign.case import EXPECTATIONS, CaseResult, Verdict
from steptwin.campaign.effects import FaultEffect, RunFacts, judge
from steptwin.campaign.faultmatrix import FaultMatrix, fault_matrix
from steptwin.campaign.reading import load_campaign
from steptwin.campaign.report.matrixpage import write_matrix
from steptwin.cli.campaign import command
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.simulation.faults.active import FaultActs

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
SECOND = 1_000_000_000
NOMINAL = RunFacts(
    CaseResult(0, (), "", 10 * SECOND, {"made": 5.0}),
    "done",
    None,
    False,
    0,
    None,
    False,
    None,
    0,
    FaultActs(1, 3 * SECOND, 3 * SECOND),
)


def failing(name: str = "guard", at: int | None = 4 * SECOND) -> CaseResult:
    return CaseResult(0, (Verdict(name, False, -1.0, at, "x > 3"),), "", 10 * SECOND, {"made": 5.0})


@pytest.mark.parametrize(
    ("facts", "effect", "why", "detection", "after"),
    [
        (NOMINAL, FaultEffect.UNAFFECTED, "", "", None),
        (replace(NOMINAL, acts=None), FaultEffect.NEVER_ACTED, "", "", None),
        (replace(NOMINAL, result=replace(NOMINAL.result, end_ns=12 * SECOND)), FaultEffect.UNAFFECTED, "2 s later", "", None),
        (replace(NOMINAL, result=failing()), FaultEffect.UNSAFE, "guard: x > 3", "", None),
        (replace(NOMINAL, result=failing("size")), FaultEffect.WRONG_PART, "size: x > 3", "", None),
        (replace(NOMINAL, collisions=1), FaultEffect.UNSAFE, "a collision", "", None),
        (replace(NOMINAL, result=replace(NOMINAL.result, error="too many")), FaultEffect.UNSAFE, "an error: too many", "", None),
        (
            replace(NOMINAL, result=failing(EXPECTATIONS)),
            FaultEffect.WRONG_PART,
            "expected x > 3",
            "expectation of a script",
            1.0,
        ),
        (
            replace(NOMINAL, result=replace(NOMINAL.result, measures={"made": 4.0})),
            FaultEffect.WRONG_PART,
            "made is 4 instead of 5",
            "",
            None,
        ),
        (replace(NOMINAL, ended=None), FaultEffect.HANGS, "nothing noticed", "", None),
        (replace(NOMINAL, ended=None, is_moving=True), FaultEffect.HANGS, "an axis moves", "", None),
        (replace(NOMINAL, is_done=False), FaultEffect.HANGS, "not done; everything stands", "", None),
        (replace(NOMINAL, is_done=True, ended=None), FaultEffect.UNAFFECTED, "", "", None),
        (
            replace(NOMINAL, overdue=(5 * SECOND, "waited for x"), overdues=1),
            FaultEffect.SAFE_STOP,
            "waited for x",
            "wait of a script",
            2.0,
        ),
        (replace(NOMINAL, alarm_ns=7 * SECOND, has_alarm=True, ended=None), FaultEffect.SAFE_STOP, "an alarm", "alarm", 4.0),
        (replace(NOMINAL, alarm_ns=7 * SECOND, has_alarm=True, is_moving=True), FaultEffect.HANGS, "an axis moves", "alarm", 4.0),
    ],
)
def test_effects(facts: RunFacts, effect: FaultEffect, why: str, detection: str, after: float | None) -> None:
    found = judge(facts, NOMINAL, 3 * SECOND, product=("size",), made=("made",))
    assert found.effect is effect
    assert why in found.why
    assert bool(why) is bool(found.why)
    assert found.detection == detection
    assert (None if found.after_ns is None else found.after_ns / SECOND) == after


def matrix_of(example: str, folder: Path, text: str, jobs: int = 1) -> FaultMatrix:
    shutil.copytree(EXAMPLES / example, folder, dirs_exist_ok=True)
    (folder / "campaign.toml").write_text(f'[campaign]\nworld = "{example}.toml"\nruns = 1\n{text}', encoding="utf-8")
    return fault_matrix(load_campaign(folder / "campaign.toml"), folder / "out", jobs=jobs)


def effects(matrix: FaultMatrix, fault: str) -> list[str]:
    (row,) = (row for row in matrix.rows if row.possible.text == fault)
    return [cell.judgement.effect.value for cell in row.cells]


@pytest.fixture(scope="module")
def press(tmp_path_factory: pytest.TempPathFactory) -> tuple[FaultMatrix, Path]:
    folder = tmp_path_factory.mktemp("press")
    return matrix_of("press", folder, 'end = "12 s"\n[matrix]\nphases = 7\n'), folder / "out"


def test_the_press_by_hand(press: tuple[FaultMatrix, Path]) -> None:
    matrix, _ = press
    # A welded contact of the safety relay leaves the valve open when the curtain is interrupted: the ram comes to the hand.
    assert effects(matrix, "welded-contact element=safety")[:5] == ["unsafe"] * 5
    # A relay without its coil lets no stroke begin: the operator waits in vain.
    assert effects(matrix, "open-coil element=safety")[:5] == ["safe stop"] * 5
    # The window of half a second that never ends accepts the second hand too late, in the first test of the script.
    assert effects(matrix, "stuck-output element=window output=out level=1")[0] == "wrong part"
    # The program does not look at the relay.
    assert set(effects(matrix, "stuck machine=cell pin=IN4 value=0")) == {"unaffected", "never acted"}


def test_each_cell_replays(press: tuple[FaultMatrix, Path]) -> None:
    matrix, folder = press
    cells = [cell for row in matrix.rows for cell in row.cells]
    assert len({cell.session for cell in cells}) == len(cells) == len(matrix.rows) * 7
    for cell in cells[:: len(cells) // 10]:
        recording = recordings.load(folder / cell.session)
        assert recording.replay().trace.digest() == recording.digest
        assert [str(given.what.fault) for given in recording.inputs if hasattr(given.what, "fault")] == [cell.fault]


def test_table_page_and_json(press: tuple[FaultMatrix, Path]) -> None:
    matrix, folder = press
    page, table, plain = write_matrix(matrix, folder)
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(matrix.counts.values())
    assert all((folder / row["session"]).is_file() for row in rows)
    assert {row["effect"] for row in rows} == {effect.value for effect, count in matrix.counts.items() if count}
    text = page.read_text(encoding="utf-8")
    assert all(row["session"] in text for row in rows)
    assert "http" not in text
    assert '"left_out"' in plain.read_text(encoding="utf-8")
    assert matrix.coverage.summary.statements > 0


def test_a_property_in_time_tells_what_is_unsafe(tmp_path: Path) -> None:
    """The hand breaks the curtain in the stroke; a welded contact keeps the valve open for longer than the relay needs."""
    guarded = '[[property]]\nname = "guarded"\nnever = "(curtain.pressed and valve.out) for 20 ms"\n'
    matrix = matrix_of("press", tmp_path, f'end = "12 s"\n[matrix]\nphases = 2\n{guarded}')
    cells = [(row.possible.text, cell.judgement) for row in matrix.rows for cell in row.cells]
    found = [(fault, judged.effect) for fault, judged in cells if "guarded" in judged.why]
    assert {fault for fault, _ in found} == {
        "welded-contact element=safety",
        "stuck-input element=safety input=coil level=1",
        "stuck-output element=safety output=no level=1",
        "stuck-output element=valve output=out level=1",
    }
    assert {effect for _, effect in found} == {FaultEffect.UNSAFE}


def test_the_labeller_by_hand(tmp_path: Path) -> None:
    matrix = matrix_of("labeller", tmp_path, 'end = "70 s"\n[matrix]\nalarm = "cell.OUT3"\n', jobs=2)
    # No mark comes: the alarm after one and a half labels.
    assert set(effects(matrix, "stuck machine=cell pin=IN2 value=0")) == {"safe stop"}
    # Products that are not seen get no label.
    assert set(effects(matrix, "stuck machine=cell pin=IN1 value=0")) == {"wrong part"}
    # A product that never goes away: the program waits for the next one, and the belt takes the products past it.
    assert set(effects(matrix, "stuck machine=cell pin=IN1 value=1")) == {"wrong part"}
    # A mark that never ends: the web runs on, for the program has no time limit there, and no further label is counted.
    assert set(effects(matrix, "stuck machine=cell pin=IN2 value=1")) == {"wrong part"}
    # The belt stands: no tenth product within the minute of the script.
    assert set(effects(matrix, "belt-stop element=belt")) == {"safe stop"}
    # The web slips a little in one label; the next mark makes it good.
    assert set(effects(matrix, "lost-steps machine=cell axis=1 pulses=64")) == {"unaffected"}
    assert {one.fault.kind.name for one in matrix.left_out} >= {"power-cut", "wear", "busy"}


PRESSES = """M1 = ON
PABS M1 10
WAITPOS
OUT2 = ON
WAIT IN1 = ON
OUT2 = OFF
PABS M1 0
WAITPOS
OUT1 = ON
DELAY 60
"""
WAITS_FOR_EVER = """
[[mic488]]
name = "cell"
program = "presses.prg"
start = true
[[axis]]
name = "x"
drive = "cell.M1"
pitch = 4.0
[[cylinder]]
name = "punch"
stroke = 20
extend_time = "200 ms"
retract_time = "200 ms"
valve = "single"
[[wire]]
from = "cell.OUT2"
to = "punch.extend"
[[cylinder.switch]]
above = 19
to = "cell.IN1"
"""


def test_a_program_that_waits_for_ever_hangs(tmp_path: Path) -> None:
    """It has no time limit for the sensor of its punch, and nobody else looks."""
    (tmp_path / "presses.prg").write_text(PRESSES)
    (tmp_path / "world.toml").write_text(WAITS_FOR_EVER)
    text = '[campaign]\nworld = "world.toml"\nend = "5 s"\n[matrix]\ndone = "cell.OUT1"\nphases = 3\n'
    (tmp_path / "campaign.toml").write_text(text)
    matrix = fault_matrix(load_campaign(tmp_path / "campaign.toml"), tmp_path / "out")
    assert effects(matrix, "stuck machine=cell pin=IN1 value=0")[0] == "hangs"
    assert effects(matrix, "stuck machine=cell pin=IN1 value=1")[-1] == "unaffected"
    # The punch is back: its switch is off and stays so, which says nothing of what the machine would do.
    assert effects(matrix, "stuck machine=cell pin=IN1 value=0")[-1] == "never acted"
    (row,) = (row for row in matrix.rows if row.possible.text == "stuck machine=cell pin=IN1 value=0")
    assert row.cells[0].judgement.why == "not done; everything stands, and nothing noticed"


@pytest.mark.parametrize(
    ("end", "rules", "wrong"),
    [
        (
            "100 ms",
            'done = "cell.OUT1"\nalarm = "x.position < 1"',
            "alarm = 'x.position < 1' is true at its end; done = .* is false at its end",
        ),
        ("5 s", '[[property]]\nname = "short"\nalways = "not cell.OUT2"', "short: .*"),
    ],
)
def test_what_is_wrong_without_a_fault_is_the_result(tmp_path: Path, end: str, rules: str, wrong: str) -> None:
    """No cell could tell what its fault did: the exit code is 1, the page says why, and the run can be replayed."""
    (tmp_path / "presses.prg").write_text(PRESSES)
    (tmp_path / "world.toml").write_text(WAITS_FOR_EVER)
    (tmp_path / "campaign.toml").write_text(f'[campaign]\nworld = "world.toml"\nend = "{end}"\n[matrix]\n{rules}\n')
    ran = CliRunner().invoke(command, ["faults", str(tmp_path / "campaign.toml"), "--jobs", "1"])
    assert ran.exit_code == 1, ran.output
    assert re.search(rf"the run without a fault does not hold, so no fault was tried: {wrong}\n", ran.output), ran.output
    page = (tmp_path / "campaign.faults" / "faults.html").read_text(encoding="utf-8")
    assert "does not hold" in page
    assert 'href="cells/without.json"' in page
    recording = recordings.load(tmp_path / "campaign.faults" / "cells" / "without.json")
    assert recording.replay().trace.digest() == recording.digest


def test_a_run_without_a_fault_that_is_refused_is_an_error(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "press", tmp_path, dirs_exist_ok=True)
    text = '[campaign]\nworld = "press.toml"\nruns = 1\nend = "1 s"\n[matrix]\nalarm = "cell.OUT77"\n'
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    with pytest.raises(Misuse, match="OUT77"):
        fault_matrix(load_campaign(tmp_path / "campaign.toml"), tmp_path / "out")


def test_what_comes_later_is_no_wrong_part() -> None:
    nominal = replace(NOMINAL, result=replace(NOMINAL.result, measures={"made": 5.0, "down": 1.0, "cycle max": 2.0}))
    late = replace(nominal, result=replace(nominal.result, measures={"made": 5.0, "down": 1.5, "cycle max": 2.5}))
    assert judge(late, nominal, 0, made=("made",)).effect is FaultEffect.UNAFFECTED
