"""Pulse lists: against single looks (equal), against the exact solution in decimal arithmetic (within 1 ns)."""

from __future__ import annotations

import itertools
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.motion import MotionState, Profile, at_rest, plan_position, plan_stop, plan_velocity
from steptwin.motion.pulses import positions, pulse_runs, pulse_times, velocities
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless

MILLION = 1_000_000


def exact_moment(k: int, way: int, acc: float, dec: float, vmax: float) -> Decimal:
    """Nanoseconds from rest to position ``k`` of a move over ``way`` pulses."""
    a, d, limit = Decimal(acc), Decimal(dec), Decimal(vmax)
    top = min((2 * way * a * d / (a + d)).sqrt(), limit)
    rise, fall = top * top / (2 * a), top * top / (2 * d)
    if k <= rise:
        return (2 * k / a).sqrt() * 10**9
    seconds = top / a + (way - rise - fall) / top
    if k >= way - fall:
        return (seconds + top / d - (2 * (way - k) / d).sqrt()) * 10**9
    return (top / a + (k - rise) / top) * 10**9


MOVES = {
    "fast": (50_000.0, 50_000.0, 64_000.0),
    "triangle": (3000.0, 7000.0, 64_000.0),
    "slow ramps": (0.001, 0.001, 64_000.0),
    "slow up, hard down": (0.001, 1e7, 64_000.0),
    "hard up, slow down": (1e7, 0.001, 64_000.0),
    "crooked": (1234.567, 7654.321, 12_345.678),
    "slow cruise": (1000.0, 1000.0, 3.7),
}


@pytest.mark.parametrize("base", [0, 2**31 - 1, -(2**31)])
@pytest.mark.parametrize("limits", MOVES.values(), ids=MOVES)
@pytest.mark.parametrize("direction", [1, -1])
def test_pulses_of_a_million_are_within_1_ns_of_the_exact_solution(
    limits: tuple[float, float, float], base: int, direction: int
) -> None:
    profile = plan_position(MotionState(0, base, 0.0, 0.0), base + direction * MILLION, *limits)
    assert profile.end is not None
    times = pulse_times(profile, 0, profile.end)
    assert times.dtype == np.int64
    assert len(times) == MILLION
    assert times[-1] == profile.end
    assert (np.diff(times) > 0).all()
    # The first and last, those around the seams of the segments, and some between.
    seams = itertools.chain.from_iterable(range(abs(c) - 20, abs(c) + 20) for c in profile.counts)
    chosen = {k for k in (*seams, *range(1, MILLION, 3331), MILLION) if 1 <= k <= MILLION}
    with localcontext() as context:
        context.prec = 40
        for k in chosen:
            exact = exact_moment(k, MILLION, *limits)
            # The whole nanosecond at or after it; a rounding error may decide where the exact moment is nearly whole.
            assert Decimal("-0.1") < times[k - 1] - exact < Decimal("1.1")
            assert abs(times[k - 1] - exact) <= 1 or abs(exact - round(exact)) < Decimal("0.1")


rates = st.floats(0.0, 1.0).map(lambda x: 0.001 * 1e9**x)
speeds = st.floats(0.0, 1.0).map(lambda x: 0.01 * (64_000.0 / 0.01) ** x)
velocities_ = st.builds(lambda v, sign: v * sign, speeds, st.sampled_from([1.0, -1.0]))
states = st.builds(
    MotionState,
    st.sampled_from([0, 1, 10**9 + 7, 1_700_000_000_123_456_789]),
    st.integers(-(2**31), 2**31),
    st.floats(-0.999, 0.999),
    st.one_of(st.just(0.0), velocities_),
)
motions = st.one_of(
    st.builds(
        lambda state, way, acc, dec, vmax: plan_position(state, state.count + way, acc, dec, vmax),
        states,
        st.integers(-9000, 9000),
        rates,
        rates,
        speeds,
    ),
    st.builds(plan_velocity, states, velocities_, rates, rates),
    st.builds(plan_stop, states, rates),
)
curves = st.builds(
    SpeedCurve, st.floats(16.0, 2000.0), st.floats(100.0, 1e6), st.floats(20.0, 60_000.0), st.floats(16.0, 40_000.0)
)
start_stop_motions = st.one_of(
    st.builds(plan_distance, st.integers(0, 10**12), st.integers(-9000, 9000), st.integers(-9000, 9000), curves),
    st.builds(plan_endless, st.integers(0, 10**12), st.integers(-9000, 9000), st.sampled_from([1, -1]), curves),
)
any_motion = st.one_of(motions, start_stop_motions)


def moments_within(profile: Profile, pulses: int, shares: list[float]) -> list[int]:
    """Sorted moments within the motion, or within its next few pulses when it is long."""
    candidates = [t for d in (1, -1) if (t := profile.pulse_time(profile.base + d * pulses, profile.start)) is not None]
    until = min([*candidates, profile.start + 10**13] if profile.end is None else [*candidates, profile.end])
    return sorted(profile.start - 5 + int(share * (until - profile.start + 10)) for share in shares)


@given(profile=any_motion, shares=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=6), nudge=st.integers(-1, 1))
@settings(max_examples=80)
def test_windows_concatenate_and_sum_to_the_count(profile: Profile, shares: list[float], nudge: int) -> None:
    """Whatever the moments of the looks: also exactly at a pulse, and one nanosecond from it."""
    looks = moments_within(profile, 6000, shares)
    middle = pulse_times(profile, looks[0], looks[-1])
    if len(middle):
        looks = sorted([*looks, int(middle[len(middle) // 2]) + nudge])
    whole = pulse_times(profile, looks[0], looks[-1])
    parts = [pulse_times(profile, a, b) for a, b in itertools.pairwise(looks)]
    assert np.array_equal(np.concatenate(parts), whole)
    for a, b in itertools.pairwise(looks):
        signed = sum(direction * len(times) for direction, times in pulse_runs(profile, a, b))
        assert signed == profile.count(max(b, profile.start)) - profile.count(max(a, profile.start))
        assert np.array_equal(
            np.concatenate([np.empty(0, int), *(t for _, t in pulse_runs(profile, a, b))]), pulse_times(profile, a, b)
        )
    assert all(profile.start < t for t in whole[:3])


@given(profile=any_motion, shares=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=2))
@settings(max_examples=80)
def test_arrays_and_single_looks_agree_exactly(profile: Profile, shares: list[float]) -> None:
    after, until = moments_within(profile, 3000, shares)
    count, previous = profile.count(max(after, profile.start)), after
    for direction, times in pulse_runs(profile, after, until):
        assert direction in (1, -1)
        for time in times.tolist():
            count += direction
            assert profile.pulse_time(count, previous) == time
            previous = time
    moments = np.linspace(max(after, profile.start), until + 1000, 50).astype(np.int64)
    assert positions(profile, moments).tolist() == [profile.position(n) for n in moments.tolist()]
    assert velocities(profile, moments).tolist() == [profile.velocity(n) for n in moments.tolist()]


def test_a_window_is_open_at_its_beginning_and_closed_at_its_end() -> None:
    profile = plan_velocity(MotionState(0, 0, 0.0, 1000.0), 1000.0, 1.0, 1.0)
    assert pulse_times(profile, 0, 3_000_000).tolist() == [1_000_000, 2_000_000, 3_000_000]
    assert pulse_times(profile, 1_000_000, 2_999_999).tolist() == [2_000_000]
    assert pulse_times(profile, 2_000_000, 2_000_000).tolist() == []
    assert pulse_times(profile, 5, 4).tolist() == []


def test_a_reversal_is_two_runs() -> None:
    # 100 pulses/s braked with 3000/s² turn at 1 2/3; back to −3.
    profile = plan_position(MotionState(0, 0, 0.0, 100.0), -3, 3000.0, 3000.0, 1000.0)
    assert profile.end is not None
    assert [(direction, len(times)) for direction, times in pulse_runs(profile, 0, profile.end)] == [(1, 1), (-1, 4)]


def test_at_rest_there_are_no_pulses() -> None:
    profile = at_rest(0, 5, 0.5)
    assert pulse_times(profile, 0, 10**12).tolist() == []
    assert pulse_runs(profile, 0, 10**12) == []
    assert positions(profile, np.array([0, 7])).tolist() == [5.5, 5.5]
    assert velocities(profile, np.array([0, 7])).tolist() == [0.0, 0.0]
