"""STEP pulses on a grid against a sequencer that walks from unit to unit and looks at its speed."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion import MotionState, Profile, at_rest, plan_position
from steptwin.motion.divisions import Division, Microstepping, StepTrain, forced_stop, profile_of, step_train
from steptwin.motion.pulses import step_times
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless

# The pairs of M and Q the chip permits, as units (full step/64) per pulse, with the end of the low range, 12 000/M full steps/s.
PAIRS = [(1, 1), (2, 2), (4, 1), (4, 4), (8, 1), (8, 2), (16, 4), (32, 1), (32, 2), (32, 4), (64, 1), (64, 2), (64, 4)]
microsteppings = st.sampled_from([Microstepping(64 // m, 64 // q, 12_000 / m * 64) for m, q in PAIRS])
curves = st.builds(
    lambda s, a, p, v: SpeedCurve(s * 64, a * 64, p * 64, v * 64),
    st.integers(16, 1950),
    st.integers(1000, 65_000),
    st.one_of(st.integers(20, 2000), st.just(25_000)),
    st.one_of(st.integers(16, 3000), st.integers(16, 600)),
)
directions = st.sampled_from([1, -1])
begins = st.one_of(st.just(0), st.integers(-300, 300))


def walked(profile: Profile, begin: int, micro: Microstepping, grid: int, last: int) -> list[tuple[int, int]]:
    """(moment, position) of each pulse: M-26 as a sequencer would do it.

    At every position of the coarse grid it takes the division for the speed it has; where the next coarse position would lie
    beyond ``last``, the fine one.
    """
    direction = profile.segments[0].direction
    origin = begin % micro.fine
    pulses: list[tuple[int, int]] = []
    position = begin
    for unit in range(begin, last + direction, direction):
        # Units before the base were passed before this profile.
        time = profile.start if (unit - profile.base) * direction <= 0 else profile.pulse_time(unit, profile.start)
        assert time is not None
        if unit != begin and (unit - position) * direction == grid:
            position = unit
            pulses.append((time, position))
        if (unit - origin) % micro.coarse == 0 and position == unit:
            speed = abs(profile.velocity(time))
            # One nanosecond decides about the limit: such a profile tells nothing.
            assume(abs(speed - micro.limit) > 1e-6 * micro.limit)
            assume((speed > micro.limit) == (abs(profile.velocity(max(time - 1, profile.start))) > micro.limit))
            grid = micro.coarse if speed > micro.limit and (last - unit) * direction >= micro.coarse else micro.fine
    return pulses


def check_train(train: StepTrain, pulses: list[tuple[int, int]], begin: int, until: int) -> None:
    profile = train.profile
    assert step_times(train, profile.start, until).tolist() == [time for time, _ in pulses]
    assert train.count(profile.start) == begin
    previous = begin
    for time, position in pulses[:: max(1, len(pulses) // 60)] + pulses[-1:]:
        assert train.count(time) == position
        assert train.count(time - 1) != position
        assert train.pulse_time(position, profile.start) == time
        assert train.pulse_time(position, time) is None
    for (time, position), (following, _) in itertools.pairwise(pulses[:21]):
        assert train.count((time + following) // 2) == position
        # A position between two pulses is passed with the later one.
        if abs(position - previous) > 1:
            between = position - train.direction
            assert train.pulse_time(between, profile.start) == time
        previous = position


@given(curve=curves, micro=microsteppings, direction=directions, begin=begins, way=st.integers(1, 4000))
@settings(max_examples=80)
def test_m_26_a_move_changes_its_division_in_flight(
    curve: SpeedCurve, micro: Microstepping, direction: int, begin: int, way: int
) -> None:
    target = begin + direction * way * micro.fine
    assume(way * micro.fine < 12_000)
    profile = plan_distance(11, begin, target, curve)
    assert profile.end is not None
    train = step_train(profile, begin, micro)
    pulses = walked(profile, begin, micro, micro.fine, target)
    check_train(train, pulses, begin, profile.end)
    assert train.count(profile.end) == target
    assert train.division(profile.end).grid == micro.fine


@given(
    curve=curves,
    micro=microsteppings,
    direction=directions,
    begin=begins,
    share=st.floats(0.0, 1.0),
    landing=st.sampled_from([None, 64]),
)
@settings(max_examples=80)
def test_m_26_a_forced_stop_changes_back_in_flight(
    *, curve: SpeedCurve, micro: Microstepping, direction: int, begin: int, share: float, landing: int | None
) -> None:
    """From before, between and after the changes of division; the train goes on from the pulse it stands on."""
    moving = plan_endless(0, begin, direction, curve)
    train = step_train(moving, begin, micro)
    now = int(share * 1.2e9 * (8000 / curve.top))
    assume(now > 0)
    counted, grid = train.count(now), train.division(now).grid
    stopping = forced_stop(train, now, curve, landing)
    assert stopping.profile.start == now
    assert stopping.count(now) == counted
    end = stopping.profile.end
    assert end is not None
    if not stopping.profile.segments:
        assert abs(moving.velocity(now)) <= curve.start
        assert stopping.count(end) == counted
        assert landing is None or (counted - begin % micro.fine) % landing == 0
        return
    rest = stopping.profile.base + stopping.profile.counts[-1]
    assume(abs(rest - counted) < 12_000)
    pulses = walked(stopping.profile, counted, micro, grid, rest)
    check_train(stopping, pulses, counted, end)
    assert stopping.count(end) == rest == stopping.profile.position(end)
    assert (rest - begin % micro.fine) % (landing or micro.fine) == 0


@given(curve=curves, micro=microsteppings, direction=directions, looks=st.lists(st.floats(0.0, 1.0), min_size=3, max_size=5))
@settings(max_examples=60)
def test_windows_of_a_train_concatenate(curve: SpeedCurve, micro: Microstepping, direction: int, looks: list[float]) -> None:
    profile = plan_distance(0, 0, direction * micro.fine * 3000, curve)
    train = step_train(profile, 0, micro)
    assert profile.end is not None
    moments = sorted(int(look * profile.end) for look in looks)
    whole = step_times(train, moments[0], moments[-1]).tolist()
    assert whole == [t for a, b in itertools.pairwise(moments) for t in step_times(train, a, b).tolist()]
    for a, b in itertools.pairwise(moments):
        assert bool(step_times(train, a, b).size) == (train.count(a) != train.count(b))


def test_m_26_by_hand() -> None:
    """M8 Q1 at 100 to 3000 full steps/s: the low range ends at 1500 full steps/s."""
    micro = Microstepping(8, 64, 1500 * 64.0)
    profile = plan_distance(0, 8, 8 + 64 * 1000, SpeedCurve(100 * 64, 10_000 * 64, 1e9, 3000 * 64))
    # 1500 full steps/s after (1500² − 100²)/20 000 = 112 full steps: at 8 + 7168 u, then on to the next multiple of 64.
    # Back before the end by as much: at 8 + 64 000 − 7168 = 56 840 u, next multiple 56 896.
    assert step_train(profile, 8, micro).divisions == (Division(8, 8), Division(7232, 64), Division(56_896, 8))
    backwards = plan_distance(0, 8, 8 - 64 * 1000, SpeedCurve(100 * 64, 10_000 * 64, 1e9, 3000 * 64))
    assert step_train(backwards, 8, micro).divisions == (Division(8, 8), Division(-7168, 64), Division(-56_832, 8))


def test_m_26_a_start_above_the_low_range_is_coarse_from_the_first_coarse_position() -> None:
    """M64: the low range ends at 187.5 full steps/s; with S200 no part of the motion is within it."""
    micro = Microstepping(1, 64, 187.5 * 64)
    curve = SpeedCurve(200 * 64, 5000 * 64, 1e9, 1000 * 64)
    train = step_train(plan_distance(0, 10, 710, curve), 10, micro)
    assert train.divisions == (Division(10, 1), Division(64, 64), Division(704, 1))
    assert train.profile.end is not None
    assert len(step_times(train, 0, train.profile.end)) == 54 + 10 + 6
    aligned = step_train(plan_distance(0, 0, 640, curve), 0, micro)
    assert aligned.divisions == (Division(0, 64), Division(640, 1))
    assert aligned.profile.end is not None
    assert [aligned.division(aligned.profile.end - back).grid for back in (0, 1)] == [1, 64]
    endless = step_train(plan_endless(0, 0, 1, curve), 0, micro)
    assert endless.divisions == (Division(0, 64),)


def test_m_26_a_limit_that_is_just_reached_is_not_passed() -> None:
    micro = Microstepping(8, 64, 1500 * 64.0)
    at_limit = SpeedCurve(100 * 64, 10_000 * 64, 1e9, 1500 * 64)
    assert step_train(plan_endless(0, 0, 1, at_limit), 0, micro).divisions == (Division(0, 8),)
    above = at_limit._replace(top=1501 * 64)
    assert len(step_train(plan_endless(0, 0, 1, above), 0, micro).divisions) == 2


def test_one_division_is_a_plain_grid() -> None:
    curve = SpeedCurve(100 * 64, 10_000 * 64, 1e9, 1000 * 64)
    train = step_train(plan_distance(0, 0, -640, curve), 0, Microstepping(64, 64, 1e9))
    assert train.profile.end is not None
    assert len(step_times(train, 0, train.profile.end)) == 10
    assert [train.pulse_time(p, 0) for p in (-64, -1)] == [train.profile.pulse_time(-64, 0)] * 2
    assert train.pulse_time(-641, 0) is None
    assert train.pulse_time(1, 0) is None


def test_a_stop_at_or_below_the_start_speed_is_at_once_on_the_counted_pulse() -> None:
    seek = SpeedCurve(200 * 64, 5000 * 64, 1e9, 200 * 64)
    micro = Microstepping(16, 16, 1e9)
    train = step_train(plan_endless(0, 0, 1, seek), 0, micro)
    # 100 u after 7.8 ms: six pulses.
    now = int(100 / (200 * 64) * 1e9)
    assert train.count(now) == 96
    stopped = forced_stop(train, now, seek)
    assert (stopped.profile.end, stopped.count(now), stopped.profile.position(now)) == (now, 96, 96.0)
    assert step_times(stopped, now, 10**12).size == 0
    assert stopped.pulse_time(112, 0) is None
    # To a full step, and to a multiple of four full steps (functions 50 and 52).
    for landing, rest in ((64, 128), (256, 256)):
        landed = forced_stop(train, now, seek, landing)
        assert landed.profile.end == pytest.approx(rest / (200 * 64) * 1e9, abs=1)
        assert landed.count(10**12) == rest
        assert landed.count(now) == 96
    on_full_step = train.pulse_time(64, 0)
    assert on_full_step is not None
    assert forced_stop(train, on_full_step + 1_000_000, seek, 64).count(10**12) == 64


def test_landing_positions_are_shifted_with_the_grid() -> None:
    """From 3 with a grid of 8 u they are 3, 67, 131, …: a train that stands on one stops there at once."""
    seek = SpeedCurve(200 * 64, 5000 * 64, 1e9, 200 * 64)
    micro = Microstepping(8, 8, 1e9)
    train = step_train(plan_endless(0, 3, 1, seek), 3, micro)
    now = train.pulse_time(67, 0)
    assert now is not None
    stopped = forced_stop(train, now, seek, 64)
    assert (stopped.count(now), stopped.profile.end) == (67, now)
    before = train.pulse_time(59, 0)
    assert before is not None
    assert forced_stop(train, before, seek, 64).count(10**12) == 67
    # From 4: 60 and 4 together are a multiple of 64, but no landing position.
    train = step_train(plan_endless(0, 4, 1, seek), 4, micro)
    now = train.pulse_time(60, 0)
    assert now is not None
    assert forced_stop(train, now, seek, 64).count(10**12) == 68


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("begin", [0, 640])
def test_m_26_a_stop_before_the_next_coarse_position_goes_on_to_it(begin: int, direction: int) -> None:
    """Between two coarse positions there is no fine one to stand on: the pulses to it would have been due already."""
    micro = Microstepping(2, 64, 375 * 64.0)
    curve = SpeedCurve(376 * 64, 1000 * 64, 1e9, 377 * 64)
    train = step_train(plan_endless(0, begin, direction, curve), begin, micro)
    now = train.profile.pulse_time(begin + direction * 18, 0)
    assert now is not None
    assert train.count(now) == begin
    stopped = forced_stop(train, now, curve)
    assert stopped.count(now) == begin
    assert stopped.profile.end is not None
    assert stopped.count(stopped.profile.end) == begin + direction * 64
    assert step_times(stopped, now, stopped.profile.end).tolist() == [stopped.profile.end]


@pytest.mark.parametrize("direction", [1, -1])
def test_a_stop_on_the_coarse_grid_goes_on_to_its_landing_position(direction: int) -> None:
    """A little above the start speed the ramp ends before the next coarse position; the next multiple of 256 u is far behind."""
    micro = Microstepping(2, 64, 375 * 64.0)
    curve = SpeedCurve(376 * 64, 100_000 * 64, 1e9, 377 * 64)
    train = step_train(plan_endless(0, 0, direction, curve), 0, micro)
    now = train.profile.pulse_time(direction * 70, 0)
    assert now is not None
    assert train.count(now) == direction * 64
    stopped = forced_stop(train, now, curve, 256)
    assert stopped.profile.end is not None
    assert stopped.count(stopped.profile.end) == direction * 256
    assert step_times(stopped, now, stopped.profile.end).size == 3


def test_trains_are_compared_by_all_they_are_made_of() -> None:
    curve = SpeedCurve(100.0, 100.0, 1e9, 1000.0)
    profile = plan_endless(0, 0, 1, curve)
    micro = Microstepping(2, 64, 100.0)
    train = StepTrain(profile, micro, (Division(0, 2),))
    assert train == StepTrain(plan_endless(0, 0, 1, curve), micro, (Division(0, 2),))
    assert hash(train) == hash(StepTrain(plan_endless(0, 0, 1, curve), micro, (Division(0, 2),)))
    for other in (
        StepTrain(plan_endless(1, 0, 1, curve), micro, (Division(0, 2),)),
        StepTrain(profile, Microstepping(2, 64, 101.0), (Division(0, 2),)),
        StepTrain(profile, micro, (Division(0, 64),)),
        profile,
    ):
        assert train != other
    assert profile_of(train) is profile_of(profile) is profile


def test_grids_and_profiles_that_do_not_fit_are_refused() -> None:
    curve = SpeedCurve(100.0, 100.0, 1e9, 1000.0)
    profile = plan_endless(0, 0, 1, curve)
    with pytest.raises(Misuse, match="coarse grid = 64 u: must be a multiple of the fine one, 48 u"):
        step_train(profile, 0, Microstepping(48, 64, 100.0))
    with pytest.raises(Misuse, match="coarse grid = 64 u: must be a multiple of the fine one, 0 u"):
        step_train(profile, 0, Microstepping(0, 64, 100.0))
    turning = plan_position(MotionState(0, 0, 0.0, 100.0), -5, 100.0, 100.0, 100.0)
    with pytest.raises(Misuse, match="one way"):
        step_train(turning, 0, Microstepping(1, 1, 100.0))
    at_stand = step_train(at_rest(0, 5), 5, Microstepping(1, 64, 100.0))
    assert (at_stand.direction, at_stand.count(10), at_stand.division(10)) == (0, 5, Division(5, 1))
