"""`steptwin run` of WBC programs: what is said of a run, and when it ends."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.files.export import read_trace
from steptwin.files.programbanks import ProgramErrors
from steptwin.files.timedinputs import parse_inputs
from steptwin.files.world import World
from steptwin.languages.run_wbc import WbcRun, run
from steptwin.languages.travels import SwitchTravel, parse_travel
from steptwin.wbc.check import check
from steptwin.wbc.dialect import DEFAULT
from steptwin.wbc.image import build
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.resolve import resolve
from steptwin.wbc.syntax import parse

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
        ("0.003000", "M1 moves to 50 mm", "3"),
        ("0.004000", "waits for M1", "4"),
        ("0.603000", "M1 at 50 mm, position reached", ""),
        ("0.604000", "OUT3 on", "5"),
        ("0.605000", "waits for IN1", "7"),
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
        ("0.004000", "waits for OUT1", "4"),
        ("3.000000", "IN2 on", ""),
        ("3.010000", "interrupt of IN2", "6"),
        ("3.011000", "line 7: division by zero", "7"),
        ("3.011000", "M2 slows down from 100 imp/s", "7"),
        ("3.011000", "ERR on", "7"),
        ("4.011000", "M2 at rest at 300.8 imp", ""),
    ]
    assert not ran.went_right
    assert "an error has stopped the program in line 7: division by zero" in ran.lines
    assert "  on: IN2, M2_EN, ERR" in ran.lines


@pytest.mark.parametrize(
    ("options", "ending", "seconds"),
    [
        ({}, "ended at the time limit (--for sets a longer one) in line 2: WAIT IN1 = ON", 60.0),
        ({"limit": 1_500_000_000}, "ended at the time limit (--for sets a longer one) in line 2: WAIT IN1 = ON", 1.5),
        ({"until_idle": True}, "the program waits for ever in line 2: WAIT IN1 = ON", 0.002),
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
    assert assumed.lines[0] == "M1: KL on IN3 assumed at -5 mm (--travel M1=LOW.. changes it)"
    told = play(HOMING, config=config, until_idle=True, travels=[SwitchTravel(1, -12.0, None)])
    assert "assumed" not in "".join(told.lines)
    homed = [next(float(time) for time, text, _ in ran.told() if "position reached" in text) for ran in (assumed, told)]
    assert homed[0] == pytest.approx(5 / 20, abs=0.05)
    assert homed[1] == pytest.approx(12 / 20, abs=0.05)
    by_hand = play(HOMING, config=config, until_idle=True, inputs=parse_inputs(f"IN3={1 - level}@2s"))
    assert "assumed" not in by_hand.lines[0]


def test_positions_are_of_the_moment_the_run_ended(play: Play) -> None:
    ran = play("M1 = ON\nVABS M1 10\nWAIT IN3 = 1\n", config="[Axis0]\nGear=10\nAcc=5\n", until_idle=True)
    # It runs up to 10 imp/s in 2 s from 0.002 s on; then nothing changes any more.
    assert ran.lines[3:6] == [
        "the program waits for ever in line 3: WAIT IN3 = 1, while M1 moves on",
        "  M1 at 10 imp, 10 imp/s, velocity mode",
        "  on: M1_EN",
    ]
    assert ran.lines[-1].startswith("2.002000 s of virtual time")


BOTH = "[Axis2]\nUnit=3\nGear=10\nVel=50\nHomeMode=0\nInKL=1\nInKR=2\n[Axis0]\nGear=10\nInKL=3\n"
KR = "M3: KR on IN3 assumed at 5 mm (--travel M3=..HIGH changes it)"
KL = "M3: KL on IN2 assumed at -5 mm (--travel M3=LOW.. changes it)"


@pytest.mark.parametrize(
    ("homing", "assumed"),
    [
        ("HOME M3 20", [KR]),
        ("HOME M3 -20", [KL]),
        ("SET v = 20\nHOME M3 v", [KR]),
        ("HOME M3 $R0", [KL]),
        ("HOME M3 -20\nWAITPOS\nHOME M3 20", [KL, KR.replace("at 5 mm", "at 500 mm")]),
        ("PABS M3 1", []),
    ],
)
def test_switches_are_assumed_where_the_program_homes_to(play: Play, homing: str, assumed: list[str]) -> None:
    ran = play(f"$R0 = -20\nM3 = ON\n{homing}\nWAITPOS\n", config=BOTH)
    assert [line for line in ran.lines if "assumed" in line] == assumed
    assert "the program has ended" in ran.lines


@pytest.mark.parametrize(
    ("config", "travels", "missing"),
    [
        (BOTH, [SwitchTravel(3, -5.0, None)], "  M3 homes to KR on IN3, which nothing operates: --travel M3=..HIGH"),
        (BOTH.replace("InKR=2\n", ""), [], "  M3 homes to KR, for which the configuration has no input (InKR of [Axis2])"),
        (BOTH.replace("HomeMode=0", "HomeMode=3"), [], "  M3 homes to a mechanical stop, which only a world has"),
        (
            BOTH.replace("HomeMode=0", "HomeMode=4"),
            [],
            "  M3 homes to channel C of its encoder on IN15, which nothing operates: --input IN15=1@TIME",
        ),
    ],
    ids=["no switch", "no input", "stop", "index"],
)
@pytest.mark.parametrize("until_idle", [False, True])
def test_a_homing_that_cannot_end_is_explained(
    play: Play, config: str, travels: list[SwitchTravel], missing: str, until_idle: bool
) -> None:
    ran = play("M3 = ON\nHOME M3 20\nWAITPOS\n", config=config, travels=travels, until_idle=until_idle)
    assert missing in ran.lines
    asked = play("M3 = ON\nHOME M3 20\nWAITPOS\n", config=config, travels=travels, as_json=True)
    assert json.loads("\n".join(asked.lines))["missing_switches"] == [missing.strip()]


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("$D0 = 123456789", "$D0 = 123456792"),
        ("$D0 = -2000000000", "$D0 = -2000000000"),
        ("$R0 = 0.1", "$R0 = 0.1"),
        ("$R0 = 16777217.5", "$R0 = 16777218"),
        ("$R0 = 1234.567", "$R0 = 1234.567"),
        ("$R0 = 1 / 3", "$R0 = 0.33333334"),
        ("$I0 = 32767", "$I0 = 32767"),
    ],
)
def test_values_are_shown_whole_or_so_that_they_read_back(play: Play, line: str, shown: str) -> None:
    ran = play(f"{line}\n")
    assert next(text for _, text, _ in ran.told()) == shown
    events = json.loads("\n".join(play(f"{line}\n", as_json=True).lines))["events"]
    assert events[0]["text"] == shown


def test_positions_in_pulses_are_whole(play: Play) -> None:
    ran = play("M1 = ON\nVmaxM1 = 60000\nPosM1 = 123456784\nPREL M1 8\nWAITPOS\nWAIT IN1 = 1\n", until_idle=True)
    assert "  M1 at 123456792 imp, position reached" in ran.lines


@pytest.mark.parametrize("statement_ns", [1_000_000, 0])
def test_what_caused_an_interrupt_comes_before_it(play: Play, statement_ns: int) -> None:
    text = "CFGINT_M1 = INT_HIGH\nM1 = ON\nWAIT IN1 = 1\nINT_M1:\n$I0 = $I0 + 1\nRETURN\n"
    ran = play(text, until_idle=True, statement_time=statement_ns)
    assert [(text, line) for _, text, line in ran.told()][:3] == [
        ("M1 on", "2"),
        ("interrupt of M1", "4"),
        ("$I0 = 1", "5"),
    ]


TABLE_AND_GEAR = {"table.csv": "A;5;x;x;x\n", "table.cfg": "[Axis0]\nGear=10\n"}


def test_files_of_the_same_name_are_taken(tmp_path: Path) -> None:
    for name, text in {"table.prg": "M1 = ON\nMOVEPTP @A\nWAITPOS\nWAIT IN1 = 1\n", **TABLE_AND_GEAR}.items():
        (tmp_path / name).write_text(text)
    ran = Ran(tmp_path / "table.prg", until_idle=True)
    assert ran.lines[0] == "with table.csv and table.cfg, found beside the program"
    assert "  M1 at 5 imp, position reached" in ran.lines
    other = tmp_path / "other.csv"
    other.write_text("A;7;x;x;x\n")
    ran = Ran(tmp_path / "table.prg", until_idle=True, positions=other)
    assert ran.lines[0] == "with table.cfg, found beside the program"
    assert "  M1 at 7 imp, position reached" in ran.lines
    data = json.loads("\n".join(Ran(tmp_path / "table.prg", until_idle=True, as_json=True).lines))
    assert (data["positions"], data["config"]) == (str(tmp_path / "table.csv"), str(tmp_path / "table.cfg"))


def test_a_row_0_that_the_program_writes_needs_no_table(play: Play) -> None:
    text = "SET M1 = ON\nSET M2 = ON\nSET LinX = 50\nSET LinY = 20\nSET LinVel = 100\nMOVELIN 0\nWAITPOS\nWAIT IN1 = 1\n"
    ran = play(text, until_idle=True)
    assert ran.warnings == []
    assert "  M1 at 50 imp, position reached" in ran.lines
    assert "  M2 at 20 imp, position reached" in ran.lines


@pytest.mark.parametrize("line", ["MOVEPTP 3", "MOVEPTP $I0", "MOVELIN 0"])
def test_rows_without_a_table_are_refused_with_the_option(play: Play, line: str) -> None:
    with pytest.raises(Misuse, match=r"program\.prg moves to rows of the position table: give it with --positions FILE$"):
        play(f"M1 = ON\nM2 = ON\n{line}\n")


def image(path: Path, text: str, rows: str = "") -> Path:
    table, _ = parse_positions(rows)
    executable = check(text, table).executable
    assert executable is not None
    data, refused = build(executable, table)
    assert refused == []
    assert data is not None
    path.write_bytes(data)
    return path


def test_an_image_is_run_with_its_own_table(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("A;2;x;x;x\nB;3;x;x;x\n")
    ran = Ran(image(tmp_path / "a.wbc", "M1 = ON\nMOVEPTP 1\nWAITPOS\nWAIT IN1 = 1\n", "A;1;x;x;x\nB;7;x;x;x\n"), until_idle=True)
    assert "  M1 at 7 imp, position reached" in ran.lines
    assert "the program waits for ever in line 5: WAIT IN1 = 1" in ran.lines


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("M1 = ON\n//!record F1000000000000000000000000000000\n", "1 of its records is not known"),
        ("//!record F1000000000000000000000000000000\n" * 3, "3 of its records are not known"),
    ],
)
def test_an_image_with_unknown_records_is_refused(tmp_path: Path, text: str, message: str) -> None:
    table, _ = parse_positions("")
    data, _ = build(resolve(parse(text)[0], table, DEFAULT).executable, table)
    (tmp_path / "a.wbc").write_bytes(data or b"")
    with pytest.raises(Misuse, match=rf"cannot run .*a\.wbc: {message}; 'steptwin decompile' shows the others$"):
        Ran(tmp_path / "a.wbc")


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.wbc").write_text("M1 = ON\n")
    with pytest.raises(Misuse, match=r"cannot run .*a\.wbc: not a compiled image: 8 bytes instead of 20094$"):
        Ran(tmp_path / "a.wbc")


def test_travel_as_people_type_it() -> None:
    assert parse_travel("M1=-10..250, m4=..7,M2=-1.5..") == [
        SwitchTravel(1, -10.0, 250.0),
        SwitchTravel(4, None, 7.0),
        SwitchTravel(2, -1.5, None),
    ]
    for text in ("M5=1..2", "M1=5", "X=1..2", "M0=1..2"):
        with pytest.raises(Misuse, match=r"^--travel .*: expected Mn=LOW\.\.HIGH, such as M1=-10\.\.250"):
            parse_travel(text)
    with pytest.raises(Misuse, match=r"^--travel M1=a\.\.2: 'a' is not a number"):
        parse_travel("M1=a..2")
    with pytest.raises(Misuse, match=r"--travel M1=5\.\.2: 5 must be below 2"):
        parse_travel("M1=5..2")


def test_what_cannot_be_run(play: Play, tmp_path: Path) -> None:
    with pytest.raises(ProgramErrors):
        play("PABS M1\n")
    with pytest.raises(Misuse, match="no input pin 'OUT1'"):
        play("OUT1 = ON\n", inputs=parse_inputs("OUT1=1@1s"))
    with pytest.raises(Misuse, match=r"--travel M1: the configuration has no KR for this axis$"):
        play("OUT1 = ON\n", travels=[SwitchTravel(1, None, 5.0)])
    with pytest.raises(Misuse, match=r"no KR for this axis; --travel M1=-12\.\. has the other switch only$"):
        play("OUT1 = ON\n", config="[Axis0]\nInKL=0\n", travels=[SwitchTravel(1, -12.0, 100.0)])
    with pytest.raises(Misuse, match=r"names positions: give the table with --positions FILE$"):
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
    assert data["state"]["details"]["user_registers"] == {"7": 3}
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
    assert [r.value for r in saved.trace.events("mic488")] == ["line 5: division by zero"]


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
    assert "the program waits for ever in line 24: WAIT partReady = ON" in ran.lines


def test_the_world_it_runs_in_is_printed_and_runs_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    files = {
        "a.prg": HOMING + "WAIT IN9 = 1\nOUT1 = ON\nWAIT IN1 = 1\n",
        "a.cfg": SWITCHES.format(level=1) + "[WBC_PROGRAM]\nProgBank=2\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    options: dict[str, Any] = {"until_idle": True, "inputs": parse_inputs("IN9=1@5s")}
    ran = Ran(Path("a.prg"), trace=tmp_path / "t.jsonl", **options)
    assert Ran(Path("a.prg"), print_world=True, **options).went_right
    world = World.from_toml(capsys.readouterr().out, {name: text.encode() for name, text in files.items()})
    world.run(for_="6 s")
    recorded = read_trace(tmp_path / "t.jsonl").trace
    kinds = ("edge", "plan", "event")
    assert [r[:4] for r in world.trace.of(*kinds, controller="mic488")] == [
        r[:4] for r in recorded.of(*kinds, controller="mic488")
    ]
    assert world.read("mic488.OUT1") == 1.0
    assert any("KL on IN3 assumed" in line for line in ran.lines)
