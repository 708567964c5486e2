"""Trajectories against a simulation that goes pulse by pulse."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pulse_by_pulse import changes, pulse_by_pulse

from steptwin.controller import SECOND, Nanos
from steptwin.motion import MotionState, Profile, plan_position
from steptwin.motion.divisions import Microstepping, step_train
from steptwin.motion.profile import cruise
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.resonance import Resonance
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

END = 20 * SECOND


def pressed(build: Build, profile: Profile, until: Nanos) -> list[tuple[Nanos, int, int]]:
    """(moment, rotor, behind) after every pulse, and at its turns and its end, for an axis with stops and no play.

    The field draws the rotor to its own place, less what was lost. A rotor that a stop keeps from there springs to the nearest
    place with the same electrical angle when the field turns or stands.
    """
    period = build.period_p

    def spring(rotor: int, behind: int, field: int) -> tuple[int, int]:
        places = [behind + n * period for n in range(-300, 301)]
        behind = min(places, key=lambda lost: (abs(field - lost - rotor), -lost))
        return held(field - behind), behind

    def held(place: int) -> int:
        return min(max(place, build.low or 0), build.high or 0)

    ends = [profile.start + int(end) for end in profile.ends if end != float("inf")]
    directions = [s.direction for s in profile.segments]
    turning_points = [end for end, one, other in zip(ends, directions, directions[1:], strict=False) if one != other]
    moments = [
        *((moment, True) for moment in [*turning_points, *ends[-1:]]),
        *((moment, False) for moment, _ in changes(profile, profile.start, until)),
    ]
    rotor, behind = 0, build.sign * profile.count(profile.start)
    way = {}
    for moment, is_turn in sorted(moments):
        field = build.sign * profile.count(moment)
        if not is_turn:
            rotor = held(field - behind)
        elif field - behind != rotor:
            rotor, behind = spring(rotor, behind, field)
        way[moment] = moment, rotor, behind
    return list(way.values())


@settings(max_examples=60, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    stops=st.tuples(st.integers(-60, -1), st.integers(1, 60)),
    period=st.sampled_from([1, 4, 16, 64]),
    sign=st.sampled_from([1, -1]),
)
@example(first=100, second=20, stops=(-10, 30), period=16, sign=1)
def test_what_is_lost_at_a_stop_is_a_whole_number_of_electrical_periods(
    first: int, second: int, stops: tuple[int, int], period: int, sign: int
) -> None:
    plan = there_and_back(first, second)
    build = Build(sign=sign, low=stops[0], high=stops[1], period_p=period)
    behind = sign * plan.count(plan.start)
    trajectory = Trajectory(build, plan, plan.start, MechanicalState(0, 0, behind=behind))
    found = []
    way = pressed(build, plan, END)
    for moment, _, _ in way:
        state = trajectory.at(moment)
        found.append((moment, state.rotor, state.behind))
        assert (state.behind - behind) % period == 0
        assert stops[0] <= state.rotor <= stops[1]
    assert found == way
    # What comes after it is the same whether the way is taken in one trajectory or begun again in the middle.
    middle = SECOND + (END - SECOND) // 40
    again = Trajectory(build, plan, middle, trajectory.at(middle))
    assert again.at(END) == trajectory.at(END)


def test_homing_against_a_stop_ends_up_to_two_full_steps_from_it() -> None:
    """16 pulses a full step: pressed with 0 to 63 pulses more, then back by 200. Where it ends goes over a whole period."""
    ends = set()
    for more in range(64):
        build = Build(high=60, period_p=64)
        out = plan_position(MotionState(0, 0, 0.0, 0.0), 1000 + more, 4000.0, 4000.0, 1000.0)
        trajectory = Trajectory(build, out, 0, MechanicalState(0, 0))
        pressed_at = trajectory.at(10 * SECOND)
        assert 60 - 32 <= pressed_at.rotor <= 60
        back = plan_position(MotionState(10 * SECOND, 1000 + more, 0.0, 0.0), 800 + more, 4000.0, 4000.0, 1000.0)
        end = Trajectory(build, back, 10 * SECOND, pressed_at).at(30 * SECOND)
        assert (800 + more - end.rotor) % 64 == 0
        ends.add(end.rotor)
    assert ends == set(range(60 - 200 - 32, 60 - 200 + 32))


def there_and_back(first: int, second: int) -> Profile:
    """Runs towards ``first`` and is told on the way to go to ``second``: the profile turns."""
    out = plan_position(MotionState(0, 0, 0.0, 0.0), first, 400.0, 400.0, 150.0)
    now = SECOND
    return plan_position(MotionState.of(out, now), second, 400.0, 400.0, 150.0)


@settings(max_examples=60, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    stops=st.one_of(st.none(), st.tuples(st.integers(-60, -1), st.integers(1, 60))),
    play=st.integers(0, 12),
    sign=st.sampled_from([1, -1]),
    looks=st.lists(st.integers(SECOND, END), min_size=1, max_size=8),
)
def test_rotor_and_load_are_where_a_simulation_has_them(
    first: int, second: int, stops: tuple[int, int] | None, play: int, sign: int, looks: list[Nanos]
) -> None:
    plan = there_and_back(first, second)
    low, high = stops or (None, None)
    build = Build(sign=sign, zero=0, low=low, high=high, play=play)
    state = MechanicalState(0, 0)
    trajectory = Trajectory(build, plan, plan.start, state)
    way = pulse_by_pulse(build, plan, state, plan.start, END)
    for now in sorted(looks):
        _, rotor, load = [step for step in way if step[0] <= now][-1]
        assert trajectory.at(now)[:2] == (rotor, load)
        # What a trace is told, in the pulses of the drive.
        _, follows, pulses = [said for said in trajectory.load_sections() if said.begin <= now][-1]
        assert (pulses + (plan.count(now) if follows else 0)) * sign == load


@settings(max_examples=60, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    play=st.integers(0, 12),
    position=st.integers(-100, 100),
    direction=st.sampled_from([1, -1]),
)
def test_it_reaches_a_position_when_a_simulation_does(first: int, second: int, play: int, position: int, direction: int) -> None:
    plan = there_and_back(first, second)
    build = Build(low=-80, high=70, play=play)
    state = MechanicalState(0, 0)
    trajectory = Trajectory(build, plan, plan.start, state)
    way = pulse_by_pulse(build, plan, state, plan.start, END)
    if (way[0][2] - position) * direction >= 0:
        return  # there already: nobody asks
    expected = next((moment for moment, _, load in way if (load - position) * direction >= 0), None)
    assert trajectory.reaches(position, plan.start, direction) == expected


def test_an_axis_that_is_stopped_slips_and_comes_back_at_once() -> None:
    """100 pulses against a stop at 60, then back by 30: 40 pulses are lost, and the way back begins at the stop."""
    out = plan_position(MotionState(0, 0, 0.0, 0.0), 100, 1000.0, 1000.0, 1000.0)
    build = Build(high=60)
    trajectory = Trajectory(build, out, 0, MechanicalState(0, 0))
    assert trajectory.at(10 * SECOND) == MechanicalState(60, 60, behind=40)
    back = plan_position(MotionState(10 * SECOND, 100, 0.0, 0.0), 70, 1000.0, 1000.0, 1000.0)
    trajectory = Trajectory(build, back, 10 * SECOND, trajectory.at(10 * SECOND))
    assert trajectory.at(20 * SECOND) == MechanicalState(30, 30, behind=40)


def test_the_division_of_an_m1486_is_seen() -> None:
    """Pulses of 64 units: the load stands on multiples of 64 only, and crosses 100 with the second."""
    profile = plan_position(MotionState(0, 0, 0.0, 0.0), 640, 10_000.0, 10_000.0, 1000.0)
    train = step_train(profile, 0, Microstepping(64, 64, 1e9))
    trajectory = Trajectory(Build(high=300), train, 0, MechanicalState(0, 0))
    assert trajectory.reaches(100, 0, 1) == train.pulse_time(128, 0)
    assert trajectory.at(10 * SECOND).load == 300


@pytest.mark.parametrize("velocity", [150.0, -150.0])
def test_at_one_speed_in_its_band_a_rotor_is_lost_once(velocity: float) -> None:
    """Without end, and slow enough to be caught: it grows in ln(25.5)/10 s from 0.05 to 1.27 full steps, which lose the field."""
    band = Resonance(low=100.0, high=200.0, growth=10.0, fading=10.0, least=0.05)
    motor = StepperMotor(((0.0, 1.0), (1000.0, 1.0)), 1e-6, friction=0.0, load=0.0, start_p=180.0, resonance=band)
    for end_s in (inf, 60.0):
        plan = Profile(0, 0, (cruise(0.0, end_s, 0.0, velocity),), 0.0 if end_s == inf else end_s * velocity)
        trajectory = Trajectory(Build(motor=motor, period_p=4), plan, 0, MechanicalState(0, 0))
        lost = trajectory.next_stall(0)
        assert lost == pytest.approx(0.324 * SECOND, rel=0.01)
        assert lost is not None
        assert trajectory.at(lost - 1).rotor == pytest.approx(0.324 * velocity, abs=2)
        assert trajectory.at(lost).rotor == trajectory.at(59 * SECOND).rotor
        assert trajectory.next_stall(lost) == (None if end_s == inf else 60 * SECOND)
