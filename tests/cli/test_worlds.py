"""The commands of worlds: run, replay."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.controller import SECOND
from steptwin.errors import Misuse

FEEDER = Path(__file__).parents[2] / "examples" / "worlds" / "feeder.toml"
runner = CliRunner()


def invoke(*arguments: str, code: int = 0) -> str:
    result = runner.invoke(app, list(arguments), catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.output


def test_run_writes_a_trace_and_a_session_that_replays(tmp_path: Path) -> None:
    told = invoke("run", str(FEEDER), "--for", "10s", "--trace", str(tmp_path / "out"), "--input", "table.IN8=1@2s")
    assert "M1 is at its home position" in told
    assert "x              149.9797 mm" in told
    digest = told.splitlines()[-1].removeprefix("digest ")
    assert {"trace.jsonl", "session.json"} <= {path.name for path in (tmp_path / "out").iterdir()}
    told = invoke("replay", str(tmp_path / "out" / "session.json"))
    assert told == f"10 s of bar feeder, 1 inputs: the same, digest {digest}\n"


def test_a_replay_that_differs_says_so(tmp_path: Path) -> None:
    invoke("run", str(FEEDER), "--for", "3s", "--trace", str(tmp_path))
    recording = tmp_path / "session.json"
    data = json.loads(recording.read_text())
    recording.write_text(json.dumps(data | {"digest": "0" * 32}))
    assert "the run differs from the recorded one" in invoke("replay", str(recording), code=1)


def test_what_a_statement_does_stands_before_what_came_of_it(tmp_path: Path) -> None:
    """At one nanosecond, and whichever controller is the first of the description; an event of an element has its name."""
    (tmp_path / "p.prg").write_text("OUT1 = ON\nEND\n")
    world = '[[mic488]]\nname = "a"\n[[mic488]]\nname = "b"\nprogram = "p.prg"\nstart = true\n'
    joined = '[[collision]]\nname = "crash"\nwhen = "b.OUT1 and not a.OUT1"\n'
    (tmp_path / "w.toml").write_text(f"{world}{joined}")
    told = [line.split() for line in invoke("run", str(tmp_path / "w.toml"), "--for", "1s").splitlines()]
    assert [(time, who, what) for time, _, who, what, *_ in told[:2]] == [
        ("0.001000", "b", "OUT1"),
        ("0.001000", "crash", "crash:"),
    ]


def test_run_ends_on_a_condition_and_tells_it_as_json() -> None:
    told = json.loads(invoke("run", str(FEEDER), "--until", "x.position <= 100", "--json"))
    assert told["ended_by"] == "x.position <= 100"
    assert told["axes"]["x"]["position"] == 100.0
    assert told["failures"] == []


def test_a_condition_that_never_comes_true_is_waited_for_an_hour_and_told(tmp_path: Path) -> None:
    world = tmp_path / "w.toml"
    world.write_text('[[mic488]]\nname = "a"\n')
    assert "warning: waited 3600 s in vain for a.M1.position > 3; a.M1.position is 0 imp\n" in invoke(
        "run", str(world), "--until", "a.M1.position > 3"
    )
    with pytest.raises(Misuse, match="--for 2s ends the run then"):
        invoke("run", str(world), "--until", "2s")
    told = json.loads(invoke("run", str(world), "--until", "a.M1.position > 3", "--for", "2s", "--json"))
    assert (told["in_vain"], told["ended_by"], told["time_s"]) == ("a.M1.position > 3", None, 2.0)
    told = json.loads(invoke("run", str(world), "--for", "2s", "--json"))
    assert told["in_vain"] is None


def test_run_writes_a_session_on_its_own(tmp_path: Path) -> None:
    recording = tmp_path / "new" / "s.json"
    told = invoke(
        "run", str(FEEDER), "--for", "2s", "--session", str(recording), "--fault", "lost-steps machine=table pulses=64 at_s=1"
    )
    assert f"wrote {recording}\n" in told
    assert "2 s of bar feeder, 1 inputs: the same" in invoke("replay", str(recording))
    with pytest.raises(Misuse, match="--session is not for WBC programs"):
        invoke("run", "x.prg", "--session", str(recording))


def test_ctrl_c_ends_a_run_and_keeps_what_it_did(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def bar(*_: object) -> Generator[Callable[[int], None]]:
        yield lambda now: signal.raise_signal(signal.SIGINT) if now == SECOND else None

    monkeypatch.setattr("steptwin.languages.run_world.bar", bar)
    recording = tmp_path / "s.json"
    told = invoke("run", str(FEEDER), "--for", "20s", "--session", str(recording), code=130)
    assert "1 s of bar feeder in" in told
    assert "ended by: Ctrl-C" in told
    monkeypatch.undo()
    assert "1 s of bar feeder, 0 inputs: the same" in invoke("replay", str(recording))


def test_a_session_goes_on_another_way(tmp_path: Path) -> None:
    first, other = tmp_path / "first.json", tmp_path / "other.json"
    invoke("run", str(FEEDER), "--for", "10s", "--input", "table.IN8=1@4s", "--session", str(first))
    told = invoke(
        "run", str(first), "--from", "3s", "--until", "drum.moving", "--input", "table.IN9=1@3.5s", "--session", str(other)
    ).splitlines()
    assert told[0].endswith("table      M1 is at its home position")
    assert any(" s of bar feeder, from 3 s on in " in line and line.endswith("ended by: drum.moving") for line in told)
    data = json.loads(other.read_text())
    assert [(given["time_ns"], given["levels"]) for given in data["inputs"]] == [(3_500_000_000, [["table", "IN9", 1.0]])]
    assert "1 inputs: the same" in invoke("replay", str(other))
    told = json.loads(invoke("run", str(first), "--for", "1s", "--json"))
    assert (told["from_s"], told["time_s"]) == (10.0, 11.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["s.json", "--seed", "3"], r"--seed: s\.json is a recording, which continues with its own"),
        (["s.json", "--from", "3s"], r"the recording ends at 2 s, before 3 s"),
        (["s.json", "--input", "table.IN8=1@1s"], r"--input table\.IN8: at 1 s: this world is at 2 s already"),
        ([str(FEEDER), "--from", "1s"], r"--from: .*feeder\.toml is not a recording; a description begins at 0 s"),
        ([str(FEEDER), "--seed", "-1"], r"seed -1: permitted are whole numbers from 0 to"),
        (["x.prg", "--seed", "0"], r"--seed is not for WBC programs"),
        (["x.m1486", "--from", "0s"], r"--from is not for M1486 programs"),
    ],
)
def test_what_a_session_cannot_go_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    invoke("run", str(FEEDER), "--for", "2s", "--session", "s.json")
    with pytest.raises(Misuse, match=message):
        invoke("run", *arguments)


def test_a_session_that_goes_on_otherwise_says_so(tmp_path: Path) -> None:
    recording = tmp_path / "s.json"
    invoke("run", str(FEEDER), "--for", "2s", "--session", str(recording))
    recording.write_text(json.dumps(json.loads(recording.read_text()) | {"digest": "0" * 32}))
    assert "the replay differs from the run recorded" in invoke("run", str(recording), "--for", "1s")


def test_another_seed_is_another_chance_and_stays_with_the_session(tmp_path: Path) -> None:
    recording = tmp_path / "s.json"
    said = [
        invoke("run", str(FEEDER), "--for", "9s", "--seed", seed, "--session", str(recording)).splitlines()[-1]
        for seed in ("7", "8", "8")
    ]
    assert said[0] != said[1] == said[2]
    assert "the same" in invoke("replay", str(recording))


def test_an_expectation_that_fails_again_and_again_is_two_lines(tmp_path: Path) -> None:
    world = tmp_path / "w.toml"
    world.write_text('[[mic488]]\nname = "a"\n[[event]]\nevery = "20 ms"\nsteps = [{ expect = "a.M1.position > 3" }]\n')
    said = [line for line in invoke("run", str(world), "--for", "1s", code=1).splitlines() if line.startswith(("expect", "and "))]
    told = "a.M1.position > 3; a.M1.position is 0 imp"
    assert said == [f"expectation failed at 0.02 s: {told}", f"and 49 more times, the last at 1 s: {told}"]


def test_an_expectation_that_fails_is_exit_code_1(tmp_path: Path) -> None:
    world = tmp_path / "w.toml"
    world.write_text('[[mic488]]\nname = "a"\n[[event]]\nat = 1\nsteps = [{ expect = "a.M1.position > 3" }]\n')
    told = "a.M1.position > 3; a.M1.position is 0 imp"
    assert f"expectation failed at 1 s: {told}\n" in invoke("run", str(world), "--for", "2s", code=1)
    (failure,) = json.loads(invoke("run", str(world), "--for", "2s", "--json", code=1))["failures"]
    assert failure == {"time_s": 1.0, "condition": "a.M1.position > 3", "what": told}


def test_what_was_waited_for_in_vain_is_a_warning(tmp_path: Path) -> None:
    world = tmp_path / "w.toml"
    steps = '[{ until = "a.M1.position > 3", within = "500 ms" }]'
    world.write_text(f'[[mic488]]\nname = "a"\n[[script]]\nname = "hand"\nsteps = {steps}\n')
    assert "warning: at 0.5 s hand waited in vain for a.M1.position > 3; a.M1.position is 0 imp\n" in invoke(
        "run", str(world), "--for", "2s"
    )
    assert "hand waited in vain" in invoke("run", str(world), "--for", "2s", "--strict", code=1)
    said = invoke("run", str(world), "--for", "400ms", "--until", "a.M1.position > 3", "--strict", code=1)
    assert "waited 0.4 s in vain for a.M1.position > 3; a.M1.position is 0 imp\n" in said
    invoke("run", str(world), "--for", "400ms", "--strict")
    told = json.loads(invoke("run", str(world), "--for", "2s", "--json"))
    assert told["overdue"] == [{"time_s": 0.5, "what": "hand waited in vain for a.M1.position > 3; a.M1.position is 0 imp"}]


def test_the_end_of_a_run_says_what_its_json_says_of_programs(tmp_path: Path) -> None:
    """A write that is refused counts for --strict; a program that is paused does not wait."""
    world = tmp_path / "w.toml"
    (tmp_path / "p.prg").write_text("WAIT IN1 = ON\n")
    steps = '[{ write = { "a.PROGRAM_CTRL" = 2 } }, { at = "500 ms" }, { write = { "a.OUT1" = 1 } }]'
    script = f'[[script]]\nname = "hand"\nat = "100 ms"\nsteps = {steps}\n[[fault]]\nkind = "busy"\nfrom_s = 0.4\n'
    world.write_text(f'[[mic488]]\nname = "a"\nprogram = "p.prg"\nstart = true\n{script}')
    said = invoke("run", str(world), "--for", "1s", "--strict", code=1)
    refused = "hand wrote a.OUT1 = 1 in vain: function 5 (05h) refused with exception 06 (device busy)"
    assert f"warning: at 0.5 s {refused}\n" in said
    assert "\na is paused at p.prg:1 WAIT IN1 = ON\n" in said
    told = json.loads(invoke("run", str(world), "--for", "1s", "--json"))
    assert told["overdue"] == [{"time_s": 0.5, "what": refused}]
    assert told["waiting"] == [{"who": "a", "state": "paused", "what": "p.prg:1 WAIT IN1 = ON"}]
    program = told["controllers"]["a"]["program"]
    assert (program["state"], program["file"], program["line"]) == ("paused", "p.prg", 1)


def test_what_is_doubtful_in_files_of_a_world_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    world = Path("w.toml")
    (tmp_path / "m.cfg").write_text("[Axis0]\nGear=10\nColour=3\n[Oven]\nHeat=1\n")
    table = '[[mic488]]\nname = "{}"\nconfig = "m.cfg"\n'
    world.write_text(table.format("a") + table.format("b"))
    result = runner.invoke(app, ["run", str(world), "--for", "1s"], catch_exceptions=False)
    assert result.exit_code == 0
    told = [line for line in result.stderr.splitlines() if line.startswith("m.cfg")]
    assert told == [
        "m.cfg:3:1: warning C005: [Axis0] Colour is not known and has no effect",
        "m.cfg:4:1: warning C005: the section [Oven] is not known and has no effect",
        "m.cfg:5:1: warning C005: [Oven] Heat is not known and has no effect",
    ]
    assert "C005" not in result.stdout


def test_a_fault_that_cannot_happen_is_refused() -> None:
    with pytest.raises(Misuse, match="fault crc happens on Modbus RTU: line 'bus' carries Modbus TCP, where gap, split"):
        invoke("run", str(FEEDER), "--fault", "crc nth=2")
    told = invoke("run", str(FEEDER), "--for", "1s", "--fault", "lost-steps machine=table pulses=64 at_s=0.5")
    assert "0.500000 s  table      lost-steps: M1 loses 64 pulses" in told


def test_a_place_where_nothing_can_be_written_is_refused_before_anything_runs(tmp_path: Path) -> None:
    program = tmp_path / "w.toml"
    program.write_text('[[mic488]]\nname = "a"\n')
    with pytest.raises(Misuse, match=r"out\.foo: formats are jsonl, html"):
        invoke("run", str(program), "--trace", str(tmp_path / "out.foo"))
    with pytest.raises(Misuse, match=r"cannot write .*w\.toml/t/trace\.jsonl: not a directory"):
        invoke("run", str(program), "--trace", str(program / "t"))
    with pytest.raises(Misuse, match=r"out\.foo: formats are jsonl, html"):
        invoke("up", str(program), "--trace", str(tmp_path / "out.foo"))
    (tmp_path / "s.json").mkdir()
    with pytest.raises(Misuse, match=r"cannot write .*: is a directory"):
        invoke("up", str(program), "--session", str(tmp_path / "s.json"))
    for command in (("up", str(program), "--session"), ("run", str(program), "--session"), ("save",)):
        with pytest.raises(Misuse, match=r"now\.toml: the name of a recording must end with \.json$"):
            invoke(*command, str(tmp_path / "now.toml"))


def test_options_for_programs_are_refused() -> None:
    with pytest.raises(Misuse, match="--firmware is not for worlds, whose file has these settings"):
        invoke("run", str(FEEDER), "--firmware", "1.70")
    with pytest.raises(Misuse, match=r"--input IN1: expected CONTROLLER\.PIN; controllers are table, drum"):
        invoke("run", str(FEEDER), "--input", "IN1=1@2s")
    with pytest.raises(Misuse, match=r"--input table\.IN1: IN1 = 2: a digital input is 0 or 1"):
        invoke("run", str(FEEDER), "--input", "table.IN1=2@1s")


def test_the_keys_of_a_description_have_their_defaults_with_units() -> None:
    from steptwin.cli.up import sections

    (source,) = [section for section in sections() if "[[source]]" in section.title]
    assert {row[0]: row[3] for row in source.rows}["period"] == "10 ms"
    (broker,) = [section for section in sections() if section.title == "[gateway.mqtt]"]
    assert {row[0]: row[3] for row in broker.rows}["keep_alive"] == "15000 ms"


WITH_PROGRAM = """
[[line]]
name = "bus"
kind = "m1486"
[[m1486]]
name = "c"
line = "bus"
variant = "E1"
program = "p.m1486"
"""


@pytest.mark.parametrize("arguments", [("run", "--for", "1s"), ("up",)])
def test_errors_in_files_of_a_world_have_the_path_seen_from_the_folder_of_the_user(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "w.toml").write_text(WITH_PROGRAM)
    (tmp_path / "cell" / "p.m1486").write_text("[\nQQ\n]\n")
    monkeypatch.chdir(tmp_path)
    command, *options = arguments
    with pytest.raises(Misuse, match=r"^cell/p\.m1486:2:2: error M103"):
        invoke(command, "cell/w.toml", *options)


def test_what_a_chip_does_at_power_on_is_shown_and_on_its_line(tmp_path: Path) -> None:
    """An E type runs its stored file at power-on (manual chapter II): U5 at 0, and U6 after one command."""
    world = tmp_path / "w.toml"
    world.write_text(WITH_PROGRAM)
    (tmp_path / "p.m1486").write_text("[\nu5\nu6\n]\n")
    shown = invoke("run", str(world), "--for", "1s", "--trace", str(tmp_path / "t.jsonl"))
    assert shown.startswith("    0.000000 s  c          U5 sends 00H\n")
    records = [json.loads(line) for line in (tmp_path / "t.jsonl").read_text().splitlines()[1:]]
    sent = [record["time_ns"] for record in records if record["kind"] == "frame"]
    assert sent == [record["time_ns"] for record in records if record["subject"] == "upload"]
    assert sent[0] == 0
    assert len(sent) == 2


def test_coverage_is_an_option_of_all_that_runs(tmp_path: Path) -> None:
    program = tmp_path / "p.prg"
    program.write_text("OUT1 = ON\nEND\n")
    world = tmp_path / "w.toml"
    world.write_text('[world]\nname = "w"\n[[mic488]]\nname = "m"\nprogram = "p.prg"\nstart = true\n')
    for file in (program, world):
        assert "p.prg           2       0         0       0  100.0 %" in invoke(
            "run", str(file), "--for", "1s", "--coverage", "-"
        )
    refused = runner.invoke(app, ["run", str(world), "--coverage", "-", "--json"])
    assert isinstance(refused.exception, Misuse)
    assert str(refused.exception).startswith("--coverage - and --json both print on standard output")
