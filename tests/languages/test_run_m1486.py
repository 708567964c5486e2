"""Programs of the M1486 in a world of their own: what is typed when, when a run ends, and what its trace has."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import read_trace
from steptwin.files.timedinputs import parse_inputs
from steptwin.files.world import World
from steptwin.languages import program_run
from steptwin.languages.run_m1486 import M1486Run, run
from steptwin.simulation.scheduler.trace import Trace

EXAMPLE_6 = """
x0
:0
l20
[
c1
t1
w2000
+64
f
r
e
]
x7
[
s70
a1000
f25600
@2
z3
r
d
j2
]
"""


class Ran:
    """A run and all that is said of it."""

    def __init__(self, program: Path, text: str, **options: Any) -> None:
        program.write_text(text)
        trace = program.with_name("trace.jsonl")
        said: list[str] = []
        options = {"variant": "B", **options}
        self.went_right = run(M1486Run(program=program, trace=trace, as_json=True, **options), said.append, print)
        self.data = json.loads("\n".join(said))
        self.ending = round(self.data["virtual_s"] * 1000), self.data["ended"]
        self.trace: Trace = read_trace(trace).trace

    def times(self, code: str, chip: str = "F") -> list[int]:
        """Milliseconds."""
        return [round(1000 * each["time_s"]) for each in self.data["events"] if (each["code"], each["chip"]) == (code, chip)]


Play = Callable[..., Ran]


@pytest.fixture
def play(tmp_path: Path) -> Play:
    def play_text(text: str, **options: Any) -> Ran:
        return Ran(tmp_path / "program.m1486", text, **options)

    return play_text


def test_a_program_ends_with_its_last_command(play: Play) -> None:
    assert play("f640\nr\n").ending == (41, "idle")
    assert play("w2500\n").ending == (2500, "idle")
    assert play("w2500\n", until_idle=True).ending == (2500, "idle")
    assert play("c1\nc2\n").ending == (2, "idle")
    assert play("").ending == (0, "idle")


def test_the_limit_ends_what_does_not_end(play: Play) -> None:
    ran = play("[\n@1\n+1\nt1\nj1\n]\n", limit=3_500 * MILLISECOND)
    assert ran.ending == (3_500, "limit")


def test_a_program_that_waits_for_ever(play: Play) -> None:
    assert play("w100\nz3\n", limit=10 * SECOND).ending == (10_000, "limit")
    assert play("w100\nz3\n", limit=10 * SECOND, until_idle=True).ending == (101, "waiting")


def test_inputs_come_at_their_moments(play: Play) -> None:
    ran = play("z3\nc1\no3\nt1\n", inputs=parse_inputs("B3=0@1.5s,B4=0@1.5s,B3=1@2s"), until_idle=True)
    assert ran.times("input") == [1500, 1500, 2000]
    assert ran.times("output") == [1500, 2000]
    assert [(r.time, r.value) for r in ran.trace.edges() if r.subject == "B3"] == [(1500 * MILLISECOND, 0.0), (2 * SECOND, 1.0)]


def test_a_run_waits_for_inputs_that_are_to_come(play: Play) -> None:
    assert play("c1\n", inputs=parse_inputs("B3=0@2s")).ending == (2000, "idle")


def test_lines_are_typed_as_there_is_room(play: Play) -> None:
    """Compression rests while the motor runs, and the buffer of an A holds 12 characters: a host that does not wait would
    lose some."""
    moves = 40
    ran = play("f640\nr\nb640\nr\n" * moves, variant="A")
    assert len(ran.times("moves")) == 2 * moves
    assert ran.times("wrong-data") == []
    assert (ran.data["lines_not_taken"], ran.data["sent"]) == (0, "")
    assert ran.data["ended"] == "idle"


def test_what_was_never_taken_is_counted(play: Play) -> None:
    ran = play("g+\nr\n" + "f640\n" * 100, limit=SECOND)
    assert ran.data["ended"] == "limit"
    assert ran.data["lines_not_taken"] == 101 - 63 - 1  # as many as the memory holds, and one in the buffer


def test_example_6_of_the_manual(play: Play) -> None:
    ran = play(EXAMPLE_6, wires=("0.B1=7.B3",), limit=10 * SECOND)
    low = [r.time for r in ran.trace.edges("chip0") if (r.subject, r.value) == ("B1", 0.0)]
    moved = [r.time for r in ran.trace.events("chip7") if r.subject == "moves"]
    assert len(low) == len(moved) == 5
    assert moved[1:] == low[1:]
    assert moved[0] - low[0] == 2 * MILLISECOND  # it had not come to its Z yet


@pytest.mark.parametrize("wires", [(), ("0.B2=7.B2",)])
def test_a_run_is_the_same_however_often_it_is_looked_at(
    play: Play, monkeypatch: pytest.MonkeyPatch, wires: tuple[str, ...]
) -> None:
    digests = set()
    for part in (SECOND, 10 * MILLISECOND, 1_234_567):
        monkeypatch.setattr(program_run, "SLICE_NS", part)
        ran = play(EXAMPLE_6, wires=wires, limit=5 * SECOND)
        digests.add(ran.trace.digest())
        assert len(ran.trace) > 20
    assert len(digests) == 1


def test_plans_and_waveforms_are_recorded(play: Play) -> None:
    ran = play("n3\nf640\nr\nn1\n")
    plans = list(ran.trace.plans())
    assert [(record.time, record.subject) for record in plans] == [(0, "1"), (2 * MILLISECOND, "1")]
    assert [record.value for record in ran.trace.edges() if record.subject == "N"] == [3.0, 1.0]


def test_the_world_it_runs_in_is_printed_and_runs_alike(
    tmp_path: Path, play: Play, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    options: dict[str, Any] = {"inputs": parse_inputs("0.B3=0@1s"), "wires": ("0.B1=7.B3",)}
    text = "x0\nz3\nc1\nx7\nz3\nf640\nr\n"
    ran = play(text, **options)
    assert run(M1486Run(program=tmp_path / "program.m1486", variant="B", print_world=True, **options), print, print)
    world = World.from_toml(capsys.readouterr().out)
    world.run_to(round(ran.data["virtual_s"] * SECOND))
    assert [(r.time, r.subject, r.value) for r in world.trace.events()] == [
        (r.time, r.subject, r.value) for r in ran.trace.events()
    ]
    assert world.m1486["chip7"].position == 640
