"""Power of motors apart from their controllers: a contact takes the current, and nobody tells the controller."""

from __future__ import annotations

from pathlib import Path

import pytest
from free_rotors import coasted, turns
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 900.0
vel = 90.0
mot_resol = 3200
enc_resol = 4000
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
power = "k.no"
[[relay]]
name = "k"
coil = "c.OUT1"
drop_out = "5 ms"
"""
MOTOR = "[axis.motor]\ntorque = [[0, 0.8], [1500, 0.8]]\n"
STIFF = TEXT.replace("[[relay]]", MOTOR + "[[relay]]")
INERTIA, LOAD, FRICTION = 5e-5, 0.3, 0.05
HANGING = STIFF.replace("[[relay]]", f"inertia = {INERTIA}\nload = {LOAD}\nfriction = {FRICTION}\nwhen_off = 'free'\n[[relay]]")


def started(text: str = TEXT, to: float = 80.0) -> World:
    """Moving since 0.1 s, at its speed from 0.2 s on."""
    world = World.from_toml(text, name="w.toml")
    device = world.mic488["c"]
    device.write("OUT1", 1)
    device.write("M1_EN", 1)
    world.run(until=0.1)
    device.write("M1_POS_ABS", to)
    return world


def events(world: World, code: str) -> list[tuple[float, str]]:
    return [(one.time / SECOND, str(one.value)) for one in world.trace.of("event") if one.subject == code and one.time]


@pytest.mark.parametrize("text", [TEXT, STIFF, STIFF + "[[fault]]\nkind = 'lost-steps'\nmachine = 'c'\naxis = 1\nat_s = 9\n"])
def test_without_power_it_stands_while_its_controller_counts_on(text: str) -> None:
    world = started(text)
    world.run(until=0.4)
    world.mic488["c"].write("OUT1", 0)
    world.run(until=0.405)
    there = world.axis["x"].position
    assert there == pytest.approx(world.read("c.M1.position"), abs=0.01)
    world.run(until=0.5)
    assert world.axis["x"].position == there
    assert world.read("c.M1.position") > there + 8.0
    assert events(world, "power") == [(0.405, "x has no power")]
    # Its encoder stands, too.
    assert world.mic488["c"].axis[1].encoder == pytest.approx(there / 5 * 4000, abs=1)
    world.run(until=2.0)
    assert (world.axis["x"].position, world.read("c.M1.position")) == (there, 80.0)
    world.mic488["c"].write("OUT1", 1)
    world.run(for_=0.1)
    # Caught at the nearest place with the angle of the field.
    assert world.axis["x"].lost % 64 == 0 < world.axis["x"].lost
    assert world.axis["x"].position == pytest.approx(there, abs=0.0501)
    assert [what for _, what in events(world, "power")] == ["x has no power", "x has power again"]


def test_power_that_returns_to_a_moving_field_finds_a_rotor_that_has_lost_it() -> None:
    world = started(STIFF.replace("torque =", "start_speed = 300\ntorque ="))
    world.run(until=0.4)
    world.mic488["c"].write("OUT1", 0)
    world.run(until=0.5)
    world.mic488["c"].write("OUT1", 1)
    world.run(until=3.0)
    (lost_at, _), (caught_at, _) = events(world, "stall")
    assert lost_at == 0.5
    # 300 rev/min are 25 mm/s, on the ramp down.
    assert caught_at == pytest.approx(0.1 + 0.1 + (80 - 9) / 90 + 65 / 900, abs=1e-6)
    assert world.axis["x"].lost % 64 == 0 < world.axis["x"].lost


def test_what_hangs_falls_from_the_speed_that_it_has() -> None:
    world = started(HANGING)
    world.run(until=0.4)
    world.mic488["c"].write("OUT1", 0)
    world.run(until=0.405)
    begin = turns(world.axis["x"].position, 5.0)
    for moment in (0.41, 0.42, 0.45):
        world.run(until=moment)
        place, _ = coasted(begin, turns(90.0, 5.0), moment - 0.405, inertia=INERTIA, load=LOAD, friction=FRICTION)
        assert turns(world.axis["x"].position, 5.0) == pytest.approx(place, abs=0.003), moment
    assert events(world, "fall")[-1] == (0.405, "x moves without current")
    assert world.read("c.M1.position") == pytest.approx(9.0 / 2 + 90 * 0.25, abs=0.01)


HIGHEST = (2 * 0.8 / 50 * (1 - ((LOAD + FRICTION) / 0.8) ** 2) ** 0.5 / INERTIA) ** 0.5
"""rad/s at which a field of 0.8 N·m still catches what hangs: √(2·T·λ/2π·√(1 − r²)/J)."""


@pytest.mark.parametrize("way", ["power", "EN"])
@pytest.mark.parametrize(("share", "caught"), [(0.97, True), (1.03, False)])
def test_a_field_at_rest_catches_a_falling_rotor_that_is_slow_enough_for_it(way: str, share: float, caught: bool) -> None:
    world = started(HANGING.replace('drop_out = "5 ms"', ""))
    world.run(until=2.0)
    key = "OUT1" if way == "power" else "M1_EN"
    world.mic488["c"].write(key, 0)
    world.run(for_=share * HIGHEST * INERTIA / (LOAD - FRICTION))
    world.mic488["c"].write(key, 1)
    world.run(for_=0.05)
    falls = [what for _, what in events(world, "fall")]
    lost = round(world.axis["x"].lost)
    assert falls[-2 if caught else -1 :] == ["x moves without current", f"x stands, {lost} pulses behind"][: 2 if caught else 1]
    assert (lost % 64 == 0) is caught
    assert (world.axis["x"].position > 79.0) is caught


@pytest.mark.parametrize(("share", "at_once"), [(0.97, True), (1.03, False)])
def test_a_moving_field_catches_a_rotor_that_is_not_much_slower_than_it(share: float, at_once: bool) -> None:
    friction, load = 0.25, 0.05
    world = started(
        HANGING.replace(f"load = {LOAD}", f"load = {load}")
        .replace(f"friction = {FRICTION}", f"friction = {friction}")
        .replace('drop_out = "5 ms"', "")
    )
    limit = (2 * 0.8 / 50 * (1 - ((load + friction) / 0.8) ** 2) ** 0.5 / INERTIA) ** 0.5
    world.run(until=0.4)
    world.mic488["c"].write("OUT1", 0)
    away = share * limit * INERTIA / (load + friction)
    world.run(for_=away)
    world.mic488["c"].write("OUT1", 1)
    world.run(until=2.0)
    lost = round(world.axis["x"].lost)
    if at_once:
        moment, text = events(world, "fall")[-1]
        assert (moment, text) == (pytest.approx(0.4 + away, abs=1e-6), f"x follows its field, {lost} pulses behind")
        assert events(world, "stall") == []
    else:
        (_, _), (caught, text) = events(world, "stall")
        assert text == f"x is caught, {lost} pulses behind"
        # The rotor has come to rest, and the field is as slow on its ramp down.
        assert turns(900 * (0.2 + (80 - 9) / 90 + 0.1 - caught), 5.0) == pytest.approx(limit, rel=1e-3)


def test_both_have_to_give_it_current() -> None:
    world = started(HANGING.replace("when_off", "start_speed = 3000\nwhen_off"))
    device = world.mic488["c"]
    world.run(until="idle")
    device.write("M1_EN", 0)
    world.run(for_=0.02)
    device.write("OUT1", 0)
    world.run(for_=0.02)
    device.write("M1_EN", 1)
    before = world.axis["x"].position
    world.run(for_=0.02)
    assert world.axis["x"].position < before
    device.write("OUT1", 1)
    world.run(for_=0.02)
    before = world.axis["x"].position
    world.run(for_=0.02)
    assert world.axis["x"].position == before


def test_a_welded_contact_leaves_it_on() -> None:
    world = started()
    world.fault("welded-contact element=k")
    world.run(until=0.4)
    world.mic488["c"].write("OUT1", 0)
    world.run(until="idle")
    assert (world.axis["x"].position, world.axis["x"].lost) == (80.0, 0)
    assert events(world, "power") == []


def test_a_jam_and_no_power_are_released_each_by_itself() -> None:
    world = started()
    device = world.mic488["c"]
    (mechanism,) = [part for part in world.schedulers[0].parts if isinstance(part, Mechanism)]
    world.run(until=0.3)
    mechanism.block(True, world.now, by="jam")
    device.write("OUT1", 0)
    world.run(until=0.4)
    there = world.axis["x"].position
    mechanism.block(False, world.now, by="jam")
    world.run(until=0.5)
    assert world.axis["x"].position == there
    device.write("OUT1", 1)
    world.run(until=0.6)
    assert world.axis["x"].position > there


@pytest.mark.parametrize("power", ["c.OUT2", "o.OUT1", "g.out", "k.nc", "p.good"])
def test_any_output_gives_power(power: str) -> None:
    """Of its controller, of another one, which shares its moments, and of elements."""
    text = TEXT.replace("k.no", power) + (
        '[[mic488]]\nname = "o"\n[[gate]]\nname = "g"\ninputs = ["o.OUT3"]\nkind = "not"\n'
        '[[supply]]\nname = "p"\nfeeds = "o"\non = "c.OUT4"\n'
    )
    world = World.from_toml(text)
    (joined,) = [one for one in world.schedulers if "c" in one.controllers]
    assert power.partition(".")[0] in {*joined.controllers, *joined.terminal_blocks}
    world.run(until=0.5)
    assert events(world, "power") == []  # but at the beginning
    has_power = power in ("g.out", "k.nc")
    world.mic488["c"].write("M1_EN", 1)
    world.mic488["c"].write("M1_POS_ABS", 10.0)
    world.run(for_=2.0)
    assert world.axis["x"].position == (10.0 if has_power else 0.0)


@pytest.mark.parametrize("text", [TEXT, HANGING])
@pytest.mark.parametrize("moment_s", [0.0, 0.402, 0.407, 0.7])
def test_snapshots_and_recordings_have_it(text: str, moment_s: float, tmp_path: Path) -> None:
    text += (
        '[[script]]\nname = "s"\nsteps = [{ write = { "c.OUT1" = 1, "c.M1_EN" = 1 } }, { wait = "100 ms" },'
        '{ write = { "c.M1_POS_ABS" = 60.0 } }, { wait = "300 ms" }, { write = { "c.OUT1" = 0 } }, { wait = "200 ms" },'
        '{ write = { "c.OUT1" = 1 } }, { wait = "500 ms" }, { write = { "c.M1_POS_ABS" = 5.0 } }]\n'
    )
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 2.0, tmp_path)


@pytest.mark.parametrize(
    ("power", "text"),
    [
        ("k.coil", "k.COIL is not an output"),
        ("c.IN1", "c.IN1 is not an output"),
        ("q.no", "nothing is called 'q'"),
        ("k", "expected CONTROLLER.PIN"),
    ],
)
def test_mistakes_have_their_places(power: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s)w.toml:16.*{text}"):
        World.from_toml(TEXT.replace("k.no", power), name="w.toml")


def test_a_normally_closed_contact_gives_power_from_the_beginning() -> None:
    world = World.from_toml(TEXT.replace("k.no", "k.nc"))
    world.run(until=0.1)
    assert [one for one in world.trace.of("event") if one.subject == "power"] == []
    assert world.read("x.power") == 0.0  # its controller has not switched it on
    world.mic488["c"].write("M1_EN", 1)
    assert world.read("x.power") == 1.0


def test_the_other_motor_of_a_gantry_moves_all_of_it() -> None:
    """Half of the beam is not too much for a motor, all of it is."""
    text = STIFF.replace('name = "x"', 'name = "y1"') + (
        '[mic488.M2]\nunit = "mm"\ngear = 640.0\nacc = 900.0\ndec = 900.0\nvel = 90.0\nmot_resol = 3200\n'
        '[[axis]]\nname = "y2"\ndrive = "c.M2"\npitch = 5.0\n[axis.motor]\ntorque = [[0, 0.8], [1500, 0.8]]\n'
        '[[gantry]]\nname = "g"\naxis = "y1"\nother = "y2"\nlimit = 30\nfriction_force = 1500\n'
    )
    head, controller, rest = text.partition("[mic488.M2]")
    second = controller + rest.partition("[[axis]]")[0]
    text = head.replace("[[axis]]", second + "[[axis]]", 1) + "[[axis]]" + rest.partition("[[axis]]")[2]
    world = World.from_toml(text)
    device = world.mic488["c"]
    device.write("OUT1", 1)
    for number in (1, 2):
        device.write(f"M{number}_EN", 1)
        device.write(f"M{number}_POS_ABS", 80.0)
    world.run(until=0.4)
    assert (world.read("y1.stalled"), world.read("y2.stalled")) == (0.0, 0.0)
    device.write("OUT1", 0)
    world.run(until=0.5)
    assert world.read("y1.power") == 0.0
    assert world.read("y2.stalled") == 1.0
