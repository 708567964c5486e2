"""Worlds that are branched, pickled, started with other values, and given faults from Python."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml import keypaths

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def a_while() -> do.Steps:
    yield do.Wait(10**9)
    yield do.Note("a second later")


def running() -> World:
    """In the middle of things."""
    world = World.load(EXAMPLES / "feeder.toml", seed=4)
    world.fault("delay unit=1 link=script for_ms=40 nth=3")
    world.script(a_while)
    world.at(2.0, do.Set((("table", "IN9", 1.0),)))
    world.press("start", 1.0)
    world.run(for_=0.7)
    return world


@pytest.mark.parametrize("twice", [lambda world: pickle.loads(pickle.dumps(world)), copy.deepcopy, World.branch])
def test_a_copy_goes_on_as_the_world_does(twice: Any) -> None:
    world = running()
    other = twice(world)
    assert other is not world
    assert (other.now, other.spec.seed) == (world.now, 4)
    for one in (world, other):
        one.run(for_=6)
    assert other.trace.digest() == world.trace.digest()
    assert list(other.trace) == list(world.trace)
    assert recording_of(other) == recording_of(world)


def test_a_snapshot_can_be_pickled() -> None:
    world = running()
    snapshot = pickle.loads(pickle.dumps(world.snapshot()))
    world.run(for_=3)
    end = world.trace.digest()
    world.restore(snapshot)
    world.run(for_=3)
    assert world.trace.digest() == end


GO_ON = """
import pickle, sys
world, snapshot = pickle.load(sys.stdin.buffer)
world.run(for_=3)
first = world.trace.digest()
if snapshot is not None:
    world.restore(snapshot)
    world.run(for_=3)
sys.stdout.buffer.write(pickle.dumps((first, world.trace.digest(), world, world.snapshot())))
"""


def in_another_process(*what: object) -> Any:
    """Of a new interpreter, which shares no memory and no imports with this one."""
    found = subprocess.run([sys.executable, "-c", GO_ON], input=pickle.dumps(what), stdout=subprocess.PIPE, check=True)
    return pickle.loads(found.stdout)


@pytest.mark.parametrize("name", ["feeder.toml", "pick_and_place/pick_and_place.toml", "press/press.toml"])
def test_worlds_and_snapshots_go_between_processes(name: str) -> None:
    """There and back: both go on from where they are."""
    world = World.load(EXAMPLES / name, seed=4)
    world.run(for_=1.7)
    there = world.snapshot()
    first, again, came, ended = in_another_process(world, there)
    world.run(for_=3)
    assert first == again == came.trace.digest() == world.trace.digest()
    assert recording_of(came) == recording_of(world)
    for one in (came, world):
        one.run(for_=1)
    assert came.trace.digest() == world.trace.digest()
    world.restore(ended)
    world.run(for_=1)
    assert world.trace.digest() == came.trace.digest()


def test_without_a_trace_a_world_has_no_past_to_pickle() -> None:
    world = World.load(EXAMPLES / "feeder.toml", keep_trace=False)
    world.run(for_=1)
    with pytest.raises(Misuse, match="keeps no trace cannot be pickled"):
        pickle.dumps(world)
    world.branch().run(for_=1)


def test_a_branch_reads_no_toml(monkeypatch: pytest.MonkeyPatch) -> None:
    world = running()
    monkeypatch.setattr(keypaths, "find_spans", None)
    monkeypatch.setattr("steptwin.simulation.toml.reader.find_spans", None)
    assert world.branch().now == world.now


def test_faults_from_python_are_in_the_session(tmp_path: Path) -> None:
    world = World.load(EXAMPLES / "feeder.toml")
    assert world.fault("lost-steps machine=table axis=1 pulses=64 at_s=0.5") == "lost-steps"
    busy = world.fault("busy unit=1 link=script name=later")
    world.run(for_=1)
    world.clear_fault(busy)
    world.run(for_=1)
    with pytest.raises(Misuse, match="no fault 'later'"):
        world.clear_fault(busy)
    with pytest.raises(Misuse, match="axis = 9"):
        world.fault("stall machine=table axis=9")
    recording = recording_of(world)
    save(recording, tmp_path / "s.json")
    assert load(tmp_path / "s.json").replay().trace.digest() == recording.digest
    assert len(recording.inputs) == 3


def test_values_of_a_description_can_be_replaced(tmp_path: Path) -> None:
    overrides = {"axis.x.pitch": 10.0, "mic488.table.M1.acc": 500.0, "axis.0.start": 60.0, "world.name": "other"}
    world = World.load(EXAMPLES / "feeder.toml", overrides=overrides)
    assert (world.axis["x"].position, world.spec.name) == (60.0, "other")
    assert world.mic488["table"].device.config.axes[0].acc == 500.0
    assert world.axes["x"].spec.pitch == 10.0
    world.run(for_=1)
    save(recording_of(world), tmp_path / "s.json")
    recording = load(tmp_path / "s.json")
    assert recording.overrides == overrides
    assert recording.replay().trace.digest() == recording.digest
    assert pickle.loads(pickle.dumps(world)).spec.overrides == overrides
    with pytest.raises(Misuse, match="another world"):
        World.load(EXAMPLES / "feeder.toml").restore(world.snapshot())


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("axis.y.pitch", 1.0, "override 'axis.y.pitch': there is no 'y'"),
        ("axs.x.pitch", 1.0, r"there is no 'axs' \(did you mean 'axis'\?\)"),
        ("axis.x.pitsch", 1.0, r"error D004: \[axis\] has no 'pitsch' \(did you mean 'pitch'\?\)"),
        ("axis.x.pitch", -1, r"error D003: \[axis\]: pitch: -1: permitted are numbers above 0"),
        ("seed", 1, "expected TABLE.KEY or TABLE.NAME.KEY"),
        ("axis.x", 1, "expected TABLE.KEY or TABLE.NAME.KEY"),
        ("axis.x.pitch.y", 1, "there is no 'pitch'|expected TABLE.KEY"),
    ],
)
def test_what_cannot_be_replaced(key: str, value: object, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        World.load(EXAMPLES / "feeder.toml", overrides={key: value})
