"""The state of a controller: of one shape whatever its kind, as its schema and its data sheet say."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest

from steptwin import World
from steptwin.controllerstate import ControllerState, ProgramActivity, StatusLevel
from steptwin.datasheet import FactType
from steptwin.jsonvalues import read, to_json
from steptwin.simulation.script.steps import Send, Set
from steptwin.subject.commands import Advance, Enable, Move, ReadPins, ReadState
from steptwin.subject.schema import definitions
from steptwin.subject.world import WorldSubject

WORLDS = sorted((Path(__file__).parents[2] / "examples/worlds").glob("*.toml"))
VALUES: Mapping[FactType, tuple[type, ...]] = {
    FactType.WHOLE: (int, type(None)),
    FactType.NUMBER: (int, float),
    FactType.TRUTH: (bool,),
    FactType.TEXT: (str,),
    FactType.WHOLES: (list,),
    FactType.NAMED: (dict,),
}
TWO = """
[[mic488]]
name = "m"
[mic488.M1]
unit = "mm"
gear = 100.0
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "k"
line = "chips"
"""


def state(subject: WorldSubject, name: str) -> dict[str, Any]:
    """As it goes over a wire."""
    return json.loads(json.dumps(subject.do(ReadState(name)).value))


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_states_of_a_running_world_are_as_schema_and_data_sheet_say(path: Path) -> None:
    defs: dict[str, Any] = definitions()
    schema = jsonschema_rs.Draft202012Validator({**defs["(state)"], "$defs": defs})
    with World.load(path) as world:
        subject = WorldSubject(world)
        for _ in range(20):
            world.run(for_=0.7)
            for part in subject.description.controllers:
                found, sheet = state(subject, part.name), part.datasheet
                assert list(schema.iter_errors(found)) == []
                assert json.loads(json.dumps(to_json(read(ControllerState, found)))) == found
                assert (found["kind"], found["variant"]) == (sheet.kind, sheet.variant)
                assert found["time_s"] == world.now / 1e9
                assert [(axis["name"], axis["unit"]) for axis in found["axes"]] == [(axis.name, axis.unit) for axis in sheet.axes]
                assert set(found["pins"]) == {pin.name for pin in sheet.pins}
                assert list(found["details"]) == [detail.name for detail in sheet.details]
                for detail in sheet.details:
                    assert type(found["details"][detail.name]) in VALUES[detail.type], detail
                assert found["program"]["state"] in {one.value for one in ProgramActivity}


def test_the_position_in_a_motion_is_that_of_the_point() -> None:
    world = World.from_toml(TWO)
    subject = WorldSubject(world)
    subject.do(Enable("m", 1))
    subject.do(Move("m", 1, to=20.0))
    subject.do(Move("k", 1, by=1280))
    world.run(for_=0.05)
    mic, chip = state(subject, "m")["axes"][0], state(subject, "k")["axes"][0]
    positions = [reading.value for reading in subject.read("m.M1.position", "k.position")]
    assert [mic["position"], chip["position"]] == positions
    assert 0 < chip["position"] < 1280
    assert [mic["enabled"], chip["enabled"]] == [True, None]
    assert [mic["moving"], chip["moving"]] == [True, True]
    assert [mic["status"]["code"], mic["status"]["text"]] == [3, "moving to position"]
    assert [chip["status"]["code"], chip["status"]["text"]] == [None, "move"]
    world.run(for_=5)
    assert [state(subject, name)["axes"][0]["moving"] for name in ("m", "k")] == [False, False]


@pytest.mark.parametrize(
    ("typed", "activity", "words", "level"),
    [
        ("z3\r", ProgramActivity.WAITING, "waits until B3 is low", StatusLevel.OK),
        ("w2000\r", ProgramActivity.WAITING, "waits 1.500 s more", StatusLevel.OK),
        ("f640000\rr\ru20\r", ProgramActivity.WAITING, "waits for the end of the move", StatusLevel.OK),
        ("k", ProgramActivity.STOPPED, "has nothing to do", StatusLevel.OK),
        ("c51\rg+\rr\rk\r", ProgramActivity.PAUSED, "stopped by Kill (C75 lets it go on)", StatusLevel.WARNING),
    ],
)
def test_what_the_program_of_a_chip_does(typed: str, activity: ProgramActivity, words: str, level: StatusLevel) -> None:
    world = World.from_toml(TWO)
    subject = WorldSubject(world)
    subject.do(Send("chips", typed.encode()))
    world.run(for_=0.5)
    found = read(ControllerState, state(subject, "k"))
    assert (found.program.state, found.program.text, found.status.level) == (activity, words, level)
    assert (found.status.text == "ok") is (level is StatusLevel.OK)


def test_a_chip_that_is_shut_down_and_an_axis_at_a_limit_are_warnings() -> None:
    world = World.from_toml(TWO.replace("gear = 100.0", 'gear = 100.0\nin_kr = "IN1"\nlimit_mode = "KR"'))
    subject = WorldSubject(world)
    subject.do(Enable("m", 1))
    subject.do(Move("m", 1, to=20.0))
    subject.do(Set((("m", "IN1", 1.0), ("k", "SD", 0.0))))
    world.run(for_=0.5)
    chip, axis = read(ControllerState, state(subject, "k")), read(ControllerState, state(subject, "m")).axes[0]
    assert (chip.status.level, chip.status.text) == (StatusLevel.WARNING, "shut down")
    assert (axis.status.level, axis.status.text) == (StatusLevel.WARNING, "stopped at limit R")


def test_the_pins_that_are_asked_for_are_those_of_the_state() -> None:
    """Those of a driver interface follow the pulses, between which a chip has nothing to do."""
    world = World.from_toml(TWO.replace('name = "k"', 'name = "k"\ninterface = "dual"'))
    subject = WorldSubject(world)
    subject.do(Send("chips", b"v200\rf64000\rr\r"))
    world.run(for_=0.5)
    for _ in range(8):
        subject.do(Advance(duration=3_100_000))
        pins = subject.do(ReadPins("k")).value
        levels = state(subject, "k")["pins"]
        assert pins == {f"k.{pin}": level for pin, level in levels.items()}
        assert world.m1486["k"].pins == levels == {pin: world.read(f"k.{pin}") for pin in levels}
