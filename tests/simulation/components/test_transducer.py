"""Analog sensors: voltages against the table at each moment, and edges where it crosses half a step."""

from __future__ import annotations

import re
from itertools import pairwise
from math import log
from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 100.0
dec = 100.0
vel = 50.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "a.M1"
pitch = 5.0
[[transducer]]
name = "gap"
of = "x.position"
to = "a.AIN1"
points = [[0, 1.0], [40, 9.0], [60, 9.0], [100, 0.0]]
resolution = 0.05
"""
TABLE = [(0, 1.0), (40, 9.0), (60, 9.0), (100, 0.0)]


def volts(position: float) -> float:
    """By hand, without steps."""
    if position <= 0:
        return 1.0
    for (x0, v0), (x1, v1) in pairwise(TABLE):
        if position <= x1:
            return v0 + (v1 - v0) * (position - x0) / (x1 - x0)
    return 0.0


def test_it_follows_the_table() -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 110.0)
    for n in range(1, 60):
        world.run(until=0.05 * n)
        assert world.read("a.AIN1") == pytest.approx(volts(world.axis["x"].position), abs=0.0251)
    device.write("M1_POS_ABS", -5.0)
    for _ in range(60):
        world.run(for_=0.05)
        assert world.read("a.AIN1") == pytest.approx(volts(world.axis["x"].position), abs=0.0251)
    assert world.read("gap.volts") == 1.0


def test_its_edges_are_exact() -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 20.0)
    world.run(until="idle")
    edges = [(record.time, float(str(record.value))) for record in world.trace.edges() if record.subject == "AIN1"]
    # 0.2 V per mm: half a step of 0.05 V after 0.125 mm, then every 0.25 mm; up to 12.5 mm s = 50 t².
    expected = [0.125 + 0.25 * n for n in range(80)]
    assert [value for _, value in edges[1:]] == pytest.approx([1.05 + 0.05 * n for n in range(80)])
    for (time, _), place in zip(edges[1:], expected, strict=True):
        if place < 10.0:
            pulse = -(-place * 640 // 1)
            assert time == pytest.approx((pulse / 640 / 50) ** 0.5 * SECOND, abs=2)


def test_it_measures_other_signals() -> None:
    more = """
    [[vacuum]]
    name = "cup"
    ejector = "a.OUT1"
    pick = "a.OUT2"
    vacuum = 80.0
    threshold = 60.0
    build_up = "100 ms"
    [[transducer]]
    name = "gauge"
    of = "cup.pressure"
    to = "a.AIN2"
    points = [[0, 0.0], [100, 10.0]]
    """
    world = World.from_toml(TEXT + more)
    device = world.mic488["a"]
    device.write("OUT2", 1)
    device.write("OUT1", 1)
    world.run(until=0.1)
    assert world.read("a.AIN2") == pytest.approx(6.0, abs=0.006)
    # e^(-t/T) = 1/4 after 0.1 s: after 0.05 s it is 1/2.
    half = [record.time for record in world.trace.edges() if record.subject == "AIN2" and record.value == pytest.approx(4.0)]
    # 4.00 V is shown from 3.995 V on: 40 · (1 + 0.005/4) kPa are lacking.
    assert half[0] == pytest.approx(0.1 * log(80 / 40.05) / log(4) * SECOND, abs=5)


def test_its_faults() -> None:
    world = World.from_toml(TEXT)
    world.fault("drift element=gap volts=-0.4 from_s=0.1 until_s=0.2")
    world.fault("broken-wire element=gap from_s=0.3")
    for until, expected in ((0.15, 0.6), (0.25, 1.0), (0.35, 0.0)):
        world.run(until=until)
        assert world.read("a.AIN1") == pytest.approx(expected)


def test_a_register_without_a_number_leaves_it_where_it_is() -> None:
    text = TEXT.replace('of = "x.position"', 'of = "a.USER_REGISTER[12]:real"')
    world = World.from_toml(text)
    shown = []
    for value in (20.0, float("nan"), float("inf"), 20.0, float("-inf"), 1e38):
        world.mic488["a"].write("USER_REGISTER[12]:real", value)
        world.run(for_=0.1)
        shown.append(world.read("a.AIN1"))
    assert shown == [5.0, 5.0, 0.0, 5.0, 1.0, 0.0]


@pytest.mark.parametrize("moment_s", [0.0, 0.3, 0.7, 1.9])
def test_snapshots_and_sessions_have_it(moment_s: float, tmp_path: Path) -> None:
    text = TEXT + (
        '[[fault]]\nkind = "drift"\nelement = "gap"\nfrom_s = 0.5\nuntil_s = 0.8\n'
        '[[script]]\nname = "s"\nsteps = [{ write = { "a.M1_EN" = 1, "a.M1_POS_ABS" = 90.0 } }, { until = "a.AIN1 > 5" },'
        '{ wait = "200 ms" }, { write = { "a.M1_POS_ABS" = 10.0 } }]\n'
    )
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 3.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("[40, 9.0]", "[40, 12.0]", "t.toml:19.*0 to 12 V: an analog input takes 0 to 10 V"),
        ("points =", "point =", r"has no 'point' \(did you mean 'points'\?\)"),
        ('of = "x.position"', 'of = "x.positon"', r"no signal 'x.positon' \(did you mean 'position'\?\)"),
        ('of = "x.position"', 'of = "y.position"', "nothing is called 'y'"),
        ('of = "x.position"', 'of = "time"', "nothing is called 'time'"),
        ("AIN1", "IN1", "a.IN1 is not an analog input"),
        ("resolution = 0.05", "resolution = 0", "permitted are numbers from 0.0001 to 10"),
        (
            "resolution",
            '[[source]]\nto = "a.AIN1"\n[[transducer]]\nname="g"\nof="x.position"\nto="a.AIN1"\npoints=[[0,1]]\nresolution',
            "driven",
        ),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s){text}"):
        World.from_toml(TEXT.replace(old, new, 1), name="t.toml")


def test_what_conditions_cannot_use_is_not_measured() -> None:
    """The levels of a driver interface change between events, at moments that nothing tells."""
    chip = '[[m1486]]\nname = "k"\ninterface = "dual"\n[[wire]]\nfrom = "a.OUT1"\nto = "k.B3"\n'
    with pytest.raises(WorldError, match="B11"):
        World.from_toml(chip + TEXT.replace('of = "x.position"', 'of = "k.B11"'))
    World.from_toml(chip + TEXT.replace('of = "x.position"', 'of = "k.B4"'))


def test_two_that_depend_on_each_other_are_refused() -> None:
    second = TEXT.replace('of = "x.position"', 'of = "next.volts"') + TEXT[TEXT.index("[[transducer]]") :].replace(
        "gap", "next"
    ).replace("x.position", "gap.volts").replace("AIN1", "AIN2")
    told = r"no signal 'next\.volts' yet: \[\[transducer\]\] 'next' is built later; elements cannot depend on each other"
    with pytest.raises(WorldError, match=told):
        World.from_toml(second)


def test_the_order_of_tables_and_kinds_does_not_count() -> None:
    """A load cell over a load, which is over a sensor that is written below it, that is over a position."""
    motor = "[axis.motor]\ntorque = [[0, 2.0], [3000, 1.0]]\ninertia = 1e-5\n"
    sensor = TEXT[TEXT.index("[[transducer]]") :]
    cell = sensor.replace("gap", "cell").replace("x.position", "part.share").replace("AIN1", "AIN2")
    cell = re.sub("points = .*", "points = [[0, 0], [1, 10]]", cell)
    load = '[[load]]\nname = "part"\naxis = "x"\nmass = 0.1\nof = "gap.volts"\npoints = [[0, 0], [10, 1]]\n'
    plain = TEXT[: TEXT.index("[[transducer]]")]
    world = World.from_toml(plain + motor + load + cell + sensor)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 30.0)
    for _ in range(4):
        world.run(for_=0.2)
        assert world.read("cell.volts") == pytest.approx(world.read("gap.volts"), abs=0.1)
    assert world.read("cell.volts") > 3.0


def test_a_controller_with_the_name_of_a_signal_is_not_measured() -> None:
    text = TEXT.replace('of = "x.position"', 'of = "time"')
    with pytest.raises(WorldError, match="of = 'time' is not a quantity of what 'a' is connected to"):
        World.from_toml(f'[[mic488]]\nname = "time"\n{text}')


def test_it_follows_an_expression() -> None:
    """A load cell: a box of 3 units on what the position presses."""
    world = World.from_toml(TEXT.replace('of = "x.position"', 'of = "2 * x.position + 3 * (a.OUT1 > 0) - 1"'))
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("OUT1", 1)
    device.write("M1_POS_ABS", 30.0)
    for n in range(1, 12):
        world.run(until=0.1 * n)
        assert world.read("gap.volts") == pytest.approx(volts(2 * world.axis["x"].position + 2), abs=0.0251)
    device.write("OUT1", 0)
    world.run(for_="1 ms")
    assert world.read("gap.volts") == pytest.approx(volts(2 * world.axis["x"].position - 1), abs=0.0251)


@pytest.mark.parametrize(
    ("of", "message"),
    [
        ("x.position + gap.volts", "'gap' depends on itself"),
        ("x.position + a.M2.position", "x.position, a.M2.position change between events: of the signals"),
        ("x.position * x.position", "x.position: multiplied"),
        ("x.position +", "ends too early"),
    ],
)
def test_an_expression_that_it_does_not_follow(of: str, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        World.from_toml(TEXT.replace("x.position", of))
