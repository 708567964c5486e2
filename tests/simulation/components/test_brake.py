"""Brakes and loads that fall, against an integration of their own in small steps: forces, friction, stops."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.export import axis_views, sort_out
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 200.0
dec = 200.0
vel = 50.0
mot_resol = 3200
enc_resol = 4000
[[axis]]
name = "z"
drive = "a.M1"
pitch = 5.0
travel = [0.0, 400.0]
start = 200.0
[axis.encoder]
counts_per_rev = 4000
[[axis.switch]]
below = 100.0
to = "a.IN1"
[axis.motor]
torque = [[0, 3.0], [600, 2.7], [1500, 0.2]]
inertia = 0.00003
mass = 25.0
force = 245.0
friction = 0.05
when_off = "free"
"""
BRAKE = """
[[brake]]
name = "hold"
axis = "z"
torque = 0.5
release = "a.OUT1"
release_time = "40 ms"
apply_time = "25 ms"
[[wire]]
from = "hold.released"
to = "a.IN2"
"""
ARM = 0.005 / (2 * pi)
"""Metres per radian."""
WEIGHT, FRICTION = 245.0 * ARM, 0.05
INERTIA = 0.00003 + 25.0 * ARM * ARM


def integrated(place: float, speed: float, pieces: list[tuple[float, float]], step: float = 2e-5) -> list[tuple[float, float]]:
    """Millimetres and mm/s at the end of each piece: (seconds, torque of the brake). Heun's method, friction against motion."""

    def rate(speed: float, against: float) -> float:
        torque = -WEIGHT - against if speed > 0 else -WEIGHT + against
        return torque / INERTIA * ARM * 1000.0

    found: list[tuple[float, float]] = []
    for seconds, brake in pieces:
        against = FRICTION + brake
        for _ in range(round(seconds / step)):
            if speed == 0.0 and (against >= WEIGHT or place <= 0.0):
                continue
            there = speed + step * rate(speed, against)
            if speed * there < 0.0:
                there = 0.0
            place += step * (speed + there) / 2
            speed = there
            if place <= 0.0 or place >= 400.0:
                place, speed = min(max(place, 0.0), 400.0), 0.0
        found.append((place, speed))
    return found


def events(world: World, code: str) -> list[tuple[float, object]]:
    return [(record.time / SECOND, record.value) for record in world.trace.of("event") if record.subject == code]


def test_without_current_it_falls_to_its_stop() -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 100.0)
    world.run(until=1.2)
    assert device.axis[1].position == 53.75
    encoder = device.axis[1].encoder
    device.write("M1_EN", 0)
    for n, (place, _) in enumerate(integrated(253.75, 50.0, [(0.05, 0.0)] * 12), start=1):
        world.run(until=1.2 + 0.05 * n)
        assert world.axis["z"].position == pytest.approx(place, abs=0.03), n
        assert device.axis[1].position == 53.75
    assert world.axis["z"].position == 0.0
    assert device.axis[1].encoder - encoder == pytest.approx(-253.75 / 5.0 * 4000, abs=1)
    lost = round(253.75 * 640)
    assert events(world, "fall")[-2:] == [
        (1.2, "z moves without current"),
        (pytest.approx(1.661, abs=2e-3), f"z stands, {lost} pulses behind"),
    ]


def test_its_switch_is_exact() -> None:
    world = World.from_toml(TEXT)
    world.run(until="a.IN1")
    # 100 mm from rest: s = a·t²/2 in pulses, the first whole nanosecond at or after the pulse.
    acceleration = (WEIGHT - FRICTION) / INERTIA * 3200 / (2 * pi)
    assert world.now == pytest.approx((2 * 64000 / acceleration) ** 0.5 * SECOND, abs=2)


def test_a_brake_holds_it() -> None:
    world = World.from_toml(TEXT + BRAKE)
    world.run(until=1.0)
    assert (world.axis["z"].position, world.read("hold.released")) == (200.0, 0)
    assert events(world, "fall") == []  # it does not move for no time at the beginning either
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("OUT1", 1)
    world.run(until="a.IN2")
    assert world.now == 1_040_000_000
    device.write("M1_POS_ABS", 100.0)
    world.run(until="idle")
    assert (world.axis["z"].position, world.axis["z"].lost) == (300.0, 0)
    device.write("OUT1", 0)
    world.run(for_=0.1)
    device.write("M1_EN", 0)
    world.run(for_=1.0)
    assert world.axis["z"].position == 300.0


def test_it_falls_until_the_brake_acts() -> None:
    world = World.from_toml(TEXT + BRAKE)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("OUT1", 1)
    world.run(until=1.0)
    device.write("OUT1", 0)
    device.write("M1_EN", 0)
    world.run(until=2.0)
    (fallen, _), (rest, speed) = integrated(200.0, 0.0, [(0.025, 0.0), (0.3, 0.5)])
    assert speed == 0.0
    assert rest < fallen < 199.5
    assert world.axis["z"].position == pytest.approx(rest, abs=0.01)
    # Current again: the rotor goes to the nearest of the places with the electrical angle of the field, 64 pulses apart.
    device.write("M1_EN", 1)
    world.run(for_=0.01)
    assert world.axis["z"].position == pytest.approx(rest, abs=0.06)
    assert world.axis["z"].lost % 64 == 0 < world.axis["z"].lost


def test_a_worn_brake_lets_it_slide() -> None:
    world = World.from_toml(TEXT + BRAKE)
    world.fault("worn-brake element=hold share=0.2 from_s=0.5")
    world.run(until=0.7)
    ((place, _),) = integrated(200.0, 0.0, [(0.2, 0.1)])
    assert world.axis["z"].position == pytest.approx(place, abs=0.01)
    assert place < 190.0
    world.clear_fault("worn-brake")
    world.run(until=3.0)
    assert 0.0 < world.axis["z"].position < place


def test_a_brake_that_does_not_let_go_stalls_the_motor() -> None:
    world = World.from_toml(TEXT + BRAKE.replace("0.5", "4.0"))
    world.fault("stuck-brake element=hold")
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    device.write("OUT1", 1)
    world.run(until=0.1)
    device.write("M1_POS_ABS", 10.0)
    world.run(until="idle")
    assert (world.axis["z"].position, world.read("hold.released")) == (200.0, 0)
    assert events(world, "stall")[0][1] == "z stalls: the motion needs 4.26 N·m, the motor has 3 N·m"


def test_a_supply_that_fails_lets_it_fall() -> None:
    world = World.from_toml(TEXT)
    device = world.mic488["a"]
    device.write("M1_EN", 1)
    world.run(until=0.1)
    world.fault("supply-drop machine=a for_s=0.1")
    world.run(until=0.19)
    ((place, _),) = integrated(200.0, 0.0, [(0.09, 0.0)])
    assert world.axis["z"].position == pytest.approx(place, abs=0.05)


def test_a_motor_catches_it_below_its_start_speed_only() -> None:
    world = World.from_toml(TEXT.replace("when_off", "start_speed = 600\nwhen_off") + BRAKE)
    device = world.mic488["a"]
    device.write("OUT1", 1)
    (_, _), (place, speed) = integrated(200.0, 0.0, [(0.04, 0.5), (0.06, 0.0)])
    world.run(until=0.1)
    assert speed < -50.0  # mm/s; 600 rev/min are 50 mm/s
    device.write("M1_EN", 1)
    device.write("OUT1", 0)
    world.run(until=0.125)
    ((after, faster),) = integrated(place, speed, [(0.025, 0.0)])
    assert world.axis["z"].position == pytest.approx(after, abs=0.05)
    world.run(until=1.0)
    caught = [seconds for seconds, text in events(world, "fall") if "stands" in str(text)][-1]
    # The brake slows it down to 50 mm/s.
    slowing = (0.5 + FRICTION - WEIGHT) / INERTIA * ARM * 1000.0
    assert caught == pytest.approx(0.125 + (-faster - 50.0) / slowing, abs=1e-4)


def test_switches_look_ahead_again_when_the_motor_has_caught_it() -> None:
    world = World.from_toml(
        TEXT.replace("when_off", "start_speed = 600\nwhen_off").replace("below = 100.0", "above = 195.0") + BRAKE
    )
    device = world.mic488["a"]
    device.write("OUT1", 1)
    world.run(until=0.16)
    assert world.read("a.IN1") == 0
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 60.0)  # the field goes while the rotor is still too fast for it
    device.write("OUT1", 0)
    world.run(until="a.IN1")
    assert world.axis["z"].position == 195.0
    assert events(world, "fall")[-1][0] < world.now / SECOND - 0.1


def test_a_chip_without_supply_lets_its_load_fall() -> None:
    text = """
    [[m1486]]
    name = "c"
    [[axis]]
    name = "z"
    drive = "c.M1"
    pitch = 5.0
    travel = [0.0, 400.0]
    start = 200.0
    [axis.motor]
    torque = [[0, 3.0]]
    inertia = 0.00003
    mass = 25.0
    force = 245.0
    friction = 0.05
    when_off = "free"
    """
    world = World.from_toml(text)
    world.run(until=0.1)
    assert world.axis["z"].position == 200.0
    world.fault("supply-drop machine=c for_s=10")
    world.run(until=0.3)
    assert world.axis["z"].position == pytest.approx(integrated(200.0, 0.0, [(0.2, 0.0)])[0][0], abs=0.05)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.tuples(st.integers(0, 120), st.booleans()), max_size=6, unique_by=lambda one: one[0]))
def test_it_is_where_an_integration_has_it(commands: list[tuple[int, bool]]) -> None:
    text = TEXT + BRAKE.replace('"40 ms"', '"0 ms"').replace('"25 ms"', '"0 ms"').replace("0.5", "0.25")
    world = World.from_toml(text)
    device = world.mic488["a"]
    pieces: list[tuple[float, float]] = []
    before, is_on = 0, False
    for at, level in [*sorted(commands), (150, False)]:
        world.at(at / 200, lambda level=level: device.write("OUT1", int(level)))  # type: ignore[misc]
        pieces.append(((at - before) / 200, 0.0 if is_on else 0.25))
        before, is_on = at, level
    world.run(until=0.75)
    assert world.axis["z"].position == pytest.approx(integrated(200.0, 0.0, pieces)[-1][0], abs=0.15)


@pytest.mark.parametrize("moment_s", [0.0, 0.51, 0.53, 0.6, 0.72, 1.3])
def test_snapshots_and_sessions_have_it(moment_s: float, tmp_path: Path) -> None:
    text = (
        TEXT
        + BRAKE
        + (
            '[[fault]]\nkind = "worn-brake"\nelement = "hold"\nfrom_s = 0.6\nuntil_s = 0.7\n'
            '[[script]]\nname = "s"\nsteps = [{ write = { "a.OUT1" = 1, "a.M1_EN" = 1 } }, { wait = "100 ms" },'
            '{ write = { "a.M1_POS_ABS" = 40.0 } }, { wait = "400 ms" }, { write = { "a.OUT1" = 0, "a.M1_EN" = 0 } },'
            '{ wait = "1 s" }, { write = { "a.OUT1" = 1 } }]\n'
        )
    )
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 2.5, tmp_path)


def test_the_trace_has_the_fall() -> None:
    world = World.from_toml(TEXT + BRAKE)
    device = world.mic488["a"]
    device.write("OUT1", 1)
    world.run(until=0.1)
    device.write("M1_EN", 1)
    device.write("M1_POS_ABS", 20.0)
    seen = []
    for n in range(1, 60):
        world.run(until=0.1 + 0.02 * n)
        seen.append((world.now, world.axis["z"].position))
    recording = sort_out(world.trace, axis_views(world))
    track = recording.axes[0].true()
    assert track is not None
    for now, position in seen[:-1]:
        plan = track.plan(now)
        shown = plan.position(now) / track.view.pulses_per_unit  # type: ignore[union-attr]
        assert shown == pytest.approx(position, abs=1.01 / 640), now


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("torque = 0.5", "torque = 0", "t.toml:34.*permitted are numbers above 0"),
        ("torque = 0.5", "torque = 1e300", r"1e\+300 N·m on so small an inertia accelerates by more than 1e\+15 imp/s² without"),
        ("force = 245.0", "force = 1e300", "N·m on so small an inertia accelerates"),
        ("inertia = 0.00003\nmass = 25.0", "inertia = 1e-300", "N·m on so small an inertia accelerates"),
        ("torque = 0.5", "torqe = 0.5", r"\[brake\] has no 'torqe' \(did you mean 'torque'\?\)"),
        ("torque = 0.5\n", "", "torque is missing"),
        ('axis = "z"', 'axis = "y"', "no axis is called 'y'"),
        ('when_off = "free"', 'when_off = "fre"', r"'fre' \(did you mean 'free'\?\): permitted are holds, free"),
        ('when_off = "free"', 'when_off = "holds"', "a brake needs an .*when_off = 'free'"),
        ("inertia = 0.00003\nmass = 25.0", "", "needs an inertia or a mass"),
        ('release = "a.OUT1"', 'release = "a.IN1"', "a.IN1 is not an output"),
        ("[[wire]]", '[[brake]]\nname = "b2"\naxis = "z"\ntorque = 1\n[[wire]]', "axis 'z' has the brake 'hold' already"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s){text}"):
        World.from_toml((TEXT + BRAKE).replace(old, new, 1), name="t.toml")


def test_a_brake_that_is_released_from_the_beginning_lets_go_in_its_time() -> None:
    text = TEXT + BRAKE.replace('release = "a.OUT1"\n', "") + '[[wire]]\nfrom = "a.OUT1"\nto = "hold.release"\ninverted = true\n'
    world = World.from_toml(text)
    world.run(until=0.1)
    released = [(record.time / SECOND, record.value) for record in world.trace.edges() if record.subject == "hold.released"]
    assert released == [(0.0, 0.0), (0.04, 1.0)]
