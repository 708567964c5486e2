"""What Python sees of a world."""

from __future__ import annotations

from pathlib import Path

import pytest
from world_rig import moved, small

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.script import steps as do


def test_names_that_are_not_there_are_misuse_with_those_that_are() -> None:
    world = small()
    with pytest.raises(Misuse, match="no axis 5: axes are 1, 2, 3, 4"):
        _ = world.mic488["a"].axis[5]
    with pytest.raises(Misuse, match="no MIC488 is called 'd'; there are a, b, c"):
        world.mic488["d"]
    with pytest.raises(Misuse, match=r"nothing is called 'z'.* there are a, b, c, x, go, time, idle"):
        world.run(until="z.position > 1")
    with pytest.raises(Misuse, match=r"no signal 'x\.spin'; there are position, lost, stalled, power, speed$"):
        world.read("x.spin")
    with pytest.raises(Misuse, match="no button is called 'stop'; there are go"):
        world.press("stop")
    with pytest.raises(Misuse, match="M1_POS_AB"):
        world.mic488["a"].write("M1_POS_AB", 1.0)
    assert "d" not in world.mic488
    assert (world.mic488.get("d"), world.mic488.get("d", 3)) == (None, 3)
    assert world.mic488.get("a") is world.mic488["a"]
    assert [*world.mic488] == ["a", "b", "c"]


def test_positions_are_those_of_register_and_mechanics() -> None:
    world = moved(small(), 25.0)
    assert world.run(until="a.M1.status == 4") == "a.M1.status == 4"
    axis = world.mic488["a"].axis[1]
    assert (axis.position, axis.velocity, axis.status, axis.unit) == (25.0, 0.0, AxisStatus.REACHED, "mm")
    assert (world.axis["x"].position, world.axis["x"].lost) == (75.0, 0)


def test_an_axis_in_motion() -> None:
    """Of a move of 25 mm with 100 mm/s²: 2 mm after 0.2 s, at 20 mm/s."""
    world = moved(small(), 25.0)
    axis, x = world.mic488["a"].axis[1], world.axis["x"]
    assert (axis.number, axis.enabled, world.mic488["a"].axis[2].enabled) == (1, True, False)
    world.run(for_=0.2)
    assert (axis.position, axis.velocity, axis.moving) == (pytest.approx(2.0, abs=0.011), pytest.approx(20.0), True)
    assert (x.position, x.rotor, x.unit, x.stalled) == (pytest.approx(52.0, abs=0.011), x.position, "mm", False)
    assert world.mic488["a"].status == int(world.mic488["a"].device.status())
    assert axis.encoder == int(round(axis.position * 100) * 400 / 3200)
    axis.stop()
    assert (axis.velocity, axis.moving) == (0.0, False)
    axis.move_by(-1.0)
    here = axis.position
    world.run(until="idle")
    assert axis.position == pytest.approx(here - 1.0, abs=1e-9)
    axis.home(-20.0)
    world.run(until="idle and time > 3", for_=30)
    assert axis.status is AxisStatus.REACHED


def test_rotor_and_load_differ_by_the_play() -> None:
    world = World.from_toml(
        '[[mic488]]\nname = "a"\n[mic488.M1]\nunit = "mm"\ngear = 100.0\n[[axis]]\nname = "x"\ndrive = "a.M1"\nbacklash = 0.5\n'
    )
    moved(world, 5.0).run(until="idle")
    assert (world.axis["x"].position, world.axis["x"].rotor) == (5.0, 5.0)
    world.mic488["a"].axis[1].move_to(2.0)
    world.run(until="idle")
    assert (world.axis["x"].position, world.axis["x"].rotor) == (2.5, 2.0)


def test_a_chip_and_what_it_is_told() -> None:
    world = World.from_toml('[[line]]\nname = "bus"\nkind = "m1486"\n[[m1486]]\nname = "d"\nline = "bus"\naddress = 3\n')
    chip = world.m1486["d"]
    assert (chip.name, chip.position, chip.counter, chip.moving) == ("d", 0, 0, False)
    world.line["bus"].send(b"x3\rf12800\rr\r")
    world.run(for_=0.05)
    assert chip.moving
    world.run(until="idle")
    assert (chip.position, chip.counter, chip.moving) == (12800, 12800, False)
    chip.set_pin("b3", 0)
    assert chip.pins["B3"] == 0.0
    chip.power_cycle()
    assert (chip.counter, chip.position) == (0, 12800)
    world.line["bus"].send(b"x3\ru20\r")
    world.run(for_=1)
    assert world.line["bus"].received()[-1:] == b"B"
    assert world.line["bus"].received() == b""


def test_a_line_has_a_place_for_each_program() -> None:
    world = World.from_toml('[[line]]\nname = "bus"\n[[mic488]]\nname = "a"\nline = "bus"\n')
    request = bytes.fromhex("01 03 27 24 00 02 8e b4")
    world.line["bus"].send(request, "plc")
    assert len(world.line["bus"].received("plc")) == 9
    assert world.line["bus"].received() == world.line["bus"].received("plc") == b""
    assert (len(world.line), [*world.line], "bus" in world.line) == (1, ["bus"], True)


def test_a_controller_is_switched_off_and_on() -> None:
    world = moved(small(), 10.0)
    world.run(for_=0.3)
    world.mic488["a"].power_cycle()
    axis = world.mic488["a"].axis[1]
    assert (axis.enabled, axis.moving, axis.position) == (False, False, 0.0)
    assert world.mic488["a"].program.name == "STOPPED" or world.mic488["a"].program == 0
    world.mic488["a"].set_pin("in7", 1)
    assert world.mic488["a"].pins["IN7"] == 1.0


def test_the_state_of_a_controller_is_that_of_the_moment() -> None:
    """Also for a program that looks during a run; the move ends after 1.025 s."""
    world = moved(small(), 25.0)
    seen = []
    for moment in ("200 ms", "1100 ms"):
        world.at(moment, do.Call(lambda: seen.append(world.mic488["a"].state.axes)))
    world.run(for_=2)
    assert [(axes[0].moving, axes[1].moving) for axes in seen] == [(True, False), (False, False)]
    assert [axes[0].status.text for axes in seen] == ["moving to position", "position reached"]
    assert [axes[0].position for axes in seen] == [pytest.approx(2.0, abs=0.011), 25.0]


def test_the_program_is_that_of_the_moment(tmp_path: Path) -> None:
    """It ends after its DELAY of 0.5 s."""
    (tmp_path / "end.prg").write_text("DELAY 0.5\nEND\n")
    (tmp_path / "world.toml").write_text('[[mic488]]\nname = "a"\nprogram = "end.prg"\nstart = true\n')
    world = World.load(tmp_path / "world.toml")
    seen = []
    for moment in ("200 ms", "900 ms"):
        world.at(moment, do.Call(lambda: seen.append(world.mic488["a"].program)))
    world.run(for_=2)
    assert [state.name for state in seen] == ["RUNNING", "STOPPED"]


def test_pins_are_those_of_the_moment() -> None:
    """An edge is 20 ms on its wire."""
    world = small()
    seen = []
    world.at("10 ms", do.Write((("a", "OUT1", 1.0),)))
    for moment in ("29 ms", "31 ms"):
        world.at(moment, do.Call(lambda: seen.append(world.mic488["b"].pins["IN3"])))
    world.run(for_=0.1)
    assert seen == [0.0, 1.0]
