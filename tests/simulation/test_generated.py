"""What ``serve`` and ``run`` describe, as a person gets it to go on with: golden/generated.txt, without what is said of keys.

Regenerate with ``python tests/simulation/test_generated.py`` and read the diff.
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


def shape(text: str) -> str:
    """What is said of a key is that of `steptwin.simulation.describe.tables`."""
    return re.sub(r"(?m)  # .*$", "  #", text)


def test_a_key_is_explained_where_it_stands_for_the_first_time() -> None:
    lines = WORLDS["demo of two"].splitlines()
    explained = [line for line in lines if line.startswith("unit = ") and "  # " in line]
    assert explained == [line for line in lines if line.startswith("unit = 1 ")]
    assert explained[0].partition("  # ")[2].startswith("slave address")


@pytest.mark.parametrize("name", WORLDS)
def test_descriptions_are_the_reviewed_ones(name: str) -> None:
    texts = [part.partition("\n") for part in GOLDEN.read_text("utf-8").split("=== ")[1:]]
    assert [head for head, _, _ in texts] == list(WORLDS)
    assert shape(WORLDS[name]) in [text for _, _, text in texts]


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
    GOLDEN.write_text("".join(f"=== {name}\n{shape(text)}" for name, text in WORLDS.items()), "utf-8")
