"""Counting: looks against stepping through every nanosecond, through replacements at the worst moments."""

from __future__ import annotations

import copy
import pickle
from fractions import Fraction
from math import ceil, copysign, inf
from typing import Any, NamedTuple, TypeAlias

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from steptwin.motion import MotionState, Profile, Segment, at_rest, plan_position, plan_stop, plan_velocity


class Stepper:
    """Moves a motor from nanosecond to nanosecond in exact arithmetic, one pulse whenever a whole position is reached."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.pulses: list[tuple[int, int]] = []
        """(moment, counted position after the pulse)"""
        self.close_calls: set[int] = set()
        """Moments at which the position was within rounding of a whole one."""

    def run(self, profile: Profile, until: int) -> None:
        for now in range(profile.start + 1, until + 1):
            p = profile.base + exact_position(profile, now)
            if abs(p - round(p)) < Fraction(1, 10**7):
                self.close_calls.add(now)
            while p >= self.count + 1:
                self.count += 1
                self.pulses.append((now, self.count))
            while p <= self.count - 1:
                self.count -= 1
                self.pulses.append((now, self.count))


def exact_position(profile: Profile, now: int) -> Fraction:
    t = Fraction(now - profile.start, 10**9)
    for s in profile.segments:
        if s.end_s == inf or t < Fraction(s.end_s):
            u = t - Fraction(s.anchor_s)
            return Fraction(s.c0) + u * (Fraction(s.c1) + u * (Fraction(s.c2) + u * Fraction(s.c3)))
    return Fraction(profile.final_p)


Command: TypeAlias = tuple[Any, ...]
"""What to plan, and the parameters: position, velocity or stop."""

# A thousand times faster than any drive, so that a whole motion has few enough nanoseconds to try them all.
fast_speeds = st.floats(1e6, 5e7)
fast_rates = st.floats(1e12, 1e14)
commands = st.one_of(
    st.tuples(st.just("position"), st.integers(-30, 30), fast_rates, fast_rates, fast_speeds),
    st.tuples(st.just("velocity"), st.builds(copysign, fast_speeds, st.sampled_from([1.0, -1.0])), fast_rates, fast_rates),
    st.tuples(st.just("stop"), fast_rates),
)


def planned(command: Command, state: MotionState) -> Profile:
    match command:
        case ("position", target, acc, dec, vmax):
            return plan_position(state, target, acc, dec, vmax)
        case ("velocity", velocity, acc, dec):
            return plan_velocity(state, velocity, acc, dec)
        case (_, dec):
            return plan_stop(state, dec)
    raise ValueError(command)


def hangs_on_rounding(profile: Profile) -> bool:
    """Whether the profile comes to rest so close to a whole position that rounding decides on a pulse."""
    stops = [s.c0 - round(s.c0) for s in profile.segments if s.c1 == 0.0 and s.c2 * s.direction < 0.0]
    if stops and stops[-1] == 0.0 and profile.end is not None:
        stops.pop()
    return any(abs(difference) < 1e-3 for difference in stops)


# When to replace: after so many nanoseconds, or at the next pulse but one nanosecond before, at it, one after.
moments = st.one_of(st.integers(1, 1500), st.sampled_from(["before", "at", "after"]))


def moment_of(wish: int | str, profile: Profile, now: int) -> int:
    if isinstance(wish, int):
        return now + wish
    count = profile.count(now)
    pulses = [t for k in (count - 1, count + 1) if (t := profile.pulse_time(k, now)) is not None]
    if not pulses:
        return now + 100
    return max(now, min(pulses) + {"before": -1, "at": 0, "after": 1}[wish])


@given(start=st.integers(0, 10**15), plan=st.lists(st.tuples(commands, moments), min_size=1, max_size=4))
@settings(max_examples=60)
def test_looks_agree_with_stepping_through_every_nanosecond(start: int, plan: list[tuple[Command, int | str]]) -> None:
    profile = at_rest(start, 0)
    stepper = Stepper(0)
    counted: list[tuple[int, int]] = []
    now = start
    for command, wish in plan:
        profile = planned(command, MotionState.of(profile, now))
        assume(not hangs_on_rounding(profile))
        then = moment_of(wish, profile, now)
        then = min(then, now + 3000)
        assert profile.count(now) == profile.base == (counted[-1][1] if counted else 0)
        stepper.run(profile, then)
        for moment in range(now + 1, then + 1):
            count = profile.count(moment)
            if count != (counted[-1][1] if counted else 0):
                counted.append((moment, count))
            assert -1.0 - 1e-6 < profile.phase(moment) < 1.0 + 1e-6
        now = then
    assert [count for _, count in counted] == [count for _, count in stepper.pulses]
    for (seen, _), (stepped, _) in zip(counted, stepper.pulses, strict=True):
        assert seen == stepped or (abs(seen - stepped) == 1 and {seen, stepped} & stepper.close_calls)


real_speeds = st.floats(0.0, 1.0).map(lambda x: 0.01 * (64_000.0 / 0.01) ** x)
real_rates = st.floats(0.0, 1.0).map(lambda x: 0.001 * 1e9**x)
real_commands = st.one_of(
    st.tuples(st.just("position"), st.integers(-(10**5), 10**5), real_rates, real_rates, real_speeds),
    st.tuples(st.just("velocity"), st.builds(copysign, real_speeds, st.sampled_from([1.0, -1.0])), real_rates, real_rates),
    st.tuples(st.just("stop"), real_rates),
)


class Replacement(NamedTuple):
    """A motion from rest and one that replaces it in flight, after ``part`` of it."""

    base: int
    phase: float
    first: Command
    second: Command
    part: float

    def plan(self) -> Profile:
        profile = planned(self.first, MotionState(0, self.base, self.phase, 0.0))
        now = int(self.part * (profile.end if profile.end is not None else 10**9))
        return planned(self.second, MotionState.of(profile, now))


replacements = st.builds(
    Replacement, st.integers(-(2**31), 2**31), st.floats(-0.999, 0.999), real_commands, real_commands, st.floats(0.0, 1.0)
)


@given(replacement=replacements, steps=st.lists(st.integers(1, 3000), min_size=1, max_size=8))
@settings(max_examples=100)
def test_the_count_jumps_exactly_at_the_pulse_times(replacement: Replacement, steps: list[int]) -> None:
    """Also after a replacement in flight, at any distance from it, on the way out and back."""
    profile = replacement.plan()
    now = profile.start
    assert profile.count(now) == profile.base
    last = profile.base + profile.counts[-1]
    for step in steps:
        for k in (profile.base + step, profile.base - step, last + step, last - step):
            after = now
            while (time := profile.pulse_time(k, after)) is not None:
                assert time > after
                assert profile.count(time) == k
                assert abs(profile.count(time - 1) - k) == 1
                v = abs(profile.velocity(time))
                rounding = 1e-6 + 2**-48 * (abs(k) + abs(last) + v * (profile.end or time) * 1e-9)
                assert profile.position(time) == pytest.approx(k, abs=v * 1.5e-9 + rounding)
                after = time


def test_turning_on_a_whole_position_gives_no_second_pulse() -> None:
    """Out to exactly 900 and back: pulse 900 belongs to the way out, the first of the way back is 899."""
    profile = plan_position(MotionState(0, 0, 0.0, 3000.0), 0, 20_000.0, 5_000.0, 32_000.0)
    assert profile.counts[1] == 900
    assert profile.pulse_time(900, 0) == 600_000_000
    assert profile.pulse_time(900, 600_000_000) is None
    back = profile.pulse_time(899, 600_000_000)
    assert back is not None
    # One pulse at 1/(1/5000 … 1/20000): the way back speeds up with 20 000/s².
    assert back - 600_000_000 == ceil((2.0 / 20_000.0) ** 0.5 * 1e9)


def test_turning_between_positions_takes_a_pulse_of_hysteresis() -> None:
    # 100 pulses/s braked with 3000/s² turn at 1 2/3: count 1, then back to 0 only when 0 is reached.
    profile = plan_position(MotionState(0, 0, 0.0, 100.0), -3, 3000.0, 3000.0, 1000.0)
    times = [profile.pulse_time(k, 0) for k in (1, 2, 0, -1)]
    assert times[1] is None
    first, _, zero, minus = times
    assert first is not None
    assert zero is not None
    assert minus is not None
    assert first < zero < minus
    assert profile.pulse_time(1, first) is None
    assert profile.position(zero) == pytest.approx(0.0, abs=1e-6)


def test_what_is_due_at_the_start_of_a_profile_was_given_before_it() -> None:
    """At the moment of a pulse the phase may round to a whole pulse either way; neither loses nor doubles it."""
    for phase in (1.0, 1.0 + 1e-9, 1.0 - 1e-12):
        profile = plan_velocity(MotionState(100, 7, phase, 500.0), 500.0, 1.0, 1.0)
        assert profile.count(100) == 7
        assert profile.pulse_time(8, 100) == 101
        assert profile.count(101) == 8
        backwards = plan_velocity(MotionState(100, 7, -phase, -500.0), -500.0, 1.0, 1.0)
        assert (backwards.count(100), backwards.count(101)) == (7, 6)


@given(command=real_commands, looks=st.lists(st.integers(0, 10**11), min_size=1))
def test_looking_changes_nothing(command: Command, looks: list[int]) -> None:
    profile = planned(command, MotionState(0, 3, 0.25, -10.0))
    untouched = pickle.dumps(profile)
    before = [profile.count(now) for now in looks]
    for now in looks:
        profile.position(now)
        profile.velocity(now)
        profile.phase(now)
        profile.pulse_time(17, now)
        list(profile.legs(now))
        MotionState.of(profile, now)
    assert pickle.dumps(profile) == untouched
    assert [profile.count(now) for now in looks] == before


def test_profiles_compare_and_copy_by_value() -> None:
    profile = plan_position(MotionState(3, 4, 0.5, 100.0), 1000, 500.0, 600.0, 700.0)
    for other in (copy.deepcopy(profile), pickle.loads(pickle.dumps(profile))):
        assert other == profile
        assert hash(other) == hash(profile)
        assert other.ends == profile.ends
    assert profile != plan_position(MotionState(3, 4, 0.5, 100.0), 1001, 500.0, 600.0, 700.0)
    assert profile != 4
    assert repr(profile) == f"Profile(start=3, base=4, end={profile.end}, segments=3)"


def test_standing_still() -> None:
    profile = at_rest(10, 5, 0.25)
    assert (profile.end, profile.moving(10)) == (10, False)
    assert (profile.count(10**12), profile.position(10**12), profile.phase(10), profile.velocity(10)) == (5, 5.25, 0.25, 0.0)
    assert profile.pulse_time(6, 0) is None
    assert list(profile.legs(10)) == []


def test_legs_name_what_is_in_progress_and_what_follows() -> None:
    profile = plan_position(MotionState(0, 0, 0.0, 3000.0), -500, 20_000.0, 5_000.0, 32_000.0)
    turn = 600_000_000
    assert next(profile.legs(turn - 1)) == (turn - 1, 1)
    legs = list(profile.legs(100))
    assert legs[:2] == [(100, 1), (turn, -1)]
    assert {direction for _, direction in legs[1:]} == {-1}
    assert next(profile.legs(turn)) == (turn, -1)
    assert profile.end is not None
    assert list(profile.legs(profile.end)) == []


def test_a_count_near_a_whole_position_is_decided_by_the_pulse_time() -> None:
    # 3 pulses/s: pulse 1 at 333 333 333.33 ns belongs to …334; there the position is above 1 by less than rounding matters.
    profile = plan_velocity(MotionState(0, 0, 0.0, 3.0), 3.0, 1.0, 1.0)
    assert profile.pulse_time(1, 0) == 333_333_334
    assert (profile.count(333_333_333), profile.count(333_333_334)) == (0, 1)
    # Pulse 3 is at exactly one second.
    assert (profile.count(999_999_999), profile.count(10**9)) == (2, 3)


def exact_root(segment: Segment, position: float) -> Fraction:
    """Where the polynomial is at ``position``, by bisection in exact arithmetic, in seconds from the anchor."""
    c0, c1, c2, c3 = (Fraction(c) for c in (segment.c0, segment.c1, segment.c2, segment.c3))
    away = 1 if segment.c2 * segment.direction > 0 else -1
    low, high = Fraction(0), Fraction(abs(segment.end_s - segment.anchor_s) or 2)
    for _ in range(90):
        middle = (low + high) / 2
        u = away * middle
        p = c0 + u * (c1 + u * (c2 + u * c3))
        if (p - Fraction(position)) * segment.direction * away < 0:
            low = middle
        else:
            high = middle
    return away * low


@given(
    slow=st.floats(1e-3, 1e6),
    ratio=st.floats(0.0, 1.0).map(lambda x: 1e-6 * 1e6**x),
    part=st.floats(0.0, 1.0),
    direction=st.sampled_from([1, -1]),
    rising=st.booleans(),
)
@settings(max_examples=60)
def test_cubic_segments_are_solved_to_the_last_digits(
    slow: float, ratio: float, part: float, direction: int, rising: bool
) -> None:
    """From nearly straight to a start at one millionth of the final speed."""
    fast = slow / ratio
    # Over two seconds the acceleration falls from fast − slow to nothing.
    c2 = 0.5 * (fast - slow)
    c3 = -c2 / 6.0
    if rising:
        segment = Segment(2.0, 0.0, 0.0, direction * slow, direction * c2, direction * c3, direction)
        position = segment.position(2.0 * part)
    else:
        segment = Segment(2.0, 2.0, 0.0, direction * slow, -direction * c2, direction * c3, direction)
        position = segment.position(2.0 - 2.0 * part)
    when = segment.when(position)
    assert when == pytest.approx(2.0 * part if rising else 2.0 - 2.0 * part, abs=1e-9)
    if rising and c3 != 0.0:
        exact = exact_root(segment, position)
        assert abs(Fraction(when) - exact) <= exact / 2**48 + Fraction(1, 2**80)


def test_a_segment_begins_at_its_anchor_at_the_earliest() -> None:
    for segment in (Segment(1.0, 0.0, 5.0, 0.0, 2.0, 0.0, 1), Segment(1.0, 0.0, 5.0, 1.0, 2.0, -0.1, 1)):
        assert segment.when(5.0) == segment.when(5.0 - 1e-9) == 0.0
    slowing = Segment(1.0, 1.0, 5.0, 0.0, -2.0, 0.0, 1)
    assert slowing.when(5.0) == slowing.when(5.0 + 1e-9) == 1.0
