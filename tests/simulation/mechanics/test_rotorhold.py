"""When a field holds its rotor, and where the rotor goes when it does not: each condition on both sides of its limit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import pytest

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.motion import MotionState, Profile, at_rest, plan_position, plan_stop
from steptwin.motion.profile import cruise
from steptwin.simulation.mechanics.motor import NO_BURDEN, Burden, StepperMotor
from steptwin.simulation.mechanics.rotorhold import MOVES_WITH_LITTLE_CURRENT, MOVES_WITHOUT_CURRENT, RUNS_ON, RotorHold
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

MOTOR = StepperMotor(((0.0, 1.0), (1e6, 1.0)), 1 / 32, 0.25, 0.0, 100.0, hold=0.5, hold_ns=300 * MILLISECOND)
"""Holds 1 N·m and 0.5 N·m with reduced current, besides 0.25 N·m of friction."""
FREE = Build(period_p=64, motor=MOTOR, coasts_unpowered=True)


@dataclass
class Field:
    """A drive."""

    plan: Profile
    is_energised: bool = True
    revision: int = 0
    offset_p: int = 0


def standing(build: Build, place: int = 0, away: int = 0) -> Trajectory:
    """At rest, the load ``away`` from the rotor."""
    count = (place - build.zero) * build.sign
    return Trajectory(build, at_rest(0, count), 0, MechanicalState(place, place + away))


def moving(build: Build, velocity: float) -> Trajectory:
    """A coasting rotor at a constant speed."""
    coasting = Profile(0, 0, (cruise(0.0, inf, 0.0, velocity),), 0.0)
    return Trajectory(build, at_rest(0, 0), 0, MechanicalState(0, 0), coasting=coasting)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("speed", "before", "after", "settles"),
    [
        # It is driven on by `before`, back by `after`: 0.75 N·m and 0.25 N·m of friction brake 1/64 v² on a full step of 16.
        (31.9, -0.5, 0.75, True),
        (32.0, -0.5, 0.75, False),
        (0.5, -0.5, 0.75, True),
        (0.0, -0.5, 0.75, False),
        (31.9, -0.25, 0.75, False),
        (31.9, -0.26, 0.75, True),
        (16.0, -0.5, 0.25, False),
        (16.0, -0.5, 0.26, True),
        (16.0, -0.5, -0.75, False),
        (16.0, 0.5, 0.75, False),
    ],
)
def test_it_comes_to_rest_between_two_loads_that_drive_it_there(
    sign: int, speed: float, before: float, after: float, settles: bool
) -> None:
    for direction in (1, -1):
        build = replace(FREE, sign=sign)
        hold = RotorHold(build, MOTOR, 0)
        one, other = (Burden(0.0, 0.0, load * direction * sign) for load in (before, after))
        assert hold.settles(moving(build, direction * speed), one, other, SECOND) is settles
    assert not RotorHold(FREE, MOTOR, 0).settles(standing(FREE), Burden(0.0, 0.0, -0.5), Burden(0.0, 0.0, 0.75), SECOND)


def test_what_swings_has_the_mass_after_the_change() -> None:
    hold = RotorHold(FREE, MOTOR, 0)
    for inertia, settles in ((0.0, True), (1 / 32, False)):
        assert hold.settles(moving(FREE, 31.9), Burden(9.0, 0.0, -0.5), Burden(inertia, 0.0, 0.75), 0) is settles


def moved(hold: RotorHold, field: Field, before: Trajectory, now: Nanos, load: float = 0.0, **more: bool) -> Profile | None:
    """The motion of a rotor that the field does not hold from ``now`` on."""
    given = {"is_new": False, "stands": False, **more}
    return hold.motion(field, before, before.at(now), now, burden=Burden(0.0, 0.0, load), **given)[0]


@pytest.mark.parametrize(
    ("load", "due_s"),
    [
        (0.75, None),  # 0.5 N·m and friction
        (0.76, 3.3),
        (-0.76, 3.3),
        (1.25, 3.3),
        (1.26, 3.0),
        (-1.26, 3.0),
    ],
)
def test_a_field_that_comes_to_rest_holds_what_it_can(load: float, due_s: float | None) -> None:
    """The field goes until 3 s; the current is reduced 0.3 s later."""
    plan = plan_position(MotionState(0, 0, 0.0, 0.0), 250, 10.0, 10.0, 100.0)
    assert plan.end is not None
    end = plan.end
    hold = RotorHold(FREE, MOTOR, 0)
    before = Trajectory(FREE, plan, 0, MechanicalState(0, 0))
    assert moved(hold, Field(plan), before, SECOND, load) is None
    assert not hold.is_coasting
    due = None if due_s is None else end + (0 if due_s == 3.0 else 300 * MILLISECOND)
    assert hold.due == due
    if due is None:
        return
    assert not hold.is_switched(Field(plan), due - 1)
    assert hold.is_switched(Field(plan), due)
    found = moved(hold, Field(plan), before, due, load)
    assert hold.is_coasting
    assert hold.why == MOVES_WITH_LITTLE_CURRENT
    assert found is not None
    assert (found.start, found.base, found.velocity(due)) == (due, 250, 0.0)
    assert found.velocity(due + SECOND) == pytest.approx(-(abs(load) - 0.25) * 32 * (1 if load > 0 else -1))


def test_current_is_reduced_again_after_it_was_switched_on() -> None:
    hold = RotorHold(FREE, MOTOR, 0)
    field = Field(at_rest(0, 0))
    here = standing(FREE)
    assert moved(hold, field, here, 0, 0.76) is None
    assert hold.due == 300 * MILLISECOND
    field.is_energised = False
    assert hold.is_switched(field, 1)
    found = moved(hold, field, here, SECOND, 0.0)
    assert found is not None
    assert (found.segments, hold.is_coasting, hold.has_current, hold.why) == ((), True, False, MOVES_WITHOUT_CURRENT)
    field.is_energised = True
    assert moved(hold, field, here, 2 * SECOND, 0.76) is None
    assert not hold.is_coasting
    assert hold.due == 2 * SECOND + 300 * MILLISECOND
    # Not again with each change of the load.
    assert moved(hold, field, here, 2 * SECOND + 1, 0.77) is None
    assert hold.due == 2 * SECOND + 300 * MILLISECOND


@pytest.mark.parametrize("sign", [1, -1])
def test_what_stands_is_where_it_was(sign: int) -> None:
    build = replace(FREE, sign=sign, zero=100)
    field = Field(at_rest(0, 0), is_energised=False)
    before = standing(build, 40)
    found = moved(RotorHold(build, MOTOR, 0), field, before, SECOND, 5.0, stands=True)
    assert found is not None
    assert (found.start, found.base, found.segments) == (SECOND, -60 * sign, ())
    falls = moved(RotorHold(build, MOTOR, 0), field, before, SECOND, 5.0)
    assert falls is not None
    assert (falls.base, falls.velocity(2 * SECOND)) == (-60 * sign, pytest.approx(-4.75 * 32 * sign))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("place", "away", "load", "ends"),
    [
        (87, 0, 0.0, 84),  # full steps are at 100 and every 16 from there
        (93, 0, 0.0, 100),
        (93, 0, 0.2, 100),
        (93, 0, 0.25, 93),  # no more than the detent holds besides friction
        (109, 0, 0.0, 114),  # a stop is at 114
        (109, 3, 0.0, 111),  # for the load
        (75, 0, 0.0, 72),
        (74, 1, 0.0, 71),
    ],
)
def test_without_current_a_rotor_goes_to_the_full_step(sign: int, place: int, away: int, load: float, ends: int) -> None:
    motor = replace(MOTOR, detent=0.5)
    build = replace(FREE, sign=sign, zero=100, motor=motor, low=72, high=114)
    hold = RotorHold(build, motor, 0)
    before = standing(build, place, away)
    field = Field(at_rest(0, 0), is_energised=False)
    found, state = hold.motion(
        field, before, before.at(SECOND), SECOND, is_new=False, burden=Burden(0.0, 0.0, load), stands=False
    )
    assert state == MechanicalState(ends, ends + away)
    assert found is not None
    assert found.base == (ends - 100) * sign
    field.is_energised = True
    held = RotorHold(build, motor, 0)
    assert held.motion(field, before, before.at(1), 1, is_new=False, burden=NO_BURDEN, stands=False)[1].rotor == place


OVERRUNS = replace(MOTOR, overruns=True)
HELD = Build(period_p=64, motor=OVERRUNS)


@pytest.mark.parametrize("speed", [4000.0, -4000.0])
def test_a_rotor_runs_on_after_a_stop_without_ramp(speed: float) -> None:
    running = Profile(0, 0, (cruise(0.0, inf, 0.0, speed),), 0.0)
    hold, before = RotorHold(HELD, OVERRUNS, 0), Trajectory(HELD, running, 0, MechanicalState(0, 0))
    assert moved(hold, Field(running), before, 1) is None
    stopped = Field(at_rest(SECOND, round(speed)))
    found = moved(hold, stopped, before, SECOND, is_new=True)
    assert found is not None
    assert (found.start, found.base) == (SECOND, round(speed))
    assert found.end is not None
    assert (hold.is_coasting, hold.due, hold.why) == (True, found.end, RUNS_ON)
    assert (found.count(found.end) - found.base) % 64 == 0
    # It runs on whatever is looked at, until something else acts on it.
    after = Trajectory(HELD, stopped.plan, SECOND, MechanicalState(round(speed), round(speed)), coasting=found)
    for now in (SECOND + 1, found.end - 1):
        assert moved(hold, stopped, after, now) is found
        assert hold.due == found.end
    assert moved(hold, stopped, after, found.end) is None
    assert (hold.is_coasting, hold.due, hold.why) == (False, None, MOVES_WITH_LITTLE_CURRENT)


@pytest.mark.parametrize(("is_new", "stands", "is_on"), [(True, False, True), (False, True, True), (False, False, False)])
def test_what_ends_its_run(is_new: bool, stands: bool, is_on: bool) -> None:
    running = Profile(0, 0, (cruise(0.0, inf, 0.0, 4000.0),), 0.0)
    hold, before = RotorHold(HELD, OVERRUNS, 0), Trajectory(HELD, running, 0, MechanicalState(0, 0))
    stopped = Field(at_rest(SECOND, 4000))
    found = moved(hold, stopped, before, SECOND, is_new=True)
    assert found is not None
    after = Trajectory(HELD, stopped.plan, SECOND, MechanicalState(4000, 4000), coasting=found)
    stopped.is_energised = is_on
    other = moved(hold, stopped, after, SECOND + MILLISECOND, is_new=is_new, stands=stands)
    assert other is not found
    assert hold.why == (MOVES_WITH_LITTLE_CURRENT if is_on else MOVES_WITHOUT_CURRENT)


def test_what_does_not_run_on() -> None:
    running = Profile(0, 0, (cruise(0.0, inf, 0.0, 4000.0),), 0.0)
    stopped = Field(at_rest(SECOND, 4000))
    stalled = Trajectory(HELD, running, 0, MechanicalState(0, 0, stalled=True))
    assert moved(RotorHold(HELD, OVERRUNS, 0), stopped, stalled, SECOND, is_new=True) is None
    before = Trajectory(HELD, running, 0, MechanicalState(0, 0))
    assert moved(RotorHold(HELD, OVERRUNS, 0), stopped, before, SECOND, is_new=True, stands=True) is None
    slow = Profile(0, 0, (cruise(0.0, inf, 0.0, 5.0),), 0.0)
    slower = Trajectory(HELD, slow, 0, MechanicalState(0, 0))
    assert moved(RotorHold(HELD, OVERRUNS, 0), Field(at_rest(SECOND, 5)), slower, SECOND, is_new=True) is None
    braked = Field(plan_stop(MotionState.of(running, SECOND), 1000.0))
    assert moved(RotorHold(HELD, OVERRUNS, 0), braked, before, SECOND, is_new=True) is None


def test_the_end_of_a_plan_at_speed_is_due() -> None:
    """Such as that of a stop at a soft limit; a plan that ends at rest leads nowhere."""
    sudden = Profile(0, 0, (cruise(0.0, 0.5, 0.0, 4000.0),), 2000.0)
    hold, before = RotorHold(HELD, OVERRUNS, 0), Trajectory(HELD, sudden, 0, MechanicalState(0, 0))
    assert moved(hold, Field(sudden), before, MILLISECOND) is None
    assert hold.due == sudden.end == SECOND // 2
    found = moved(hold, Field(sudden), before, SECOND // 2)
    assert found is not None
    assert (found.base, hold.is_coasting) == (2000, True)
    gentle = plan_position(MotionState(0, 0, 0.0, 0.0), 250, 10.0, 10.0, 100.0)
    hold = RotorHold(HELD, OVERRUNS, 0)
    assert moved(hold, Field(gentle), Trajectory(HELD, gentle, 0, MechanicalState(0, 0)), MILLISECOND) is None
    assert hold.due is None


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("load", "away", "ends"), [(2.0, 0, -30), (-2.0, 0, 50), (2.0, 4, -34), (-2.0, 4, 46)])
def test_it_falls_until_the_load_is_at_its_stop(sign: int, load: float, away: int, ends: int) -> None:
    build = replace(FREE, sign=sign, zero=10, low=-30, high=50)
    before = standing(build, 20, away)
    found = moved(RotorHold(build, MOTOR, 0), Field(at_rest(0, 0), is_energised=False), before, SECOND, load)
    assert found is not None
    assert found.end is not None
    assert found.count(found.end) == (ends - 10) * sign


@pytest.mark.parametrize(("inertia", "friction", "rate"), [(0.0, 0.0, 24.0), (1 / 32, 0.0, 12.0), (0.0, 0.25, 16.0)])
def test_what_a_free_rotor_moves_besides_its_own(inertia: float, friction: float, rate: float) -> None:
    before, field = standing(FREE), Field(at_rest(0, 0), is_energised=False)
    burden = Burden(inertia, friction, 1.0)
    found, _ = RotorHold(FREE, MOTOR, 0).motion(field, before, before.at(0), 0, is_new=False, burden=burden, stands=False)
    assert found is not None
    assert found.velocity(SECOND) == -rate


def test_a_stop_of_the_current_moment_is_not_due_again() -> None:
    hold = RotorHold(FREE, MOTOR, 0)
    assert (hold.is_coasting, hold.has_current, hold.due) == (False, True, None)
    field, here = Field(at_rest(SECOND, 0)), standing(FREE)
    assert moved(hold, field, here, SECOND, 0.76) is None
    assert hold.due == SECOND + 300 * MILLISECOND
    stiff = RotorHold(replace(FREE, coasts_unpowered=False), MOTOR, 0)
    assert moved(stiff, field, here, SECOND, 5.0) is None
    assert (stiff.due, stiff.is_coasting) == (None, False)
    assert [build.may_coast for build in (FREE, HELD, Build(motor=MOTOR), Build())] == [True, True, False, False]
