"""`steptwin run FILE.m1486`: what it prints and refuses."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from steptwin.cli import app
from steptwin.errors import Misuse
from steptwin.files.export import read_trace

Run = Callable[..., Result]

PROGRAM = """[
@1
c1          ; clamp
f12800
r
t1
w500
b12800
r
u1
z3
u20
]
"""


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """``run(text, options...)`` runs a program file; what would be told as wrong use is raised."""

    def run_(text: str, *options: str) -> Result:
        (tmp_path / "p.m1486").write_text(text)
        result = CliRunner().invoke(app, ["run", str(tmp_path / "p.m1486"), *options])
        if isinstance(result.exception, Misuse):
            raise result.exception
        return result

    return run_


def test_what_happens_and_when(run: Run) -> None:
    result = run(PROGRAM, "--variant", "B", "--input", "B3=0@2s")
    assert result.exit_code == 0
    *lines, last = result.stdout.splitlines()
    assert lines == [
        "      0.000000 s  B1 low",
        "      0.002000 s  moves +12800 to 12800 in 0.328000 s",
        "      0.330000 s  stands at 12800",
        "      0.330000 s  B1 high",
        "      0.331000 s  waits 500 ms",
        "      0.832000 s  moves -12800 to 0 in 0.328000 s",
        "      1.160000 s  stands at 0",
        "      1.160000 s  U1 sends 00H",
        "      1.161000 s  waits until B3 is low",
        "      2.000000 s  input B3 low",
        "      2.000000 s  U20 sends 42H",
        "position 0, true position 0 (0 full steps)",
        "  sent 00 42",
    ]
    assert re.fullmatch(r"2\.001000 s of virtual time in \d+\.\d{3} s: [\d,]+ times faster than real time", last)


def test_a_run_that_is_ended_says_where_it_stands(run: Run) -> None:
    result = run("g+\nr\n", "--for", "500ms")
    assert result.stdout.splitlines()[1:-1] == [
        "position 27840, true position 27840 (435 full steps), endless at 1000.0 step/s",
        "  waits for the end of the endless move",
        "ended at the time limit; --for sets a longer one",
    ]
    result = run("c1\nz3\n", "--until", "idle")
    assert result.stdout.splitlines()[2:4] == [
        "position 0, true position 0 (0 full steps)",
        "  waits until B3 is low",
    ]


def test_json(run: Run) -> None:
    shown = json.loads(run(PROGRAM, "--variant", "E1", "--input", "B3=0@2s", "--json").stdout)
    wall_s, ratio = shown.pop("wall_s"), shown.pop("ratio")
    assert ratio == pytest.approx(2.001 / wall_s)
    events = shown.pop("events")
    assert events[0] == {"time_s": 0.0, "chip": "F", "code": "output", "text": "B1 low"}
    assert events[-1] == {"time_s": 2.0, "chip": "F", "code": "upload", "text": "U20 sends 45H"}
    assert Path(shown.pop("file")).name == "p.m1486"
    assert shown == {
        "version": 1,
        "language": "m1486",
        "variant": "E1",
        "ended": "idle",
        "went_wrong": False,
        "virtual_s": 2.001,
        "lines_not_taken": 0,
        "sent": "0045",
        "chips": [
            {
                "address": "F",
                "position": 0,
                "position_valid": True,
                "true_position": 0,
                "program": "has nothing to do",
            }
        ],
    }


def test_an_e_type_is_switched_on_with_a_file_and_typed_to_otherwise(run: Run) -> None:
    """Writing takes half a second a command."""
    assert "      0.000000 s  U20 sends 45H" in run("[\nu20\n]\n", "--variant", "E1").stdout
    assert "      0.500000 s  U20 sends 45H" in run("u20\n", "--variant", "E1").stdout
    assert "      1.500000 s  U20 sends 45H" in run("\\\n[\nu20\n]\n", "--variant", "E1").stdout


def test_several_chips(run: Run) -> None:
    result = run("x0\nz3\nc1\nx7\nz3\nu20\n", "--variant", "B", "--wire", "0.B1=7.B3", "--input", "0.B3=0@1s")
    *lines, _ = result.stdout.splitlines()
    assert lines == [
        "      0.000000 s  0  waits until B3 is low",
        "      0.000000 s  7  waits until B3 is low",
        "      1.000000 s  0  input B3 low",
        "      1.000000 s  0  B1 low",
        "      1.000000 s  7  U20 sends 42H",
        "chip 0: position 0, true position 0 (0 full steps)",
        "chip 7: position 0, true position 0 (0 full steps)",
        "  sent 42",
    ]


def test_an_error_is_shown_and_what_the_chip_makes_of_it(run: Run) -> None:
    result = run("c1\nj3\n")
    assert result.exit_code == 1
    assert "p.m1486:2:2: error M" in result.stderr
    assert "there is no label 3; the program stops" in result.stdout


def test_a_trace_can_be_read_back(run: Run, tmp_path: Path) -> None:
    assert run(PROGRAM, "--until", "idle", "--trace", str(tmp_path / "t.jsonl")).exit_code == 0
    saved = read_trace(tmp_path / "t.jsonl")
    assert [record.time // 1_000_000 for record in saved.trace.plans()] == [0, 2, 832]
    assert [(record.subject, record.value) for record in saved.trace.edges() if record.subject == "B1"] == [
        ("B1", 0.0),
        ("B1", 1.0),
    ]
    assert saved.until == 1_162_000_000
    view = saved.views["chipF", "1"]
    assert (view.unit, view.pulses_per_unit) == ("step", 64.0)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--variant", "D"], "no M1486 variant is called 'D'"),
        (["--until", "dark"], "--until dark: permitted is 'idle'"),
        (["--for", "soon"], "--for: 'soon' is not a time: expected a number with"),
        (["--for", "0"], "--for 0: must be more than 0"),
        (["--input", "B3"], "--input B3: expected PIN=VALUE@TIME"),
        (["--input", "B22=0@1s"], "no input pin 'B22'"),
        (["--input", "B3=2@1s"], "B3 = 2: a digital input is 0 or 1"),
        (["--input", "7.B3=0@1s"], "--input 7.B3: no chip 7; there are F"),
        (["--input", "B12=0@1s", "--interface", "two"], "--input B12: B12 is taken: the Two DACs interface has B8 to B17"),
        (
            ["--wire", "F.B1=F.B12", "--interface", "dual"],
            "--wire F.B1=F.B12: B12 is taken: the Dual DAC interface has B10 to B17",
        ),
        (["--trace", "t.xyz"], "t.xyz: formats are jsonl"),
        (["--firmware", "1.70"], "--firmware is not for M1486 programs"),
    ],
)
def test_wrong_use_is_said(run: Run, options: list[str], text: str) -> None:
    with pytest.raises(Misuse) as refusal:
        run("c1\n", *options)
    assert str(refusal.value).startswith(text)


def test_an_e_type_that_is_typed_to_because_of_an_error_says_how_slowly(run: Run) -> None:
    result = run("[\nf640\nv99999\n]\n", "--variant", "E1")
    assert result.exit_code == 1
    assert "executed as follows, with 1 error, typed at 0.5 s a command:" in result.stderr


def test_an_input_of_one_of_several_chips_is_named(run: Run) -> None:
    with pytest.raises(Misuse, match=r"--input B3: there are several chips; name one, such as 0\.B3"):
        run("x0\nx7\n", "--input", "B3=0@1s")


def test_files_of_other_kinds() -> None:
    result = CliRunner().invoke(app, ["run", "p.txt"])
    assert isinstance(result.exception, Misuse)
    assert str(result.exception).startswith("p.txt: unknown suffix: permitted are .prg, .wbc, .m1486, .toml, .json")
