"""Loads that change, and friction by position, against an integration of their own in small steps of SI units."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi
from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 400.0
dec = 400.0
vel = 100.0
mot_resol = 3200
[[axis]]
name = "z"
drive = "a.M1"
pitch = 5.0
travel = [-200.0, 400.0]
start = {start}
[axis.motor]
torque = [[0, 0.5], [1500, 0.3]]
inertia = 0.00003
mass = 2.0
friction = 0.05
start_speed = 60
when_off = "free"
"""
ARM = 0.005 / (2 * pi)
"""Metres per radian."""
INERTIA = 0.00003 + 2.0 * ARM * ARM


def world(more: str, start: float = 0.0) -> World:
    return World.from_toml(TEXT.format(start=start) + more, name="w.toml")


def moving(more: str, to: float = 200.0) -> World:
    found = world(more)
    found.mic488["a"].write("M1_EN", 1)
    found.mic488["a"].write("M1_POS_ABS", to)
    return found


def guide(newtons: float, points: str, resolution: float) -> str:
    table = f"friction_force = {newtons}\nof = 'z.position'\npoints = {points}\nresolution = {resolution}\n"
    return f"[[load]]\nname = 'g'\naxis = 'z'\n{table}"


def events(found: World, subject: str) -> list[tuple[float, str]]:
    records = [record for record in found.trace.of("event") if record.subject == subject]
    return [(record.time / SECOND, str(record.value)) for record in records if record.time]


def linear(table: list[tuple[float, float]], x: float) -> float:
    for (x0, y0), (x1, y1) in pairwise(table):
        if x0 <= x < x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return table[0][1] if x < table[0][0] else table[-1][1]


# ---------------------------------------------------------------------- with current


def stalled_after(friction_n: Callable[[float], float], extra_kg: Callable[[float], float]) -> tuple[float, float]:
    """(seconds, mm) from the start at which the torque no longer suffices: 400 mm/s² up to 100 mm/s, in steps of 2 µs."""
    step = 2e-6
    n = 0
    while True:
        t = n * step
        place, speed, rate = (200 * t * t, 400 * t, 400.0) if t < 0.25 else (12.5 + 100 * (t - 0.25), 100.0, 0.0)
        inertia = INERTIA + extra_kg(t) * ARM * ARM
        needed = inertia * rate / 1000 / ARM + 0.05 + friction_n(place) * ARM
        if needed > 0.5 - 0.2 * (speed / 5 * 60) / 1500:
            return t, place
        n += 1


def test_friction_by_position() -> None:
    """A guide that becomes tighter from 50 to 150 mm."""
    table = [(50.0, 0.0), (150.0, 600.0)]
    after, place = stalled_after(lambda x: linear(table, x), lambda t: 0.0)
    found = moving(guide(600, "[[50, 0], [150, 1]]", 0.001))
    found.run(until="z.stalled")
    assert found.now / SECOND == pytest.approx(after, abs=2e-3)
    assert found.axis["z"].position == pytest.approx(place, abs=0.11)  # half of a step of the share, and one of the force
    coarse = moving(guide(600, "[[50, 0], [150, 1]]", 0.1))
    coarse.run(until="z.stalled")
    assert coarse.axis["z"].position == pytest.approx(place, abs=10.0)


@pytest.mark.parametrize(("kg", "stalls"), [(20.0, False), (2000.0, True)])
def test_a_load_by_time(kg: float, stalls: bool) -> None:
    """It is put on while the axis accelerates."""
    found = moving(f"[[load]]\nname = 'g'\naxis = 'z'\nmass = {kg}\nwhen = 'time > 0.1'\n")
    found.run(until=1.0)
    if not stalls:
        assert events(found, "stall") == []
        assert stalled_after_or_none(kg) is None
        return
    after = stalled_after_or_none(kg)
    assert after == pytest.approx(0.1, abs=1e-5)
    why = "the motion needs 0.702 N·m, the motor has 0.436 N·m"
    assert events(found, "stall")[0] == (0.100000001, f"z stalls: {why}")  # the first nanosecond after 0.1 s


def stalled_after_or_none(kg: float) -> float | None:
    for n in range(100_000):
        t = n * 1e-5
        rate = 400.0 if t < 0.25 else 0.0
        inertia = INERTIA + (kg if t > 0.1 else 0.0) * ARM * ARM
        if inertia * rate / 1000 / ARM + 0.05 > 0.5 - 0.2 * (min(400 * t, 100.0) / 5 * 60) / 1500:
            return t
    return None


def test_what_is_too_heavy_for_a_motor_at_rest_falls() -> None:
    """0.8 N·m on 0.5 N·m and 0.05 N·m of friction: until it is put down again, it falls; then the motor has it again."""
    found = world("[[load]]\nname = 'box'\naxis = 'z'\nload = 0.8\ninertia = 0.00005\nwhen = 'a.OUT1'\n", start=100.0)
    found.mic488["a"].write("M1_EN", 1)
    found.run(until=0.5)
    assert (found.axis["z"].position, found.read("box.acts")) == (100.0, 0)
    found.mic488["a"].write("OUT1", 1)
    found.run(until=0.6)
    place, speed = 100.0, 0.0
    for _ in range(10_000):
        rate = -(0.8 - 0.05) / (INERTIA + 0.00005) * ARM * 1000
        place, speed = place + speed * 1e-5 + rate * 0.5e-10, speed + rate * 1e-5
    assert found.axis["z"].position == pytest.approx(place, abs=0.01)
    found.mic488["a"].write("OUT1", 0)
    found.run(until="idle")
    found.run(for_=1.0)
    assert events(found, "fall")[0] == (0.5, "z moves with too little current")
    assert events(found, "fall")[-1][1].startswith("z stands, ")
    assert found.axis["z"].lost % 64 == 0
    assert found.axis["z"].lost > 1000


# ---------------------------------------------------------------------- without current


def fallen(force: Callable[[float], float], friction: float, seconds: float, start: float) -> float:
    """Where a free rotor is, by steps of 2 µs; forces in N over mm, positive ones pull down."""
    place, speed, step = start, 0.0, 2e-6
    for _ in range(round(seconds / step)):
        torque = -force(place) * ARM
        if speed == 0.0 and abs(torque) <= friction:
            continue
        way = (speed > 0) - (speed < 0) or ((torque > 0) - (torque < 0))
        there = speed + step * (torque - way * friction) / INERTIA * ARM * 1000
        if speed * there < 0.0:
            there = 0.0
        place, speed = place + step * (speed + there) / 2, there
    return place


WEIGHT = "[[load]]\nname = 'weight'\naxis = 'z'\nforce = 100\n"


def test_a_fall_into_a_tight_guide() -> None:
    def friction_at(place: float) -> float:
        return 0.05 + linear([(-100.0, 120.0 * ARM), (0.0, 0.0)], place)

    place, speed, step = 100.0, 0.0, 2e-6
    places: list[float] = []
    while not places or speed:
        friction = friction_at(place)
        there = min(speed + step * (-100 * ARM + friction) / INERTIA * ARM * 1000, 0.0)
        place, speed = place + step * (speed + there) / 2, there
        places.append(place)
    found = world(WEIGHT + guide(120, "[[-100, 1], [0, 0]]", 0.002), start=100.0)
    for n in range(1, 9):
        found.run(until=n * 0.1)
        assert found.axis["z"].position == pytest.approx(places[n * 50_000 - 1], abs=0.01), n
    found.run(until=2.0)
    assert found.axis["z"].position == pytest.approx(place, abs=0.01)
    assert events(found, "fall")[-1][0] == pytest.approx(len(places) * step, abs=1e-4)


SPRING = "[[load]]\nname = 'spring'\naxis = 'z'\nforce = -300\nof = 'z.position'\npoints = [[-100, 1], [0, 0]]\n"


def test_a_fall_onto_a_spring() -> None:
    def force(place: float) -> float:
        return 100.0 - linear([(-100.0, 300.0), (0.0, 0.0)], place)

    found = world(WEIGHT + SPRING, start=50.0)
    for n in range(1, 6):
        found.run(until=n * 0.1)
        assert found.axis["z"].position == pytest.approx(fallen(force, 0.05, n * 0.1, 50.0), abs=0.01), n
    found.run(until=5.0)
    assert 100.0 - 300.0 * -found.axis["z"].position / 100 == pytest.approx(0.0, abs=0.05 / ARM + 3.0)


def test_two_forces_towards_a_place_hold_the_rotor_there() -> None:
    """With less friction than the step of the force: the swings end, and with them the events."""
    step = "[[load]]\nname = 'up'\naxis = 'z'\nforce = -200\nwhen = 'z.position < 0'\n"
    found = world(WEIGHT.replace("100", "110") + step, start=0.5)
    found.run(until=3.0)
    assert found.axis["z"].position == pytest.approx(0.0, abs=0.03)
    assert found.read("z.stalled") == 0
    assert found.step() is None  # it rests: nothing happens any more


def test_a_load_that_turns_does_not_hold_it() -> None:
    """Two loads in turn hold a rotor only where they drive it to one place."""
    turned = "[[load]]\nname = 'up'\naxis = 'z'\nforce = -200\nwhen = 'time > 0.01'\n"
    found = world(WEIGHT + turned)
    found.run(until=0.5)
    assert found.axis["z"].position > 50.0


# ---------------------------------------------------------------------- snapshots, faults, messages


def test_a_snapshot_anywhere() -> None:
    text = WEIGHT + SPRING + "[[load]]\nname = 'box'\naxis = 'z'\nmass = 4\nwhen = 'a.OUT1'\n"
    for moment in (0.0, 0.061, 0.13, 0.4):
        found, other = world(text, start=50.0), world(text, start=50.0)
        found.run(until=moment)
        snapshot = found.snapshot()
        for one in (found, other):
            one.restore(snapshot)
            one.mic488["a"].write("OUT1", 1)
            one.run(until=1.0)
        assert found.trace.digest() == other.trace.digest()


def test_faults_and_sessions(tmp_path: Path) -> None:
    found = moving("[[load]]\nname = 'g'\naxis = 'z'\nfriction_force = 100\n")
    found.fault("other-load element=g factor=10 from_s=1")
    found.run(until=0.9)
    assert found.read("g.share") == 1
    found.run(until=1.1)
    assert found.read("g.share") == 10
    assert events(found, "stall")[0][0] == 1.0
    save(recording_of(found), tmp_path / "s.json")
    again = load(tmp_path / "s.json")
    assert again.replay().trace.digest() == found.trace.digest()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("axis = 'y'\nmass = 1", "no axis is called 'y'"),
        ("axis = 'z'", "'g' weighs nothing: give it a mass, a force, a friction or an inertia"),
        ("axis = 'z'\nmass = -1", "permitted are numbers from 0"),
        ("axis = 'z'\nmas = 1", "mas"),
        ("axis = 'z'\nmass = 1\nwhen = 'z.position >'", "expected"),
        ("axis = 'z'\nmass = 1\nwhen = 'a.OUT99'", "no signal 'a.OUT99'"),
        ("axis = 'z'\nmass = 1\nof = 'z.position'", "of means nothing without points"),
        ("axis = 'z'\nmass = 1\npoints = [[0, 1]]", "points means nothing without of"),
        ("axis = 'z'\nmass = 1\nof = 'z.position'\npoints = [[0, -1]]", "shares of -1 to -1: permitted are 0 to 1000"),
        ("axis = 'z'\nmass = 1\nof = 'z.positon'\npoints = [[0, 1]]", "position"),
    ],
)
def test_messages(table: str, message: str) -> None:
    with pytest.raises(WorldError, match=r"w\.toml:") as error:
        world(f"[[load]]\nname = 'g'\n{table}\n")
    assert message in str(error.value)


def test_an_axis_without_a_motor_moves_any_load() -> None:
    text = TEXT.format(start=0.0).partition("[axis.motor]")[0] + "[[load]]\nname = 'g'\naxis = 'z'\nmass = 1\n"
    with pytest.raises(WorldError, match=r"axis 'z' has no \[axis\.motor\]"):
        World.from_toml(text)
