"""Lines, circles and arcs against the ideal path, computed with libm, by brute force."""

from __future__ import annotations

import copy
import pickle
from itertools import groupby, pairwise
from math import atan2, ceil, cos, degrees, dist, floor, hypot, isclose, pi, sin
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion import MotionState, Profile, plan_position, plan_stop
from steptwin.motion.paths import Arc, ArcProfile, Circular, Straight, arc_between, circle
from steptwin.motion.profile import cruise
from steptwin.motion.pulses import positions, pulse_runs, pulse_times, velocities


def travel_of(length: float, acc: float, dec: float, speed: float, start: int = 0) -> Profile:
    return plan_position(MotionState(start, 0, 0.0, 0.0), length, acc, dec, speed)


class Run(NamedTuple):
    """Both axes along an arc in pulses (GEAR 1)."""

    arc: Arc
    travel: Profile
    x: ArcProfile
    y: ArcProfile

    def ideal(self, now: int) -> tuple[float, float]:
        """Where the pen should be, by libm."""
        angle = self.arc.begin_q + self.arc.sweep_q * self.travel.position(now) / self.arc.length
        radians = angle * pi / 2
        return self.arc.centre_x + self.arc.radius * cos(radians), self.arc.centre_y + self.arc.radius * sin(radians)

    def moments(self, number: int) -> list[int]:
        assert self.travel.end is not None
        return [self.travel.start + (self.travel.end - self.travel.start) * i // number for i in range(number + 1)]


def run_arc(arc: Arc, acc: float, dec: float, speed: float, start: int = 0) -> Run:
    travel = travel_of(arc.length, acc, dec, speed, start)
    turn_q = arc.sweep_q / arc.length
    profiles = []
    for centre, begin, end, quarter in (
        (arc.centre_x, arc.begin[0], arc.end[0], 0.0),
        (arc.centre_y, arc.begin[1], arc.end[1], -1.0),
    ):
        curve = Circular(centre, arc.radius, arc.begin_q + quarter, turn_q)
        profiles.append(curve.profile(travel, round(begin), round(end)))
    return Run(arc, travel, *profiles)


class Walker:
    """Steps from nanosecond to nanosecond, a pulse whenever the real position reaches a whole one."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.pulses: list[tuple[int, int]] = []

    def walk(self, profile: Profile, until: int) -> None:
        for now in range(profile.start + 1, until + 1):
            p = profile.position(now)
            while p >= self.count + 1:
                self.count += 1
                self.pulses.append((now, self.count))
            while p <= self.count - 1:
                self.count -= 1
                self.pulses.append((now, self.count))


coordinates = st.integers(-3000, 3000)
speeds = st.floats(100.0, 64_000.0)
rates = st.floats(1000.0, 1e6)
starts = st.sampled_from([0, 10**18])
circles = st.builds(
    circle,
    st.floats(-2000.0, 2000.0),
    st.floats(-2000.0, 2000.0),
    st.one_of(st.floats(1.0, 3000.0), st.sampled_from([1.0, 7.5, 100.0])),
    st.one_of(st.floats(-9.0, 9.0).filter(lambda q: abs(q) > 0.01), st.sampled_from([4.0, -4.0, 1.0, -8.0])),
)


@settings(max_examples=60)
@given(arc=circles, acc=rates, dec=rates, speed=speeds, start=starts)
def test_each_axis_is_within_one_pulse_of_the_arc_and_ends_exactly(
    arc: Arc, acc: float, dec: float, speed: float, start: int
) -> None:
    run = run_arc(arc, acc, dec, speed, start)
    for now in run.moments(400):
        ideal = run.ideal(now)
        for profile, exact in zip((run.x, run.y), ideal, strict=True):
            assert profile.position(now) == pytest.approx(exact, abs=1e-6) or now == run.travel.end
            assert abs(profile.count(now) - exact) < 1.0 + 1e-6
    assert run.travel.end is not None
    for profile, end in ((run.x, arc.end[0]), (run.y, arc.end[1])):
        assert profile.end == run.travel.end
        assert profile.count(run.travel.end) == round(end)
        assert profile.phase(run.travel.end) == 0.0
        assert profile.velocity(run.travel.end) == 0.0


@settings(max_examples=60)
@given(arc=circles, acc=rates, dec=rates, speed=speeds)
def test_ramps_end_at_the_same_moments_on_both_axes(arc: Arc, acc: float, dec: float, speed: float) -> None:
    run = run_arc(arc, acc, dec, speed)
    for profile in (run.x, run.y):
        assert {s.end_s for s in run.travel.segments} <= {s.end_s for s in profile.segments}


@given(arc=circles, speed=speeds)
def test_the_speed_along_an_arc_is_that_of_the_way(arc: Arc, speed: float) -> None:
    run = run_arc(arc, 50_000.0, 50_000.0, speed)
    for now in run.moments(50)[:-1]:
        assert hypot(run.x.velocity(now), run.y.velocity(now)) == pytest.approx(run.travel.velocity(now), abs=1e-6 * speed)
        later = now + 1000
        if later < run.moments(50)[-1]:
            moved = run.x.position(later) - run.x.position(now)
            assert moved == pytest.approx(run.x.velocity(now) * 1e-6, abs=1e-3)


# A thousand times faster than any drive, so that a whole arc has few enough nanoseconds to try them all.
@settings(max_examples=40)
@given(
    centre=st.tuples(st.floats(-5.0, 5.0), st.one_of(st.integers(-5, 5).map(float), st.floats(-5.0, 5.0))),
    radius=st.one_of(st.floats(0.3, 12.0), st.integers(1, 20).map(lambda n: n / 2)),
    sweep=st.floats(-5.0, 5.0).filter(lambda q: abs(q) > 0.05),
    base=st.sampled_from([0, 2**31 - 10]),
)
def test_pulses_are_where_stepping_through_every_nanosecond_finds_them(
    centre: tuple[float, float], radius: float, sweep: float, base: int
) -> None:
    arc = circle(*centre, radius, sweep)
    # A touch between two nanoseconds counts, but a walker does not see it.
    turns = [c + radius * side for c in centre for side in (-1.0, 1.0)]
    assume(all(abs(turn - round(turn)) > 1e-3 for turn in turns))
    arc = arc._replace(centre_x=arc.centre_x + base)
    run = run_arc(arc, 1e13, 1e13, 1e7)
    assert run.travel.end is not None
    for profile in (run.x, run.y):
        walker = Walker(profile.base)
        walker.walk(profile, run.travel.end)
        found: list[tuple[int, int]] = []
        count, now = profile.base, profile.start
        for direction, times in pulse_runs(profile, profile.start, run.travel.end):
            for time in times:
                count += direction
                found.append((int(time), count))
                assert profile.count(int(time)) == count
                assert profile.count(int(time) - 1) == count - direction or time - 1 <= profile.start
                assert profile.pulse_time(count, now) == time
                now = int(time)
        assert [c for _, c in found] == [c for _, c in walker.pulses]
        for (time, _), (stepped, _) in zip(found, walker.pulses, strict=True):
            assert abs(time - stepped) <= 1 or isclose(profile.position(time), round(profile.position(time)), abs_tol=1e-7)
        assert profile.count(run.travel.end) == profile.base + sum(d * len(t) for d, t in pulse_runs(profile, 0, run.travel.end))


@settings(max_examples=30)
@given(arc=circles, acc=rates, speed=speeds)
def test_lists_of_pulses_agree_with_single_looks(arc: Arc, acc: float, speed: float) -> None:
    run = run_arc(arc, acc, 2 * acc, speed, start=12345)
    assert run.travel.end is not None
    for profile in (run.x, run.y):
        times = pulse_times(profile, 0, run.travel.end)
        assert (np.diff(times) >= 0).all()
        count, now = profile.base, 0
        for direction, interval in pulse_runs(profile, 0, run.travel.end):
            for time in interval[:: max(1, len(interval) // 7)]:
                assert profile.count(int(time)) - profile.count(int(time) - 1) in (direction, 2 * direction) or time == now
            count += direction * len(interval)
        assert count == profile.count(run.travel.end)
        middle = np.linspace(12345, run.travel.end + 10, 50).astype(np.int64)
        assert positions(profile, middle).tolist() == [profile.position(int(t)) for t in middle]
        assert velocities(profile, middle).tolist() == [profile.velocity(int(t)) for t in middle]


def test_a_circle_turns_on_whole_positions_without_double_pulses() -> None:
    arc = circle(0.0, 0.0, 10.0, -4.0)
    assert arc.begin == (10.0, 0.0)
    run = run_arc(arc, 1000.0, 1000.0, 50.0)
    assert run.travel.end is not None
    assert [(d, len(t)) for d, t in pulse_runs(run.x, 0, run.travel.end)] == [(-1, 20), (1, 20)]
    assert [(d, len(t)) for d, t in pulse_runs(run.y, 0, run.travel.end)] == [(-1, 10), (1, 20), (-1, 10)]
    for profile, directions in ((run.x, [-1, 1]), (run.y, [-1, 1, -1])):
        assert [direction for direction, _ in groupby(direction for _, direction in profile.legs(0))] == directions


def test_a_circle_begins_at_its_point_nearest_the_origin() -> None:
    assert circle(30.0, 40.0, 10.0, 1.0).begin == pytest.approx((24.0, 32.0))
    assert circle(3.0, 4.0, 10.0, 1.0).begin == pytest.approx((-3.0, -4.0))
    assert circle(0.0, 0.0, 2.0, 1.0).begin == (2.0, 0.0)


@pytest.mark.parametrize(("radius", "sweep"), [(0.0, 1.0), (-1.0, 1.0), (float("nan"), 1.0), (float("inf"), 1.0), (1.0, 5000.0)])
def test_circles_that_do_not_exist(radius: float, sweep: float) -> None:
    with pytest.raises(Misuse, match="must be"):
        circle(5.0, 5.0, radius, sweep)


points = st.tuples(coordinates, coordinates)


@given(begin=points, end=points, more=st.floats(1.0, 5.0), outward=st.booleans())
def test_arcs_between_points(begin: tuple[int, int], end: tuple[int, int], more: float, outward: bool) -> None:
    (x0, y0), (x1, y1) = begin, end
    assume((x0, y0) != (x1, y1))
    chord = dist((x0, y0), (x1, y1))
    radius = 0.5 * chord * more + 1e-9
    arc = arc_between(x0, y0, x1, y1, radius, outward=outward)
    assert arc.begin == pytest.approx((x0, y0), abs=1e-8)
    assert arc.end == pytest.approx((x1, y1), abs=1e-8)
    assert abs(arc.sweep_q) <= 2.0
    middle = arc.at(arc.begin_q + 0.5 * arc.sweep_q)
    other = arc_between(x0, y0, x1, y1, radius, outward=not outward)
    opposite = other.at(other.begin_q + 0.5 * other.sweep_q)
    farther = hypot(*middle) - hypot(*opposite)
    assert farther > -1e-6 if outward else farther < 1e-6
    # What libm says of the angle at the start.
    seen = degrees(atan2(y0 - arc.centre_y, x0 - arc.centre_x)) / 90
    assert (seen - arc.begin_q) % 4 == pytest.approx(0.0, abs=1e-9) or (seen - arc.begin_q) % 4 == pytest.approx(4.0, abs=1e-9)


def test_a_chord_pointing_at_the_origin_has_its_outward_arc_clockwise() -> None:
    assert arc_between(10.0, 0.0, 20.0, 0.0, 5.0, outward=True).at(1.0) == pytest.approx((15.0, 5.0))
    assert arc_between(10.0, 0.0, 20.0, 0.0, 5.0, outward=True).sweep_q == -2.0
    assert arc_between(10.0, 0.0, 20.0, 0.0, 5.0, outward=False).sweep_q == 2.0


def test_an_arc_that_cannot_reach_says_how_large_its_radius_must_be() -> None:
    with pytest.raises(Misuse, match=r"radius = 4.9: must be at least 5, half the distance"):
        arc_between(0.0, 0.0, 10.0, 0.0, 4.9, outward=True)
    assert arc_between(0.0, 0.0, 10.0, 0.0, 4.9, outward=True, slack=0.2).radius == 5.0
    with pytest.raises(Misuse, match="end point other than"):
        arc_between(1.0, 2.0, 1.0, 2.0, 5.0, outward=True)


distances = st.integers(-20_000, 20_000)


@given(travel_p=st.tuples(distances, distances), speed=speeds, acc=rates, phase=st.floats(-0.5, 0.5), start=starts)
def test_lines_start_and_finish_together_within_a_pulse(
    travel_p: tuple[int, int], speed: float, acc: float, phase: float, start: int
) -> None:
    dx, dy = travel_p
    assume(dx or dy)
    length = hypot(dx, dy)
    travel = travel_of(length, acc, 2 * acc, speed, start)
    assert travel.end is not None
    for delta, phase_p in ((dx, phase), (dy, 0.0)):
        curve = Straight(7.0 + phase_p, (delta - phase_p) / length)
        profile = curve.profile(travel, 7, 7 + delta)
        if delta:
            assert profile.end == travel.end
        for i in range(101):
            now = start + (travel.end - start) * i // 100
            ideal = 7 + phase_p + (delta - phase_p) * travel.position(now) / length
            assert profile.position(now) == pytest.approx(ideal, abs=1e-6)
            assert abs(profile.count(now) - ideal) < 1.0 + 1e-9
        assert profile.count(travel.end) == 7 + delta
        assert sum(d * len(t) for d, t in pulse_runs(profile, start, travel.end)) == delta


@given(arc=circles, speed=speeds, part=st.floats(0.0, 1.0))
@example(arc=circle(0.0, 0.0, 9.0, 4.0), speed=166.0, part=0.9999999999999999)
def test_braking_stays_on_the_path(arc: Arc, speed: float, part: float) -> None:
    run = run_arc(arc, 5000.0, 5000.0, speed, start=1000)
    assert run.travel.end is not None
    now = 1000 + floor((run.travel.end - 1000) * part)
    travel = plan_stop(MotionState.of(run.travel, now), 8000.0)
    turn_q = arc.sweep_q / arc.length
    for profile, centre, quarter in ((run.x, arc.centre_x, 0.0), (run.y, arc.centre_y, -1.0)):
        count = profile.count(now)
        braked = Circular(centre, arc.radius, arc.begin_q + quarter, turn_q).profile(travel, count, None)
        if now < run.travel.end:
            assert braked.position(now) == pytest.approx(profile.position(now), abs=1e-6)
            assert braked.velocity(now) == pytest.approx(profile.velocity(now), abs=1e-3)
        assert braked.count(now) == count
        assert braked.end == travel.end
        assert travel.end is not None
        radians = (arc.begin_q + quarter + turn_q * travel.position(travel.end)) * pi / 2
        assert braked.position(travel.end) == pytest.approx(centre + arc.radius * cos(radians), abs=1e-6)
        assert abs(braked.phase(travel.end)) < 1.0 + 1e-6


@given(arc=circles, edge=st.floats(-3000.0, 3000.0), side=st.sampled_from([-1, 1]), begin=st.floats(0.0, 0.9))
def test_where_an_arc_first_goes_beyond_an_edge(arc: Arc, edge: float, side: int, begin: float) -> None:
    curve = Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length)
    begin_w = begin * arc.length
    found = curve.first_beyond(edge, side, begin_w, arc.length)
    steps = [begin_w + (arc.length - begin_w) * i / 2000 for i in range(2001)]
    moving_out = [
        w for w, after in pairwise(steps)
        if (curve.position(after) - edge) * side > 1e-5 and (curve.position(after) - curve.position(w)) * side > 0.0
    ]  # fmt: skip
    if found is None:
        assert not moving_out
    else:
        assert begin_w <= found <= arc.length
        if moving_out:
            assert found <= moving_out[0] + (arc.length - begin_w) / 2000 * 1.01
        ahead = min(found + arc.length * 1e-7, arc.length)
        assert (curve.position(ahead) - edge) * side >= -1e-3
        before = [w for w in steps if w < found - arc.length * 1e-9]
        rises = [
            w for w, after in pairwise(before)
            if (curve.position(after) - edge) * side > 1e-5 and (curve.position(after) - curve.position(w)) * side > 1e-9
        ]  # fmt: skip
        assert not rises


@given(slope=st.floats(-2.0, 2.0), edge=st.floats(-100.0, 100.0), side=st.sampled_from([-1, 1]))
def test_where_a_line_first_goes_beyond_an_edge(slope: float, edge: float, side: int) -> None:
    found = Straight(3.0, slope).first_beyond(edge, side, 10.0, 50.0)
    if found is None:
        assert slope * side <= 0 or (3.0 + slope * 50.0 - edge) * side <= 1e-6
    elif found == 10.0:
        assert (3.0 + slope * 10.0 - edge) * side >= -1e-9
    else:
        assert 3.0 + slope * found == pytest.approx(edge)


def test_paths_are_plain_data() -> None:
    run = run_arc(circle(5.0, 5.0, 3.0, 4.0), 100.0, 100.0, 10.0)
    assert pickle.loads(pickle.dumps(run.x)) == run.x
    assert copy.deepcopy(run.x) == run.x
    assert run.x != run.y
    assert ceil(run.arc.length) == 19


@pytest.mark.parametrize("sweep_q", [4000.0, -4000.0])
def test_an_arc_has_at_most_a_thousand_turns(sweep_q: float) -> None:
    assert circle(5.0, 5.0, 2.0, sweep_q).sweep_q == sweep_q
    with pytest.raises(Misuse) as caught:
        circle(5.0, 5.0, 2.0, sweep_q * 1.001)
    assert str(caught.value) == f"angle = {90 * sweep_q * 1.001:g}°: must be within ±360000°"
    with pytest.raises(Misuse, match="angle = nan°"):
        circle(5.0, 5.0, 2.0, float("nan"))


@pytest.mark.parametrize(
    ("radius", "slack", "message"),
    [
        (0.0, 10.0, "radius = 0: must be greater than 0"),
        (-1.0, 10.0, "radius = -1: must be greater than 0"),
        (4.5, 0.25, "radius = 4.5: must be at least 5, half the distance of the ends"),
        (float("inf"), 0.0, "radius = inf: must be greater than 0"),
        (float("nan"), 0.0, "radius = nan: must be greater than 0"),
    ],
)
def test_radii_of_arcs_that_do_not_exist(radius: float, slack: float, message: str) -> None:
    with pytest.raises(Misuse) as caught:
        arc_between(0.0, 0.0, 10.0, 0.0, radius, outward=True, slack=slack)
    assert str(caught.value) == message


def test_the_slack_of_a_radius_is_permitted_whole() -> None:
    assert arc_between(0.0, 0.0, 10.0, 0.0, 4.5, outward=True, slack=0.5).radius == 5.0
    assert arc_between(0.0, 0.0, 10.0, 0.0, 5.0, outward=True).sweep_q == -2.0


def test_an_axis_along_a_line_that_stops_under_way_stops_with_it() -> None:
    travel = travel_of(100.0, 1000.0, 1000.0, 50.0)
    now = 10**9
    stop = plan_stop(MotionState.of(travel, now), 500.0)
    assert stop.end is not None
    curve = Straight(7.0, 2.5)
    profile = curve.profile(stop, round(curve.position(travel.position(now))), None)
    assert profile.end == stop.end
    assert profile.position(stop.end) == pytest.approx(curve.position(stop.position(stop.end)))
    assert profile.position(now) == pytest.approx(curve.position(travel.position(now)))
    still = Straight(7.5, 0.0).profile(stop, 8, None)
    assert (still.end, still.position(now), still.count(now)) == (now, 7.5, 8)


@pytest.mark.parametrize("turn_q", [0.01, -0.01])
@pytest.mark.parametrize("length", [100.0, 150.0, 250.0, 350.0])
def test_a_rest_at_the_end_of_a_way_keeps_the_direction_and_takes_its_time(turn_q: float, length: float) -> None:
    """Half a second at the same place of a circle, in the same half of it as the interval before."""
    travel = Profile(0, 0, (cruise(0.0, 1.0, 0.0, length), cruise(1.0, 1.5, length, 0.0)), length)
    before, last = Circular(0.0, 1000.0, 0.3, turn_q).profile(travel, 0, None).segments[-2:]
    assert (before.end_s, last.end_s) == (1.0, 1.5)
    assert (last.direction, last.half) == (before.direction, before.half)
