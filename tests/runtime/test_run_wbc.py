"""`steptwin run` of WBC programs: what is said of a run, and when it ends."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.runtime.export import read_trace
from steptwin.runtime.programbanks import ProgramErrors
from steptwin.runtime.run_wbc import WbcRun, run
from steptwin.runtime.timedinputs import parse_inputs
from steptwin.runtime.wbc_bench import Travel, parse_travel

TOLD = re.compile(r" *(\d+\.\d{6}) s  (\S.*?)(?:  +(\d+)  \S.*)?$")
EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"


class Ran:
    """A run, and what was said."""

    def __init__(self, program: Path, **options: Any) -> None:
        said: list[str] = []
        self.warnings: list[str] = []
        self.went_right = run(WbcRun(program=program, **options), said.append, self.warnings.append)
        self.lines = "\n".join(said).splitlines()

    def told(self) -> list[tuple[str, ...]]:
        """Time, text and line of everything that happened."""
        rows = (TOLD.match(line) for line in self.lines)
        return [(row[1], row[2], row[3] or "") for row in rows if row]


@pytest.fixture
def play(tmp_path: Path) -> Callable[..., Ran]:
    def play_text(text: str, **options: Any) -> Ran:
        program = tmp_path / "program.prg"
        program.write_text(text)
        for name in ("positions", "config"):
            if name in options:
                path = tmp_path / f"program.{name}"
                path.write_text(options[name])
                options[name] = path
        return Ran(program, **options)

    return play_text


Play = Callable[..., Ran]


def test_everything_a_program_does_with_times_and_lines(play: Play) -> None:
    ran = play(
        "M1 = ON\n"
        "VmaxM1 = 100\n"
        "PABS M1 50\n"
        "WAITPOS\n"
        "OUT3 = ON\n"
        "// looks until the button is pressed\n"
        "WAIT IN1 = ON\n"
        "$R4 = PosM1 / 4\n"
        "$R4 = PosM1 / 4\n"
        "DELAY 0,25\n"
        "PULSE(OUT4, 0.5)\n"
        "BRAKE M1\n"
        "END\n",
        config="[Axis0]\nUnit=3\nGear=10\nAcc=1000\nDec=1000\nVel=10\n",
        inputs=parse_inputs("IN1=1@2s"),
    )
    assert ran.told() == [
        ("0.001000", "M1 on", "1"),
        ("0.003000", "M1 goes to 50 mm", "3"),
        ("0.004000", "waits", "4"),
        ("0.603000", "M1 at 50 mm, position reached", ""),
        ("0.604000", "OUT3 on", "5"),
        ("0.605000", "waits", "7"),
        ("2.000000", "IN1 on", ""),
        ("2.011000", "$R4 = 12.5", "8"),
        ("2.013000", "waits 0.25 s", "10"),
        ("2.265000", "the program ends", "13"),
        ("2.265000", "M1 off", "13"),
        ("2.265000", "OUT3 off", "13"),
    ]
    assert ran.went_right
    assert ran.lines[-4:-1] == ["the program has ended", "  M1 at 50 mm, off", "  on: IN1"]
    assert ran.lines[-1].startswith("2.265000 s of virtual time in 0.")


def test_an_interrupt_and_an_error(play: Play) -> None:
    ran = play(
        "CFGINT_IN2 = RIS\nM2 = ON\nVABS M2 100\nWAIT OUT1 = ON\nEND\nINT_IN2:\nSET x = 1 / $I5\n$R8 = x\nRETURN\n",
        config="[Axis1]\nGear=10\nAcc=100\n",
        inputs=parse_inputs("IN2=1@3s"),
    )
    assert ran.told() == [
        ("0.002000", "M2 on", "2"),
        ("0.003000", "M2 runs at 100 imp/s", "3"),
        ("0.004000", "waits", "4"),
        ("3.000000", "IN2 on", ""),
        ("3.010000", "interrupt of IN2", "6"),
        ("3.011000", "line 7: division by zero", "7"),
        ("3.011000", "M2 slows down from 100 imp/s", "7"),
        ("3.011000", "ERR on", "7"),
        ("4.011000", "M2 stands at 300.8 imp", ""),
    ]
    assert not ran.went_right
    assert "an error has stopped the program in line 7: division by zero" in ran.lines
    assert "  on: IN2, M2_EN, ERR" in ran.lines


@pytest.mark.parametrize(
    ("options", "ending", "seconds"),
    [
        ({}, "ended by the limit of time (--for takes a longer one) in line 2: WAIT IN1 = ON", 60.0),
        ({"limit": 1_500_000_000}, "ended by the limit of time (--for takes a longer one) in line 2: WAIT IN1 = ON", 1.5),
        ({"until_idle": True}, "it waits for ever in line 2: WAIT IN1 = ON", 0.002),
        ({"until_idle": True, "inputs": parse_inputs("IN1=1@9s")}, "the program has ended", 9.021),
    ],
)
def test_endings(play: Play, options: dict[str, Any], ending: str, seconds: float) -> None:
    ran = play("OUT1 = ON\nWAIT IN1 = ON\nDELAY 0\n", **options)
    assert ending in ran.lines
    assert ran.lines[-1].startswith(f"{seconds:.6f} s of virtual time")
    assert ran.went_right


def test_a_program_that_never_rests_ends_with_the_limit(play: Play) -> None:
    ran = play("MAIN:\nDELAY 0.5\n$I0 = $I0 + 1\nJUMP MAIN\n", until_idle=True, limit=3_000_000_000)
    assert [text for _, text, _ in ran.told() if text.startswith("$I0")] == [f"$I0 = {n}" for n in range(1, 6)]
    assert ran.lines[-1].startswith("3.000000 s")


HOMING = "M1 = ON\nHOME M1 -20\nWAITPOS\n$R0 = PosM1\nPABS M1 -100\nWAITPOS\n"
SWITCHES = "[Axis0]\nUnit=3\nGear=10\nAcc=1000\nDec=1000\nVel=50\nHomeMode=0\nLimitMode=0\nInKL=2\nInKR=3\n[IN2]\nLevel={level}\n"


@pytest.mark.parametrize("level", [0, 1])
def test_switches_stand_where_travel_says_or_are_assumed(play: Play, level: int) -> None:
    config = SWITCHES.format(level=level)
    assumed = play(HOMING, config=config, until_idle=True)
    assert assumed.lines[0] == "M1: KL on IN3 assumed at -5 mm (--travel says otherwise)"
    told = play(HOMING, config=config, until_idle=True, travels=[Travel(1, -12.0, None)])
    assert "assumed" not in "".join(told.lines)
    homed = [next(float(time) for time, text, _ in ran.told() if "position reached" in text) for ran in (assumed, told)]
    assert homed[0] == pytest.approx(5 / 20, abs=0.05)
    assert homed[1] == pytest.approx(12 / 20, abs=0.05)
    by_hand = play(HOMING, config=config, until_idle=True, inputs=parse_inputs(f"IN3={1 - level}@2s"))
    assert "assumed" not in by_hand.lines[0]


def test_travel_as_people_type_it() -> None:
    assert parse_travel("M1=-10..250, m4=..7,M2=-1.5..") == [
        Travel(1, -10.0, 250.0),
        Travel(4, None, 7.0),
        Travel(2, -1.5, None),
    ]
    for text in ("M5=1..2", "M1=5", "X=1..2", "M1=a..2", "M0=1..2"):
        with pytest.raises(Misuse, match=r"^--travel .*: expected Mn=LOW\.\.HIGH, such as M1=-10\.\.250"):
            parse_travel(text)
    with pytest.raises(Misuse, match=r"--travel M1=5\.\.2: 5 must be below 2"):
        parse_travel("M1=5..2")


def test_what_cannot_be_run(play: Play, tmp_path: Path) -> None:
    with pytest.raises(ProgramErrors):
        play("PABS M1\n")
    with pytest.raises(Misuse, match="no input pin 'OUT1'"):
        play("OUT1 = ON\n", inputs=parse_inputs("OUT1=1@1s"))
    with pytest.raises(Misuse, match=r"--travel M1: the configuration has no KR for this axis"):
        play("OUT1 = ON\n", travels=[Travel(1, None, 5.0)])
    with pytest.raises(Misuse, match="names positions: give the table with --positions 0=FILE"):
        play("M1 = ON\nMOVEPTP @top\n")
    with pytest.raises(Misuse, match="cannot read"):
        run(WbcRun(program=tmp_path / "none.prg"), print, print)


def test_warnings_go_where_they_do_not_disturb(play: Play) -> None:
    ran = play("PABS M1 5\nWAITPOS\n", until_idle=True)
    assert "warning W207" in ran.warnings[0]
    assert [text for _, text, _ in ran.told()] == ["position command ignored: M1 is not enabled", "the program ends"]


def test_json_says_the_same(play: Play) -> None:
    text = "M1 = ON\nPABS M1 50\nWAITPOS\n$I7 = 3\nWAIT IN1 = ON\n"
    ran = play(text, until_idle=True, as_json=True)
    data = json.loads("\n".join(ran.lines))
    assert {key: data[key] for key in ("version", "language", "firmware", "ended", "went_wrong")} == {
        "version": 1,
        "language": "wbc",
        "firmware": "1.70",
        "ended": "waiting",
        "went_wrong": False,
    }
    assert data["state"]["program"]["line"] == 5
    assert data["state"]["axes"][0]["position"] == 50.0
    assert data["state"]["user_registers"] == {"7": 3}
    assert [(e["code"], e["line"], e["statement"]) for e in data["events"]] == [
        ("axis", 1, "M1 = ON"),
        ("axis", 2, "PABS M1 50"),
        ("wait", 3, "WAITPOS"),
        ("axis", None, None),
        ("register", 4, "$I7 = 3"),
        ("wait", 5, "WAIT IN1 = ON"),
    ]


def test_trace(play: Play, tmp_path: Path) -> None:
    where = tmp_path / "run.jsonl"
    play(
        "M1 = ON\nOUT1 = ON\nPABS M1 50\nWAITPOS\nSET x = 1 / $I0\n$R2 = x\n", trace=where, inputs=parse_inputs("AIN1=2.5@0.01s")
    )
    saved = read_trace(where)
    shown = [(r.time, r.kind, r.subject, r.value if r.kind != "plan" else None) for r in saved.trace if r.time <= 10_000_000]
    assert [row for row in shown if row[1] in ("edge", "plan")] == [
        (0, "plan", "1", None),
        (0, "plan", "2", None),
        (0, "plan", "3", None),
        (0, "plan", "4", None),
        (1_000_000, "edge", "M1_EN", 1.0),
        (2_000_000, "edge", "OUT1", 1.0),
        (3_000_000, "plan", "1", None),
        (10_000_000, "edge", "AIN1", 2.5),
    ]
    assert [r.value for r in saved.trace.statements()][:4] == [1, 2, 3, 4]
    assert [r.value for r in saved.trace.events()] == ["line 5: division by zero"]


@pytest.mark.parametrize(("statement_ns", "told"), [(0, "0.000000"), (100_000, "0.060300"), (1_000_000, "0.603000")])
def test_statement_time(play: Play, statement_ns: int, told: str) -> None:
    text = "SET n = 0\nWHILE n < 200\n    n = n + 1\nENDWHILE\n$R0 = n\n"
    assert (told, "$R0 = 200", "5") in play(text, statement_time=statement_ns).told()


def test_pick_and_place_as_documented() -> None:
    ran = Ran(
        EXAMPLES / "pick_and_place.prg",
        positions=EXAMPLES / "pick_and_place.csv",
        config=EXAMPLES / "pick_and_place.cfg",
        inputs=parse_inputs("IN5=1@5s,IN7=1@6s,IN5=0@7s,IN6=1@10s"),
        until_idle=True,
    )
    assert [(text, line) for _, text, line in ran.told() if text.startswith(("OUT", "$"))] == [
        ("OUT2 on", "25"),
        ("OUT1 on", "59"),
        ("OUT3 on", "66"),
        ("OUT1 off", "72"),
        ("OUT3 off", "74"),
        ("$I10 = 1", "33"),
        ("OUT2 off", "34"),
    ]
    assert "it waits for ever in line 24: WAIT partReady = ON" in ran.lines
