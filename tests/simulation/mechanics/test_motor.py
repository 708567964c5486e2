"""The torque of a motor: thresholds against the analytic values, moments against a walk through time."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import inf, pi

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motor_rig import INERTIA, PER_REV, accelerated, at_speed, final, motor

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.motion import MotionState, Segment, plan_position, plan_velocity
from steptwin.motion.ramps import SpeedCurve, plan_endless
from steptwin.simulation.mechanics.motor import FASTEST, Burden, StepperMotor, _first_below_0, _first_not_below_0, roots
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

# ---------------------------------------------------------------------- thresholds


HEAVY = 100 * INERTIA
"""With 1 N·m its rotor swings with a period of 89 ms, and its ramps last for seconds."""


def test_the_acceleration_from_which_steps_are_lost_is_that_of_the_torque() -> None:
    """From rest to v: J a = T(v) near the end of the ramp. With T(v) = 1 − 0.8 v / 32000 and v = 16000, T = 0.6 N·m.

    What lacks for less than a swing at the very end of the ramp loses nothing.
    """
    limit = 0.6 / HEAVY
    build = Build(period_p=64, motor=motor(inertia=HEAVY))
    below, above = accelerated(limit * 0.9999, 16_000.0), accelerated(limit * 1.15, 16_000.0)
    assert final(build, below) == MechanicalState(200_000, 200_000)
    assert final(build, above).rotor < 200_000
    assert final(build, accelerated(limit * 1.0001, 16_000.0)) == MechanicalState(200_000, 200_000)


def test_the_speed_at_which_steps_are_lost_is_where_the_curve_meets_the_need() -> None:
    """Half the standstill torque is needed for the ramp: lost at T(v) = 0.5, v = 20000 pulses/s."""
    rate = 0.5 / HEAVY
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 30_000.0, rate, rate)
    heavy = motor(inertia=HEAVY)
    lost = heavy.loses(plan.segments[0], 0.0, plan.segments[0].end_s, 1)
    assert lost == pytest.approx(20_000.0 / rate, rel=1e-12)
    trajectory = Trajectory(Build(period_p=64, motor=heavy), plan, 0, MechanicalState(0, 0))
    moment = round(20_000.0 / rate * SECOND)
    assert not trajectory.at(moment - 10).stalled
    assert trajectory.at(moment + 10).stalled


def test_friction_is_needed_at_speed_and_helps_to_brake() -> None:
    """Of 0.5 N·m; from rest about 0.726 of that at once, from 0.4 down to −0.591: by the energy of the swing."""
    build = Build(period_p=64, motor=motor(((0.0, 0.5), (32_000.0, 0.5)), inertia=HEAVY, friction=0.2))

    def rotor(up: float, down: float) -> int:
        return final(build, plan_position(MotionState(0, 0, 0.0, 0.0), 500_000, up / HEAVY, down / HEAVY, 20_000.0)).rotor

    assert rotor(0.16, 0.48) == 500_000
    assert rotor(0.18, 0.48) < 500_000
    assert rotor(0.16, 0.51) < 500_000


def test_a_load_that_pulls_down_makes_the_way_up_harder() -> None:
    build = Build(period_p=64, motor=motor(((0.0, 0.5), (32_000.0, 0.5)), inertia=HEAVY, load=0.3))
    rate = 0.4 / HEAVY
    up = plan_position(MotionState(0, 0, 0.0, 0.0), 50_000, rate, rate * 0.1, 5000.0)
    down = plan_position(MotionState(0, 0, 0.0, 0.0), -50_000, rate, rate * 0.1, 5000.0)
    assert final(build, up).rotor < 50_000
    assert final(build, down).rotor == -50_000
    assert final(Build(sign=-1, period_p=64, motor=build.motor), up).rotor == -50_000


def test_a_start_above_the_start_speed_is_not_followed() -> None:
    """The M1486 begins at its start/stop speed at once."""
    plan = plan_endless(0, 0, 1, SpeedCurve(500.0, 1000.0, 2000.0, 2000.0))
    for start, follows in ((499.0, False), (500.0, True), (None, True)):
        build = Build(period_p=64, motor=motor(inertia=0.0, start=start))
        trajectory = Trajectory(build, plan, 0, MechanicalState(0, 0), jump=500.0)
        assert (trajectory.at(SECOND).rotor > 0) is follows


def test_what_is_lost_is_a_whole_number_of_electrical_periods() -> None:
    state = final(Build(period_p=64, motor=motor()), accelerated(0.9 / INERTIA))
    assert 200_000 - state.rotor > 0
    assert (200_000 - state.rotor) % 64 == 0
    assert not state.stalled


def test_a_stalled_rotor_is_caught_below_the_start_speed() -> None:
    slow, fast = Build(period_p=64, motor=motor(start=2000.0)), Build(period_p=64, motor=motor())
    plan = accelerated(0.9 / INERTIA)
    assert final(slow, plan).rotor > final(fast, plan).rotor
    trajectory = Trajectory(slow, plan, 0, MechanicalState(0, 0))
    end = plan.end or 0
    caught = end - round(2000.0 / 1000.0 * SECOND)
    assert trajectory.at(caught - 1000).stalled
    assert not trajectory.at(caught + 1000).stalled


def test_a_rotor_is_caught_when_speed_and_torque_both_allow_it() -> None:
    """1 N·m at standstill, 0.2 from 300 rev/min on; lost at 600 rev/min when braking with 300 000 pulses/s² begins.

    Braking needs 8.8e-4 · 589 = 0.518 N·m, which there is below 180.6 rev/min, 155 pulses before rest: 1552 pulses are lost until
    then, of which 24 periods stay. By its speed alone, below 280 rev/min, it would be 21 periods; at rest 27.
    """
    per_rpm = PER_REV / 60
    curve = ((0.0, 1.0), (300 * per_rpm, 0.2), (1200 * per_rpm, 0.2))
    build = Build(period_p=64, motor=motor(curve, inertia=8.8e-4 * 2 * pi / PER_REV, start=280 * per_rpm))
    plan = plan_position(MotionState(0, 0, 0.0, 0.0), 20_000, 50_000.0, 300_000.0, 600 * per_rpm)
    trajectory = Trajectory(build, plan, 0, MechanicalState(0, 0))
    assert 20_000 - trajectory.at(1000 * SECOND).rotor == 24 * 64
    speed = next(n for n in range(28_000, 0, -1) if at_speed(curve, n / 100 * per_rpm) >= 300_000 * build.motor.inertia) / 100  # type: ignore[union-attr]
    assert speed == pytest.approx(180.6, abs=0.1)
    caught = (plan.end or 0) - round(speed * per_rpm / 300_000 * SECOND)
    assert trajectory.at(caught - 100_000).stalled
    assert not trajectory.at(caught + 100_000).stalled


@settings(max_examples=60, deadline=None)
@given(
    torques=st.lists(st.floats(0.05, 1.5), min_size=2, max_size=5),
    rate=st.floats(2000.0, 400_000.0),
    speed=st.floats(500.0, 25_000.0),
    friction=st.floats(0.0, 0.3),
    load=st.floats(-0.3, 0.3),
    start=st.floats(100.0, 25_000.0),
    braking=st.booleans(),
    sign=st.sampled_from([1, -1]),
)
def test_the_moment_of_being_caught_is_the_first_that_a_walk_finds(
    torques: list[float], rate: float, speed: float, friction: float, load: float, start: float, braking: bool, sign: int
) -> None:
    """Every 1/2000 of a ramp: is it slow enough, and is there the torque?"""
    curve = tuple((7000.0 * n, torque) for n, torque in enumerate(torques))
    plan = plan_position(MotionState(0, 0, 0.0, 0.0), 200_000, rate, rate, speed)
    s = plan.segments[-1 if braking else 0]
    begin = plan.segments[-2].end_s if braking else 0.0
    drive = motor(curve, friction=friction, load=load, start=start)
    found = drive.catches(s, begin, s.end_s, sign)
    step = (s.end_s - begin) / 2000
    need = abs(INERTIA * sign * 2 * s.c2 + sign * friction + load)

    def spare(t: float) -> float:
        speed = abs(s.velocity(t))
        return min(at_speed(curve, speed) - need, (start - speed) * 1e-4)

    walked = next((t for n in range(2000) if spare(t := begin + n * step) >= 0), None)
    if walked is None:
        assert found is None or max(spare(found), spare(found - step), spare(found + step)) > -1e-3
    else:
        assert found is not None, f"never caught, a walk finds {walked}"
        assert found <= walked + 1e-9 or spare(walked) < 1e-6
        assert walked - found <= step * 1.001 or spare(found) >= -1e-9


def test_a_motor_too_weak_for_its_load_never_catches_it() -> None:
    build = Build(period_p=64, motor=motor(load=2.0))
    state = final(build, accelerated(1000.0))
    assert state.stalled
    assert state.rotor == 0


# ---------------------------------------------------------------------- against a walk through time

CURVES = st.lists(st.floats(0.05, 1.5), min_size=2, max_size=5).map(
    lambda torques: tuple((7000.0 * n, torque) for n, torque in enumerate(torques))
)


@settings(max_examples=25, deadline=None)
@given(
    curve=CURVES,
    rate=st.floats(2000.0, 400_000.0),
    speed=st.floats(500.0, 25_000.0),
    friction=st.floats(0.0, 0.3),
    load=st.floats(-0.3, 0.3),
    parabolic=st.booleans(),
)
@example(curve=((0, 0.46875), (7000, 1.125)), rate=243826, speed=500, friction=0.234375, load=0.2109375, parabolic=True)
def test_the_moment_is_the_first_at_which_a_walk_finds_too_little_torque(
    curve: tuple, rate: float, speed: float, friction: float, load: float, parabolic: bool
) -> None:
    """Velocity and acceleration by differences of the position, every 100 µs."""
    if parabolic:
        knee = speed * 0.5
        plan = plan_endless(0, 0, 1, SpeedCurve(knee * 0.1, rate, knee, speed))
    else:
        plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), speed, rate, rate)
    drive = motor(curve, friction=friction, load=load)
    step = 100e-6
    for s, begin in zip(plan.segments, [0.0, *(s.end_s for s in plan.segments)], strict=False):
        if s.end_s == inf or s.end_s - begin < 20 * step:
            continue
        found = drive.loses(s, begin, s.end_s, 1)
        walked = None
        t = begin + step
        while t < s.end_s - step:
            velocity = (s.position(t + step) - s.position(t - step)) / (2 * step)
            slope = (s.velocity(t + step) - s.velocity(t - step)) / (2 * step)
            torque = at_speed(curve, velocity)
            if abs(INERTIA * slope + friction + load) > torque * (1 + 1e-9) + 1e-9:
                walked = t
                break
            t += step
        if walked is None:
            # The walk begins a step after the segment and ends a step before it.
            near_an_end = found is not None and (found < begin + 2 * step or found > s.end_s - 3 * step)
            assert found is None or near_an_end or is_close(drive, s, found)
        else:
            assert found is not None
            assert found <= walked + step
            assert found >= walked - 2 * step or is_close(drive, s, found)


def is_close(drive: StepperMotor, s: Segment, t: float) -> bool:
    """What is needed and what is there differ by so little at ``t`` that the walk may step over it."""
    torque = at_speed(drive.curve, abs(s.velocity(t)))
    need = drive.inertia * (2 * s.c2 + 6 * s.c3 * (t - s.anchor_s)) + drive.friction + drive.load
    return abs(abs(need) - torque) < 1e-3


@pytest.mark.parametrize("curve", [(), ((1.0, 1.0),), ((0.0, 1.0), (0.0, 2.0)), ((0.0, -1.0),)])
def test_curves_that_are_none_are_misuse(curve: tuple) -> None:
    with pytest.raises(Misuse, match="curve"):
        motor(curve)


def test_at_standstill_the_first_torque_holds() -> None:
    assert motor(load=1.0).holds()
    assert not motor(load=1.0001).holds()
    assert motor().torque(32_001.0) < 0.0


# ---------------------------------------------------------------------- when a quadratic goes below 0


@settings(max_examples=100, deadline=None)
@given(
    q2=st.floats(-50.0, 50.0).filter(lambda q: abs(q) > 1e-3),
    middle=st.floats(-2.0, 2.0),
    spread=st.sampled_from([0.0, 1e-9, 1e-7, 1e-5, 1e-3, 0.1, 1.0, -1e-9, -1e-6, -1e-3, -1.0]),
    begin=st.floats(-2.0, 1.9),
)
@example(q2=1.0, middle=0.5, spread=1e-7, begin=0.0)
@example(q2=-1.0, middle=0.5, spread=1e-3, begin=0.499)
def test_the_first_moment_below_0_is_that_of_a_dense_scan(q2: float, middle: float, spread: float, begin: float) -> None:
    """Roots far apart, nearly double, double and not there (``spread`` < 0: as far above or below 0)."""
    end, slack = 2.0, 1e-12
    q0, q1 = q2 * (middle * middle - spread * abs(spread)), -2.0 * q2 * middle

    def value(u: float) -> float:
        return q0 + u * (q1 + u * q2)

    found = _first_below_0((q0, q1, q2), begin, end, slack)
    scan = [begin + (end - begin) * n / 4000 for n in range(4001)]
    # Between the roots of a parabola that opens upwards a scan may find nothing: they are looked for there, too.
    moments = sorted({*scan, *(u for u in (middle, middle - spread / 2, middle + spread / 2) if begin <= u <= end)})
    below = next((u for u in moments if value(u) < -1e-9), None)
    if below is None:
        assert found is None or min(value(u) for u in moments) < 1e-9, f"found {found}, where there is nothing below 0"
        return
    assert found is not None, f"below 0 at {below}"
    assert found <= below
    assert found == begin or abs(value(found)) < 1e-9
    assert all(value(u) > -1e-9 for u in moments if u < found)


@settings(max_examples=80, deadline=None)
@given(
    parabolas=st.lists(st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)), min_size=1, max_size=2),
    begin=st.floats(-1.0, 0.9),
)
@example(parabolas=[(0.0, 0.0, 1.0), (1.5e-231, 1.0, 0.0)], begin=-1.0)
def test_the_first_moment_at_which_nothing_is_below_0_is_that_of_a_dense_scan(parabolas: list, begin: float) -> None:
    def least(u: float) -> float:
        return min(q0 + u * (q1 + u * q2) for q0, q1, q2 in parabolas)

    found = _first_not_below_0(parabolas, begin, 1.0, 1e-12)
    scan = [begin + (1.0 - begin) * n / 2000 for n in range(2000)]
    up = next((u for u in scan if least(u) > 1e-6), None)
    if up is None:
        assert found is None or least(found) > -1e-6
    else:
        assert found is not None, f"nothing is below 0 at {up}"
        assert found <= up
        assert least(found) > -1e-6
        assert all(least(u) <= 1e-6 for u in scan if u < found)


# ---------------------------------------------------------------------- single values


@pytest.mark.parametrize(
    ("speed", "torque"),
    [
        (0.0, 1.0),
        (3000.0, 0.85),
        (6000.0, 0.7),
        (6001.0, 0.7 - 0.5 / 26_000),
        (19_000.0, 0.45),
        (32_000.0, 0.2),
        (32_000.1, -1.0),
    ],
)
def test_torques_of_a_curve(speed: float, torque: float) -> None:
    assert motor(((0.0, 1.0), (6000.0, 0.7), (32_000.0, 0.2))).torque(speed) == pytest.approx(torque)


def test_a_curve_of_one_point_is_for_standstill() -> None:
    assert (motor(((0.0, 1.0),)).torque(0.0), motor(((0.0, 1.0),)).torque(0.1)) == (1.0, -1.0)


@pytest.mark.parametrize(
    ("acceleration", "direction", "need"), [(1000.0, 1, 1.8), (-1000.0, 1, -0.2), (1000.0, -1, 1.2), (-1000.0, -1, -0.8)]
)
def test_what_a_motion_needs(acceleration: float, direction: int, need: float) -> None:
    """1 N·m for the acceleration, 0.3 of friction, 0.5 of load."""
    assert motor(inertia=0.001, friction=0.3, load=0.5).needs(acceleration, direction) == pytest.approx(need)


def test_burdens_add_up() -> None:
    one, other = Burden(1.0, 2.0, 3.0), Burden(10.0, 20.0, 30.0)
    assert one.plus(other) == Burden(11.0, 22.0, 33.0)
    assert one.times(0.5) == Burden(0.5, 1.0, 1.5)


def test_what_moves_freely_is_not_faster_than_can_be_calculated() -> None:
    """Load, friction and brake together, against the limit of acceleration."""
    body = motor(inertia=1.0, friction=0.25 * FASTEST, load=-0.25 * FASTEST)
    body.check_coasting(0.5 * FASTEST)
    with pytest.raises(Misuse, match="on so small an inertia accelerates by more than"):
        body.check_coasting(0.500001 * FASTEST)
    motor(inertia=0.0).check_coasting()
    with pytest.raises(Misuse):
        motor(inertia=0.0, load=1e-9).check_coasting()


def test_a_rotor_is_caught_below_its_start_speed_or_at_rest() -> None:
    assert (motor(start=2000.0).catch_p, motor().catch_p) == (2000.0, 0.0)


def test_what_is_not_below_0_only_at_the_end_is_not_found_before_it() -> None:
    """u − 1 from 0 to 1; with another parabola that is above 0 throughout."""
    line = (-1.0, 1.0, 0.0)
    assert _first_not_below_0([line], 0.0, 1.0, 1e-12) is None
    assert _first_not_below_0([line, (5.0, 0.0, 0.0)], 0.0, 1.0, 1e-12) is None
    assert _first_not_below_0([line], 0.0, 1.1, 1e-12) == 1.0
    assert _first_not_below_0([line], 1.0, 2.0, 1e-12) == 1.0


@given(
    curve=CURVES,
    share=st.floats(0.01, 0.99),
    direction=st.sampled_from([1, -1]),
    above=st.sampled_from([0.0, 1e-6]),
)
def test_what_is_needed_may_be_all_of_the_torque(curve: tuple, share: float, direction: int, above: float) -> None:
    """In a motion without end, whose torque is that of the line through two points, exactly calculated."""
    speed = share * curve[-1][0]
    (s0, t0), (s1, t1) = next((a, b) for a, b in pairwise(curve) if speed <= b[0])
    torque = Fraction(t0) + (Fraction(t1) - Fraction(t0)) * (Fraction(speed) - s0) / (Fraction(s1) - Fraction(s0))
    drive = motor(curve, friction=float(torque) * (1.0 + above))
    lost = drive.loses(Segment(inf, 2.0, 0.0, direction * speed, 0.0, 0.0, direction), 2.0, inf, 1)
    assert lost == (2.0 if above and torque else None)


def test_what_uses_all_of_the_torque_at_its_end_loses_nothing() -> None:
    """From 0 to 500 pulses/s in 0.5 s: the torque is 1 - v/2000, and 0.75 is needed."""
    drive = motor(((0.0, 1.0), (1000.0, 0.5)), inertia=0.75 / 1000.0)
    for end_s, lost in ((0.5, None), (0.5 + 1e-6, 0.5)):
        assert drive.loses(Segment(end_s, 0.0, 0.0, 0.0, 500.0, 0.0, 1), 0.0, end_s, 1) == lost


def test_what_is_within_rounding_of_0_is_no_loss_and_what_leads_below_it_is() -> None:
    slack = 1e-12
    assert _first_below_0((-slack, 0.0, 0.0), 0.0, 1.0, slack) is None
    assert _first_below_0((-1.1 * slack, 0.0, 0.0), 0.0, 1.0, slack) == 0.0
    # (u - 1)² - 1e-6 begins at 0, and is above it again 2e-3 later.
    assert _first_not_below_0([(1.0 - 1e-6, -2.0, 1.0)], 1.0 - 1e-3, 2.0, slack) == pytest.approx(1.0 + 1e-3)
    assert _first_not_below_0([(1.0, -2.0, 1.0)], 1.0, 2.0, slack) == 1.0


def test_what_touches_0_and_falls_is_below_it_from_there_on() -> None:
    """-u², with no room for rounding, and from 1 on; u² - 1 is below 0 only before 1."""
    assert _first_below_0((0.0, 0.0, -1.0), 0.0, 2.0, 0.0) == 0.0
    assert _first_below_0((1.0, 0.0, -1.0), 0.0, 2.0, 0.0) == 1.0
    assert _first_below_0((-1.0, 0.0, 1.0), 1.0, 2.0, 0.0) is None


def test_how_deep_it_falls_is_looked_at_where_it_is_lowest() -> None:
    """u² - u is lowest at 0.5, by 0.25."""
    assert _first_below_0((0.0, -1.0, 1.0), 0.0, 2.0, 0.24) == 0.0
    assert _first_below_0((0.0, -1.0, 1.0), 0.0, 2.0, 0.25) is None
    assert _first_not_below_0([(0.0, 0.0, 0.0)], 0.0, 1.0, 0.0) == 0.0
    assert _first_not_below_0([(0.0, -1.0, 1.0)], 0.0, 2.0, 0.25) == 0.0
    assert _first_not_below_0([(0.0, -1.0, 1.0)], 0.0, 2.0, 0.24) == 1.0


@given(st.floats(1e-12, 1e-6), st.floats(0.01, 10.0), st.sampled_from([1, -1]), st.floats(0.5, 2.0))
def test_a_root_near_0_is_exact(root: float, other: float, sign: int, scale: float) -> None:
    """Of scale · (u + root) · (u + other), and of its mirror image."""
    found = sorted(roots((scale * root * other, sign * scale * (root + other), scale)), key=abs)
    assert found == [pytest.approx(-sign * root, rel=1e-9), pytest.approx(-sign * other, rel=1e-9)]
