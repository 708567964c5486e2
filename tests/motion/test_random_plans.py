"""Plans by chance are to the last bit what they were: golden/random.txt has digests of each kind.

Regenerate with ``python tests/motion/test_random_plans.py`` where plans have changed. ``... SEED`` shows questions and answers,
so that their lines before and after a change can be compared. That velocities are the slopes of positions, and pulses where the
count changes, is checked besides.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from math import inf
from pathlib import Path

import pytest
from chance import Chance, GoldenDigests

from steptwin.errors import Misuse
from steptwin.machine import SECOND
from steptwin.motion.divisions import Microstepping, StepTrain, forced_stop, step_train
from steptwin.motion.elastic import DriveStretch, Response, Spring
from steptwin.motion.paths import Arc, Circular, Straight, arc_between, circle
from steptwin.motion.plain import plain_plan
from steptwin.motion.planner import MotionState, plan_position, plan_stop, plan_velocity
from steptwin.motion.profile import Profile, Segment
from steptwin.motion.pulses import positions, pulse_runs, pulse_times, step_times, velocities
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless, plan_forced_stop

PLANS = 6


class Plans:
    """Questions to plans by chance, and the answers."""

    def __init__(self, seed: int) -> None:
        self.chance = Chance("plan", seed)
        self.found: dict[str, list[str]] = {name: [] for name in ("moves", "ramps", "trains", "paths", "springs")}

    def real(self, text: str) -> float:
        return float(self.chance.filled(text))

    def whole(self, text: str) -> int:
        return int(self.chance.filled(text))

    def run(self) -> None:
        for _ in range(PLANS):
            self.found["moves"] += self.moves()
            self.found["ramps"] += self.ramps()
            self.found["trains"] += self.trains()
            self.found["paths"] += self.paths()
        self.found["springs"] += self.springs()

    # ------------------------------------------------------------------ any profile

    def moment(self, profile: Profile) -> int:
        """Within a profile, or at one of its borders."""
        last = 3 * SECOND if profile.end is None else profile.end - profile.start
        borders = [end for end in profile.ends if end != inf]
        if borders and self.chance.below(3) == 0:
            return profile.start + max(int(self.chance.one(borders)) + self.chance.below(3) - 1, 0)
        return profile.start + self.chance.below(last + 2)

    def looks(self, profile: Profile) -> Iterator[str]:
        yield repr(plain_plan(profile))
        yield f"{profile.start} {profile.end} {profile.ends} {profile.counts}"
        for _ in range(6):
            now = self.moment(profile)
            there = profile.position(now), profile.velocity(now), profile.count(now), profile.phase(now), profile.moving(now)
            yield f"{now} {there} {list(profile.legs(now))} {MotionState.of(profile, now)}"
            check_slope(profile, now)
            for count in (there[2] - 1, there[2] + 1, there[2] + self.whole("⟨#-40..40⟩")):
                yield f"{count} {profile.pulse_time(count, now)}"
            until = now + self.chance.below(SECOND // 20)
            times = pulse_times(profile, now, until)
            check_pulses(profile, times.tolist(), now, until)
            yield f"{times.tolist()[:9]} {len(times)} {[(way, len(some)) for way, some in pulse_runs(profile, now, until)]}"
            assert positions(profile, times).tolist() == [profile.position(one) for one in times.tolist()]
            assert velocities(profile, times).tolist() == [profile.velocity(one) for one in times.tolist()]
        for s in profile.segments:
            if isinstance(s, Segment) and s.end_s < inf:
                t = s.end_s - self.chance.below(9) / 8 * abs(s.end_s - s.anchor_s)
                speed = abs(s.velocity(t))
                yield f"{t} {s.position(t)} {s.velocity(t)} {s.when(s.position(t))} {s.when_speed(speed) if s.c2 else None}"

    def state(self) -> MotionState:
        velocity = self.real("⟨0|-900.0..900.0|-50.0..50.0⟩")
        phase = self.real("⟨0|-0.99..0.99⟩")
        return MotionState(self.chance.below(10**9), self.whole("⟨#-500..500⟩"), phase, velocity)

    # ------------------------------------------------------------------ kinds of plans

    def moves(self) -> Iterator[str]:
        state = self.state()
        acc, dec, most = self.real("⟨100.0..9000.0⟩"), self.real("⟨100.0..9000.0⟩"), self.real("⟨5.0..1500.0⟩")
        target = state.count + self.whole("⟨0|#-9..9|#-900..900⟩")
        moved = plan_position(state, target, acc, dec, most)
        yield from self.looks(moved)
        to = self.real("⟨0|-900.0..900.0⟩")
        turned = plan_velocity(MotionState.of(moved, self.moment(moved)), to, acc, dec)
        yield from self.looks(turned)
        again = MotionState.of(turned, self.moment(turned))
        yield from self.looks(plan_position(again, self.whole("⟨#-900..900⟩"), acc, dec, most))
        yield from self.looks(plan_stop(again, dec))

    def curve(self) -> SpeedCurve:
        start, top = self.real("⟨100.0..3000.0⟩"), self.real("⟨50.0..9000.0⟩")
        return SpeedCurve(start, self.real("⟨1000.0..90000.0⟩"), self.real("⟨50.0..9000.0⟩"), top)

    def ramps(self) -> Iterator[str]:
        curve, begin, now = self.curve(), self.whole("⟨#-99..99⟩"), self.chance.below(10**9)
        moved = plan_distance(now, begin, begin + self.whole("⟨0|#-9..9|#-3000..3000⟩"), curve)
        yield from self.looks(moved)
        yield from self.looks(plan_endless(now, begin, self.chance.one((1, -1)), curve))
        state = MotionState.of(moved, self.moment(moved))
        yield from self.looks(plan_forced_stop(state, curve, self.chance.one((1, 4, 64)), self.whole("⟨#0..3⟩")))

    def trains(self) -> Iterator[str]:
        curve, grid = self.curve(), self.chance.one((1, 2, 8))
        micro = Microstepping(grid, grid * self.chance.one((1, 2, 8)), self.real("⟨200.0..6000.0⟩"))
        begin = self.whole("⟨#-99..99⟩")
        way = self.whole("⟨#-300..300|#-20..20⟩") * grid
        train = step_train(plan_distance(self.chance.below(10**9), begin, begin + way, curve), begin, micro)
        yield from self.train_looks(train)
        now = self.moment(train.profile)
        yield from self.train_looks(forced_stop(train, now, curve, self.chance.one((None, None, 64))))

    def train_looks(self, train: StepTrain) -> Iterator[str]:
        yield f"{plain_plan(train)} {train.direction} {list(train.stretches())}"
        for _ in range(4):
            now = self.moment(train.profile)
            count = train.count(now)
            until = now + self.chance.below(SECOND // 10)
            times = step_times(train, now, until).tolist()
            yield f"{now} {count} {train.division(now)} {times[:9]} {len(times)}"
            for more in (-1, 1, self.whole("⟨#-99..99⟩")):
                yield f"{more} {train.pulse_time(count + more, now)}"
            assert [train.count(one) != train.count(one - 1) for one in times] == [True] * len(times)
            assert train.count(until) - count == sum(train.count(one) - train.count(one - 1) for one in times)

    def paths(self) -> Iterator[str]:
        way = plan_position(MotionState(self.chance.below(10**9), 0, 0.0, 0.0), self.whole("⟨#1..900⟩"), 900.0, 700.0, 400.0)
        slope = self.real("⟨-1.0..1.0|0⟩")
        straight = Straight(self.real("⟨-50..50⟩"), slope)
        yield from self.course_looks(straight, way)
        for arc in self.arcs():
            yield f"{arc} {arc.length} {arc.begin} {arc.end}"
            if arc.length:
                yield from self.course_looks(Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length), way)

    def arcs(self) -> Iterator[Arc]:
        yield circle(self.real("⟨0|-50..50⟩"), self.real("⟨0|-50..50⟩"), self.real("⟨1..90⟩"), self.real("⟨-9..9⟩"))
        x0, y0, x1, y1 = (self.real("⟨-50..50⟩") for _ in range(4))
        try:
            yield arc_between(x0, y0, x1, y1, self.real("⟨5..90⟩"), outward=self.chance.below(2) == 0, slack=self.real("⟨0|3⟩"))
        except Misuse as error:
            self.found["paths"].append(str(error))

    def course_looks(self, course: Straight | Circular, way: Profile) -> Iterator[str]:
        end = way.final_p
        for side in (1, -1):
            for edge in (course.position(0.0), course.position(end), self.real("⟨-99..99⟩")):
                yield f"{course.first_beyond(edge, side, self.real('⟨0|1..9⟩'), end)}"
        count = round(course.position(0.0))
        final = self.chance.one((None, round(course.position(end)), round(course.position(end)) + 1))
        yield from self.looks(course.profile(way, count, final))

    def springs(self) -> Iterator[str]:
        spring = Spring(self.real("⟨2.0..40.0⟩"), self.real("⟨0.02..0.9⟩"))
        begins = sorted(self.chance.below(SECOND) for _ in range(3))
        drives = [
            DriveStretch(
                begin, self.real("⟨-30..30⟩"), self.real("⟨0|-90..90⟩"), self.real("⟨0|-900..900⟩"), self.real("⟨0|-999..999⟩")
            )
            for begin in begins
        ]
        drives.append(DriveStretch(begins[-1] + SECOND // 3, 5.0, 0.0, 0.0, 0.0))
        response = Response(spring, drives, self.real("⟨-9..9⟩"), self.real("⟨-99..99⟩"))
        yield f"{spring} {response.stretches} {list(response.ends())}"
        for _ in range(4):
            now = begins[0] + self.chance.below(SECOND)
            yield f"{now} {response.at(now)} {response.oscillates(now)} {response.stretch(now).bounds(now, now + 10**7)}"
            level = response.at(now + SECOND // 50)[0]
            yield f"{[response.reaches(level, now, way) for way in (1, -1)]}"
        yield f"{[moment for moment, _ in zip(response.turns(begins[0]), range(20), strict=False)]}"


def check_slope(profile: Profile, now: int) -> None:
    """The velocity between two moments is that of the way between them, unless the acceleration changes there."""
    a, b = now - 1000, now + 1000
    if a < profile.start or any(a <= profile.start + end <= b for end in profile.ends):
        return
    slope = (profile.position(b) - profile.position(a)) / 2e-6
    assert profile.velocity(now) == pytest.approx(slope, rel=1e-5, abs=0.05)


def check_pulses(profile: Profile, times: list[int], after: int, until: int) -> None:
    """The count changes where there are pulses, by their number, and nowhere else."""
    for time, pulses in Counter(times).items():
        assert abs(profile.count(time) - profile.count(time - 1)) == pulses
    counts = [profile.count(after), *(profile.count(time) for time in dict.fromkeys(times)), profile.count(until)]
    assert sum(abs(b - a) for a, b in pairwise(counts)) == len(times)
    assert counts[-1] == counts[-2]


def seen(seed: int) -> dict[str, list[str]]:
    plans = Plans(seed)
    plans.run()
    return plans.found


GOLDEN = GoldenDigests(seen, Path(__file__).parent / "golden" / "random.txt", range(16))


@pytest.mark.parametrize("seed", GOLDEN.seeds)
def test_plans_are_what_they_were(seed: int) -> None:
    assert GOLDEN.of(seed) == GOLDEN.recorded(seed)


if __name__ == "__main__":
    GOLDEN.main()
