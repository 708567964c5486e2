"""Rules that hold for every plan, for plans by chance: moves, ramps, trains of pulses, paths."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from math import inf

import pytest
from chance import Chance

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.motion.divisions import Microstepping, StepTrain, forced_stop, step_train
from steptwin.motion.paths import Arc, Circular, Straight, arc_between, circle
from steptwin.motion.planner import MotionState, plan_position, plan_stop, plan_velocity
from steptwin.motion.profile import Profile
from steptwin.motion.pulses import positions, pulse_runs, pulse_times, step_times, velocities
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless, plan_forced_stop


class Plans:
    """Plans by chance, from rest and from the middle of others."""

    def __init__(self, seed: int) -> None:
        self.chance = Chance("plan", seed)

    def real(self, text: str) -> float:
        return float(self.chance.filled(text))

    def whole(self, text: str) -> int:
        return int(self.chance.filled(text))

    def moment(self, profile: Profile) -> int:
        """A moment within a profile, or at one of its borders."""
        last = 3 * SECOND if profile.end is None else profile.end - profile.start
        borders = [end for end in profile.ends if end != inf]
        if borders and self.chance.below(3) == 0:
            return profile.start + max(int(self.chance.one(borders)) + self.chance.below(3) - 1, 0)
        return profile.start + self.chance.below(last + 2)

    def profiles(self) -> Iterator[Profile]:
        yield from self.moves()
        yield from self.ramps()
        yield from self.paths()

    def moves(self) -> Iterator[Profile]:
        phase, velocity = self.real("⟨0|-0.99..0.99⟩"), self.real("⟨0|-900.0..900.0|-50.0..50.0⟩")
        state = MotionState(self.chance.below(10**9), self.whole("⟨#-500..500⟩"), phase, velocity)
        acc, dec, most = self.real("⟨100.0..9000.0⟩"), self.real("⟨100.0..9000.0⟩"), self.real("⟨5.0..1500.0⟩")
        moved = plan_position(state, state.count + self.whole("⟨0|#-9..9|#-900..900⟩"), acc, dec, most)
        turned = plan_velocity(MotionState.of(moved, self.moment(moved)), self.real("⟨0|-900.0..900.0⟩"), acc, dec)
        again = MotionState.of(turned, self.moment(turned))
        yield from (moved, turned, plan_position(again, self.whole("⟨#-900..900⟩"), acc, dec, most), plan_stop(again, dec))

    def curve(self) -> SpeedCurve:
        start, top = self.real("⟨100.0..3000.0⟩"), self.real("⟨50.0..9000.0⟩")
        return SpeedCurve(start, self.real("⟨1000.0..90000.0⟩"), self.real("⟨50.0..9000.0⟩"), top)

    def ramps(self) -> Iterator[Profile]:
        curve, begin, now = self.curve(), self.whole("⟨#-99..99⟩"), self.chance.below(10**9)
        moved = plan_distance(now, begin, begin + self.whole("⟨0|#-9..9|#-3000..3000⟩"), curve)
        state = MotionState.of(moved, self.moment(moved))
        forced = plan_forced_stop(state, curve, self.chance.one((1, 4, 64)), self.whole("⟨#0..3⟩"))
        yield from (moved, plan_endless(now, begin, self.chance.one((1, -1)), curve), forced)

    def trains(self) -> Iterator[StepTrain]:
        curve, grid = self.curve(), self.chance.one((1, 2, 8))
        micro = Microstepping(grid, grid * self.chance.one((1, 2, 8)), self.real("⟨200.0..6000.0⟩"))
        begin = self.whole("⟨#-99..99⟩")
        end = begin + self.whole("⟨#-300..300|#-20..20⟩") * grid
        train = step_train(plan_distance(self.chance.below(10**9), begin, end, curve), begin, micro)
        yield from (train, forced_stop(train, self.moment(train.profile), curve, self.chance.one((None, None, 64))))

    def paths(self) -> Iterator[Profile]:
        travel = plan_position(MotionState(self.chance.below(10**9), 0, 0.0, 0.0), self.whole("⟨#1..900⟩"), 900.0, 700.0, 400.0)
        curves: list[Straight | Circular] = [Straight(self.real("⟨-50..50⟩"), self.real("⟨-1.0..1.0|0⟩"))]
        arcs = [arc for arc in self.arcs() if arc.length]
        curves += [Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length) for arc in arcs]
        for curve in curves:
            last = round(curve.position(travel.final_p))
            yield curve.profile(travel, round(curve.position(0.0)), self.chance.one((None, last, last + 1)))

    def arcs(self) -> Iterator[Arc]:
        yield circle(self.real("⟨0|-50..50⟩"), self.real("⟨0|-50..50⟩"), self.real("⟨1..90⟩"), self.real("⟨-9..9⟩"))
        x0, y0, x1, y1 = (self.real("⟨-50..50⟩") for _ in range(4))
        with contextlib.suppress(Misuse):  # no circle of this radius passes through both points
            yield arc_between(x0, y0, x1, y1, self.real("⟨5..90⟩"), outward=self.chance.below(2) == 0, slack=self.real("⟨0|3⟩"))


def check_slope(profile: Profile, now: int) -> None:
    """The velocity between two moments is that of the travel between them, unless the acceleration changes there."""
    a, b = now - 1000, now + 1000
    if a < profile.start or any(a <= profile.start + end <= b for end in profile.ends):
        return
    slope = (profile.position(b) - profile.position(a)) / 2e-6
    assert profile.velocity(now) == pytest.approx(slope, rel=1e-5, abs=0.05)


def check_pulses(profile: Profile, now: int, until: int) -> None:
    """The count changes where there are pulses, by their number, and nowhere else; arrays have the values of single moments."""
    found = pulse_times(profile, now, until)
    times: list[int] = found.tolist()
    for time, pulses in Counter(times).items():
        assert abs(profile.count(time) - profile.count(time - 1)) == pulses
    counts = [profile.count(now), *(profile.count(time) for time in dict.fromkeys(times)), profile.count(until)]
    assert (
        sum(abs(b - a) for a, b in pairwise(counts))
        == len(times)
        == sum(len(some) for _, some in pulse_runs(profile, now, until))
    )
    assert counts[-1] == counts[-2]
    assert positions(profile, found).tolist() == [profile.position(one) for one in times]
    assert velocities(profile, found).tolist() == [profile.velocity(one) for one in times]


def check_crossing(profile: Profile, now: int, count: int) -> None:
    """A count is reached in the nanosecond of its pulse, in which there may be others."""
    there = profile.pulse_time(count, now)
    if there is not None:
        low, high = sorted((profile.count(there - 1), profile.count(there)))
        assert low <= count <= high
        assert low != high


@pytest.mark.parametrize("seed", range(24))
def test_profiles(seed: int) -> None:
    plans = Plans(seed)
    for profile in (one for _ in range(4) for one in plans.profiles()):
        for _ in range(6):
            now = plans.moment(profile)
            check_slope(profile, now)
            check_pulses(profile, now, now + plans.chance.below(SECOND // 20))
            for count in (profile.count(now) - 1, profile.count(now) + 1, profile.count(now) + plans.whole("⟨#-40..40⟩")):
                check_crossing(profile, now, count)


@pytest.mark.parametrize("seed", range(24))
def test_step_trains(seed: int) -> None:
    """The steps of a window change the count, one by one, and by nothing else."""
    plans = Plans(seed)
    for train in (one for _ in range(4) for one in plans.trains()):
        for _ in range(4):
            now = plans.moment(train.profile)
            until = now + plans.chance.below(SECOND // 10)
            times = step_times(train, now, until).tolist()
            changes = [train.count(one) - train.count(one - 1) for one in times]
            assert 0 not in changes
            assert train.count(until) - train.count(now) == sum(changes)
