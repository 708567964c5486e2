"""Courses of axes, free motions, coordinates of two axes and cams in all their parts, to the nanosecond: golden/ways.txt.

What is right is compared with simulations of their own in `test_course.py`, `test_free.py` and others. Regenerate with
``make golden ARGS=tests/simulation/test_ways_golden.py`` and read the diff.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from pathlib import Path

import pytest
from way_texts import course_text, profile_text

from steptwin.files.world import World
from steptwin.machine import MILLISECOND, SECOND
from steptwin.motion import MotionState, at_rest, plan_position, plan_stop, plan_velocity
from steptwin.motion.divisions import Microstepping, Plan, step_train
from steptwin.motion.paths import Circular, circle
from steptwin.motion.ramps import SpeedCurve, plan_distance
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.coordinate import Coordinate, Pulled
from steptwin.simulation.mechanics.cam import Cam
from steptwin.simulation.mechanics.course import Build, Course, MechanicalState
from steptwin.simulation.mechanics.free import FreeMotion
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.resonance import Resonance
from steptwin.simulation.mechanics.wells import Wells

GOLDEN = Path(__file__).parent / "golden" / "ways.txt"


# ---------------------------------------------------------------------- courses

BEGIN = 2 * SECOND
OUT = plan_position(MotionState(BEGIN, 0, 0.25, 0.0), 90, 400.0, 800.0, 150.0)
TURNS = plan_position(MotionState(BEGIN, 0, 0.25, 120.0), -70, 400.0, 800.0, 150.0)
BACK = plan_position(MotionState(BEGIN, 0, 0.0, 0.0), -60, 400.0, 400.0, 100.0)
ENDLESS = plan_velocity(MotionState(BEGIN, 0, 0.0, 0.0), 120.0, 300.0, 300.0)
STOPS = plan_stop(MotionState(BEGIN, 20, 0.5, 100.0), 300.0)
JUMPS = plan_distance(BEGIN, 0, 300, SpeedCurve(100.0, 400.0, 180.0, 300.0))
STANDS = at_rest(BEGIN, 12)
DIVIDED = step_train(JUMPS, BEGIN, Microstepping(16, 64, 200.0))
ARC = circle(0.0, 0.0, 60.0, 2.5)
ROUND = Circular(ARC.centre_x, ARC.radius, ARC.begin_q, ARC.sweep_q / ARC.length).profile(
    plan_position(MotionState(BEGIN, 0, 0.0, 0.0), ARC.length, 400.0, 400.0, 80.0), round(ARC.begin[0]), round(ARC.end[0])
)
MOTOR = StepperMotor(((0.0, 1.0), (120.0, 0.8), (200.0, 0.3)), 0.001, 0.1, 0.0, 60.0)
WEAK = replace(MOTOR, curve=((0.0, 0.45), (300.0, 0.42)))
HEAVY = replace(MOTOR, load=0.35)
NEVER = replace(WEAK, start_p=None)
RINGS = replace(MOTOR, resonance=Resonance(60.0, 110.0, 14.0, 4.0, 0.05))
HERE = MechanicalState(0, 0)
FALLS = FreeMotion(0.001, 0.3, 0.1, -80, 60).profile(BEGIN, 0, 0.0, 90.0)

COURSES: dict[str, tuple[Build, Plan, MechanicalState, dict[str, object]]] = {
    "ideal": (Build(), OUT, HERE, {}),
    "inverted, elsewhere": (Build(sign=-1, zero=17), TURNS, MechanicalState(17, 17), {}),
    "stops": (Build(low=-30, high=40), TURNS, HERE, {}),
    "stops, inverted": (Build(sign=-1, low=-30, high=40), TURNS, HERE, {}),
    "stops and periods": (Build(low=-30, high=40, period_p=16), TURNS, HERE, {}),
    "stops, periods and play": (Build(low=-30, high=40, period_p=64, play=6), TURNS, HERE, {}),
    "a stop below": (Build(low=-30, period_p=16, play=4), TURNS, MechanicalState(0, 2), {}),
    "a stop above": (Build(high=20, period_p=16), OUT, HERE, {}),
    "at a stop": (Build(high=0, period_p=16), OUT, HERE, {}),
    "at a stop, drawn": (Build(low=-40, high=0, period_p=64), BACK, MechanicalState(0, 0, behind=-9), {}),
    "drawn beyond the end": (Build(high=0, period_p=640), BACK, MechanicalState(0, 0, behind=-200), {}),
    "away from a stop": (Build(low=0, play=5), OUT, MechanicalState(-5, 0), {}),
    "play": (Build(play=9), TURNS, HERE, {}),
    "play, at its other side": (Build(play=9), BACK, MechanicalState(0, 9), {}),
    "play, inverted": (Build(sign=-1, play=9), TURNS, MechanicalState(0, 4), {}),
    "play that is not used up": (Build(play=200), TURNS, MechanicalState(0, 100), {}),
    "behind": (Build(period_p=16), OUT, MechanicalState(-16, -16, behind=16), {}),
    "no place for it": (Build(period_p=16), OUT, MechanicalState(5, 5), {}),
    "no place for it, downwards": (Build(period_p=64), BACK, MechanicalState(5, 5), {}),
    "half a period": (Build(period_p=16), STANDS, MechanicalState(4, 4), {}),
    "a pulse before a stop": (Build(high=1), OUT, HERE, {}),
    "a pulse before a stop below": (Build(low=-3, play=2), BACK, MechanicalState(-4, -3), {}),
    "a pulse beyond a stop": (Build(high=89, period_p=16), OUT, HERE, {}),
    "two pulses beyond a stop": (Build(high=88, period_p=16), OUT, HERE, {}),
    "pushed at a stop below": (Build(low=0, play=5, period_p=64), BACK, MechanicalState(-5, 0, behind=5), {}),
    "at a stop below without play": (Build(low=0, period_p=64), BACK, HERE, {}),
    "the load meets a stop with its rotor": (Build(high=30, play=40), OUT, MechanicalState(0, 30), {}),
    "endless": (Build(high=50, play=3), ENDLESS, HERE, {}),
    "a stop of the field": (Build(play=3, zero=-20), STOPS, MechanicalState(0, 0), {}),
    "microsteps": (Build(low=-10, high=250), DIVIDED, HERE, {}),
    "an arc": (Build(sign=-1, play=2), ROUND, HERE, {}),
    "an arc and a motor": (Build(motor=replace(MOTOR, inertia=0.003)), ROUND, HERE, {}),
    "blocked": (Build(), TURNS, HERE, {"blocked": True}),
    "blocked and stalled": (Build(period_p=16, motor=MOTOR), OUT, MechanicalState(0, 0, stalled=True), {"blocked": True}),
    "a motor": (Build(motor=MOTOR, period_p=16), OUT, HERE, {}),
    "a stalled motor, caught at once": (Build(motor=MOTOR, period_p=16), BACK, MechanicalState(3, 3, stalled=True), {}),
    "a motor that stalls": (Build(motor=WEAK, period_p=16), TURNS, HERE, {}),
    "a motor that stalls, inverted": (Build(sign=-1, motor=WEAK, period_p=16), TURNS, HERE, {}),
    "a motor that stalls where it is fast": (Build(motor=MOTOR, period_p=16, play=2), JUMPS, HERE, {}),
    "a motor that is never caught": (Build(motor=NEVER, period_p=16), TURNS, HERE, {}),
    "a motor and its load": (Build(motor=HEAVY, period_p=16, low=-20, high=60), TURNS, HERE, {}),
    "a motor that cannot hold": (
        Build(motor=replace(MOTOR, load=1.2), period_p=16),
        STANDS,
        MechanicalState(3, 3, stalled=True),
        {},
    ),
    "a motor that can hold": (Build(motor=MOTOR, period_p=16), STANDS, MechanicalState(3, 3, stalled=True), {}),
    "a jump that it follows": (Build(motor=MOTOR, period_p=16), STOPS, MechanicalState(20, 20), {"jump": 60.0}),
    "a jump": (Build(motor=MOTOR, period_p=16), STOPS, MechanicalState(20, 20), {"jump": -60.5}),
    "a jump to rest": (Build(motor=MOTOR, period_p=16), STANDS, MechanicalState(12, 12), {"jump": 100.0}),
    "resonance": (Build(motor=RINGS, period_p=16), OUT, HERE, {"vibration": 0.3}),
    "caught and lost at once": (
        Build(motor=replace(RINGS, load=0.68, start_p=100.0, resonance=Resonance(60.0, 130.0, 14.0, 4.0, 0.9)), period_p=16),
        plan_velocity(MotionState(BEGIN, 0, 0.0, 80.0), 80.0, 300.0, 300.0),
        MechanicalState(0, 0, stalled=True),
        {"vibration": 0.9},
    ),
    "resonance and a weak motor": (
        Build(motor=replace(RINGS, load=0.3), period_p=16),
        plan_position(MotionState(BEGIN, 0, 0.0, 0.0), 150, 100.0, 100.0, 190.0),
        HERE,
        {"vibration": 0.4},
    ),
    "resonance, but a weak motor before": (
        Build(motor=replace(RINGS, curve=((0.0, 1.0), (80.0, 0.9), (90.0, 0.3), (400.0, 0.3))), period_p=16),
        plan_position(MotionState(BEGIN, 0, 0.0, 0.0), 400, 300.0, 100.0, 190.0),
        HERE,
        {"vibration": 0.2},
    ),
    "resonance, slower": (Build(motor=RINGS, period_p=16), BACK, HERE, {"vibration": 0.01}),
    "free": (Build(sign=-1, zero=5, motor=MOTOR, is_free=True), STANDS, MechanicalState(5, 8, behind=2), {"free": FALLS}),
    "free, at rest": (Build(motor=MOTOR, is_free=True), STANDS, MechanicalState(3, 3), {"free": at_rest(BEGIN, 3)}),
}


def courses() -> Iterator[tuple[str, list[str]]]:
    for name, (build, plan, state, more) in COURSES.items():
        yield name, [*course_text(build, plan, state, more, BEGIN, BEGIN)]
    # Begun again on the way.
    for name in ("stops, periods and play", "a motor that stalls", "microsteps", "an arc"):
        build, plan, state, more = COURSES[name]
        begin = BEGIN + 511 * MILLISECOND
        there = Course(build, plan, BEGIN, state, **more).at(begin)  # type: ignore[arg-type]
        yield f"{name}, from its middle", [*course_text(build, plan, there, more, begin, BEGIN)]


# ---------------------------------------------------------------------- free motions

BODY = FreeMotion(0.001, 0.4, 0.1, None, None)
DETENT = Wells(0.3, 16.0)
CAUGHT = replace(BODY, load=0.05, detent=DETENT)
BODIES: dict[str, FreeMotion] = {
    "falls": BODY,
    "falls up to a stop": replace(BODY, low=470, high=512),
    "is driven up": replace(BODY, load=-0.4, high=560),
    "friction": replace(BODY, load=0.05),
    "nothing brakes": replace(BODY, load=0.0, friction=0.0, low=300, high=700),
    "a detent": CAUGHT,
    "a detent and stops": replace(CAUGHT, low=497, high=514),
    "a detent and a load": replace(CAUGHT, load=-0.2),
    "a detent that is too weak": replace(CAUGHT, load=0.41),
}


def free_motions() -> Iterator[tuple[str, list[str]]]:
    for name, body in BODIES.items():
        begins = [(500, 0.0, 0.0), (500, 0.25, 25.0), (500, 0.25, -25.0), (500, 0.0, 150.0), (500, -0.5, -150.0)]
        begins += [(500, 0.0, 400.0), (500, 0.0, -400.0), (510, 0.0, -30.0), (498, 0.0, 30.0), (505, 0.0, 60.0)]
        yield (
            f"from there: {name}",
            [f"  {velocity:g}: {profile_text(body.profile(7, base, phase, velocity))}" for base, phase, velocity in begins],
        )
        field = Wells(1.0, 64.0)
        runs = ((velocity, body.overrun(field, 7, 500, velocity)) for velocity in (100.0, -250.0, 300.0, 600.0, -600.0))
        yield f"runs on: {name}", [f"  {velocity:g}: {'-' if found is None else profile_text(found)}" for velocity, found in runs]


# ---------------------------------------------------------------------- coordinates of two axes

TWO = """
[[mic488]]
name = "a"
[mic488.M1]
acc = 1000.0
dec = 2000.0
vel = 800.0
[mic488.M2]
acc = 500.0
dec = 500.0
vel = 600.0
[[axis]]
name = "x"
drive = "a.M1"
pulses_per_unit = 10.0
[[axis]]
name = "y"
drive = "a.M2"
pulses_per_unit = 20.0
inverted = true
backlash = 0.5
"""


CHIP_AND_TWO = """
[[m1486]]
name = "c"
program = "p"
[[mic488]]
name = "a"
[mic488.M1]
acc = 500.0
dec = 300.0
vel = 700.0
[[axis]]
name = "x"
drive = "c.M1"
pulses_per_unit = 640.0
[[axis]]
name = "y"
drive = "a.M1"
pulses_per_unit = 20.0
[[wire]]
from = "a.OUT1"
to = "c.B3"
"""
"""The acceleration of the chip falls from 300 steps/s on."""


def with_a_chip() -> Iterator[tuple[str, list[str]]]:
    world = World.from_toml(CHIP_AND_TWO, {"p": b"[\rs100\ra900\rp300\rv700\rf64000\rr\rw9000\r]\r"})
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 1100.0)
    one, other = (world.parts.built(AXIS)[name] for name in ("x", "y"))
    for moment in (0.0, 0.05, 0.4, 0.9, 1.6):
        world.run(until=moment)
        for shares in ((0.5, 0.5), (0.5, -0.5), (0.25, -0.5)):
            its = Coordinate((one, other), shares, (Pulled(), Pulled()))
            turns = " ".join(str(turn - world.now) for turn in its.turns(world.now))
            yield f"{shares} at {moment}", [f"  {its.place(world.now)} {turns}"]


def coordinates() -> Iterator[tuple[str, list[str]]]:
    world = World.from_toml(TWO)
    for name, value in (("M1_EN", 1), ("M2_EN", 1), ("M1_POS_ABS", 900.0), ("M2_POS_ABS", -1500.0)):
        world.mic488["a"].write(name, value)
    world.run(for_=0.4)
    world.mic488["a"].write("M2_POS_ABS", 300.0)
    world.run(for_=0.05)
    one, other = (world.parts.built(AXIS)[name] for name in ("x", "y"))
    for shares, pulled in (
        ((0.5, 0.5), (Pulled(), Pulled())),
        ((0.5, -0.5), (Pulled(), Pulled(behind=0.75))),
        ((1.0, 0.0), (Pulled(), Pulled())),
        ((0.5, 0.5), (Pulled(held=12.5), Pulled())),
        ((0.5, -0.5), (Pulled(held=1.0), Pulled(held=-2.0))),
    ):
        its = Coordinate((one, other), shares, pulled)
        lines = [f"  {its.place(world.now)} {' '.join(str(turn - world.now) for turn in its.turns(world.now))}"]
        for way in (1, -1):
            places = [n * 7_000_000 for n in range(-6, 10)]
            found = (its.reaches(place, world.now, way) for place in places)
            lines.append("  " + " ".join("-" if at is None else str(at - world.now) for at in found))
        yield f"{shares} {' '.join(map(str, pulled))}", lines


# ---------------------------------------------------------------------- cams


def cams() -> Iterator[tuple[str, list[str]]]:
    points = [(10, 0), (30, 8), (70, 8), (85, 3)]
    for turn in (Fraction(100), Fraction(301, 3)):
        cam = Cam([(Fraction(place), Fraction(lift)) for place, lift in points], turn)
        lines = []
        for place in (-101, 9, 10, 30, 50, 69, 70, 100):
            near = " ".join(str(cam.nearest(place, steps)) for steps in (1, 2, 1000))
            corners = (" ".join(str(one) for one in islice(cam.corners(place, way), 6)) for way in (1, -1))
            lines.append(f"  {place}: {near}; {' | '.join(corners)}")
            for level in (Fraction(0), Fraction(1, 3), Fraction(3), Fraction(8), Fraction(9)):
                found = (cam.next(level, place, direction, way) for direction in (1, -1) for way in (1, -1))
                lines.append(f"    {level}: {' '.join('-' if one is None else str(one) for one in found)}")
        yield f"a turn of {turn}", lines


SOURCES: tuple[Callable[[], Iterator[tuple[str, list[str]]]], ...] = (courses, free_motions, coordinates, with_a_chip, cams)


def ways(source: Callable[[], Iterator[tuple[str, list[str]]]]) -> dict[str, list[str]]:
    return {f"{source.__name__}, {name}": lines for name, lines in source()}


@pytest.mark.parametrize("source", SOURCES, ids=[source.__name__ for source in SOURCES])
def test_ways_are_the_reviewed_ones(source: Callable[[], Iterator[tuple[str, list[str]]]]) -> None:
    texts = GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]
    expected = {name: lines for name, *lines in (text.rstrip().splitlines() for text in texts)}
    assert ways(source) == {name: lines for name, lines in expected.items() if name.startswith(f"{source.__name__}, ")}


if __name__ == "__main__":
    found = (way for source in SOURCES for way in ways(source).items())
    GOLDEN.write_text("\n".join("\n".join([f"=== {name}", *lines]) for name, lines in found) + "\n", encoding="utf-8")
