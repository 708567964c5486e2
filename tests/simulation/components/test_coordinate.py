"""A coordinate of two axes, here of 1 pulse per unit: when it turns, by hand. `test_tool.py` compares it with trapezoids."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.motion import MotionState, Profile, at_rest, plan_velocity
from steptwin.simulation.components.coordinate import GRID_PER_UNIT, Coordinate, Pulled
from steptwin.simulation.mechanics.coasting import CoastingRotor
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

RAMP = plan_velocity(MotionState(0, 0, 0.0, 0.0), 100.0, 100.0, 100.0)
"""At 100 pulses/s after 1 s, for ever."""
CRUISE = plan_velocity(MotionState(0, 0, 0.0, 120.0), 120.0, 100.0, 100.0)
FALL = CoastingRotor(inertia=0.001, load=0.1, friction=0.0, low=None, high=None).profile(0, 0, 0.0, 0.0)
"""With 100 pulses/s², for ever."""


def axis(plan: Profile, coasting: Profile | None = None) -> Any:
    trajectory = Trajectory(Build(), plan, 0, MechanicalState(0, 0), coasting=coasting)
    return SimpleNamespace(scale=SimpleNamespace(pulses_per_unit=1), mechanism=SimpleNamespace(trajectory=lambda now: trajectory))


def coordinate(one: Any, other: Any) -> Coordinate:
    return Coordinate((one, other), (1.0, 1.0), (Pulled(), Pulled()))


@pytest.mark.parametrize(("before", "turning_points"), [(1, [0]), (2, [-1, 0]), (3, [-1, 0]), (SECOND, [-1, 0])])
def test_it_may_turn_where_the_motion_of_an_axis_changes_and_just_before(before: int, turning_points: list[int]) -> None:
    """In the moments after the one that is asked for."""
    its = coordinate(axis(RAMP), axis(at_rest(0, 0)))
    assert [turn - SECOND for turn in its.turning_points(SECOND - before)] == turning_points
    assert list(its.turning_points(SECOND)) == []


def test_it_turns_also_where_no_motion_changes_any_more() -> None:
    """120 - 100 t = 0; its place then is 120 · 1.2 - 50 · 1.2² = 72."""
    its = coordinate(axis(CRUISE), axis(at_rest(0, 0), FALL))
    (turn,) = its.turning_points(0)
    assert abs(turn - 1_200_000_000) <= 1
    assert its.grid_position(turn) == 72 * GRID_PER_UNIT
    assert its.reaches(72 * GRID_PER_UNIT + 1, 0, 1) is None
    found = its.reaches(64 * GRID_PER_UNIT, 0, 1), its.reaches(64 * GRID_PER_UNIT, turn, -1)
    assert found == (pytest.approx(0.8 * SECOND, abs=20), pytest.approx(1.6 * SECOND, abs=20))
