from __future__ import annotations

from itertools import product
from math import inf
from random import Random

import pytest
from space_scenes import END_NS, bodies_of, motion_of, random_scene

from steptwin.motion.profile import Profile, cruise
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.contacts import NEVER, Pair
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint, in_plane, placement, whole
from steptwin.simulation.space.pieces import Motion
from steptwin.simulation.space.sweeps import Sweep, Sweeps, SweptBody, sweep


def moving(seconds: float, *, turns: bool = False) -> Frame:
    plan = Profile(0, 0, (cruise(0.0, seconds, 0.0, 1000.0),), 0.0 if seconds == inf else 1000.0 * seconds)
    return Frame("x", FLOOR, (100, 0, 0), Joint(motion_of(plan), Direction(0, -1), turns))


def test_a_sweep_is_the_way_of_a_body_until_its_plan_ends() -> None:
    body = Body("body", moving(2.0), Box((10, 20, 30)), (5, 0, 0))
    assert sweep(body, 0) == Sweep((-1906.0, -20.0, -30.0), (116.0, 20.0, 30.0))
    assert sweep(body, 10**9) == Sweep((-1906.0, -20.0, -30.0), (-884.0, 20.0, 30.0))
    assert sweep(body, 3 * 10**9) == Sweep((-1906.0, -20.0, -30.0), (-1884.0, 20.0, 30.0))


def test_what_goes_on_for_ever_comes_anywhere_and_what_turns_stays_within_its_radius() -> None:
    assert sweep(Body("body", moving(inf), Box((10, 20, 30))), 0).low[0] == -inf
    assert sweep(Body("body", moving(inf, turns=True), Box((10, 30, 40))), 0) == Sweep((90.0, -51.0, -51.0), (110.0, 51.0, 51.0))


@pytest.mark.parametrize("seconds", [2.0, inf])
def test_a_sweep_may_be_that_of_a_time(seconds: float) -> None:
    body, second = Body("body", moving(seconds), Box((10, 20, 30)), (5, 0, 0)), 10**9
    assert sweep(body, 0, until=second) == Sweep((-906.0, -20.0, -30.0), (116.0, 20.0, 30.0))
    assert sweep(body, 0, since=second, until=2 * second).high == (-884.0, 20.0, 30.0)
    assert sweep(body, 0, since=second).low[0] == (-inf if seconds == inf else -1906.0)
    assert sweep(body, 0, since=3 * second).high[0] == (inf if seconds == inf else -1884.0)


def test_where_it_comes_soon_is_that_of_its_present_plan() -> None:
    plans = [Profile(0, 0, (cruise(0.0, inf, 0.0, 1000.0),), 0.0), Profile(0, 0, (cruise(0.0, inf, 0.0, -3000.0),), 0.0)]
    motion = Motion(lambda: len(plans), lambda now: motion_of(plans[0]).pieces(now))
    body, second = SweptBody(Body("body", Frame("x", FLOOR, (0, 0, 0), Joint(motion, Direction(0, 1))), Box((10, 10, 10)))), 10**9
    assert (body.soon(0, second).low[0], body.soon(0, second).high[0]) == (-11.0, 1011.0)
    assert body.soon(0, 2 * second).high[0] == 2011.0
    del plans[0]
    assert (body.soon(0, 2 * second).low[0], body.soon(0, 2 * second).high[0]) == (-6011.0, 11.0)


@pytest.mark.parametrize("turns", [0.0, 0.25, 0.1])
def test_what_goes_on_for_ever_on_a_turntable_comes_anywhere_in_its_plane(turns: float) -> None:
    table = Frame("table", FLOOR, (0, 0, 0), Joint(motion_of(Profile(0, 0, (), turns)), Direction(2, 1), turns=True))
    slide = Profile(0, 0, (cruise(0.0, inf, 0.0, 1000.0),), 0.0)
    found = sweep(Body("body", Frame("x", table, (0, 0, 0), Joint(motion_of(slide), Direction(0, 1))), Box((10, 20, 30))), 0)
    assert (found.low[:2], found.high[:2]) == ((-inf, -inf), (inf, inf))
    assert (found.low[2], found.high[2]) == (-30.0, 30.0)


@pytest.mark.parametrize("seed", range(12))
def test_all_corners_of_a_body_are_always_within_its_sweep(seed: int) -> None:
    for body in bodies_of(random_scene(seed)):
        if not isinstance(body.shape, Box):
            continue
        its = sweep(body, 0)
        for now in range(0, END_NS, END_NS // 37):
            axis, at = placement(body.frame, FLOOR, now)
            for signs in product((-1, 1), repeat=3):
                corner = [c + sign * half for c, sign, half in zip(body.centre, signs, body.shape.half, strict=True)]
                place = whole(at.of(in_plane(corner, axis)), axis)
                assert all(low <= p <= high for low, p, high in zip(its.low, place, its.high, strict=True))


def test_what_cannot_meet_is_not_near() -> None:
    """Of random scenes none whose bodies are not near has a contact."""
    apart = 0
    for seed in range(60):
        one, other = bodies_of(random_scene(seed))
        sweeps = Sweeps()
        sweeps.put(other.name, sweep(other, 0))
        if not sweeps.near(sweep(one, 0)):
            apart += 1
            assert not Pair(one, other).overlap(0)
            assert Pair(one, other).next_change(0) == NEVER
    assert apart > 2


def test_those_without_an_end_are_counted() -> None:
    sweeps = Sweeps()
    assert sweeps.endless == 0
    for name, seconds in (("one", inf), ("other", inf), ("third", 2.0)):
        sweeps.put(name, sweep(Body(name, moving(seconds), Box((10, 20, 30))), 0))
    assert sweeps.endless == 2
    sweeps.discard("one")
    assert sweeps.endless == 1


def test_near_ones_are_those_of_a_comparison_with_all() -> None:
    chance = Random(1)
    sweeps, those = Sweeps(), {}
    for step in range(300):
        name = f"body{chance.randrange(40)}"
        if name in those and chance.random() < 0.3:
            del those[name]
            sweeps.discard(name)
        else:
            low = [float(chance.randrange(100)) for _ in range(3)]
            high = [one + chance.choice((1.0, 5.0, 60.0, inf)) for one in low]
            those[name] = Sweep((low[0], low[1], low[2]), (high[0], high[1], high[2]))
            sweeps.put(name, those[name])
        for its in those.values() if step % 10 == 0 else ():
            expected = [
                other
                for other, there in sorted(those.items())
                if all(its.low[n] < there.high[n] and there.low[n] < its.high[n] for n in range(3))
            ]
            assert sorted(sweeps.near(its)) == expected
