"""Descriptions that ``serve`` and ``run`` write for a person to go on with; some in golden/generated.txt, without their remarks.

Regenerate with ``make golden ARGS=tests/simulation/test_generated.py`` and read the diff.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.world import World
from steptwin.simulation.describe.generated import InputChange, Whole
from steptwin.simulation.describe.generated_m1486 import m1486_world
from steptwin.simulation.describe.generated_mic488 import AxisSwitches, mic488_world
from steptwin.simulation.faults import read

GOLDEN = Path(__file__).parent / "golden" / "generated.txt"
HERE = {"tcp": "127.0.0.1:0"}

WORLDS = {
    "one MIC488": mic488_world(Whole(name="w", line=HERE), [None], {}),
    "demo of one": mic488_world(Whole(name="w", line=HERE, seed=7, state="memory", trace="ring 100"), [5], {}, demo=True),
    "demo of two": mic488_world(Whole(name="w"), [1, 2], {"firmware": "1.23"}, demo=True),
    "switches and inputs": mic488_world(
        Whole(name="w", faults=[read("slip axis=2 counts=5"), read("busy name=late address=100-101")]),
        [None],
        {},
        switches=[
            AxisSwitches(1, -5.0, 20.5, "IN1", "IN2"),
            AxisSwitches(3, None, 8.0, "IN3", "IN4", ("NC", "NC")),
            AxisSwitches(4, 0.0, None, "IN5", "IN6", ("NC", "NO")),
        ],
        changes=[
            InputChange(250 * MILLISECOND, "mic488.IN8", 1.0, "IN8 = 1"),
            InputChange(2 * SECOND, "mic488.AIN1", 4.2, 'it says "go"'),
        ],
    ),
    "one chip": m1486_world(Whole(name="w", line=HERE), [15], {"variant": "E1"}),
    "chips": m1486_world(
        Whole(name="w"),
        [3, 10],
        {"variant": "A", "interface": "two"},
        wires=[("chip3.B1", "chipA.B2")],
        typed=["f64", "r", "x3", "xg", "u20"],
        changes=[InputChange(SECOND, "chip3.B7", 0.0, "B7 = 0")],
    ),
}


REVIEWED = ("one MIC488", "switches and inputs", "chips")


def shape(text: str) -> str:
    """What is said of a key is that of `steptwin.simulation.describe.tables`."""
    return re.sub(r"(?m)  # .*$", "  #", text)


def test_a_key_is_explained_where_it_stands_for_the_first_time() -> None:
    lines = WORLDS["demo of two"].splitlines()
    explained = [line for line in lines if line.startswith("unit = ") and "  # " in line]
    assert explained == [line for line in lines if line.startswith("unit = 1 ")]
    assert explained[0].partition("  # ")[2].startswith("slave address")


@pytest.mark.parametrize("name", REVIEWED)
def test_descriptions_are_the_reviewed_ones(name: str) -> None:
    texts = [part.partition("\n") for part in GOLDEN.read_text("utf-8").split("=== ")[1:]]
    assert [head for head, _, _ in texts] == list(REVIEWED)
    assert shape(WORLDS[name]) in [text for _, _, text in texts]


def test_what_belongs_to_the_whole_world_and_to_each_controller() -> None:
    one, two = (tomllib.loads(WORLDS[name]) for name in ("demo of one", "demo of two"))
    assert one["world"] == {"name": "w", "seed": 7, "state": "memory", "trace": "ring 100"}
    assert two["world"] == {"name": "w"}
    assert [(machine["name"], machine.get("unit")) for machine in one["mic488"]] == [("mic488", 5)]
    named = [(machine["name"], machine["unit"], machine["firmware"]) for machine in two["mic488"]]
    assert named == [("mic488-1", 1, "1.23"), ("mic488-2", 2, "1.23")]
    assert tomllib.loads(WORLDS["one chip"])["m1486"] == [{"name": "chipF", "line": "bus", "address": 15, "variant": "E1"}]


@pytest.mark.parametrize(("name", "count"), [("demo of one", 4), ("demo of two", 8)])
def test_each_drive_of_a_demo_has_a_spindle_with_the_switches_that_it_knows(name: str, count: int) -> None:
    described = tomllib.loads(WORLDS[name])
    drives = {
        f"{machine['name']}.{key}": (machine["name"], drive)
        for machine in described["mic488"]
        for key, drive in machine.items()
        if isinstance(drive, dict)
    }
    assert len(drives) == count
    assert {axis["drive"] for axis in described["axis"]} == drives.keys()
    for axis in described["axis"]:
        machine, drive = drives[axis["drive"]]
        ends = [{"below": -10.0, "to": f"{machine}.{drive['in_kl']}"}, {"above": 250.0, "to": f"{machine}.{drive['in_kr']}"}]
        assert axis["switch"] == ends
        assert (drive["unit"], drive["gear"], drive["limit_mode"]) == ("mm", 100.0, "KL+KR")


def test_the_spindles_of_a_demo_can_be_homed_and_stop_at_their_ends() -> None:
    world = World.from_toml(WORLDS["demo of one"])
    controller = world.mic488["mic488"]
    for axis in range(1, 5):
        controller.write(f"M{axis}_EN", 1)
        controller.write(f"M{axis}_HOME", -20.0)
    world.run(for_="5 s")
    assert [event.code for event in controller.device.events].count("homed") == 4
    for axis in range(1, 5):
        controller.write(f"M{axis}_POS_ABS", 400.0)
    world.run(for_="20 s")
    assert [world.axis[axis].position for axis in "xyzu"] == pytest.approx([250.0] * 4, abs=0.1)


@pytest.mark.parametrize("name", WORLDS)
def test_descriptions_can_be_run(name: str) -> None:
    world = World.from_toml(WORLDS[name])
    world.run(for_="1 s")
    assert list(world.failures) == []


def test_lines_are_sent_to_chips_as_they_have_room() -> None:
    world = World.from_toml(m1486_world(Whole(name="w"), [15], {"variant": "A"}, typed=["f6400", "r", *["u20"] * 9, "b640", "r"]))
    world.run(for_="10 s")
    assert world.m1486["chipF"].position == 6400 - 640


def test_texts_stay_readable_and_are_toml() -> None:
    """Letters stay what they are; TOML permits no control character, DEL among them."""
    name = 'prasa ąż "2" \\ \t\x7f'
    text = mic488_world(Whole(name=name), [None], {})
    assert 'name = "prasa ąż \\"2\\" \\\\ \\t\\u007f"' in text
    assert tomllib.loads(text)["world"]["name"] == name


if __name__ == "__main__":
    GOLDEN.write_text("".join(f"=== {name}\n{shape(text)}" for name, text in WORLDS.items() if name in REVIEWED), "utf-8")
