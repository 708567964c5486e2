"""Motions whose values come by chance, as text: courses of axes, free rotors, cams, curves, conditions, belts and cylinders.

One half of the values is on a coarse grid, so that moments and places coincide. What is right is compared with simulations
elsewhere (`test_course.py`, `test_free.py`, `test_quantities.py`); these find what has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import islice
from typing import NamedTuple, TypeVar

from chance import Chance
from way_texts import course_text, profile_text

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, SECOND, Nanos
from steptwin.motion import MotionState, at_rest, plan_position, plan_stop, plan_velocity
from steptwin.motion.divisions import Microstepping, Plan, step_train
from steptwin.motion.paths import Circular, circle
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless
from steptwin.simulation.logic.contacts import Zone
from steptwin.simulation.logic.curve import Curve
from steptwin.simulation.logic.expression import Truth, parse_condition
from steptwin.simulation.logic.quantities import change_between, sides
from steptwin.simulation.mechanics.belt import ConstantDrive, Load, Workpiece, next_change
from steptwin.simulation.mechanics.cam import Cam
from steptwin.simulation.mechanics.course import Build, Course, MechanicalState
from steptwin.simulation.mechanics.free import FreeMotion
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.resonance import Resonance
from steptwin.simulation.mechanics.travel import Travel
from steptwin.simulation.mechanics.wells import Wells

BEGIN: Nanos = 2 * SECOND
T = TypeVar("T")


class Numbers:
    """Drawn by a `Chance`."""

    def __init__(self, name: str, seed: int) -> None:
        self._chance = Chance(name, seed)

    def one(self, *among: T) -> T:
        return self._chance.one(among)

    def number(self, low: float, high: float) -> float:
        steps = 8 if self._chance.is_even else 1 << 40
        return low + (high - low) * self._chance.below(steps + 1) / steps

    def whole(self, low: int, high: int) -> int:
        return low + self._chance.below(high - low + 1)


# ---------------------------------------------------------------------- axes


def motor(c: Numbers) -> StepperMotor:
    knee = c.number(40.0, 160.0)
    top = c.number(0.3, 1.2)
    curve = c.one(((0.0, top),), ((0.0, top), (knee, 0.5 * top)), ((0.0, top), (knee, 0.9 * top), (knee + 80.0, 0.2 * top)))
    return StepperMotor(
        curve,
        c.number(0.0003, 0.002),
        c.one(0.0, 0.1, 0.2),
        c.one(0.0, 0.0, 0.1, -0.1, 0.3, -0.3, 0.6),
        c.one(None, c.number(40.0, 120.0)),
        resonance=c.one(
            None, Resonance(c.number(30.0, 70.0), c.number(80.0, 140.0), c.number(5.0, 30.0), c.number(2.0, 9.0), 0.05)
        ),
    )


def plan(c: Numbers) -> Plan:
    state = MotionState(BEGIN, c.whole(-20, 20), c.one(0.0, 0.25, -0.5), c.one(0.0, 0.0, c.number(-150.0, 150.0)))
    acc, dec = c.number(100.0, 600.0), c.number(100.0, 600.0)
    curve = SpeedCurve(c.number(50.0, 120.0), c.number(200.0, 600.0), c.number(100.0, 200.0), c.number(130.0, 300.0))
    match c.whole(0, 9):
        case 0:
            return plan_velocity(state, c.number(-150.0, 150.0), acc, dec)
        case 1:
            return plan_stop(state, dec)
        case 2:
            return plan_distance(BEGIN, c.whole(-9, 9), c.whole(-250, 250), curve)
        case 3:
            moved = plan_distance(BEGIN, 0, 64 * c.whole(1, 6), curve)
            return step_train(moved, BEGIN, Microstepping(16, 64, c.number(100.0, 250.0)))
        case 4:
            return at_rest(BEGIN, c.whole(-20, 20))
        case 5:
            arc = circle(c.number(-9.0, 9.0), c.number(-9.0, 9.0), c.number(30.0, 80.0), c.number(-4.0, 4.0) or 1.0)
            way = plan_position(MotionState(BEGIN, 0, 0.0, 0.0), arc.length, acc, dec, c.number(60.0, 120.0))
            ends = round(arc.begin[0]), round(arc.end[0])
            return Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length).profile(way, *ends)
        case 6:
            return plan_endless(BEGIN, 0, c.one(1, -1), curve)
        case _:
            return plan_position(state, c.whole(-120, 120), acc, dec, c.number(60.0, 200.0))


def courses(c: Numbers) -> Iterator[str]:
    has_motor = c.whole(0, 2) > 0
    low, high = c.one(None, -c.whole(0, 60)), c.one(None, c.whole(0, 60))
    build = Build(
        sign=c.one(1, -1),
        zero=c.one(0, 0, c.whole(-20, 20)),
        low=low,
        high=high,
        play=c.one(0, 0, 1, 3, 9, 40),
        period_p=c.one(1, 4, 16, 64),
        motor=motor(c) if has_motor else None,
        is_free=has_motor and c.one(True, False),
    )
    its = plan(c)
    here = build.sign * its.count(BEGIN) + build.zero
    behind = c.one(0, 0, 0, build.period_p, -build.period_p, c.whole(-9, 9))
    rotor = here - behind + c.one(0, 0, 0, c.whole(-9, 9))
    rotor = max(rotor, rotor if low is None else low - build.play)
    rotor = min(rotor, rotor if high is None else high)
    state = MechanicalState(rotor, rotor + c.whole(0, build.play), has_motor and c.one(True, False, False), behind)
    more: dict[str, object] = {"vibration": c.one(0.0, 0.3, 0.9), "jump": c.one(0.0, 0.0, c.number(-200.0, 200.0))}
    if c.whole(0, 9) == 0:
        more = {"blocked": True}
    elif build.is_free and c.one(True, False):
        more = {"free": body(c, here).profile(BEGIN, here, 0.0, c.number(-200.0, 200.0))}
    yield from course_text(build, its, state, more, BEGIN, BEGIN)
    course = Course(build, its, BEGIN, state, **more)  # type: ignore[arg-type]
    looks = [BEGIN, *(piece.begin for piece in course.pieces[1:4]), *(BEGIN + n * 233 * MILLISECOND for n in range(6))]
    yield from (repr((now, *course.at(now), course.load_at(now), course.turns(now)[:3])) for now in looks)
    later = c.one(*looks)
    yield from course_text(build, its, course.at(later), more, later, BEGIN)


def body(c: Numbers, at: int) -> FreeMotion:
    return FreeMotion(
        c.number(0.0003, 0.002),
        c.one(0.0, 0.0, c.number(-0.5, 0.5)),
        c.one(0.0, c.number(0.01, 0.3), c.number(0.01, 0.3)),
        c.one(None, None, at - c.whole(0, 60)),
        c.one(None, None, at + c.whole(0, 60)),
        c.one(None, Wells(c.number(0.05, 0.5), c.one(4.0, 16.0, 12.8, 64.0))),
    )


def free_rotors(c: Numbers) -> Iterator[str]:
    base = c.whole(-40, 40)
    its = body(c, base)
    for _ in range(6):
        yield profile_text(
            its.profile(BEGIN, base, c.one(0.0, 0.25, -0.5), c.one(0.0, c.number(-40.0, 40.0), c.number(-400.0, 400.0)))
        )
        field = Wells(c.number(0.2, 1.0), c.one(4.0, 16.0, 12.8, 64.0))
        found = its.overrun(field, BEGIN, base, c.number(20.0, 600.0) * c.one(1, -1))
        yield "stays" if found is None else profile_text(found)


# ---------------------------------------------------------------------- what is moved


def cams(c: Numbers) -> Iterator[str]:
    turn = c.one(Fraction(36), Fraction(100), Fraction(301, 3), Fraction(c.whole(60, 900)), Fraction(c.whole(300, 999), 7))
    places = {c.one(Fraction(c.whole(0, 1000), 1001) * turn, Fraction(c.whole(0, 30))) for _ in range(5)}
    cam = Cam([(place, Fraction(c.whole(0, 16), c.one(1, 2, 3))) for place in sorted(places)], turn)
    for _ in range(6):
        place = c.whole(-250, 250)
        yield f"{place}: {cam.lift(place)} {[cam.nearest(place, steps) for steps in (1, 2, 1000)]}"
        yield repr([[*islice(cam.corners(place, way), 5)] for way in (1, -1)])
        level = Fraction(c.whole(0, 32), c.one(1, 2, 3))
        yield repr((level, [cam.next(level, place, side, way) for side in (1, -1) for way in (1, -1)]))


def curves(c: Numbers) -> Iterator[str]:
    x, points = c.number(-9.0, 9.0), []
    for _ in range(c.whole(2, 5)):
        points.append((x, c.one(0.0, 5.0, c.number(0.0, 10.0))))
        x += c.number(0.5, 9.0)
    curve = Curve(points, c.one(0.1, 0.25, 1.0))
    for value in (points[0][0], points[-1][0], *(c.number(-12.0, 30.0) for _ in range(8))):
        yield f"{value!r}: {curve.level(value)} {curve.ends(value)} {curve.highest}"


def zones(c: Numbers) -> Iterator[str]:
    low = c.whole(-20, 20)
    try:
        zone = Zone(
            c.one(None, low),
            c.one(None, low + c.whole(-1, 12)),
            c.one(0, 0, c.whole(1, 5)),
            c.one(None, None, c.whole(1, 40)),
        )
    except Misuse as error:
        yield str(error)
        return
    for place in (low - 1, low, low + 1, *(c.whole(-90, 90) for _ in range(8))):
        yield repr(
            (place, [zone.on(place, was_on=was) for was in (True, False)], [zone.edges(place, is_on=on) for on in (True, False)])
        )


def travels(c: Numbers) -> Iterator[str]:
    now = BEGIN
    its = Travel(c.whole(3, 40), c.whole(3, 40), is_forth=c.one(True, False), now=now)
    versions = []
    for _ in range(6):
        its.send(c.one(1, -1, 0), now)
        versions.append(its.version())
        place = its.place(now)
        found = [its.reaches(at, now, way) for at in (0, its.full // 3, place, its.full, its.full + 1) for way in (1, -1)]
        yield repr((now, its.direction, place, found, [*its.turns(now)]))
        now += c.whole(0, 30)
    yield repr([one == other for one in versions for other in versions])


def belts(c: Numbers) -> Iterator[str]:
    now = BEGIN
    drive, load = ConstantDrive(Fraction(c.whole(1, 30), c.one(1, 7)), now), Load()
    for number in range(10):
        drive.run(c.one(True, False), now)
        belt = drive.place(now)
        marks = c.one((), ((2, 3),), ((1, 1), (4, 5)))
        match c.whole(0, 3):
            case 0 | 1:
                load.put(Workpiece(f"w{number}", belt, c.whole(3, 9), marks=marks))
            case 2 if load.pieces:
                load.hold(c.one(*load.pieces), c.whole(0, 30))
            case _ if load.pieces:
                piece = c.one(*load.pieces)
                load.take(piece) if piece.held is None else load.release(piece, belt)
        for at in (c.whole(0, 20), c.whole(0, 40)):
            for of_marks in (True, False):
                covering, (below, above) = load.covering(at, belt, of_marks=of_marks), load.edges(at, belt, of_marks=of_marks)
                yield repr((at, covering, below, above, next_change(drive, below, above, now)))
        yield repr((now, belt, load.pieces))
        now += c.whole(0, 9)


# ---------------------------------------------------------------------- conditions


class Way(NamedTuple):
    """A signal that goes evenly."""

    at_begin: float
    rate: float

    def at(self, now: Nanos) -> float:
        return self.at_begin + self.rate * (now - BEGIN)


def term(c: Numbers, deep: int = 0) -> str:
    if deep > 2 or c.whole(0, 2) == 0:
        return c.one("a", "b", "d", f"{c.number(-9.0, 9.0):.6g}".replace("-", "- "), "2", "0")
    one, other, sign = term(c, deep + 1), term(c, deep + 1), c.one("+", "-", "*", "/", "%", "")
    return f"({one} {sign} {other})" if sign else f"abs({one})"


def truth(c: Numbers, deep: int = 0) -> str:
    if deep > 1 or c.whole(0, 2) == 0:
        return f"{term(c)} {c.one('<', '<=', '>', '>=', '==', '!=')} {term(c)}"
    one, other = truth(c, deep + 1), truth(c, deep + 1)
    return c.one(f"({one} and {other})", f"({one} or {other})", f"not ({one})", f"{one} or {other} and {one}")


def conditions(c: Numbers) -> Iterator[str]:
    """Their values, their ranges, and when they change between two moments."""
    for _ in range(3):
        text = truth(c)
        ways = {name: Way(c.number(-9.0, 9.0), c.one(0.0, c.number(-0.02, 0.02))) for name in "abd"}
        yield f"{text}: {condition(parse_condition(text), ways, BEGIN + 1000)}"


def condition(node: Truth, ways: Mapping[str, Way], end: Nanos) -> tuple[object, ...]:
    def between(name: str) -> tuple[float, float]:
        one, other = ways[name].at(BEGIN), ways[name].at(end)
        return min(one, other), max(one, other)

    low, high = node.range(between)
    change = change_between(node, {name: way.at for name, way in ways.items()}, BEGIN, end)
    return [*node.names()], node.value(lambda name: ways[name].at(BEGIN)), low, high, sorted(sides(low, high)), change


KINDS: dict[str, tuple[Callable[[Numbers], Iterator[str]], int]] = {
    "courses": (courses, 600),
    "free rotors": (free_rotors, 300),
    "cams": (cams, 120),
    "curves": (curves, 60),
    "zones": (zones, 200),
    "travels": (travels, 60),
    "belts": (belts, 60),
    "conditions": (conditions, 90),
}
"""And how many of each."""


def way_of(kind: str, seed: int) -> list[str]:
    return [*KINDS[kind][0](Numbers(kind, seed))]
