"""Elements of a world: one that only the tests know passes through all of it, and what is incomplete is refused."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from toy import kind, lamp
from toy.lamp import LAMP
from typer.testing import CliRunner
from whole_world import everything

from steptwin.cli import app
from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.files.export import axis_views, read_trace, write_trace
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.running import up
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.components.contact import ContactSpec
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.components.registry import ELEMENTS, register
from steptwin.simulation.components.source import SOURCE
from steptwin.simulation.components.wire import WIRE
from steptwin.simulation.faults import KINDS, read
from steptwin.simulation.script.steps import SetFault
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import word
from steptwin.tables import IncompleteTable

TEXT = """
[world]
name = "signal lamp"
[[line]]
name = "bus"
kind = "toys"
tcp = "127.0.0.1:0"
[[toy]]
name = "t"
line = "bus"
[[lamp]]
name = "busy"
from = "t.BUSY"
warms = "50 ms"
[[fault]]
kind = "burnt-out"
element = "busy"
from_s = 0.2
until_s = 0.3
[[script]]
name = "operator"
steps = [
  { send = "bus", text = "M\\n" },
  { until = "busy.lit == 1" },
  { note = "lit" },
  { until = "busy.lit == 0" },
  { note = "dark" },
  { until = "idle" },
  { expect = "busy.lit == 1" },
]
"""
"""M 10 is a move of 100 pulses at 1000 p/s², which takes 2·√(100/1000) s."""
MOVE_NS = 632_455_533


@pytest.fixture(autouse=True)
def lamps() -> Iterator[None]:
    with kind.registered(), lamp.registered():
        yield


def edges(world: World, channel: str) -> list[tuple[int, object]]:
    return [(record.time, record.value) for record in world.trace.edges() if record.subject == channel]


def test_it_is_described_built_recorded_and_asked_for() -> None:
    world = World.from_toml(TEXT)
    world.run(for_=2)
    # The move ends within the nanosecond after its last pulse's moment.
    *burnt, (end, off) = edges(world, "busy")
    assert burnt == [(50 * MILLISECOND, 1.0), (200 * MILLISECOND, 0.0), (300 * MILLISECOND, 1.0)]
    assert abs(end - MOVE_NS) <= 1
    assert off == 0.0
    notes = [(record.value, record.time) for record in world.trace if record.subject == "note"]
    assert notes == [("lit", 50 * MILLISECOND), ("dark", 200 * MILLISECOND)]
    # At the end of the move the lamp is dark in the same moment.
    assert [record.value for record in world.failures] == ["busy.lit == 1; busy.lit is 0"]
    assert world.objects.built(LAMP)["busy"].lit is False


def test_its_faults_are_recorded_set_and_cleared() -> None:
    world = World.from_toml(TEXT)
    world.run(for_=0.1)
    world.apply_input(SetFault(read("burnt-out element=busy name=now")))
    world.run(for_=0)
    assert world.read("busy.lit") == 0.0
    assert [(record.subject, record.value) for record in world.trace.of("fault")] == [("now", "it is burnt out")]
    world.objects.faults.remove("now", world.now)
    assert world.read("busy.lit") == 1.0
    world.run(for_=1)
    texts = [(record.time, record.value) for record in world.trace.of("fault") if record.subject == "burnt-out"]
    assert texts == [(200 * MILLISECOND, "it is burnt out"), (300 * MILLISECOND, "it has been replaced")]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('"t.BUSY"', '"t.STOP"', "t.STOP is not an output: outputs of 't' are BUSY"),
        ('"t.BUSY"', '"u.BUSY"', "nothing is called 'u'"),
        ('warms = "50 ms"', 'warm = "50 ms"', r"\[lamp\] has no 'warm' \(did you mean 'warms'\?\)"),
        ('warms = "50 ms"', 'warms = "soon"', "warms: 'soon' is not a time"),
        ('name = "busy"', 'name = "t"', r"'t' is taken by \[\[toy\]\] 't'"),
        ('element = "busy"', 'element = "bus"', "element = 'bus': those that can fail are busy"),
        ("busy.lit == 0", "busy.light == 0", "no signal 'busy.light'"),
        ("[[lamp]]", "[[lmap]]", r"the file has no \[lmap\] \(did you mean 'lamp'\?\)"),
    ],
)
def test_mistakes_in_its_table_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(TEXT.replace(old, new, 1))


@pytest.mark.parametrize("moment_s", [0.0, 0.03, 0.2, 0.25, 0.31, 0.7])
def test_a_snapshot_a_session_and_a_file_have_it(moment_s: float, tmp_path: Path) -> None:
    world = World.from_toml(TEXT)
    world.run(for_=moment_s)
    snapshot = world.snapshot()
    world.run(until=1.0)
    other = World.from_toml(TEXT)
    other.restore(snapshot)
    other.run(until=1.0)
    assert other.trace.digest() == world.trace.digest()
    save(recording_of(world), tmp_path / "s.json")
    assert load(tmp_path / "s.json").digest == world.trace.digest()
    write_trace(world.trace, tmp_path / "t.jsonl", views=axis_views(world))
    assert read_trace(tmp_path / "t.jsonl").trace.digest() == world.trace.digest()


def test_run_and_up_have_it(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    place = tmp_path / "lamp.toml"
    place.write_text(TEXT, "utf-8")
    ended = CliRunner().invoke(app, ["run", str(place), "--for", "2s", "--trace", str(tmp_path / "t.csv")])
    assert "it is burnt out" in ended.output
    assert "expectation failed" in ended.output
    assert "busy.lit == 1" in ended.output
    assert "t.busy" in (tmp_path / "t.csv").read_text().splitlines()[0]
    place.write_text(TEXT.replace("{ expect", '{ stop = "done" },\n  { expect'), "utf-8")
    assert up(UpOptions(world=place, live=LiveOptions(speed="1000")))
    assert "it has been replaced" in capfd.readouterr().out


def test_a_fault_of_an_element_happens_once_from_its_beginning_to_its_end() -> None:
    world = World.from_toml(TEXT)
    (active,) = world.objects.faults.active
    happened = []
    for moment in (0.199, 0.2, 0.25, 0.3, 0.9):
        world.run(until=moment)
        happened.append(active.struck)
    assert happened == [0, 1, 1, 1, 1]


def test_what_elements_of_a_kind_do() -> None:
    world = everything()
    found = {
        name: element.function(built)
        for element in ELEMENTS.values()
        if element.function is not None
        for name, built in world.objects.built(element).items()
    }
    assert found == {"both": "or", "start-time": "pulse"}


EDGES = """
beam.skewed belt.sensor1 both.out box.acts bump.hit clamp.extended clamp.retracted cup.held cycles.out
glance.seen head.x_switch1 hold.released ic.hit ig.at_high ig.at_low ig.switch1 ih.at_high ih.at_low
jaws.closed jaws.held jaws.opened knife.switch1
lifter.held nudge.hit power.nc power.no rail.good seen.out slide.switch1 start start-time.out
turret.switch1 va.extended va.retracted
"""


def test_what_elements_record_begins_with_its_first_level() -> None:
    """Every edge that no pin has."""
    world = everything()
    pins = {pin for controller in world.controllers.values() for pin in controller.pins()}
    subjects = []
    for seconds in (0.001, 2.0):
        world.run(for_=seconds)
        subjects.append({record.subject for record in world.trace.edges()} - pins)
    first, all_of_them = subjects
    assert all_of_them - first == {"belt.feeder_stands"}, "of a fault"
    assert sorted(first) == EDGES.split()


@table("[[button]]")
class Unread(ContactSpec):
    """A button with a field that is not a key."""

    name: str = ""
    colour: str = "green"


class Undeclared(NamedSpec):
    """A key without ``@table``, which nobody reads."""

    colour: str = key(word("green", "red"), "colour", default="green")


@pytest.mark.parametrize(
    ("element", "changed", "text"),
    [
        (BUTTON, {"spec": Undeclared}, "Undeclared lacks its header"),
        (BUTTON, {"spec": Unread}, "element button: no key becomes colour, name of Unread"),
        (BUTTON, {"signals": None}, "element button has a name and lacks its signals"),
        (WIRE, {"signals": lambda part: {}}, "element wire has signals and lacks a name"),
        (WIRE, {"terminals": ELEMENTS["gate"].terminals}, "element wire has terminals and lacks a name"),
        (WIRE, {"faults": LAMP.faults}, "element wire: fault burnt-out is of the layer element, and its element has a name"),
        (LAMP, {"faults": (KINDS["stall"],)}, "element lamp: fault stall is of the layer element"),
    ],
)
def test_an_incomplete_element_is_refused(element: Any, changed: dict[str, object], text: str) -> None:
    with pytest.raises(IncompleteTable, match=text):
        dataclasses.replace(element, **changed)


def test_a_piece_that_is_left_out_is_an_error_at_import() -> None:
    whole: dict[str, Any] = {one.name: getattr(SOURCE, one.name) for one in dataclasses.fields(SOURCE) if one.init}
    for name in ("spec", "refers", "build"):
        with pytest.raises(TypeError, match=name):
            type(SOURCE)(**{key: value for key, value in whole.items() if key != name})


def test_a_name_is_registered_once() -> None:
    with pytest.raises(Misuse, match="there is an element 'lamp' already"):
        register(LAMP)
