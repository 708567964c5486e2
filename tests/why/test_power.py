"""Why a motor has current or not, and why an axis stands that should move."""

from __future__ import annotations

import pytest

from steptwin.files.world import World

TEXT = """
[[mic488]]
name = "c"
program = "p.prg"
start = true
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 900.0
vel = 90.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
power = "k.no"
[axis.motor]
torque = [[0, 0.8], [1500, 0.2]]
[[relay]]
name = "k"
coil = "c.OUT1"
drop_out = "5 ms"
"""
PROGRAM = (
    b"M1 = ON\nOUT1 = ON\nPABS M1 80\nDELAY 0.3\nOUT1 = OFF\nDELAY 0.1\nOUT1 = ON\nWAITPOS\nDELAY 0.1\nOUT1 = OFF\nM1 = OFF\n"
)
CONTACT = "which gives x its power"


@pytest.fixture(scope="module")
def world() -> World:
    found = World.from_toml(TEXT, {"p.prg": PROGRAM})
    found.run(until=2.0)
    return found


def links(world: World, question: str, at: float) -> list[str]:
    return [link.text for link in world.why(question, at).links]


def test_its_contact_is_why_a_motor_has_no_current(world: World) -> None:
    assert links(world, "x.power", 0.35)[:3] == [
        f"k.no became 0, {CONTACT}",
        "c.OUT1 became 0, k follows after 5 ms",
        "line 5 `OUT1 = OFF` was executed",
    ]
    assert links(world, "x.power", 0.5)[0] == f"k.no became 1, {CONTACT}"


@pytest.mark.parametrize("signal", ["x.position", "x.lost"])
def test_it_is_why_an_axis_stands_that_should_move(world: World, signal: str) -> None:
    assert links(world, signal, 0.35)[0] == f"k.no became 0, {CONTACT}"
    # At rest it moves nothing.
    assert links(world, signal, 1.9)[:3] == [
        "x is caught, 36480 pulses behind",
        "x stalls: it no longer follows its field",
        "x had no power from 0.309000 s on: the pulses since then moved nothing",
    ]


def test_a_controller_that_switches_the_motor_off_is_why_too() -> None:
    found = World.from_toml(TEXT.replace('power = "k.no"\n', ""), {"p.prg": PROGRAM})
    found.run(until=2.0)
    assert links(found, "x.power", 0.5)[0] == "line 1 `M1 = ON` was executed"
    assert links(found, "x.power", 1.9)[0] == "line 11 `M1 = OFF` was executed"
