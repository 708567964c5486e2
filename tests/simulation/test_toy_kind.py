"""A world, its faces and its files with a kind of controller that only the tests know: nothing else knows it either."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from toy.kind import TOY, registered
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.files.export import axis_views, read_trace, write_trace
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.jsonvalues import to_json
from steptwin.live import twins
from steptwin.live.clock import Clock
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.output import Output
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.running import up
from steptwin.live.view import LiveView
from steptwin.live.world import ClientPort, LiveWorld, announced
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.simulation.script.steps import Turn
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.world.inputs import Download, ExternalInput, See, SetVariable
from steptwin.simulation.world.motions import ordered
from steptwin.subject.commands import Advance, Describe, Home, Move, ReadPins, ReadState
from steptwin.subject.world import WorldSubject
from steptwin.wire.frameline import FrameLine

TEXT = """
[world]
name = "toys"
[[line]]
name = "bus"
kind = "toys"
tcp = "127.0.0.1:0"
[[toy]]
name = "t"
line = "bus"
[[axis]]
name = "x"
drive = "t.M1"
pulses_per_unit = 10
[[axis.switch]]
to = "t.STOP"
above = 3.0
[[script]]
name = "operator"
steps = [
  { send = "bus", text = "M\\n" },
  { until = "t.position >= 20" },
  { note = "past 20" },
  { until = "idle" },
  { expect = "x.position > 7" },
]
"""
"""M 10 is a move of 100 pulses; from the switch at 30 it needs as much again to stop."""


@pytest.fixture(autouse=True)
def toys() -> Iterator[None]:
    with registered():
        yield


def noted(world: World) -> list[int]:
    return [record.time for record in world.trace if record.subject == "note"]


def test_a_description_a_script_a_condition_and_a_switch() -> None:
    world = World.from_toml(TEXT)
    assert world.run("idle", for_=10) == "idle"
    # 20 pulses at 1000 p/s² from rest take √(2·20/1000) s.
    assert noted(world) == [200_000_000]
    stopped = world.axis["x"].position
    assert 6.0 <= stopped <= 6.1
    assert world.views(TOY)["t"].position == world.read("t.position") == stopped * 10
    assert [record.subject for record in world.failures] == ["expectation"]


def test_mistakes_in_its_table_have_their_places() -> None:
    with pytest.raises(WorldError, match=r"steps: 11: permitted are whole numbers from 1 to 10"):
        World.from_toml('[[toy]]\nname = "t"\nsteps = 11\n')
    with pytest.raises(WorldError, match="'t' cannot be on a line of kind modbus"):
        World.from_toml('[[line]]\nname = "bus"\n[[toy]]\nname = "t"\nline = "bus"\n')
    with pytest.raises(WorldError, match="gap means nothing for kind = 'toys'"):
        World.from_toml(TEXT.replace("tcp =", "gap = 1\ntcp ="))
    with pytest.raises(Misuse, match="'t' is a toy, which has no registers"):
        World.from_toml('[[toy]]\nname = "t"\n[[script]]\nname = "s"\nsteps = [{ write = { "t.POS_ABS" = 1 } }]\n')
    with pytest.raises(
        WorldError, match="'t' is a toy, which has no status of motions: send its commands, and wait for a condition"
    ):
        World.from_toml('[[toy]]\nname = "t"\n[[script]]\nname = "s"\nsteps = [{ wait_for = "t.M1" }]\n')


def test_a_snapshot_goes_on_alike_and_can_be_pickled() -> None:
    world = World.from_toml(TEXT)
    world.run(for_=0.1)
    other = pickle.loads(pickle.dumps(world))
    for one in (world, other):
        one.run(for_=2)
    assert other.trace.digest() == world.trace.digest()


def test_a_fault() -> None:
    world = World.from_toml(TEXT)
    world.fault("stuck pin=STOP value=1")
    world.run(for_=1)
    assert world.read("t.position") == 0
    with pytest.raises(Misuse, match="'t' is a toy"):
        world.fault("wear")


def test_a_session_is_replayed(tmp_path: Path) -> None:
    world = World.from_toml(TEXT)
    world.run(for_=0.1)
    world.views(TOY)["t"].set_pin("STOP", 1)
    world.run(for_=1)
    save(recording_of(world), tmp_path / "s.json")
    assert load(tmp_path / "s.json").replay().trace.digest() == world.trace.digest()


def test_its_trace_is_exported_and_read_back(tmp_path: Path) -> None:
    world = World.from_toml(TEXT)
    world.run(for_=2)
    write_trace(world.trace, tmp_path / "t.jsonl", views=axis_views(world), ended=world.now)
    assert read_trace(tmp_path / "t.jsonl").trace.digest() == world.trace.digest()
    write_trace(world.trace, tmp_path / "t.vcd", views=axis_views(world), ended=world.now)
    assert "M1_STEP" in (tmp_path / "t.vcd").read_text("utf-8")


def test_a_subject_describes_it_and_shows_its_state() -> None:
    subject = WorldSubject(World.from_toml(TEXT))
    (part,) = subject.description.controllers
    assert (part.datasheet.kind, part.line, part.points) == ("toy", "bus", ("t.STOP", "t.BUSY", "t.position"))
    assert subject.do(Describe()).value["datasheets"][0]["axes"][0]["unit"] == "pulse"
    state = subject.do(ReadState("t")).value
    assert (state["kind"], state["axes"][0]["position"], state["pins"]) == ("toy", 0, {"STOP": 0.0, "BUSY": 0.0})
    assert state["details"] == {"commands": 0}
    assert subject.do(ReadPins("t")).value == {"t.STOP": 0.0, "t.BUSY": 0.0}


def test_a_subject_reads_and_commands_it() -> None:
    subject = WorldSubject(World.from_toml(TEXT.replace("{ send", "{ wait = '1 min' }, { send")))
    subject.do(Move("t", 1, by=20))
    subject.do(Advance(until="idle"))
    assert subject.read("t.position", "t.BUSY") == (("t.position", 20.0, "pulse", "good"), ("t.BUSY", 0.0, "", "good"))
    with pytest.raises(Refusal, match="'t' is a toy, which cannot do home; it can do move, stop"):
        subject.do(Home("t", 1, 1.0))


def test_its_data_sheet_is_json() -> None:
    world = World.from_toml(TEXT)
    sheet = to_json(world.kind("t").datasheet(world.controllers["t"]))
    assert json.loads(json.dumps(sheet))["points"][0]["path"] == "position"


def test_what_goes_over_its_line_is_put_into_words() -> None:
    world = World.from_toml(TEXT)
    shown: list[FrameLine] = []
    subscribe_to_frames(LiveWorld(world), shown.append)
    world.run(for_=0.1)
    assert [(line.link, line.meaning) for line in shown] == [("script", "M 10"), ("script", "M 10")]


def test_run_checks_and_runs_it(tmp_path: Path) -> None:
    place = tmp_path / "toys.toml"
    place.write_text(TEXT, "utf-8")
    ended = CliRunner().invoke(app, ["run", str(place), "--for", "2s", "--trace", str(tmp_path / "t.csv")])
    assert "past 20" in ended.output
    assert "expectation failed" in ended.output
    assert ended.exit_code == 1
    assert (tmp_path / "t.csv").exists()


def test_a_program_outside_talks_to_it() -> None:
    live = LiveWorld(World.from_toml(TEXT))
    port = ClientPort(live, "bus", "tcp-1", "raw")
    assert port.exchange(b"P", 0) == b""
    assert port.exchange(b"\0", 0) == b"P\0"
    live.advance(200_000_000)
    assert port.exchange(b"P\0", 200_000_000) == b"P\x02"
    assert announced(live.world) == [
        {"line": "bus", "name": "t", "kind": "toy", "axes": [{"unit": "pulse", "pulses_per_unit": 1.0}]}
    ]


def test_the_live_view_shows_it(run: Callable[..., Any]) -> None:
    async def scene() -> list[str]:
        live = LiveWorld(World.from_toml(TEXT))
        view = LiveView(live, RealTimeDriver(live, Clock()), Output(None))
        live.advance(100_000_000)
        return [line.plain for line in view.lines(80, 40)]

    shown = run(scene())
    assert any(line.startswith("t  ") and line.endswith("ok") for line in shown)
    assert "M1          5 pulse     100 pulse/s  busy" in shown
    assert " STOP BUSY" in shown
    assert "commands 1" in shown


def test_its_end_of_a_run_is_printed_and_is_json(tmp_path: Path) -> None:
    place = tmp_path / "toys.toml"
    free = TEXT.partition("[[axis]]")[0] + "[[script]]" + TEXT.partition("[[script]]")[2].partition("  { expect")[0] + "]\n"
    place.write_text(free, "utf-8")
    shown = CliRunner().invoke(app, ["run", str(place), "--for", "2s"])
    assert "t.M1           100.0000 pulse" in shown.output
    data = json.loads(CliRunner().invoke(app, ["run", str(place), "--for", "2s", "--json"]).output)
    assert data["controllers"]["t"]["axes"][0]["position"] == 100.0
    assert data["controllers"]["t"]["details"] == {"commands": 1}


def test_a_running_one_is_found_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(twins, "running", lambda: ["toys"])
    points = [{"kind": "tcp", "protocol": "toys", "line": "bus", "host": "127.0.0.1", "port": 5020}]
    told = {"name": "toys", "pid": 1, "file": None, "end_points": points, "controllers": announced(World.from_toml(TEXT))}
    monkeypatch.setattr(twins, "ask", lambda name, command, timeout_s: told)
    (found,) = twins.running_twins()[0].controllers
    assert (found.full_name, found.kind, found.selection, found.places) == ("toys.t", "toy", "", ("tcp://127.0.0.1:5020",))
    assert twins.find_controller("toys.t") == ("toys", "t")
    with pytest.raises(LineFailure, match=r"toys\.t is of kind toy, for which there is no driver"):
        twins.find_device("toys.t")


def test_up_serves_it(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    place = tmp_path / "toys.toml"
    place.write_text(TEXT.replace("{ expect", '{ stop = "done" },\n  { expect'), "utf-8")
    assert up(UpOptions(world=place, live=LiveOptions(speed="1000", log_frames=True)))
    shown = capfd.readouterr().out
    assert "toys" in shown
    assert "127.0.0.1:" in shown
    assert "M 10" in shown
    assert "past 20" in shown


@pytest.mark.parametrize(
    ("what", "message"),
    [
        (Download("t", "", "m 1"), "'t' is a toy, which has no program memory"),
        (SetVariable("t", "n", 1.0), "'t' is a toy, which has no program whose text is known"),
        (See("t", 1.0, 0.0, 0.0, 0.0), "'t' is a toy, which has no vision registers"),
        (Turn("t", 1, 5), "'t' is a toy, which has no encoder"),
    ],
)
def test_what_only_other_controllers_have_is_refused(what: ExternalInput, message: str) -> None:
    world = World.from_toml(TEXT)
    with pytest.raises(Misuse) as caught:
        world.apply_input(what)
    assert str(caught.value) == message


def test_a_command_that_it_does_not_know_is_refused() -> None:
    with pytest.raises(Misuse) as caught:
        ordered(World.from_toml(TEXT), Home("t", 1, 1.0))
    assert str(caught.value) == "'t' is a toy, which has no command home"


def test_it_has_no_encoder_that_mechanics_could_turn() -> None:
    with pytest.raises(WorldError, match="encoder: t is a toy, which reads none"):
        World.from_toml(TEXT.replace("[[axis.switch]]", "[axis.encoder]\nslip = 0.1\n[[axis.switch]]"))
