"""What a motor does on all kinds of plans, against differences of their speeds."""

from __future__ import annotations

from itertools import islice, pairwise

import pytest
from motor_rig import INERTIA, LINEAR, at_speed, motor

from steptwin.controller import SECOND, Nanos
from steptwin.motion import MotionState, Profile, plan_position
from steptwin.motion.paths import Circular
from steptwin.motion.ramps import SpeedCurve, plan_distance
from steptwin.simulation.mechanics.effort import Effort
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

LOAD, FRICTION = 0.05, 0.02
ROUND = plan_position(MotionState(0, 0, 0.0, 0.0), 50_265, 40_000.0, 40_000.0, 20_000.0)
PLANS = {
    "an arc": Circular(-8_000, 8_000, 0.0, 4.0 / 50_265).profile(ROUND, 0, 0),
    "a ramp": plan_position(MotionState(0, 0, 0.0, 0.0), 9_000, 40_000.0, 30_000.0, 16_000.0),
    "a parabola": plan_distance(0, 0, 9_000, SpeedCurve(400.0, 40_000.0, 6_000.0, 16_000.0)),
    "down": plan_distance(0, 0, -9_000, SpeedCurve(400.0, 40_000.0, 6_000.0, 16_000.0)),
}


def effort(plan: Profile, sign: int = 1) -> Effort:
    build = Build(sign=sign, period_p=64, motor=motor(load=LOAD, friction=FRICTION))
    return Effort(Trajectory(build, plan, 0, MechanicalState(0, 0)), True, None)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", PLANS)
def test_torque_and_reserve_are_those_of_the_speed(name: str, sign: int) -> None:
    plan = PLANS[name]
    it = effort(plan, sign)
    assert plan.end is not None
    for now in range(1_000, plan.end - SECOND // 500, SECOND // 317):
        speed = sign * plan.velocity(now)
        rate = sign * (plan.velocity(now + 2_000) - plan.velocity(now)) / 2e-6
        torque = INERTIA * rate + FRICTION * (1 if speed > 0 else -1) + LOAD
        assert it.speed(now) == speed
        assert it.torque(now) == pytest.approx(torque, abs=1e-4)
        assert it.reserve(now) == pytest.approx(at_speed(LINEAR, abs(speed)) - abs(torque), abs=1e-4)
    assert it.torque(plan.end) == pytest.approx(LOAD - FRICTION)


@pytest.mark.parametrize("name", PLANS)
def test_between_turning_points_they_go_one_way(name: str) -> None:
    plan = PLANS[name]
    it = effort(plan)
    turns: list[Nanos] = [0, *islice(it.turning_points(0), 100)]
    assert name == "an arc" or plan.end in turns
    for begin, end in pairwise(turns):
        for of in (it.speed, it.torque, it.reserve):
            values = [of(begin + (end - begin) * n // 50) for n in range(51)]
            near = 1e-9 * max(map(abs, values))
            ways = {(b > a + near) - (b < a - near) for a, b in pairwise(values)} - {0}
            assert len(ways) < 2, (of, begin, end)
