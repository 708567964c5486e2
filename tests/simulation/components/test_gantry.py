"""Gantries: moments at which a motor has to move the whole beam, and at which it skews, against steps of time in SI units."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.components.gantry import GANTRY as ELEMENT
from steptwin.simulation.mechanics.channels import MovedChannel
from steptwin.simulation.toml.reader import WorldError

CONTROLLER = """
[[mic488]]
name = "{name}"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = {acc}
dec = {acc}
vel = 100.0
mot_resol = 3200
[[axis]]
name = "y{name}"
drive = "{name}.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 0.5], [1500, 0.3]]
inertia = 0.00002
start_speed = 60
"""
GANTRY = """
[[gantry]]
name = "beam"
axis = "ya"
other = "yb"
limit = 2.0
mass = 20.0
friction_force = 480.0
reset = "a.OUT3"
"""


def text(acc_b: float = 400.0) -> str:
    return CONTROLLER.format(name="a", acc=400.0) + CONTROLLER.format(name="b", acc=acc_b) + GANTRY


def start(world: World, *names: str) -> None:
    for name in names:
        world.mic488[name].write("M1_EN", 1)
    for name in names:
        world.mic488[name].write("M1_POS_ABS", 200.0)


def events(world: World, subject: str) -> list[tuple[float, str]]:
    return [(record.time / SECOND, str(record.value)) for record in world.trace.of("event") if record.subject == subject]


def stalled_after(share: float) -> float | None:
    """Seconds from the start after which a motor is too weak for a share of the beam: 0.4 m/s² up to 0.1 m/s, in steps."""
    lead = 0.005 / (2 * pi)  # m per radian
    step_s, steps = 1e-6, 300_000
    for n in range(steps):
        speed = min(0.4 * n * step_s, 0.1)
        acceleration = 0.4 if speed < 0.1 else 0.0
        needed = (20e-6 + share * 20.0 * lead**2) * acceleration / lead + share * 480.0 * lead
        rpm = speed / lead * 60 / (2 * pi)
        if needed > 0.5 - 0.2 * rpm / 1500:
            return n * step_s
    return None


def test_each_motor_moves_half_while_both_follow() -> None:
    assert stalled_after(0.5) is None
    world = World.from_toml(text())
    start(world, "a", "b")
    world.run(until="idle")
    assert (world.axis["ya"].position, world.axis["yb"].position) == (200.0, 200.0)
    assert world.read("beam.position") == 200.0
    assert events(world, "stall") == []


def test_a_motor_whose_partner_has_no_current_moves_all_of_it() -> None:
    expected = stalled_after(1.0)
    assert expected is not None
    assert 0.05 < expected < 0.25
    world = World.from_toml(text(), overrides={"beam.limit": 50.0})
    start(world, "b")
    world.run(until="idle")
    assert events(world, "stall")[0] == (
        pytest.approx(expected, abs=2e-6),
        "yb stalls: the motion needs more than the 0.398 N·m that the motor has at this speed",
    )
    loaded = World.from_toml(text(), overrides={"beam.limit": 50.0, "beam.friction_force": 200.0})
    start(loaded, "b")
    loaded.run(until="yb.position > 40")
    assert events(loaded, "stall") == []


def test_what_one_loses_the_other_has_to_move() -> None:
    world = World.from_toml(text())
    start(world, "a", "b")
    world.run(for_=0.5)
    world.fault("stall machine=a axis=1 for_s=0.3")
    world.run(until="idle")
    assert events(world, "stall")[0] == (0.5, "yb stalls: the motion needs 0.382 N·m, the motor has 0.34 N·m")
    assert events(world, "collision") == []


def travelled(seconds: float, acceleration: float) -> float:
    ramp = min(seconds, 100.0 / acceleration)
    return acceleration * ramp * ramp / 2 + 100.0 * (seconds - ramp)


def test_it_is_stuck_at_the_moment_at_which_it_is_too_skewed() -> None:
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if travelled(middle, 400.0) - travelled(middle, 200.0) <= 2.0 else (low, middle)
    world = World.from_toml(text(200.0))
    start(world, "a", "b")
    world.run(for_=1.0)
    ((moment, words),) = events(world, "collision")
    assert moment == pytest.approx(high, abs=2e-9)
    assert words == "the ends of beam are skewed by 2 mm"
    assert world.read("beam.skew") == pytest.approx(2.0, abs=1 / 640)  # they stand at whole pulses
    assert world.read("beam.skewed") == world.read("beam.count") == 1.0
    stuck = world.axis["ya"].position
    world.run(for_=10.0)
    assert world.axis["ya"].position == stuck
    free = World.from_toml(text(200.0), overrides={"beam.effect": "report"})
    start(free, "a", "b")
    free.run(until="idle")
    assert events(free, "collision")[0] == (moment, words)
    assert events(free, "collision")[1][1] == "beam: apart again"
    assert free.axis["yb"].position == 200.0


WATCHED = """
[[event]]
when = "beam.skew > 1.5"
steps = [{ note = "apart" }]
[[event]]
when = "beam.position >= 100"
steps = [{ note = "half" }]
[[event]]
when = "beam.skew < 1.5 and time > 1"
steps = [{ note = "together" }]
"""


def test_conditions_have_its_skew_and_its_middle_to_the_nanosecond() -> None:
    world = World.from_toml(text(200.0) + WATCHED, overrides={"beam.limit": 50.0})
    start(world, "a", "b")
    world.run(until="idle")
    # Both cruise at 100 mm/s from 0.5 s to 2 s: the middle is at (12.5 + 100 (t - 0.25) + 25 + 100 (t - 0.5)) / 2 mm.
    # The ends part by (400 - 200) t² / 2; after 2.25 s a stands, and b is 200 (2.5 - t)² / 2 behind.
    expected = [("apart", sqrt(0.015)), ("half", 1.1875), ("together", 2.5 - sqrt(0.015))]
    noted = [(str(record.value), record.time / SECOND) for record in world.trace.of("event") if record.value in dict(expected)]
    assert [what for what, _ in noted] == [what for what, _ in expected]
    assert [moment for _, moment in noted] == pytest.approx([moment for _, moment in expected], abs=2e-9)


def test_what_the_beam_hits_stops_both_ends() -> None:
    stop = '[[collision]]\nname = "stop"\nwhen = "beam.position > 60"\neffect = "jam"\n'
    sensor = '[[transducer]]\nname = "gap"\nof = "beam.position"\nto = "a.AIN1"\npoints = [[0, 0], [100, 10]]\n'
    world = World.from_toml(text() + stop + sensor)
    start(world, "a", "b")
    world.run(until=3.0)
    assert events(world, "collision") == [(pytest.approx(0.25 + 47.5 / 100, abs=2e-9), "stop: ya and yb touch")]
    assert (world.axis["ya"].position, world.axis["yb"].position) == pytest.approx((60.0, 60.0), abs=1 / 640)
    assert world.read("gap.volts") == pytest.approx(6.0, abs=0.01)


def test_stiff_guides_stall_both() -> None:
    world = World.from_toml(text())
    start(world, "a", "b")
    world.run(for_=0.5)
    world.fault("stiff-guides element=beam factor=3")
    world.run(for_=0.1)
    lack = "the motion needs 0.573 N·m, the motor has 0.34 N·m"
    assert [words for _, words in events(world, "stall")] == [f"ya stalls: {lack}", f"yb stalls: {lack}"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('other = "yb"', 'other = "ya"'), "other = 'ya' is its axis already: a gantry has two"),
        (('other = "yb"', 'other = "yc"'), "no axis is called 'yc'"),
        (("limit = 2.0", "limt = 2.0"), r"\[gantry\] has no 'limt' \(did you mean 'limit'\?\)"),
        (("limit = 2.0", "limit = 0"), "permitted are numbers above 0"),
        (('effect = "jam"', 'effect = "jamm"'), r"'jamm' \(did you mean 'jam'\?\): permitted are report, jam"),
        (("pitch = 5.0", 'pitch = 5.0\nunit = "cm"'), "'ya' is in mm and 'yb' in cm: a gantry has one unit"),
        (("[axis.motor]\ntorque = [[0, 0.5], [1500, 0.3]]\ninertia = 0.00002\nstart_speed = 60\n", ""), "axis 'yb' has no"),
        (("mass = 20.0", "mass = 20.0\nunit = 3"), r"\[gantry\] has no 'unit'"),
        (
            ('reset = "a.OUT3"', 'reset = "a.OUT3"\n[[gantry]]\nname = "g"\naxis = "ya"\nother = "yb"\nlimit = 1\n'),
            "moves the gantry",
        ),
    ],
)
def test_mistakes_have_their_places(change: tuple[str, str], message: str) -> None:
    whole = text().replace('reset = "a.OUT3"', 'effect = "jam"\nreset = "a.OUT3"')
    before, found, after = whole.rpartition(change[0])
    assert found
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{message}"):
        World.from_toml(before + change[1] + after, name="w.toml")


@pytest.mark.parametrize("moment_s", [0.0, 0.1, 0.5, 0.7, 1.5])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    found, other = (World.from_toml(text(), overrides={"beam.limit": 1.0}) for _ in range(2))
    start(found, "a", "b")
    found.fault("stall machine=a axis=1 at_s=0.5 for_s=0.3")
    found.fault("stiff-guides element=beam factor=1.5 from_s=0.6")
    check_it_can_be_restored(found, other, moment_s, 5.0, tmp_path)


@pytest.mark.parametrize(("old", "new"), [("friction_force = 480.0", "friction_force = 2000.0"), ("mass = 20.0", "mass = 1e6")])
def test_a_beam_that_is_too_heavy_for_both_stands(old: str, new: str) -> None:
    """Half of it is 0.8 N·m of 0.5 at each motor, or far more."""
    world = World.from_toml(text().replace(old, new))
    start(world, "a", "b")
    world.run(until=0.1)
    assert (world.read("ya.stalled"), world.read("yb.stalled")) == (1, 1)
    assert abs(world.read("beam.position")) < 1.0


def test_its_beam_is_drawn_from_both_ends() -> None:
    """640 pulses are a mm; the second end goes the other way."""
    found = World.from_toml(text().replace('drive = "b.M1"', 'drive = "b.M1"\ninverted = true'))
    (gantry,) = found.objects.built(ELEMENT).values()
    assert ELEMENT.moved is not None
    ((end, channel),) = ELEMENT.moved(gantry)
    assert end == "ya"
    half = 1 / 1280
    assert channel == MovedChannel("beam", "position", "mm", half, other=("b", "1"), other_per_pulse=-half)


def test_there_may_be_several() -> None:
    others = "".join(CONTROLLER.format(name=name, acc=400.0) for name in "cd")
    second = GANTRY.replace("beam", "bridge").replace("ya", "yc").replace("yb", "yd").replace("a.OUT3", "c.OUT3")
    assert list(World.from_toml(text() + others + second).objects.built(ELEMENT)) == ["beam", "bridge"]
