"""How long motions last, against the trapezoid of school physics, and why they ended."""

from __future__ import annotations

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.drivers.mic488.motion import (
    MOVING,
    MotionCommand,
    MotionKind,
    MoveEnd,
    Reason,
    arrival,
    reason_of,
    status_text,
    travel_s,
)
from steptwin.mic488.status import AxisStatus


def trapezoid(distance: float, velocity: float, acc: float, dec: float, vmax: float) -> float:
    """Seconds from ``velocity`` (towards the target, at most ``vmax``, braking in time) over ``distance`` to rest."""
    peak = sqrt((2 * acc * dec * distance + dec * velocity * velocity) / (acc + dec))
    if peak <= vmax:
        return (peak - velocity) / acc + peak / dec
    ramps = (vmax * vmax - velocity * velocity) / (2 * acc) + vmax * vmax / (2 * dec)
    return (vmax - velocity) / acc + vmax / dec + (distance - ramps) / vmax


@given(
    distance=st.floats(0.1, 1e4),
    sign=st.sampled_from([1, -1]),
    part=st.floats(0.0, 0.95),
    acc=st.floats(1.0, 1e4),
    dec=st.floats(1.0, 1e4),
    vmax=st.floats(0.1, 1e3),
)
def test_a_move_lasts_as_its_trapezoid(distance: float, sign: int, part: float, acc: float, dec: float, vmax: float) -> None:
    velocity = part * min(vmax, sqrt(2 * dec * distance))
    found = travel_s(sign * distance, sign * velocity, acc, dec, vmax)
    assert found == pytest.approx(trapezoid(distance, velocity, acc, dec, vmax), rel=1e-3, abs=1e-4)


def test_a_move_that_has_to_turn_brakes_first() -> None:
    """From 10 u/s the wrong way: 2 s and 10 u to rest, then 20 u from there."""
    assert travel_s(-10.0, 10.0, 5.0, 5.0, 1e3) == pytest.approx(2.0 + 2.0 * sqrt(20.0 / 5.0), rel=1e-4)
    assert travel_s(0.0, 10.0, 5.0, 5.0, 1e3) == pytest.approx(2.0 + 2.0 * sqrt(10.0 / 5.0), rel=1e-4)


def test_a_tiny_move_lasts_as_its_trapezoid_too() -> None:
    """0.02 s up and 0.02 s down, at 1 u/s²."""
    assert travel_s(0.0004, 0.0, 1.0, 1.0, 1.0) == pytest.approx(0.04, rel=1e-3)


def test_no_way_takes_no_time_and_what_cannot_be_planned_has_none() -> None:
    assert travel_s(0.0, 0.0, 1.0, 1.0, 1.0) == 0.0
    for dynamics in ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0), (float("nan"), 1.0, 1.0)):
        assert travel_s(5.0, 1.0, *dynamics) is None, dynamics


@pytest.mark.parametrize(
    ("status", "motion", "reason"),
    [
        (AxisStatus.OFF, None, Reason.DISABLED),
        (AxisStatus.ON, None, Reason.REST),
        (AxisStatus.ON, (MotionKind.VELOCITY, 0.0), Reason.REST),
        (AxisStatus.ON, (MotionKind.VELOCITY, 0.5), Reason.STOPPED),
        (AxisStatus.ON, (MotionKind.POSITION, 0.0), Reason.STOPPED),
        (AxisStatus.ON, (MotionKind.DISTANCE, 1.0), Reason.STOPPED),
        (AxisStatus.REACHED, (MotionKind.VELOCITY, 0.0), Reason.TARGET),
        (AxisStatus.REACHED, None, Reason.TARGET),
        (AxisStatus.ERROR, None, Reason.POSITION_ERROR),
        (AxisStatus.LIMIT_L, None, Reason.LIMIT_L),
        (AxisStatus.LIMIT_R, (MotionKind.POSITION, 1.0), Reason.LIMIT_R),
        (77, None, Reason.STOPPED),
    ],
)
def test_why_an_axis_stands(status: int, motion: tuple[MotionKind, float] | None, reason: Reason) -> None:
    told = None if motion is None else MotionCommand(*motion, at=0, before=1)
    assert reason_of(status, told) is reason


def test_an_end_in_words() -> None:
    assert str(MoveEnd(2, Reason.TARGET, 12.5, "mm", 1.0)) == "M2: target reached at 12.5 mm"
    assert str(MoveEnd(1, Reason.OVERDUE, None, "u", 1.0, "velocity mode")) == "M1: still moving (velocity mode)"
    assert str(MoveEnd(1, Reason.DIVERTED, 0.0, "u", 1.0, "x")) == "M1: redirected by another command at 0 u (x)"
    assert {reason for reason in Reason if MoveEnd(1, reason, None, "u", 0.0).ok} == {
        Reason.TARGET,
        Reason.RESTED,
        Reason.REST,
        Reason.RELEASED,
    }
    assert str(MoveEnd(1, Reason.RESTED, 10.0, "u", 1.0, "x")) == "M1: came to rest at 10 u (x)"
    assert frozenset({AxisStatus.VELOCITY, AxisStatus.POSITION, AxisStatus.HOMING, AxisStatus.CORRECTION}) == MOVING
    assert status_text(99) == "unknown status 99"


@pytest.mark.parametrize(
    ("target", "position", "seen", "reason"),
    [
        (12.5, 12.5, (), Reason.TARGET),
        (0.1, 0.10000000149011612, (), Reason.TARGET),  # as REAL has it
        (60.0, 20.0, (), Reason.DIVERTED),  # of pulses that are as large as they can be: 20
        (60.0, 40.5, (), Reason.RESTED),
        (60.0, 40.5, (3.25,), Reason.DIVERTED),  # at most 3.25
        (-60.0, -40.5, (-38.0,), Reason.DIVERTED),  # at most 2.5
        (10.3, 10.0, (), Reason.RESTED),
        (10.3, 10.0, (9.0,), Reason.RESTED),  # of 1 imp in a unit
        (12.345, 12.3453125, (0.0015625,), Reason.RESTED),  # of 640
        (12.345, 12.346875, (0.0015625,), Reason.DIVERTED),
        (60.0, 20.0, (20.000001,), Reason.DIVERTED),  # as near as two readings of one place
        (60.0, 0.0, (), Reason.RESTED),  # nothing is known of its pulses
        (60.0, 0.0, (4.0,), Reason.DIVERTED),
    ],
)
def test_without_pulses_per_unit_only_what_no_rounding_explains_is_elsewhere(
    target: float, position: float, seen: tuple[float, ...], reason: Reason
) -> None:
    assert arrival(target, position, None, seen) is reason
