"""Motors for tests: their torques, and motions that they follow or not."""

from __future__ import annotations

from itertools import pairwise
from math import pi

from steptwin.controller import SECOND
from steptwin.motion import MotionState, Profile, plan_position
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

PER_REV = 3200
INERTIA = 1e-4 * 2 * pi / PER_REV
"""1e-4 kg·m², in N·m per pulse/s²."""
LINEAR = ((0.0, 1.0), (32_000.0, 0.2))
"""1 N·m at standstill, 0.2 at 10 rev/s."""


def motor(
    curve: tuple[tuple[float, float], ...] = LINEAR,
    *,
    inertia: float = INERTIA,
    friction: float = 0.0,
    load: float = 0.0,
    start: float | None = None,
) -> StepperMotor:
    return StepperMotor(curve, inertia, friction, load, start)


def final(build: Build, plan: Profile) -> MechanicalState:
    return Trajectory(build, plan, plan.start, MechanicalState(0, 0)).at(1000 * SECOND)


def accelerated(rate: float, speed: float = 30_000.0) -> Profile:
    return plan_position(MotionState(0, 0, 0.0, 0.0), 200_000, rate, 1000.0, speed)


def at_speed(curve: tuple, speed: float) -> float:
    """The curve, looked up in the plainest way."""
    for (s0, t0), (s1, t1) in pairwise(curve):
        if s0 <= speed <= s1:
            return t0 + (t1 - t0) * (speed - s0) / (s1 - s0)
    return curve[0][1] if speed < 0 else -1.0
