"""Planning against an exact solution (decimal, 50 digits) and against numerical integration of what the profile says."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from decimal import Decimal, localcontext
from math import ceil, copysign, inf, nan
from typing import NamedTuple

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion import MotionState, Profile, plan_position, plan_stop, plan_velocity


class Phase(NamedTuple):
    """Constant acceleration ``a`` for ``duration`` seconds from position ``p`` and velocity ``v``."""

    duration: Decimal
    p: Decimal
    v: Decimal
    a: Decimal


class Exact:
    """A motion as phases of constant acceleration, appended one after the other."""

    def __init__(self, p: float, v: float) -> None:
        self.phases: list[Phase] = []
        self.p, self.v = Decimal(p), Decimal(v)

    def change(self, v: Decimal, rate: Decimal) -> None:
        a = rate if v > self.v else -rate
        self.last(abs(v - self.v) / rate, a)

    def last(self, duration: Decimal, a: Decimal = Decimal(0)) -> None:
        self.phases.append(Phase(duration, self.p, self.v, a))
        self.p += (self.v + a * duration / 2) * duration
        self.v += a * duration

    @property
    def seconds(self) -> Decimal:
        return sum((phase.duration for phase in self.phases), Decimal(0))

    def at(self, t: Decimal) -> tuple[Decimal, Decimal]:
        """Position and velocity ``t`` seconds after the start."""
        for duration, p, v, a in self.phases:
            if t < duration:
                return p + (v + a * t / 2) * t, v + a * t
            t -= duration
        return self.p, self.v


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(0.0, 1.0).map(lambda x: low * (high / low) ** x)


rates = logarithmic(1e-3, 1e7)
speeds = logarithmic(1e-2, 64_000.0)
velocities = st.one_of(st.just(0.0), st.builds(copysign, speeds, st.sampled_from([1.0, -1.0])))
phases = st.one_of(st.just(0.0), st.floats(-1.0, 1.0, exclude_min=True, exclude_max=True))
distances = st.one_of(st.integers(-20, 20), st.integers(-(10**6), 10**6), st.integers(-(2**31), 2**31))
bases = st.one_of(st.just(0), st.integers(-(2**31), 2**31))
starts = st.one_of(st.just(0), st.integers(0, 10**19))


class Move(NamedTuple):
    """A position move: what `plan_position` is given, the target as a distance from the counted position."""

    phase: float
    v: float
    distance: int
    acc: float
    dec: float
    vmax: float
    base: int = 0
    start: int = 0

    def plan(self) -> Profile:
        state = MotionState(self.start, self.base, self.phase, self.v)
        return plan_position(state, self.base + self.distance, self.acc, self.dec, self.vmax)

    @property
    def brake_p(self) -> float:
        return self.v * self.v / (2 * self.dec)


moves = st.builds(Move, phases, velocities, distances, rates, rates, speeds, bases, starts)

# Every kind of move: short and long, too fast, wrong way, too late to brake; from and to the far end of the range.
KINDS = [
    Move(0.0, 0.0, 1, 1000.0, 1000.0, 1000.0),
    Move(0.0, 0.0, -100_000, 20_000.0, 5_000.0, 32_000.0),
    Move(0.25, 3_000.0, 100_000, 20_000.0, 5_000.0, 2_000.0),
    Move(-0.75, 3_000.0, -500, 20_000.0, 5_000.0, 32_000.0),
    Move(0.5, -3_000.0, -500, 20_000.0, 5_000.0, 32_000.0),
    Move(0.0, 64_000.0, 0, 1e7, 1e7, 64_000.0),
    Move(0.5, 0.0, 0, 1000.0, 1000.0, 1000.0),
    Move(5e-324, 0.0, 0, 1000.0, 1000.0, 1000.0),
    Move(0.0, 0.0, 2**31, 0.001, 0.001, 64_000.0),
    Move(0.0, 63_000.0, 10**9, 0.001, 1e5, 64_000.0),
    Move(0.0, -64_000.0, 2**31, 0.001, 100.0, 1.0),
]


def every_move(test: Callable[[Move], None]) -> Callable[[], None]:
    for move in KINDS:
        test = example(move)(test)
    return given(moves)(test)


def exactly(move: Move) -> Exact:
    """As fast as the limits allow to rest at the target."""
    motion = Exact(move.phase, move.v)
    a, d, limit, goal = Decimal(move.acc), Decimal(move.dec), Decimal(move.vmax), move.distance
    if motion.v * (goal - motion.p) < 0 or motion.v**2 > 2 * d * abs(goal - motion.p):
        motion.change(Decimal(0), d)
    sign = 1 if goal > motion.p else -1
    if abs(motion.v) > limit:
        motion.change(sign * limit, d)
    # Up to the speed from which braking ends at the goal: v²/2d = rest, where rest = way − (v² − v0²)/2a.
    way = abs(goal - motion.p)
    top = min(((way + motion.v**2 / (2 * a)) / (1 / (2 * a) + 1 / (2 * d))).sqrt(), limit)
    if top > abs(motion.v):
        motion.change(sign * top, a)
    if top > 0:
        motion.last(max((abs(goal - motion.p) - top**2 / (2 * d)) / top, Decimal(0)))
        motion.change(Decimal(0), d)
    return motion


@every_move
@settings(max_examples=100)
def test_a_position_move_is_the_exact_solution(move: Move) -> None:
    assume(abs(move.brake_p - abs(move.distance - move.phase)) > 1e-5)
    profile = move.plan()
    with localcontext() as context:
        context.prec = 50
        exact = exactly(move)
        seconds = exact.seconds
        # Rounding: 2^-49 of the time; of the way before the cruise, divided by the speed of the cruise.
        way = abs(move.distance) + move.brake_p
        slack_ns = 1e9 * (float(seconds) * 2**-49 + way * 2**-50 / move.vmax)
        assert profile.end is not None
        assert -slack_ns < profile.end - move.start - seconds * 10**9 < 1 + slack_ns
        for tenth in range(10):
            n = int(seconds * 10**8 * tenth)
            now = move.start + n
            p_exact, v_exact = exact.at(Decimal(n) / 10**9)
            slack_p = 1e-9 + way * 2**-48 + abs(float(v_exact)) * n * 1e-9 * 2**-50
            assert profile.phase(now) + (profile.count(now) - move.base) == pytest.approx(float(p_exact), abs=slack_p)
            slack_v = 2**-48 * max(abs(move.v), move.vmax) + max(move.acc, move.dec) * (slack_ns + n * 2**-50) * 1e-9
            assert profile.velocity(now) == pytest.approx(float(v_exact), abs=slack_v)


@every_move
@settings(max_examples=80)
def test_a_position_move_ends_at_rest_on_its_target(move: Move) -> None:
    profile = move.plan()
    assert profile.end is not None
    assert not profile.moving(profile.end)
    assert profile.moving(profile.end - 1) or profile.end == move.start
    assert profile.count(profile.end) == move.base + move.distance
    assert profile.position(profile.end) == move.base + move.distance
    assert profile.phase(profile.end) == 0.0
    assert profile.velocity(profile.end) == 0.0
    assert profile.count(move.start) == move.base
    slack_p = 1e-6 + 2**-49 * (abs(move.base) + 2 * move.brake_p)
    assert profile.position(move.start) == pytest.approx(move.base + move.phase, abs=slack_p)


def sampled(profile: Profile, seconds: float, points: int) -> list[tuple[float, float, float]]:
    """(seconds, position, velocity) at evenly spread moments."""
    moments = sorted({ceil(seconds * 1e9 * i / points) for i in range(points + 1)})
    begin = profile.start
    return [(n / 1e9, profile.position(begin + n), profile.velocity(begin + n)) for n in moments]


def check_limits(profile: Profile, seconds: float, move: Move) -> None:
    """Speeding up with at most ``acc``, slowing with ``dec``; above ``vmax`` only slowing; the velocity gives the position."""
    acc, dec = move.acc, move.dec
    for (t1, p1, v1), (t2, p2, v2) in itertools.pairwise(sampled(profile, seconds, 400)):
        h = t2 - t1
        rounding = 1e-11 * max(abs(v1), abs(v2), abs(move.v)) + max(acc, dec) * t2 * 2**-48
        if v1 * v2 >= 0.0:
            assert abs(v2) - abs(v1) <= acc * h * (1 + 1e-9) + rounding
            assert abs(v1) - abs(v2) <= dec * h * (1 + 1e-9) + rounding
        else:
            # From v1 to standstill with `dec`, then to v2 with `acc`: there must have been time for both.
            assert abs(v1) / dec + abs(v2) / acc <= h * (1 + 1e-9) + rounding / min(acc, dec)
        assert abs(v2) <= max(move.vmax, abs(v1)) * (1 + 1e-12) + rounding
        kink = (acc + dec) * h * h
        assert p2 - p1 == pytest.approx(0.5 * (v1 + v2) * h, abs=kink + 2**-46 * (abs(p1) + 2 * move.brake_p + 1.0))


@every_move
@settings(max_examples=60)
def test_limits_are_kept_and_the_position_is_the_integral_of_the_velocity(move: Move) -> None:
    profile = move._replace(base=0).plan()
    assert profile.end is not None
    check_limits(profile, (profile.end - move.start) / 1e9, move)
    assert profile.velocity(move.start) == pytest.approx(move.v, rel=1e-9, abs=1e-9)


@given(phase=phases, v=velocities, to=velocities, acc=rates, dec=rates)
@settings(max_examples=60)
def test_a_velocity_is_reached_by_the_shortest_ramps(phase: float, v: float, to: float, acc: float, dec: float) -> None:
    profile = plan_velocity(MotionState(0, 0, phase, v), to, acc, dec)
    if v * to < 0.0:
        seconds = abs(v) / dec + abs(to) / acc
    else:
        seconds = (abs(v) - abs(to)) / dec if abs(v) > abs(to) else (abs(to) - abs(v)) / acc
    n = ceil(seconds * 1e9)
    slack_n = 2 + n // 2**48
    assert profile.velocity(n + slack_n) == to
    assert profile.velocity(max(0, n - slack_n)) == pytest.approx(to, abs=2 * max(acc, dec) * slack_n * 1e-9 + 1e-9)
    check_limits(profile, seconds * 1.25 + 1e-6, Move(phase, v, 0, acc, dec, abs(to)))
    assert (profile.end is None) == (to != 0.0)
    if to != 0.0:
        later = profile.position(n + 10**10) - profile.position(n + 10**9)
        assert later == pytest.approx(9.0 * to, rel=1e-6, abs=2**-44 * (1 + v * v / dec + to * to / acc))


@given(phase=phases, v=velocities, dec=rates)
@example(phase=0.0, v=23537.564822130615, dec=0.0010000000230258512)
def test_a_stop_takes_speed_over_deceleration_and_half_that_way(phase: float, v: float, dec: float) -> None:
    profile = plan_stop(MotionState(0, 0, phase, v), dec)
    assert profile.end == pytest.approx(abs(v) / dec * 1e9, rel=1e-12, abs=1)
    assert profile.end is not None
    assert profile.position(profile.end) == pytest.approx(phase + v * abs(v) / (2 * dec), rel=1e-12, abs=1e-9)
    assert profile.velocity(profile.end) == 0.0
    if profile.end:
        assert profile.velocity(profile.end - 1) * v >= -(2**-52) * v * v  # the rounding of v - dec · t


@given(move=moves, share=st.floats(0.0, 1.0))
@settings(max_examples=80)
def test_the_same_command_again_changes_nothing(move: Move, share: float) -> None:
    """Above all within the last ramp, where a rounding error must not look like a brake too late."""
    move = move._replace(phase=0.0, v=0.0, start=0, distance=move.distance % 10**6 - 500_000)
    first = move.plan()
    assert first.end is not None
    now = int(first.end * share)
    second = plan_position(MotionState.of(first, now), move.base + move.distance, move.acc, move.dec, move.vmax)
    assert second.end is not None
    # A last distance of 1e-6 pulse takes this long at the least; nothing longer may be lost.
    hop_ns = 1e9 * (2e-6 / move.dec) ** 0.5 + 1e-9 * first.end + 1
    assert abs(second.end - first.end) <= hop_ns
    assert all(s.direction == (1 if move.distance > 0 else -1) for s in second.segments)
    middle = (now + first.end) // 2
    assert second.position(middle) == pytest.approx(first.position(middle), abs=1e-5)


def test_a_move_of_nothing_is_over_at_once() -> None:
    profile = plan_position(MotionState(5, 7, 0.0, 0.0), 7, 1.0, 1.0, 1.0)
    assert (profile.end, profile.count(5), profile.velocity(5)) == (5, 7, 0.0)


def test_turning_back_gives_the_pulses_of_both_ways() -> None:
    # 3000 pulses/s braked with 5000/s²: 900 pulses on, then 1400 back.
    profile = plan_position(MotionState(0, 0, 0.0, 3000.0), -500, 20_000.0, 5_000.0, 32_000.0)
    assert profile.count(600_000_000) == 900
    assert [direction for _, direction in profile.legs(0)][:2] == [1, -1]
    assert profile.end is not None
    assert profile.count(profile.end) == -500


@pytest.mark.parametrize("name", ["acc", "dec", "vmax"])
@pytest.mark.parametrize("value", [0.0, -1.0, nan, inf, -inf, 1e-61, 1e61])
def test_parameters_that_are_not_finite_and_positive_are_refused(name: str, value: float) -> None:
    parameters = {"acc": 1000.0, "dec": 1000.0, "vmax": 1000.0, name: value}
    with pytest.raises(Misuse) as caught:
        plan_position(MotionState(0, 0, 0.0, 0.0), 10, **parameters)
    unit = "pulses/s" if name == "vmax" else "pulses/s²"
    assert str(caught.value) == f"{name} = {value} {unit}: must be finite and greater than 0 (from 1e-60 to 1e+60)"
    if name != "vmax":
        with pytest.raises(Misuse, match=re.escape(f"{name} = {value} {unit}")):
            plan_velocity(MotionState(0, 0, 0.0, 0.0), 10.0, parameters["acc"], parameters["dec"])


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e61])
def test_velocities_that_are_not_finite_are_refused(value: float) -> None:
    message = re.escape(f"velocity = {value} pulses/s: must be finite")
    with pytest.raises(Misuse, match=message):
        plan_velocity(MotionState(0, 0, 0.0, 0.0), value, 1.0, 1.0)
    with pytest.raises(Misuse, match=message):
        plan_position(MotionState(0, 0, 0.0, value), 1, 1.0, 1.0, 1.0)
    for other in (1.0, 1e60, -1e60):
        with pytest.raises(Misuse, match=message):
            plan_velocity(MotionState(0, 0, 0.0, value), other, 1.0, 1.0)


def test_distances_too_far_to_be_exact_are_refused() -> None:
    plan_position(MotionState(0, -1, 0.0, 0.0), 2**48 - 1, 1.0, 1.0, 1.0)
    with pytest.raises(Misuse, match=r"distance = 281474976710657 pulses: must be within ±281474976710656"):
        plan_position(MotionState(0, -1, 0.0, 0.0), 2**48, 1.0, 1.0, 1.0)


extremes = st.sampled_from([1e-60, 1e-45, 1.4e-20, 1.0, 3.4e38, 1e60])


@given(
    v=st.sampled_from([0.0, 5e-324, 1e-60, -1.0, 64_000.0, -1e60]),
    to=st.sampled_from([0.0, 5e-324, 1e-60, -1.0, 1e60]),
    distance=st.sampled_from([0, 1, -(2**48), 2**48]),
    acc=extremes,
    dec=extremes,
    vmax=extremes,
)
@settings(max_examples=100)
def test_no_permitted_parameter_overflows(*, v: float, to: float, distance: int, acc: float, dec: float, vmax: float) -> None:
    state = MotionState(0, 0, 0.5, v)
    move = plan_position(state, distance, acc, dec, vmax)
    assert move.end is not None
    if v * v / (2 * dec) < 2**47:
        assert move.count(move.end) == distance
    ramp = plan_velocity(state, to, acc, dec)
    for profile in (move, ramp):
        for now in (0, 1, 10**9, 10**18):
            assert profile.count(now) - 1 <= profile.position(now) <= profile.count(now) + 1 or abs(profile.position(now)) > 2**50
            assert abs(profile.velocity(now)) < inf
        profile.pulse_time(2**53, 0)


@pytest.mark.parametrize("value", [1e-60, 1e60])
def test_the_ends_of_the_ranges_are_permitted(value: float) -> None:
    state = MotionState(0, 0, 0.0, 0.0)
    for name in ("acc", "dec", "vmax"):
        plan_position(state, 10, **{"acc": 1.0, "dec": 1.0, "vmax": 1.0, name: value})
    for name in ("acc", "dec"):
        plan_velocity(state, 10.0, **{"acc": 1.0, "dec": 1.0, name: value})
    for velocity in (value, -value):
        plan_position(state._replace(velocity=velocity), 10, 1.0, 1.0, 1.0)
        endless = plan_velocity(state, velocity, 1.0, 1.0)
        assert (endless.end, endless.segments[-1].c1) == (None, velocity), "no velocity but less than this is 0"
    assert plan_velocity(state, 0.99e-60, 1.0, 1.0).end == 0


@pytest.mark.parametrize("begin", [2**48 - 1, -(2**48) + 1])
def test_distances_are_counted_from_where_the_motion_begins(begin: int) -> None:
    for target in (begin - 2**48, begin + 2**48):
        profile = plan_position(MotionState(0, begin, 0.0, 0.0), target, 1e30, 1e30, 1e30)
        assert profile.end is not None
        assert profile.count(profile.end) == target


@pytest.mark.parametrize(("distance", "parts"), [(1000, 2), (-1000, 4), (10, 1)])
def test_a_motion_has_no_parts_that_take_no_time(distance: int, parts: int) -> None:
    """At its speed already: on and brake, or brake, speed up, on and brake, or brake at once."""
    assert len(plan_position(MotionState(0, 0, 0.0, 100.0), distance, 500.0, 500.0, 100.0).segments) == parts


@pytest.mark.parametrize("sign", [1, -1])
def test_a_braking_that_ends_beyond_its_target_by_rounding_ends_on_it(sign: int) -> None:
    """From 100 pulses/s at 500 pulses/s² it takes 10 pulses."""
    profile = plan_position(MotionState(0, 0, sign * 2e-7, sign * 100.0), sign * 10, 500.0, 500.0, 100.0)
    (braking,) = profile.segments
    assert (braking.position(braking.end_s), profile.final_p) == (sign * 10.0, sign * 10.0)
