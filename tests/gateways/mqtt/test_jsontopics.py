"""Topics and payloads of the JSON face."""

from __future__ import annotations

import asyncio
import json
from datetime import datetime
from typing import Any

import pytest
from gateway_rig import GatewayWorld

from steptwin.errors import Misuse
from steptwin.gateways.mqtt.homeassistant import discovery
from steptwin.gateways.mqtt.jsontopics import ControllerText, Group, Topics
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.simulation.script.steps import Set

TEXT = """
    [[mic488]]
    name = "table"
    [mic488.M1]
    unit = "mm"
    [[m1486]]
    name = "drum"
"""
REGISTERS = {"table": ["USER_REGISTER[5]"]}


def topics(text: str = TEXT, file: str = "cells/hall.toml") -> tuple[GatewayWorld, Topics]:
    world = GatewayWorld(text)
    return world, Topics("plant/steptwin", file, world.description, REGISTERS)


def sample(world: GatewayWorld, controller: str) -> Sample:
    return asyncio.run(Sampler(world.samples, REGISTERS).take(controller))


def test_groups_have_topics_of_their_own() -> None:
    _, found = topics()
    below = [group.topic.removeprefix("plant/steptwin/hall/") for group in found.groups["table"]]
    axes = [f"table/M{number}" for number in (1, 2, 3, 4)]
    assert below == ["table", "table/program", *axes, "table/pins", "table/details", "table/registers"]
    assert found("do") == "plant/steptwin/hall/do"
    assert [group.topic for group in found.groups["time"]] == ["plant/steptwin/hall/time"]


def test_a_world_with_a_name_is_called_by_it() -> None:
    assert topics('[world]\nname = "press"\n' + TEXT)[1].base == "plant/steptwin/press"
    assert topics(file="a+b#.toml")[1].base == "plant/steptwin/a_b_"


@pytest.mark.parametrize("name", ["do", "online", "events", "answer"])
def test_a_controller_cannot_be_called_like_a_topic(name: str) -> None:
    with pytest.raises(Misuse, match=f"plant/steptwin/hall/{name} is not a topic for a controller"):
        topics(f'[[mic488]]\nname = "{name}"\n')


def values(group: Group, taken: Sample) -> dict[str, Any]:
    ((_, payload),) = ControllerText([group], taken.controller).changed(taken)
    found = json.loads(payload)
    assert found.pop("at").endswith("Z")
    return dict(found)


def test_values_have_their_types() -> None:
    world, found = topics()
    shown = {group.name: values(group, sample(world, "table")) for group in found.groups["table"]}
    assert shown[""] == {"answers": True, "status": "ok", "status_code": 0, "status_level": "ok"}
    assert (shown["pins"]["IN3"], shown["pins"]["AIN1"]) == (False, 0.0)
    assert shown["registers"] == {"USER_REGISTER[5]": 0.0}
    assert shown["M1"]["moving"] is False


def test_a_controller_that_is_silent_has_unknown_values() -> None:
    world, found = topics()
    world.silent.add("table")
    taken = sample(world, "table")
    assert values(found.groups["table"][0], taken) == {
        "answers": False,
        "status": None,
        "status_code": None,
        "status_level": None,
    }
    assert set(values(found.groups["table"][2], taken).values()) == {None}


def test_a_payload_has_the_moment_of_its_values() -> None:
    world, found = topics()
    taken = sample(world, "drum")
    payload = json.loads(dict(ControllerText(found.groups["drum"], "drum").changed(taken))["plant/steptwin/hall/drum"])
    assert datetime.fromisoformat(payload["at"]) == taken.at.replace(microsecond=taken.at.microsecond // 1000 * 1000)
    assert payload["at"].endswith("Z")
    assert payload["status"] == "ok"


def test_a_text_has_the_present_values_after_any_changes() -> None:
    world, found = topics()
    (group,) = (group for group in found.groups["table"] if group.name == "pins")
    text = ControllerText(found.groups["table"], "table")
    assert len(dict(text.changed(sample(world, "table")))) == len(found.groups["table"])
    assert dict(text.changed(sample(world, "table"))) == {}
    for level in (2.5, 7.0, 0.0):
        world.inner.do(Set((("table", "AIN1", level), ("table", "IN4", float(level > 5.0)))))
        taken = sample(world, "table")
        ((topic, payload),) = text.changed(taken)
        shown = json.loads(payload)
        assert shown.pop("at")
        assert (topic, shown) == (group.topic, values(group, taken))
        assert (shown["AIN1"], shown["IN4"]) == (level, level > 5.0)
    world.silent.add("table")
    silent = dict(text.changed(sample(world, "table")))
    assert len(silent) == len(found.groups["table"])
    assert {value for name, value in json.loads(silent[group.topic]).items() if name != "at"} == {None}
    assert dict(text.changed(sample(world, "table"))) == {}


def test_the_description_has_units_and_what_can_be_written() -> None:
    _, found = topics()
    about = json.loads(json.dumps(found.describe(["stop"])))
    table = about["controllers"][0]["topics"]
    assert table["plant/steptwin/hall/table/M1"]["values"]["velocity"]["unit"] == "mm/s"
    register = table["plant/steptwin/hall/table/registers"]["values"]["USER_REGISTER[5]"]
    assert (register["type"], register["low"], register["high"], register["written"]) == ("number", 0, 65535, True)
    assert about["commands"] == {"topic": found("do"), "answers": found("answer"), "names": ["stop"]}


def test_home_assistant_gets_one_device_for_each_controller() -> None:
    world, found = topics()
    sent = list(discovery(found, world.description))
    assert [one.topic for one in sent] == [
        "homeassistant/device/plant_steptwin_hall_table/config",
        "homeassistant/device/plant_steptwin_hall_drum/config",
    ]
    assert all(one.retain for one in sent)
    parts = json.loads(sent[0].payload)["cmps"]
    assert len({part["uniq_id"] for part in parts.values()}) == len(parts)
    speed = parts["M1_velocity"]
    assert (speed["dev_cla"], speed["unit_of_meas"], speed["val_tpl"]) == ("speed", "mm/s", "{{ value_json['velocity'] }}")
    assert json.loads(parts["stop_M2"]["pl_prs"]) == {"do": "stop", "controller": "table", "axis": 2}
