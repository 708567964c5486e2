"""What a master sends for each command of a controller, and what is refused before it is sent."""

from __future__ import annotations

import struct

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.mic488.registermap import DataType
from steptwin.mic488.values import encoded, named
from steptwin.simulation.kinds.kind import MotionEnds
from steptwin.simulation.kinds.mic488.writes import REGISTERS
from steptwin.simulation.kinds.registry import M1486, MIC488
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControllerCommand, ControlProgram, Enable, Halt, Home, Jog, Move, Seek, StopAxes
from steptwin.simulation.world.references import check_step
from steptwin.subject.world import WorldSubject
from steptwin.wire.pdu import encode_request

MOST = 2**31 - 1
ON_A_LINE = """
[[line]]
name = "bus"
kind = "modbus"

[[mic488]]
name = "a"
line = "bus"
unit = 1

[mic488.M1]
unit = "mm"
gear = 640.0
acc = 150.0
dec = 150.0
vel = 50.0
"""


def controller() -> World:
    return World.from_toml('[[mic488]]\nname = "a"\n[mic488.M1]\nunit = "mm"\ngear = 0.5\n')


@pytest.mark.parametrize(
    ("command", "values"),
    [
        (Enable("a", 2), [("M2_EN", 1.0)]),
        (Enable("a", 2, on=False), [("M2_EN", 0.0)]),
        (Move("a", 1, to=3.5), [("M1_POS_ABS", 3.5)]),
        (Move("a", 4, to=0.0), [("M4_POS_ABS", 0.0)]),
        (Move("a", 1, by=-2.5), [("M1_POS_REL", -2.5)]),
        (Move("a", 5, to=1e30), [("M5_POS_ABS", 1e30)]),  # the register is not there, and it is told so
        (Move("a", 0, to=1e30), [("M0_POS_ABS", 1e30)]),
        (Home("a", 3, -7.0), [("M3_HOME", -7.0)]),
        (Jog("a", 3, 7.0), [("M3_VEL_ABS", 7.0)]),
        (ControlProgram("a", "start"), [("PROGRAM_CTRL", 1.0)]),
    ],
)
def test_registers_that_are_written(command: ControllerCommand, values: list[tuple[str, float]]) -> None:
    device = controller().mic488["a"].device
    found = MIC488.step_of(device, "bus", command)
    assert found == do.Write(tuple(("a", name, value) for name, value in values))


@pytest.mark.parametrize("register", ["POS_ABS", "POS_REL", "POSLIM_L", "POSLIM_R"])
@pytest.mark.parametrize("gear", [0.5, 1.0, 3.7, 640.0])
def test_what_is_refused_before_it_is_sent_is_what_a_controller_refuses(register: str, gear: float) -> None:
    """The nearest REALs on both sides of the ends of the range."""
    device = World.from_toml(f'[[mic488]]\nname = "a"\n[mic488.M1]\nunit = "mm"\ngear = {gear}\n').mic488["a"].device
    item = named(device.registers, f"M1_{register}")
    refused = {False: 0, True: 0}
    for end in (-(2.0**31) / gear, 2.0**31 / gear):
        around = real(end)
        for step in range(-4, 5):
            value = real(around * (1 + step * 2.0**-23))
            answer = device.execute(encode_request(encoded(item, value, DataType.REAL)), 0)
            try:
                REGISTERS.requests(device, ((item.name, value),), is_command=True)
                is_refused = False
            except Misuse:
                is_refused = True
            assert is_refused is bool(answer[0] & 0x80), value
            refused[is_refused] += 1
    assert all(refused.values())


def real(value: float) -> float:
    """The nearest REAL."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


@pytest.mark.parametrize("register", ["POS_ABS", "POS_REL"])
def test_each_way_to_a_position_that_is_too_far_has_one_answer(register: str) -> None:
    world = controller()
    subject = WorldSubject(world)
    values = (("a", f"M1_{register}", 2.0 * MOST + 2.0),)
    expected = f"M1_{register} = 4294967296 mm: permitted -4294967296…4294967294 mm"
    move = Move("a", 1, to=values[0][2]) if register == "POS_ABS" else Move("a", 1, by=values[0][2])
    ways = [
        lambda: subject.do(move),
        lambda: subject.do(do.Write(values)),
        lambda: check_step(world, do.Order(move)),
    ]
    for way in ways:
        with pytest.raises(Misuse) as error:
            way()
        assert str(error.value) == expected


def test_a_script_may_write_what_a_controller_ignores_now() -> None:
    """When a description or a recording is read, DATA_TYPE is not yet what it will be."""
    world = controller()
    values = (("a", "M1_POS_ABS", 2.0 * MOST + 2.0),)
    check_step(world, do.Write(values))
    world.apply_input(do.Write(values))
    world.run(until=0.5)
    assert world.read("a.M1.position") == 0.0
    world.apply_input(do.Write((("a", "DATA_TYPE", 1.0),)))
    world.run(until=1.0)
    world.apply_input(do.Write((("a", "M1_POS_ACT", float(MOST)),)))
    world.run(until=1.5)
    assert world.read("a.M1.position") == MOST / 0.5


def test_a_write_is_encoded_with_the_data_type_of_its_moment() -> None:
    """DATA_TYPE is changed by a request that is still on the line when time is advanced past it."""
    world = World.from_toml(ON_A_LINE)
    world.apply_input(do.Write((("a", "M1_EN", 1.0),)))
    world.run(until=0.1)
    world.fault("delay unit=1 for_ms=50 nth=1")
    world.apply_input(do.Write((("a", "USER_REGISTER[1]", 1.0),)))
    world.apply_input(do.Write((("a", "DATA_TYPE", 1.0),)))
    world.advance(world.now + 100 * MILLISECOND)
    world.apply_input(do.Write((("a", "M1_POS_ABS", 640.0),)))
    world.run(until=3.0)
    assert world.read("a.M1.position") == 1.0


def test_when_a_motion_has_ended() -> None:
    over = "a.M2.status != 3 and a.M2.status != 6 and a.M2.status != 8"
    assert MIC488.motion_ends("a", 2, None, None) == MotionEnds(over, "a.M2.status == 4")
    assert M1486.motion_ends("c", 1, None, None) == MotionEnds("not c.busy", "c.valid")
    assert M1486.motion_ends("c", 1, "chips", None) == MotionEnds("not c.busy and chips.idle", "c.valid")
    for pin, level in (("B8", 0), ("B4", 1)):
        ends = M1486.motion_ends("c", 1, "chips", Seek("c", 1, -1, pin))
        assert ends == MotionEnds("not c.busy and chips.idle", f"c.valid and c.counter == 0 and c.{pin} == {level}")


CHIP = """
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "c"
line = "chips"
address = 10
variant = "{variant}"
"""


def chips(*texts: str, variant: str = "A") -> World:
    """At rest after these commands."""
    world = World.from_toml(CHIP.format(variant=variant))
    for text in texts:
        world.line["chips"].send(f"xA\r{text}\r".encode())
        world.run(for_=2.0)
    return world


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Move("c", 1, to=640.0), "xA\rg640\rr\r"),
        (Move("c", 1, to=0.0), "xA\rh\rr\r"),
        (Move("c", 1, by=640.0), "xA\rf640\rr\r"),
        (Move("c", 1, by=-64.0), "xA\rb64\rr\r"),
        (Jog("c", 1, 6400.0), "xA\rv100\rg+\rr\r"),
        (Jog("c", 1, -1024.0), "xA\rv16\rg-\rr\r"),
    ],
)
def test_characters_that_are_typed(command: ControllerCommand, text: str) -> None:
    chip = chips("f1280", "r").m1486["c"].chip
    assert chip.drive.counter_u(chip.now) == 1280
    assert M1486.step_of(chip, "chips", command) == do.Send("chips", text.encode())


def test_characters_for_a_seek_and_for_a_chip_at_24_mhz() -> None:
    chip = chips().m1486["c"].chip
    assert M1486.seek(chip, "chips", Seek("c", 1, 1, "B21")) == do.Send("chips", b"xA\r)21\rc100\r")
    assert M1486.seek(chip, "chips", Seek("c", 1, -1, "B1")) == do.Send("chips", b"xA\r(1\rc100\r")
    fast = chips(variant="A2x").m1486["c"].chip
    assert M1486.step_of(fast, "chips", Jog("c", 1, 6400.0)) == do.Send("chips", b"xA\rv50\rg+\rr\r")


GRID = "no multiple of 64, the microstep of M1"


@pytest.mark.parametrize(
    ("command", "kind", "text"),
    [
        (Move("c", 2, to=64.0), Misuse, "c: no axis 2: an M1486 has one, 1"),
        (Jog("c", 1, 6432.0), Misuse, "velocity 6432 min. microsteps/s, V100.5: a whole number is needed"),
        (Jog("c", 1, 960.0), Misuse, "velocity 960 min. microsteps/s, V15: "),
        (Move("c", 1, to=64.5), Misuse, "position 64.5 min. microsteps: a whole number is needed"),
        (Move("c", 1, to=-64.0), Misuse, "position -64 min. microsteps: "),
        (Move("c", 1, by=65.0), Refusal, f"distance 65 min. microsteps: {GRID}"),
        (Move("c", 1, by=-65.0), Refusal, f"distance -65 min. microsteps: {GRID}"),
        (Move("c", 1, to=65.0), Refusal, f"position 65 min. microsteps: {GRID}"),
    ],
)
def test_what_a_chip_does_not_take(command: ControllerCommand, kind: type[Exception], text: str) -> None:
    chip = chips("f1280", "r").m1486["c"].chip
    with pytest.raises(kind) as error:
        M1486.step_of(chip, "chips", command)
    assert str(error.value).startswith(text)
    with pytest.raises(Refusal, match="c is on no line, so no commands can be sent to it"):
        M1486.step_of(chip, None, Jog("c", 1, 6400.0))


def test_a_chip_is_stopped_at_itself_and_its_program_cannot_be_started() -> None:
    chip = chips().m1486["c"].chip
    assert M1486.step_of(chip, None, StopAxes("c")) == Halt("c")
    assert M1486.step_of(chip, None, ControlProgram("c", "stop")) == Halt("c", program="stop")
    for action in ("start", "pause"):
        with pytest.raises(Refusal, match=f"c: an M1486 has no command to {action} its program: only stop can be done"):
            M1486.step_of(chip, None, ControlProgram("c", action))


@pytest.mark.parametrize(("to", "is_taken"), [(80.0, True), (112.0, False), (64.0, False)])
def test_positions_lie_on_the_grid_from_where_the_chip_is(to: float, is_taken: bool) -> None:
    """A microstep of 16 was made, then come whole steps of 64."""
    chip = chips("m4\rq4", "f16", "r", "m1\rq1").m1486["c"].chip
    assert (chip.drive.counter_u(chip.now), chip.drive.grid_u) == (16, 64)
    if is_taken:
        assert M1486.step_of(chip, "chips", Move("c", 1, to=to))
        return
    with pytest.raises(Refusal, match=GRID):
        M1486.step_of(chip, "chips", Move("c", 1, to=to))


def test_a_chip_that_moves_or_was_stopped_in_a_move_takes_no_move() -> None:
    world = chips()
    chip = world.m1486["c"].chip
    world.line["chips"].send(b"xA\rf64000\rr\r")
    world.run(for_=0.2)
    commands = (Move("c", 1, by=64.0), Jog("c", 1, 6400.0))
    for command in commands:
        with pytest.raises(Refusal, match=r"c is not at rest .*: wait, or stop it"):
            M1486.step_of(chip, "chips", command)
    with pytest.raises(Refusal, match="c is not at rest"):
        M1486.seek(chip, "chips", Seek("c", 1, 1, "B4"))
    world.line["chips"].send(b"xA\rk\r")
    world.run(for_=2.0)
    with pytest.raises(Refusal, match=r"c was stopped in a move: its counter does not show where it is \(M-16\)"):
        M1486.step_of(chip, "chips", Move("c", 1, to=64.0))
    assert M1486.step_of(chip, "chips", Move("c", 1, by=64.0))
    assert world.now > SECOND


@pytest.mark.parametrize("pin", ["B0", "B22", "B100", "b4", "IN1", "B4 "])
def test_lines_that_cannot_be_sought(pin: str) -> None:
    with pytest.raises(Misuse, match="permitted are B1 to B21, such as '-B8'"):
        M1486.seek(chips().m1486["c"].chip, "chips", Seek("c", 1, 1, pin))


def test_a_distance_of_0_is_no_position_that_is_ignored() -> None:
    world = World.from_toml('[[mic488]]\nname = "a"\n[mic488.M1]\ngear = 1e10\n')
    command = Move("a", 1, by=0.0)
    assert MIC488.step_of(world.mic488["a"].device, None, command) == do.Write((("a", "M1_POS_REL", 0.0),))
