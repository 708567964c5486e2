"""The energy of a rotor about its field, and its way through the phases of a motion, against the plain equation."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, inf, pi, sin, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motor_rig import INERTIA, motor

from steptwin.controller import SECOND
from steptwin.motion import MotionState, Profile, Segment, plan_position, plan_velocity
from steptwin.simulation.mechanics.pullout import Lag, Pullout
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

FLAT = ((0.0, 1.0), (1e6, 1.0))
PERIOD_P = 64
SWING_S = 2 * pi / sqrt(50 * 1.0 / 1e-4)
"""Of 1e-4 kg·m² in a field of 1 N·m with 50 periods per turn."""


def pullout(plan: Profile, sign: int = 1, friction: float = 0.0, start: float | None = None) -> Pullout:
    return Pullout(motor(FLAT, friction=friction, start=start), PERIOD_P, sign, plan)


def steps(*needs: tuple[float, float], speed: float = 0.0) -> Profile:
    """A motion that needs each torque (N·m, for the acceleration) for some seconds, from ``speed`` on and never backwards."""
    segments, t, p, v = [], 0.0, 0.0, speed
    for need, duration in needs:
        rate = need / INERTIA
        segments.append(Segment(t + duration, t, p, v, 0.5 * rate, 0.0, 1))
        p, v, t = p + v * duration + 0.5 * rate * duration * duration, v + rate * duration, t + duration
    return Profile(0, 0, tuple(segments), p)


def test_the_swing_of_a_rotor_has_the_period_of_the_textbook() -> None:
    found = pullout(steps((0.1, 1.0)))
    assert found.period_s(1.0) == pytest.approx(SWING_S)
    assert found.period_s(0.25) == pytest.approx(2 * SWING_S)
    assert found.period_s(0.0) == inf


def leaves(before: float, after: float) -> bool:
    """Whether a pendulum at rest at sin φ = ``before`` goes over the top for ever where its torque becomes ``after``."""
    if abs(after) >= 1.0:
        return True
    side = 1 if after >= 0 else -1
    begin, r = asin(side * before), abs(after)
    top = pi - asin(r)
    return -r * begin - cos(begin) >= -r * top - cos(top)


@given(before=st.floats(-0.99, 0.99), after=st.floats(-1.2, 1.2), sign=st.sampled_from([1, -1]))
def test_what_is_held_after_a_step_of_the_torque_is_what_has_not_the_energy(before: float, after: float, sign: int) -> None:
    found = pullout(steps((0.1, 1.0)), sign)
    limit = leaves(before, after)
    if leaves(before, after * 1.0001) is limit is leaves(before, after * 0.9999):
        assert found.holds(1.0, after, Lag(PERIOD_P / (2 * pi) * asin(before), 0.0)) is not limit


def test_from_no_load_the_share_is_0_7246() -> None:
    found = pullout(steps((0.1, 1.0)))
    assert found.holds(1.0, 0.7245, Lag(0.0, 0.0))
    assert not found.holds(1.0, 0.7247, Lag(0.0, 0.0))
    assert found.holds(1.0, 0.5, Lag(PERIOD_P / 12, 0.0)), "sin 30°: where it rests"


@pytest.mark.parametrize(("pulses", "held"), [(-31.9, True), (-32.1, False), (31.9, True), (32.1, False)])
def test_what_is_in_another_period_is_not_held(pulses: float, held: bool) -> None:
    assert pullout(steps((0.1, 1.0))).holds(1.0, 0.0, Lag(pulses, 0.0)) is held


def test_what_is_fast_is_not_held() -> None:
    """v = 2·ω about a field without load: the energy of the top."""
    edge = 2 * 2 * pi / SWING_S * PERIOD_P / (2 * pi)
    found = pullout(steps((0.1, 1.0)))
    assert found.holds(1.0, 0.0, Lag(0.0, 0.9999 * edge))
    assert not found.holds(1.0, 0.0, Lag(0.0, -1.0001 * edge))


def walked(needs: list[tuple[float, float]], before: float, load: float = 0.0, h: float = 2e-5) -> bool:
    """Whether a rotor loses the field, by plain small steps through all phases, and for three swings after the last."""
    scale = PERIOD_P / (2 * pi)
    x, v, rest = scale * asin(before), 0.0, [*needs, (0.0, 3 * SWING_S)]
    for need, duration in rest:
        for _ in range(round(duration / h)):
            # Leapfrog, whose energy does not drift.
            v += 0.5 * h * (need + load - sin(x / scale)) / INERTIA
            x += h * v
            v += 0.5 * h * (need + load - sin(x / scale)) / INERTIA
            if abs(x) > PERIOD_P / 2:
                return True
    return False


@settings(max_examples=40, deadline=None)
@given(
    first=st.floats(0.5, 1.6),
    time=st.floats(0.1, 0.9),
    second=st.floats(-0.4, 0.7),
    before=st.floats(-0.4, 0.4),
)
def test_short_phases_are_solved(first: float, time: float, second: float, before: float) -> None:
    """The first is shorter than a swing; the second is not, and whatever is held in it is held for ever."""
    needs = [(first, time * SWING_S), (second, 2 * SWING_S)]
    results = {walked([(first * k, time * SWING_S), (second, 2 * SWING_S)], before) for k in (0.99, 1.0, 1.01)}
    if len(results) == 1:
        plan = steps(*needs, speed=1e5)
        assert (pullout(plan).after_step(0, 0.0, before) is None) is results.pop()


def test_the_moment_from_which_it_is_held_is_in_the_first_long_phase() -> None:
    """1.5 N·m for a tenth of a swing, for a tenth nothing, then a quarter of the torque."""
    plan = steps((1.5, 0.1 * SWING_S), (0.0, 0.1 * SWING_S), (0.25, 2 * SWING_S), speed=1e5)
    assert pullout(plan).after_step(0, 0.0, 0.0) == pytest.approx(0.2 * SWING_S)
    assert pullout(plan).after_step(2, 0.2 * SWING_S, 0.0) == 0.2 * SWING_S, "a small step: at once"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_short_ramp_is_a_jump_where_the_speed_of_that_is_known(sign: int) -> None:
    """2 N·m for a tenth of a swing; the equation holds it."""
    top = 2.0 / INERTIA * 0.1 * SWING_S
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), sign * top, 2.0 / INERTIA, 2.0 / INERTIA)
    end = plan.segments[0].end_s
    for start, settled in ((None, pytest.approx(end)), (1.001 * top, end), (0.999 * top, None)):
        assert pullout(plan, start=start).after_step(0, 0.0, 0.0) == settled
    slow = plan_velocity(MotionState(0, 0, 0.0, 0.0), sign * 100.0, 0.6 / INERTIA, 0.6 / INERTIA)
    assert pullout(slow, start=0.0).after_step(0, 0.0, 0.0) is not None, "it has the torque"


def test_a_long_ramp_is_no_jump() -> None:
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 2.0 / INERTIA * SWING_S, 0.8 / INERTIA, 0.8 / INERTIA)
    assert pullout(plan, start=1e6).after_step(0, 0.0, 0.0) is None


def test_friction_holds_a_rotor_at_rest_until_the_field_pulls_enough() -> None:
    """1 N·m with 0.5 of friction: until the lag is that of 30°, it only falls behind."""
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 1e5, 0.1 / INERTIA, 0.1 / INERTIA)
    s = plan.segments[0]
    at, moment = pullout(plan, friction=0.5).started(s, 0.0, Lag(0.0, 0.0))
    assert at.pulses == pytest.approx(PERIOD_P / 12)
    assert moment == pytest.approx(sqrt(2 * at.pulses / (0.1 / INERTIA)))
    assert at.speed == pytest.approx(0.1 / INERTIA * moment)
    assert pullout(plan).started(s, 0.0, Lag(0.0, 0.0)) == (Lag(0.0, 0.0), 0.0)


def test_a_lack_that_ends_soon_loses_nothing() -> None:
    """The ramp ends a quarter of a swing, or two swings, after the curve has fallen to what is needed."""
    rate = 0.5 / INERTIA
    for after, lost in ((0.25, False), (2.0, True)):
        crossing = 5 * SWING_S
        end = crossing + after * SWING_S
        curve = ((0.0, 1.0), (rate * crossing, 0.5), (rate * crossing * 2, 0.2))
        plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), rate * end, rate, rate)
        one = replace(motor(FLAT), curve=curve)
        trajectory = Trajectory(Build(period_p=PERIOD_P, motor=one), plan, 0, MechanicalState(0, 0))
        assert trajectory.at(SECOND).stalled is lost, after


def test_what_stays_on_the_top_counts_as_lost() -> None:
    """As much as there is, for ever: neither held nor lost."""
    plan = steps((1.0, 1000.0), speed=1.0)
    assert pullout(plan).after_step(0, 0.0, 0.99999999) is None


@pytest.mark.parametrize(("share", "follows"), [(0.53, True), (0.55, False)])
def test_a_turn_from_speeding_up_to_braking_is_a_step_of_twice_the_torque(share: float, follows: bool) -> None:
    """Without load from R to −R: R·π = 2·√(1 − R²), R = 0.537."""
    rate = share / (400 * INERTIA)
    plan = plan_position(MotionState(0, 0, 0.0, 0.0), 400_000, rate, rate, 1e6)
    trajectory = Trajectory(Build(period_p=PERIOD_P, motor=motor(FLAT, inertia=400 * INERTIA)), plan, 0, MechanicalState(0, 0))
    assert (trajectory.at(10_000 * SECOND).rotor == 400_000) is follows


def test_a_change_of_the_plan_is_a_step_from_what_was_needed_before() -> None:
    """From a ramp with 0.7 of the torque to one with 0.9 it keeps the field; from none to 0.9 it does not."""
    heavy = motor(FLAT, inertia=400 * INERTIA)
    build = Build(period_p=PERIOD_P, motor=heavy)
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 1e5, 0.9 / heavy.inertia, 0.9 / heavy.inertia)
    for needed, stalls in ((0.7, False), (None, True), (0.0, True)):
        assert Trajectory(build, plan, 0, MechanicalState(0, 0), needed=needed).at(SECOND).stalled is stalls
    first = Trajectory(build, plan_velocity(MotionState(0, 0, 0.0, 0.0), 1e5, 100.0, 100.0), 0, MechanicalState(0, 0))
    assert first.needs(0) == 0.0
    assert first.needs(SECOND) == pytest.approx(heavy.inertia * 100.0)
    assert first.needs(2000 * SECOND) == 0.0
