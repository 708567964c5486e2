"""Places in space: every element that moves others, against its own signal; bodies; what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.space.frames import pose
from steptwin.simulation.toml.reader import WorldError
from steptwin.subject.describe import describe
from steptwin.subject.scene import BeamDescription, CupDescription, NestDescription

MACHINE = """
[[mic488]]
name = "c"
[mic488.M1]
acc = 300.0
dec = 400.0
vel = 90.0
unit = "mm"
[mic488.M2]
acc = 500.0
dec = 200.0
vel = 60.0
unit = "mm"
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
at = [10, 20, 300]
along = "+x"
[[axis]]
name = "y"
drive = "c.M2"
pitch = 4.0
inverted = true
start = 7.0
on = "x"
along = "-y"
[[axis]]
name = "turret"
drive = "c.M3"
kind = "rotary"
at = [500, 0, 0]
[[cylinder]]
name = "z"
extend = "c.OUT1"
stroke = 60.0
on = "y"
at = [0, 0, -40]
along = "-z"
[[carriage]]
name = "slide"
axis = "x"
frequency = 12.0
[[shaft]]
name = "main"
axis = "x"
ratio = 0.03
offset = 15.0
at = [0, 0, 100]
along = "-z"
[[follower]]
name = "knife"
shaft = "main"
points = [[10, 0], [120, 9], [200, 4]]
along = "+y"
[[tool]]
name = "head"
axis = "x"
other = "y"
at = [0, 500, 0]
along = ["-x", "+z"]
[[axis]]
name = "left"
drive = "c.M4"
pitch = 5.0
unit = "cm"
at = [0, 900, 0]
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[[mic488]]
name = "d"
[[axis]]
name = "right"
drive = "d.M1"
pitch = 5.0
unit = "cm"
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[[gantry]]
name = "beam"
axis = "left"
other = "right"
limit = 100.0
[[conveyor]]
name = "belt"
length = 400.0
speed = 100.0
run = "c.OUT2"
at = [0, 0, 800]
[[body]]
name = "tip"
on = "z"
at = [0, 0, -12.5]
diameter = 8.0
height = 12.5
"""
AXES = {"x": 0, "y": 1, "z": 2}


def moving() -> World:
    world = World.from_toml(MACHINE)
    c, d = world.mic488["c"], world.mic488["d"]
    for n in (1, 2, 3, 4):
        c.write(f"M{n}_EN", 1)
        c.write(f"M{n}_POS_ABS", 30.0)
    d.write("M1_EN", 1)
    d.write("M1_POS_ABS", 12.0)
    c.write("OUT1", 1)
    return world


def test_every_element_that_carries_others_is_where_its_signal_says() -> None:
    """But for a pulse: signals of axes are those of whole pulses."""
    world = moving()
    frames = world.objects.frames
    movers = {one.spec.path[0] for one in frames.values() if one.movements}
    assert movers == {"axis", "carriage", "cylinder", "follower", "gantry", "shaft", "tool"}
    for _ in range(40):
        world.run(for_=0.037)
        for name, mounted in frames.items():
            sums = [0.0, 0.0, 0.0]
            for movement in mounted.movements:
                position = world.read(f"{name}.{movement.signal}") * movement.per_unit * movement.along.sign
                at = movement.motion.at(world.now) * movement.along.sign
                if movement.turns:
                    assert at * 90.0 == pytest.approx(position, abs=0.2), name
                else:
                    assert at / 1e6 == pytest.approx(position, abs=0.03), name
                    sums[movement.along.axis] += at / 1e6
            if not any(movement.turns for movement in mounted.movements):
                there = pose(mounted.frame, mounted.base, world.now).at
                assert [one / 1e6 for one in there] == pytest.approx(sums, abs=1e-6), name


def test_a_body_is_where_all_that_carries_it_has_it() -> None:
    world = moving()
    world.run(for_=1.0)
    frames = world.objects.frames
    x, y, z = (one / 1e6 for one in pose(frames["tip"].frame, frames["belt"].frame, world.now).at)
    assert x == pytest.approx(10.0 + world.read("x.position"), abs=0.03)
    assert y == pytest.approx(20.0 - world.read("y.position"), abs=0.03)
    assert z == pytest.approx(300.0 - 40.0 - world.read("z.position") - 12.5 - 800.0, abs=1e-6)


def test_a_carriage_and_a_gantry_stand_where_their_axis_does() -> None:
    frames = World.from_toml(MACHINE).objects.frames
    assert frames["slide"].base.at == (10_000_000, 20_000_000, 300_000_000)
    assert frames["beam"].base.at == (0, 900_000_000, 0)


def test_a_viewer_gets_the_frames_with_their_signals() -> None:
    scene = describe(World.from_toml(MACHINE)).scene
    by_name = {frame.name: frame for frame in scene.frames}
    assert [(one.signal, one.along, one.per_unit) for one in by_name["head"].joints] == [
        ("head.x", "-x", 1.0),
        ("head.y", "+z", 1.0),
    ]
    assert by_name["left"].joints[0].per_unit == 10.0
    assert (by_name["turret"].joints[0].turns, by_name["turret"].joints[0].per_unit) == (True, 1.0)
    assert (by_name["belt"].along, by_name["belt"].joints) == ("+x", ())
    assert (by_name["tip"].on, by_name["tip"].at) == ("z", (0.0, 0.0, -12.5))
    assert [(one.name, one.diameter, one.height, one.size) for one in scene.bodies] == [("tip", 8.0, 12.5, None)]


def test_a_viewer_gets_the_sizes_of_beams_nests_and_cups() -> None:
    more = """
[[beam]]
name = "curtain"
at = [0, 0, 10]
along = "-x"
length = 100
count = 2
to = "c.IN1"
[[nest]]
name = "tray"
at = [0, 0, 10]
cells = [3, 1]
pitch = [60, 50]
[[vacuum]]
name = "cup"
at = [0, 0, 200]
ejector = "c.OUT1"
diameter = 12
[[vacuum]]
name = "nowhere"
ejector = "c.OUT2"
"""
    scene = describe(World.from_toml(MACHINE + more)).scene
    assert scene.beams == (BeamDescription("curtain", length=100.0, count=2, pitch=20.0, across="+z"),)
    assert scene.nests == (NestDescription("tray", cells=(3, 1), pitch=(60.0, 50.0), cell=(60.0, 50.0)),)
    assert scene.cups == (CupDescription("cup", diameter=12.0),)


HAND = """[[body]]
name = "hand"
size = [100, 100, 100]
when = "x.position > 0.03 and c.OUT1"
"""


def test_a_viewer_sees_whether_a_body_is_there() -> None:
    world = World.from_toml(MACHINE + HAND)
    c = world.mic488["c"]
    assert world.read("hand.present") == 0.0
    c.write("OUT1", 1)
    c.write("M1_EN", 1)
    c.write("M1_POS_ABS", 30.0)
    world.run(until="x.position > 0.02")
    assert world.read("hand.present") == 0.0
    world.run(until="x.position > 0.03")
    assert world.read("hand.present") == 1.0
    c.write("OUT1", 0)
    assert world.read("hand.present") == 0.0
    with pytest.raises(Misuse, match="conditions say themselves when"):
        world.run(until="hand.present == 1")
    assert "present" not in [signal.name for one in describe(world).elements if one.name == "tip" for signal in one.signals]


def test_a_viewer_sees_whether_a_lamp_is_lit() -> None:
    lamp = "[[body]]\nname = 'lamp'\nsize = [9, 9, 9]\nlit = 'c.OUT2 and x.position > 0.02'\n"
    world = World.from_toml(MACHINE + lamp)
    c = world.mic488["c"]
    c.write("OUT2", 1)
    c.write("M1_EN", 1)
    c.write("M1_POS_ABS", 30.0)
    world.run(until="x.position > 0.01")
    assert world.read("lamp.lit") == 0.0
    world.run(until="x.position > 0.02")
    assert world.read("lamp.lit") == 1.0
    c.write("OUT2", 0)
    assert world.read("lamp.lit") == 0.0
    (body,) = [one for one in describe(world).scene.bodies if one.name == "lamp"]
    assert body.lit == "c.OUT2 and x.position > 0.02"
    with pytest.raises(WorldError, match="'lamp' depends on itself"):
        World.from_toml(MACHINE + lamp.replace("c.OUT2", "lamp.lit"))


STEPS = """[[axis]]
name = "w"
drive = "d.M2"
unit = "step"
pulses_per_unit = 1.0
along = "+z"
"""
PITCH = '[[axis]]\nname = "w"\ndrive = "d.M2"\npitch = 5.0\n'
BODY = '[[body]]\nname = "b"\n'
SIZE = "size = [1, 1, 1]\n"
GATE = '[[gate]]\nname = "g"\nkind = "or"\ninputs = ["c.OUT1", "c.OUT2"]\n'


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        (f'{BODY}{SIZE}on = "nowhere"', "no element with a place in space is called 'nowhere'"),
        (f'{BODY}{SIZE}on = "g"\n{GATE}', "a [[gate]] has no place in space, and carries nothing"),
        (f'{BODY}{SIZE}on = "e"\n[[body]]\nname = "e"\non = "b"\n{SIZE}', "'b' is on 'e' is on 'b'"),
        (f'[[body]]\nname = "workpieces"\n{SIZE}', "in space 'workpieces' are all workpieces: choose another name"),
        (f'{BODY}{SIZE}on = "c"', "a [[mic488]] has no place in space, and carries nothing"),
        (BODY, "a body needs size, or diameter and height"),
        (f"{BODY}diameter = 4.0", "diameter means nothing without height"),
        (f"{BODY}size = [1, 1]", "expected [length, width, height] in mm"),
        (f"{BODY}{SIZE}at = [0, 0, 2e6]", "permitted are numbers from -100000 to 100000"),
        (f'{BODY}{SIZE}color = "red"', "expected a color such as '#c0392b'"),
        (STEPS, "'w' counts in step: what is on it needs its mm_per_unit"),
        (f'{PITCH}along = "+x"\nmm_per_unit = 2.0', "which is a length already"),
        (f'{PITCH}along = "x"', "permitted are +x, -x, +y, -y, +z, -z"),
    ],
)
def test_what_does_not_fit_is_refused(more: str, problem: str) -> None:
    with pytest.raises(WorldError) as error:
        World.from_toml(MACHINE + more)
    assert problem in str(error.value)


CUP = '[[vacuum]]\nname = "cup"\nejector = "c.OUT2"\non = "z"\n'
TRAY = '[[nest]]\nname = "tray"\nat = [0, 0, 30]\n'


@pytest.mark.parametrize("on", ["cup", "tray"])
def test_what_is_on_an_element_that_moves_nothing_has_its_place_before_that_is_built(on: str) -> None:
    frames = World.from_toml(f'{MACHINE}{CUP}{TRAY}{BODY}{SIZE}on = "{on}"\nat = [1, 2, 3]').objects.frames
    assert pose(frames["b"].frame, frames[on].frame, 0).at == (1_000_000, 2_000_000, 3_000_000)


def test_of_what_is_on_a_wrong_axis_nothing_is_reported() -> None:
    axis = '[[axis]]\nname = "w"\ndrive = "c.M9"\npitch = 5.0\n'
    with pytest.raises(WorldError) as error:
        World.from_toml(f'{MACHINE}{CUP}{TRAY}{axis}{BODY}{SIZE}on = "w"')
    assert [found.message for found in error.value.findings] == ["drive = 'c.M9': c has M1, M2, M3, M4"]


def test_an_axis_that_counts_steps_says_how_long_one_is() -> None:
    world = World.from_toml(f"{MACHINE}{STEPS}mm_per_unit = 0.25\nstart = 8.0")
    mounted = world.objects.frames["w"]
    assert pose(mounted.frame, mounted.base, 0).at == (0, 0, 2_000_000)


def test_it_can_be_restored(tmp_path: Path) -> None:
    check_it_can_be_restored(moving(), World.from_toml(MACHINE), 0.3, 1.0, tmp_path)
