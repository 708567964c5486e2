"""Sessions: what came from outside, replayed, gives the same digest - here and on other versions of Python."""

from __future__ import annotations

import json
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from damage import VALUES, WAYS, damaged
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, SteptwinError
from steptwin.files.recording import load, recording_of, save
from steptwin.files.savedrecordings import path_of, usual_name
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Move
from steptwin.simulation.script.steps import Steps
from steptwin.simulation.world.inputs import Bytes, ExternalInput

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
GOLDEN = json.loads((Path(__file__).parent / "world_digests.json").read_text())
"""Digests of 30 s of the examples, and of `busy`. Written on 3.11; every version must agree."""


def busy() -> World:
    """A world to which everything happens that can come from outside."""
    world = World.load(EXAMPLES / "feeder.toml")
    world.apply_input(do.SetFault(read("delay unit=1 for_ms=40 nth=3 name=slow")))
    world.run(for_=0.5)
    world.mic488["table"].write("M2_EN", 1)
    world.mic488["table"].write("M2_VEL_ABS", 400.0)
    world.mic488["table"].set_pin("IN9", 1)
    world.press("start", 0.3)
    world.run(for_=1.25)
    world.line["bus"].send(bytes.fromhex("01 03 27 24 00 02 8e b4"))
    world.apply_input(do.Turn("table", 3, -25))
    world.run(for_=0.5)
    assert len(world.line["bus"].received()) == 9
    world.line["chips"].send(b"x3\rf6400\rr\r")
    world.m1486["drum"].set_pin("B5", 0)
    world.run(for_=6)
    world.apply_input(do.ClearFault("slow"))
    world.mic488["table"].power_cycle()
    world.run(for_=2)
    return world


def test_a_session_replays_from_its_file_alone(tmp_path: Path) -> None:
    world = busy()
    recording = recording_of(world)
    save(recording, tmp_path / "s.json")
    loaded = load(tmp_path / "s.json")
    assert loaded == recording
    text = (tmp_path / "s.json").read_text()
    assert text == json.dumps(json.loads(text), indent=1) + "\n"
    assert loaded.firmware == {"table": "1.70", "drum": "B"}
    again = loaded.replay()
    assert again.trace.digest() == recording.digest
    assert list(again.trace) == list(world.trace)
    assert recording_of(again) == recording


def test_what_python_code_did_is_in_the_session_and_the_code_is_not(tmp_path: Path) -> None:
    def operator() -> Steps:
        yield do.Wait(SECOND)
        yield do.Press("start")
        position = yield do.Read("x.position")
        yield do.Write((("table", "M3_EN", 1.0), ("table", "M3_POS_ABS", round(position))))

    world = World.load(EXAMPLES / "feeder.toml")
    world.script(operator)
    world.at(2.5, lambda: world.release("start"))
    world.when("table.M3.position > 20", do.Set((("table", "IN8", 1.0),)))
    world.run(for_=20)
    recording = recording_of(world)
    assert len(recording.inputs) == 4
    assert recording.replay().trace.digest() == recording.digest


def test_requests_of_python_are_in_the_session() -> None:
    def operator() -> Steps:
        answer = yield do.Request("bus", 1, bytes.fromhex("05 07 d0 ff 00"), SECOND)
        assert answer == bytes.fromhex("05 07 d0 ff 00")

    world = World.load(EXAMPLES / "feeder.toml")
    world.script(operator)
    world.run(for_=2)
    recording = recording_of(world)
    assert [type(given.what).__name__ for given in recording.inputs] == ["Request"]
    assert recording.replay().trace.digest() == recording.digest


def test_what_commands_of_python_did_not_reach_is_in_the_session(tmp_path: Path) -> None:
    def operator() -> Steps:
        yield do.Order(Move("drum", 1, by=6400.0))
        yield do.Wait(MILLISECOND)
        yield do.Order(Move("drum", 1, by=640.0))
        yield do.ExpectReached("table", 2)

    world = World.from_toml(
        "[[mic488]]\nname = 'table'\n[[line]]\nname = 'chips'\nkind = 'm1486'\n"
        "[[m1486]]\nname = 'drum'\nline = 'chips'\naddress = 3\n"
    )
    world.script(operator)
    world.run(for_=2)
    assert [failure.value for failure in world.failures] == [
        "drum is not at rest (waits for the end of the move): wait, or stop it",
        "table.M2.status == 4; table.M2.status is 0",
    ]
    save(recording_of(world), tmp_path / "s.json")
    recording = load(tmp_path / "s.json")
    assert [type(given.what).__name__ for given in recording.inputs] == ["Send", "Refused", "Expect"]
    assert recording.replay().trace.digest() == recording.digest


TICKING = """
    [[mic488]]
    name = "a"
    [[event]]
    when = "a.IN2"
    steps = [{ note = "after that" }]
    [[script]]
    name = "first"
    steps = [{ wait = "1 s" }, { set = { "a.IN1" = 1 } }, { stop = "enough" }, { note = "gone on" }]
    [[script]]
    name = "second"
    steps = [{ until = "a.IN1" }, { set = { "a.IN2" = 1 } }]
"""


@pytest.mark.parametrize("how", [{"for_": 5}, {"until": "a.IN1"}])
def test_runs_that_were_stopped_replay(how: dict[str, Any]) -> None:
    """What happens at a moment has happened when a run ends there, whatever the order of the scripts."""
    world = World.from_toml(TICKING)
    assert world.run(**how) == "enough"
    assert [record.value for record in world.trace if record.subject == "note"] == ["after that"]
    stopped = recording_of(world)
    assert stopped.until == SECOND
    assert stopped.replay().trace.digest() == stopped.digest
    world.mic488["a"].set_pin("IN3", 1)
    assert world.run(for_=2) is None
    assert [record.value for record in world.trace if record.subject == "note"] == ["after that", "gone on"]
    assert recording_of(world).replay().trace.digest() == recording_of(world).digest


def test_a_world_that_was_stopped_goes_on_from_a_snapshot() -> None:
    world = World.from_toml(TICKING)
    world.run(for_=5)
    branch = world.branch()
    world.run(for_=2)
    branch.run(for_=2)
    assert branch.trace.digest() == world.trace.digest()


CHAIN = """
    [[mic488]]
    name = "t"
    [[event]]
    when = "t.IN3"
    steps = [{ set = { "t.IN4" = 1 } }]
    [[event]]
    when = "t.IN4 and not t.IN1"
    steps = [{ note = "IN4 before IN1" }]
    [[event]]
    when = "t.IN1 and t.IN2"
    steps = [{ note = "both" }, { set = { "t.IN2" = 0 } }]
    [[script]]
    name = "s"
    steps = [{ wait = "1 s" }, { set = { "t.IN3" = 1 } }, { stop = "a" }, { stop = "b" }, { note = "x" }]
"""


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.lists(st.tuples(st.sampled_from(["IN1", "IN2", "IN3"]), st.integers(0, 1)), max_size=3)),
        max_size=6,
    ),
    st.lists(st.integers(0, 3), max_size=3),
)
def test_what_comes_at_the_nanosecond_of_other_steps_replays(changes: list[Any], pauses: list[int]) -> None:
    """Scripts from outside come when those of the description have nothing to do at a moment, also in a replay."""
    world = World.from_toml(CHAIN)

    def pin(name: str, level: int) -> do.Set:
        return do.Set((("t", name, float(level)),))

    for second, pins in changes:
        world.at(second, tuple(pin(*one) for one in pins))
    world.when("t.IN4", pin("IN2", 1))
    for seconds in pauses:
        world.run(for_=seconds)
        world.mic488["t"].set_pin("IN1", 1)
        world.mic488["t"].set_pin("IN2", 1)
    world.run(until="t.IN2", for_=4)
    world.run(for_=4)
    recording = recording_of(world)
    assert list(recording.replay().trace) == list(world.trace)
    assert recording.replay().inputs == world.inputs


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (do.Set((("table", "IN7", 1.0), ("table", "IN99", 1.0))), "no input pin 'IN99'"),
        (do.Set((("table", "IN7", 1.0), ("drum", "B5", 2.0))), "B5 = 2: a digital input is 0 or 1"),
        (do.Write((("table", "M1_EN", 1.0), ("drum", "M1_EN", 1.0))), "'drum' is an M1486, which has no registers"),
        (do.Turn("table", 9, 1), "no axis M9: axes are M1 to M4"),
        (do.Turn("table", 1, 2**31), "2147483648 encoder counts at once"),
        (do.Expect("nothing > 1"), "nothing is called 'nothing'"),
        (do.ClearFault("crc"), "no fault 'crc'"),
        (do.SetFault(read("stall machine=table axis=9")), "permitted are 1 to 4"),
        (Bytes("bus", "late", "raw", b"?"), "takes no connection of kind 'raw'"),
    ],
)
def test_what_is_refused_leaves_no_mark(step: ExternalInput, message: str) -> None:
    world = World.load(EXAMPLES / "feeder.toml")
    world.run(for_=1)
    before = world.trace.digest()
    with pytest.raises(Misuse, match=message):
        world.apply_input(step)
    world.sync_all()
    assert (world.trace.digest(), world.inputs) == (before, [])


def test_a_session_has_the_seed_it_ran_with(tmp_path: Path) -> None:
    world = World.load(EXAMPLES / "feeder.toml", seed=8)
    world.run(for_=30)
    recording = recording_of(world)
    assert recording.digest != GOLDEN["feeder"]
    save(recording, tmp_path / "s.json")
    assert load(tmp_path / "s.json").replay().trace.digest() == recording.digest
    assert world.branch().spec.seed == 8
    with pytest.raises(Misuse, match="seed -1: permitted are whole numbers from 0 to"):
        World.load(EXAMPLES / "feeder.toml", seed=-1)
    with pytest.raises(Misuse, match="the snapshot is of another world"):
        World.load(EXAMPLES / "feeder.toml").restore(world.snapshot())


def test_a_session_goes_another_way_from_any_moment() -> None:
    recording = recording_of(busy())
    moment = 3 * SECOND
    world = recording.replay(moment)
    assert world.now == moment
    assert [given.time for given in world.inputs] == [given.time for given in recording.inputs if given.time <= moment]
    world.mic488["table"].set_pin("IN9", 0)
    world.run(for_=2)
    other = recording_of(world)
    assert other.digest != recording.digest
    assert other.replay().trace.digest() == other.digest
    with pytest.raises(Misuse, match=r"the recording ends at 10\.25 s, before 11 s"):
        recording.replay(11 * SECOND)


def test_a_session_ends_when_what_its_last_input_led_to_has_happened() -> None:
    world = World.from_toml(TICKING)
    world.run(for_=0.5)
    world.mic488["a"].set_pin("IN2", 1)
    recording = recording_of(world)
    assert [record.value for record in world.trace if record.subject == "note"] == ["after that"]
    assert recording.replay().trace.digest() == recording.digest


def test_another_run_has_another_digest() -> None:
    recording = recording_of(busy())
    world = recording.world()
    for time, what, _ in recording.inputs[:-1]:
        world.advance(time)
        world.apply_input(what)
    world.run(until=recording.until / SECOND)
    assert world.trace.digest() != recording.digest


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not a recording of a world"),
        ("[]", "is not a recording of a world"),
        ('{"steptwin_session": 99}', "is a recording of format 99: this version reads 1"),
        ('{"steptwin_session": 1}', "is not a recording of a world: 'until_ns' is missing"),
        ("[" * 100_000, "is not a recording of a world: it is nested too deeply"),
    ],
)
def test_what_is_no_session_is_misuse(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "s.json"
    path.write_text(text)
    with pytest.raises(Misuse, match=message):
        load(path)


def put(**levels: object) -> dict[str, object]:
    return {"time_ns": 5, "settled": True, "do": "Set"} | levels


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"until_ns": "5"}, "until_ns is '5'"),
        ({"until_ns": 6e9}, "until_ns is 6000000000.0"),
        ({"until_ns": 10**30}, "until_ns is 10+: permitted are 0 to"),
        ({"name": 5}, "name is 5"),
        ({"world": 5}, "world is 5"),
        ({"files": []}, r"files is \[\]"),
        ({"firmware": {"table": 5}}, "firmware of table is 5"),
        ({"inputs": 5}, "inputs is 5"),
        ({"inputs": [5]}, "an input is 5"),
        ({"inputs": [put(time_ns="5", levels=[])]}, "time_ns is '5'"),
        ({"inputs": [put(time_ns=-1, levels=[])]}, "not in order"),
        ({"inputs": [put(time_ns=7, levels=[]), put(levels=[])]}, "not in order"),
        ({"inputs": [put(do="Call")]}, "'Call' is missing"),
        ({"inputs": [put(level=3)]}, "unexpected keyword argument 'level'"),
        ({"inputs": [put(levels=5)]}, "levels of Set is 5"),
        ({"inputs": [put(levels=[[5, 5, 5]])]}, "levels of Set is"),
        ({"inputs": [put(levels=[["t", "IN1"]])]}, "levels of Set is"),
        ({"inputs": [put(levels=[["t", "IN1", "x"]])]}, "levels of Set is"),
        ({"inputs": [put(do="Expect", condition=5)]}, "condition of Expect is 5"),
        ({"inputs": [put(do="SetFault", fault=5)]}, "fault of SetFault is 5"),
        ({"inputs": [put(do="Press", button="b", duration=0.5)]}, "duration of Press is 0.5"),
    ],
)
def test_a_damaged_session_is_misuse(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = tmp_path / "s.json"
    whole = {"steptwin_session": 1, "version": "0", "name": "n", "seed": 0, "firmware": {}, "until_ns": 9, "digest": ""}
    path.write_text(json.dumps(whole | {"world": "", "files": {}, "inputs": [put(levels=[["t", "IN1", 1]])]}))
    load(path)
    path.write_text(json.dumps(whole | {"world": "", "files": {}, "inputs": []} | change))
    with pytest.raises(Misuse, match=rf"s\.json is not a recording of a world: .*{message}"):
        load(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": -8}, "seed -8: permitted are whole numbers from 0 to"),
        ({"firmware": {"table": "1.40"}}, "table is 1.40 in the recording, but its world has 1.70"),
        ({"until_ns": SECOND}, "the recording ends at 1000000000 ns, before an input at 2000000000 ns"),
    ],
)
def test_a_session_that_contradicts_itself_is_misuse(tmp_path: Path, change: dict[str, object], message: str) -> None:
    world = World.load(EXAMPLES / "feeder.toml")
    world.run(for_=2)
    world.press("start", 0.3)
    file = tmp_path / "s.json"
    save(recording_of(world), file)
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(Misuse, match=message):
        load(file).replay()


@pytest.mark.parametrize("name", GOLDEN)
def test_digests_are_the_same_everywhere(name: str) -> None:
    if name == "busy":
        world = busy()
    else:
        world = World.load(EXAMPLES / f"{name}.toml")
        world.run(for_=30)
    assert world.trace.digest() == GOLDEN[name]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(way=WAYS, value=VALUES)
def test_a_session_of_other_values_is_refused_or_replayed(way: list[int], value: Any, tmp_path: Path) -> None:
    world = World.from_toml('[[mic488]]\nname = "a"\nline = "l"\n[[line]]\nname = "l"\n')
    world.apply_input(do.Set((("a", "IN3", 1.0),)))
    world.apply_input(do.SetFault(read("crc nth=3 link=script")))
    world.line["l"].send(b"\x01")
    world.run(for_=0.5)
    path = tmp_path / "s.json"
    save(recording_of(world), path)
    path.write_text(json.dumps(damaged(json.loads(path.read_text()), way, value)))
    with suppress(SteptwinError):
        recording = load(path)
        if recording.until <= world.now:
            assert recording.replay().now == recording.until


@pytest.mark.parametrize(("stem", "begin"), [("hall", "hall"), ("my hall ż", "my_hall__"), (".a", "_a"), ("n" * 300, "n" * 60)])
def test_a_recording_without_a_name_has_one_that_is_permitted_whatever_its_world_is_called(stem: str, begin: str) -> None:
    name = usual_name(stem, datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC))
    assert name == f"{begin}-20260504-030201"
    assert path_of(Path(), name).name == f"{name}.json"
