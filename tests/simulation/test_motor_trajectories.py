"""The torque of a motor along arcs, in motions without end, and in the parts that matter to its resonance."""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, pi, sin

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motor_rig import INERTIA, LINEAR, at_speed, motor

from steptwin.controller import SECOND
from steptwin.motion import MotionState, Profile, Segment, plan_position, plan_velocity
from steptwin.motion.paths import Circular
from steptwin.simulation.mechanics.motor import StepperMotor, _first_below_0
from steptwin.simulation.mechanics.resonance import MotionPhase, Resonance
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

# ---------------------------------------------------------------------- along an arc


@settings(max_examples=60, deadline=None)
@given(
    radius=st.integers(2000, 20_000),
    speed=st.floats(5000.0, 30_000.0),
    inertia=st.floats(1e-7, 2e-5),
    friction=st.floats(0.0, 0.2),
    load=st.floats(-0.2, 0.2),
    start=st.floats(100.0, 30_000.0),
    sign=st.sampled_from([1, -1]),
    part=st.floats(0.0, 0.9),
)
@example(radius=8000, speed=20_000.0, inertia=1e-5, friction=0.1, load=0.1, start=9000.0, sign=-1, part=0.3)
def test_along_an_arc_it_is_looked_every_millisecond(
    radius: int, speed: float, inertia: float, friction: float, load: float, start: float, sign: int, part: float
) -> None:
    """x = R cos φ with φ = w / R: velocity and acceleration by the derivatives of that, at whole milliseconds of a segment."""
    travel = plan_position(MotionState(0, 0, 0.0, 0.0), round(2 * pi * radius), 40_000.0, 40_000.0, speed)
    profile = Circular(-radius, radius, 0.0, 4.0 / round(2 * pi * radius)).profile(travel, 0, 0)
    drive = StepperMotor(LINEAR, inertia, friction, load, start)
    scale = 2 * pi / round(2 * pi * radius)
    begin = 0.0
    for s in profile.segments:
        first = begin + part * (s.end_s - begin)
        lost = caught = None
        is_close = False
        for n in range(int((s.end_s - first) / 0.001) + 1):
            t = first + n * 0.001
            w, dw, ddw = s.travel.position(t), s.travel.velocity(t), 2 * s.travel.c2
            velocity = -radius * sin(scale * w) * scale * dw
            acceleration = -radius * scale * (cos(scale * w) * scale * dw * dw + sin(scale * w) * ddw)
            need = abs(inertia * sign * acceleration + friction * sign * s.direction + load)
            torque = at_speed(LINEAR, abs(velocity))
            # At the ends of a segment the difference from which the acceleration comes reaches beyond it.
            is_close |= abs(need - torque) < 2e-3 or abs(abs(velocity) - start) < 1.0
            if lost is None and need > torque:
                lost = t
            if caught is None and need <= torque and abs(velocity) <= start:
                caught = t
        if not is_close:
            assert drive.loses(s, first, s.end_s, sign) == lost
            assert drive.catches(s, first, s.end_s, sign) == caught
        begin = s.end_s


def test_a_motor_on_an_arc_loses_the_field_where_the_curve_is_too_tight() -> None:
    """R = 8000 at 20 000 pulses/s: 50 000 pulses/s² where the axis turns; 1 N·m is there at any speed."""
    travel = plan_position(MotionState(0, 0, 0.0, 0.0), 50_265, 20_000.0, 20_000.0, 20_000.0)
    profile = Circular(-8000, 8000, 0.0, 4.0 / 50_265).profile(travel, 0, 0)
    for need, follows in ((0.99, True), (1.01, False)):
        build = Build(period_p=64, motor=StepperMotor(((0.0, 1.0), (32_000.0, 1.0)), need / 50_000.0, 0.0, 0.0, 20_000.0))
        trajectory = Trajectory(build, profile, 0, MechanicalState(0, 0))
        assert (trajectory.next_stall(0) is None) is follows, need
        assert (trajectory.at(1000 * SECOND) == MechanicalState(0, 0)) is follows or trajectory.at(1000 * SECOND).behind % 64 == 0


# ---------------------------------------------------------------------- motions without end


@pytest.mark.parametrize(
    ("speed", "start", "lost", "caught"),
    [
        (15_999.0, 16_000.0, None, 0.5),
        (16_000.0, 16_000.0, None, 0.5),
        (16_001.0, 16_000.0, 0.5, None),
        (8000.0, 7999.0, None, None),
        (8000.0, 8000.0, None, 0.5),
    ],
)
@pytest.mark.parametrize("direction", [1, -1])
def test_a_steady_motion_is_followed_or_not_from_its_beginning(
    speed: float, start: float, lost: float | None, caught: float | None, direction: int
) -> None:
    """Friction of 0.6 N·m; the curve has that at 16 000 pulses/s. Above the start speed nothing is caught."""
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), direction * speed, 1e9, 1e9)
    steady = plan.segments[-1]
    assert steady.end_s == inf
    drive = motor(friction=0.6, start=start)
    assert drive.loses(steady, 0.5, inf, direction) == lost
    assert drive.catches(steady, 0.5, inf, direction) == caught


@pytest.mark.parametrize(("jump", "follows"), [(2000.0, True), (-2000.0, True), (2001.0, False), (-2001.0, False)])
def test_a_jump_of_the_speed_is_followed_up_to_the_start_speed(jump: float, follows: bool) -> None:
    assert motor(start=2000.0).follows(jump) is follows
    assert motor().follows(jump)


def test_a_rotor_that_would_be_caught_and_lost_at_once_stays_lost() -> None:
    """Friction takes all there is at any speed: what is caught at rest in a turn is lost in the same moment."""
    build = Build(period_p=64, motor=motor(((0.0, 0.5), (32_000.0, 0.5)), inertia=1e-9, friction=0.6))
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 5000.0, 1000.0, 1000.0)
    turned = plan_velocity(MotionState.of(plan, SECOND), -5000.0, 1000.0, 1000.0)
    trajectory = Trajectory(build, turned, SECOND, MechanicalState(0, 0, stalled=True))
    for moment in (SECOND, 2 * SECOND, 3 * SECOND, 9 * SECOND):
        assert trajectory.at(moment).stalled, moment
        assert trajectory.at(moment).rotor == 0
    assert [section.begin for section in trajectory.sections] == sorted({section.begin for section in trajectory.sections})


@pytest.mark.parametrize(
    ("q", "end", "found"),
    [
        ((0.0, -1.0, 0.0), 2.0, 0.0),  # a line
        ((0.0, -1e-10, -1.0), 1.0, 0.0),  # falls steeper and steeper
        ((0.0, -1.0, 0.25), 8.0, 0.0),  # down to -1 at 2, and up again
        ((0.0, -1.0, 0.25), 0.5, 0.0),  # not as far as the lowest point
        ((1e-10, -1.0, 0.25), 8.0, 0.0),  # rounding apart, at the beginning
        ((0.0, -1e-6, 0.25), 8.0, None),  # never lower than rounding
        ((0.0, -1e-10, 0.0), 2.0, None),
        ((0.0, -1e-10, -1e-10), 1.0, None),
    ],
)
def test_what_falls_from_0_at_the_beginning_is_below_0_there(
    q: tuple[float, float, float], end: float, found: float | None
) -> None:
    """Unless it falls by no more than rounding, 1e-9 here."""
    assert _first_below_0(q, 0.0, end, 1e-9) == found


# ---------------------------------------------------------------------- for the resonance


BAND = Resonance(4000.0, 9000.0, 10.0, 10.0, 0.05)


def parts_of(drive: StepperMotor, plan: Profile, number: int, sign: int = 1) -> list[MotionPhase]:
    begin = plan.segments[number - 1].end_s if number else 0.0
    s = plan.segments[number]
    return list(drive.phases(s, begin, s.end_s, sign))


@pytest.mark.parametrize("sign", [1, -1])
def test_parts_of_a_ramp_end_where_the_speed_passes_the_band_and_corners(sign: int) -> None:
    """With 1000 pulses/s²; a corner of the curve is at 6000 pulses/s. Of each part the middle counts."""
    curve = ((0.0, 1.0), (6000.0, 0.7), (32_000.0, 0.2))
    drive = replace(motor(curve, friction=0.1, load=0.05), resonance=BAND)
    (ramp, *_) = plan_position(MotionState(0, 0, 0.0, 0.0), sign * 10**6, 1000.0, 1000.0, 10_000.0).segments
    parts = list(drive.phases(ramp, 0.0, ramp.end_s, 1))
    assert [part.begin_s for part in parts] == pytest.approx([0.0, 4.0, 6.0, 9.0])
    assert [part.end_s for part in parts] == pytest.approx([4.0, 6.0, 9.0, 10.0])
    assert [part.speed for part in parts] == pytest.approx([2000.0, 5000.0, 7500.0, 9500.0])
    need = abs(sign * (INERTIA * 1000.0 + 0.1) + 0.05)
    torques = [0.9, 0.75, 0.7 - 1500 * 0.5 / 26_000, 0.7 - 3500 * 0.5 / 26_000]
    assert [part.use for part in parts] == pytest.approx([need / torque for torque in torques])
    assert parts_of(replace(drive, resonance=None), Profile(0, 0, (ramp,), 0.0), 0)[0].end_s == pytest.approx(6.0)


def test_where_the_acceleration_falls_that_of_the_middle_counts() -> None:
    """From 3000 to 1000 pulses/s² in 2 s, and below the band: one part, in whose middle it is 2000."""
    drive = replace(motor(((0.0, 1.0), (32_000.0, 1.0)), friction=0.1), resonance=Resonance(9000.0, 9500.0, 10.0, 10.0, 0.05))
    segment = Segment(2.0, 0.0, 0.0, 1000.0, 1500.0, -1000.0 / 6.0, 1)
    (part,) = drive.phases(segment, 0.0, 2.0, 1)
    assert part.speed == pytest.approx(1000.0 + 3000.0 - 500.0)
    assert part.use == pytest.approx(INERTIA * 2000.0 + 0.1)


def test_a_motion_without_end_is_one_part() -> None:
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 8000.0, 1000.0, 1000.0)
    drive = replace(motor(friction=0.2), resonance=BAND)
    (part,) = parts_of(drive, plan, len(plan.segments) - 1)
    assert (part.begin_s, part.end_s, part.speed) == (pytest.approx(8.0), inf, pytest.approx(8000.0))
    assert part.use == pytest.approx(0.2 / 0.8)


@pytest.mark.parametrize(("friction", "use"), [(0.9999, 0.9999), (1.0, 1.0), (1.5, 1.0)])
def test_no_more_than_all_of_the_torque_is_used(friction: float, use: float) -> None:
    flat = ((0.0, 1.0), (32_000.0, 1.0))
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), 8000.0, 1e6, 1e6)
    (part,) = parts_of(replace(motor(flat, friction=friction), resonance=BAND), plan, len(plan.segments) - 1)
    assert part.use == pytest.approx(use)


def test_along_an_arc_there_is_a_part_for_each_millisecond() -> None:
    travel = plan_position(MotionState(0, 0, 0.0, 0.0), 50_265, 20_000.0, 20_000.0, 20_000.0)
    arc = Circular(-8000, 8000, 0.0, 4.0 / 50_265).profile(travel, 0, 0).segments[0]
    drive = replace(motor(friction=0.1), resonance=BAND)
    begin, end = 0.1, 0.1045
    parts = list(drive.phases(arc, begin, end, 1))
    assert [part.begin_s for part in parts] == pytest.approx([0.1, 0.101, 0.102, 0.103, 0.104])
    assert [part.end_s for part in parts] == pytest.approx([0.101, 0.102, 0.103, 0.104, 0.1045])
    assert [part.speed for part in parts] == [pytest.approx(abs(arc.velocity(part.begin_s))) for part in parts]
    assert all(0.0 < part.use < 1.0 for part in parts)
