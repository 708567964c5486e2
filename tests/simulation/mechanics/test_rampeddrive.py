"""Belts with ramps: where they are and when they come to a place, against an exact integral and a walk by nanoseconds."""

from __future__ import annotations

from fractions import Fraction
from math import floor

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.simulation.mechanics.belt import ConstantDrive
from steptwin.simulation.mechanics.rampeddrive import RampedDrive

SECOND = 10**9
MM = 10**9
"""Steps of the grid."""


def test_from_rest_to_speed_and_back() -> None:
    """200 mm/s in 0.5 s, back in 0.25 s: 50 mm and 25 mm."""
    drive = RampedDrive(Fraction(200), SECOND // 2, SECOND // 4, 0)
    drive.run(True, SECOND)
    places = [drive.grid_position(SECOND + n * SECOND // 4) for n in range(5)]
    assert places == [0, 12_500_000_000, 50 * MM, 100 * MM, 150 * MM]
    assert drive.reaches(12_500_000_000, SECOND, 1) == 1_250_000_000
    assert drive.reaches(100 * MM, SECOND, 1) == 1_750_000_000
    drive.run(False, 2 * SECOND)
    assert drive.grid_position(2 * SECOND + SECOND // 8) == 150 * MM + 18_750_000_000
    assert [drive.grid_position(2 * SECOND + n * SECOND // 4) for n in (1, 2, 99)] == [175 * MM] * 3
    assert drive.reaches(175 * MM, 2 * SECOND, 1) == 2_250_000_000
    assert drive.reaches(175 * MM + 1, 2 * SECOND, 1) is None
    assert drive.reaches(0, 2 * SECOND, -1) is None


def test_a_change_on_a_ramp_goes_on_from_its_speed() -> None:
    """Off at half of 200 mm/s: half of the ramp down; on again at a quarter."""
    drive = RampedDrive(Fraction(200), SECOND // 2, SECOND, 0)
    drive.run(True, 0)
    drive.run(False, SECOND // 4)
    assert drive.grid_position(SECOND // 4) == 12_500_000_000
    assert drive.grid_position(SECOND) == 12_500_000_000 + 25 * MM
    drive.run(True, SECOND // 2)
    assert drive.grid_position(SECOND // 2) == 12_500_000_000 + 18_750_000_000
    assert drive.grid_position(SECOND // 2 + 375_000_000) == 31_250_000_000 + Fraction(125 * 375, 1000) * MM


@given(speed=st.fractions(Fraction(1, 7), 900, max_denominator=9), moments=st.lists(st.integers(0, 40), max_size=6))
def test_without_ramps_it_is_constant(speed: Fraction, moments: list[int]) -> None:
    one, other = RampedDrive(speed, 0, 0, 5), ConstantDrive(speed, 5)
    for n, moment in enumerate(sorted(moments)):
        for drive in (one, other):
            drive.run(n % 2 == 0, 5 + moment)
    for now in range(5 + max(moments, default=0), 80):
        assert one.grid_position(now) == other.grid_position(now)
        for place in range(one.grid_position(now), one.grid_position(now) + 5):
            assert one.reaches(place, now, 1) == other.reaches(place, now, 1)


def integral(level: Fraction, runs: bool, ramp: int, t: int) -> tuple[Fraction, Fraction]:
    """(share of the speed, way in ns at whole speed) after ``t`` ns."""
    goal = Fraction(1 if runs else 0)
    if ramp == 0 or level == goal:
        return goal, goal * t
    length = abs(goal - level) * ramp
    if t >= length:
        return goal, (level + goal) / 2 * length + goal * (t - length)
    reached = level + (goal - level) * Fraction(t) / length
    return reached, (level + reached) / 2 * t


@given(
    speed=st.fractions(Fraction(1, 3), 30, max_denominator=7),
    up=st.integers(0, 25),
    down=st.integers(0, 25),
    waits=st.lists(st.integers(0, 30), min_size=1, max_size=5),
)
@example(speed=Fraction(5, 2), up=7, down=5, waits=[3, 2, 9])
@example(speed=Fraction(1), up=10, down=0, waits=[10, 1])
def test_places_are_the_whole_steps_of_the_integral(speed: Fraction, up: int, down: int, waits: list[int]) -> None:
    drive = RampedDrive(speed, up, down, 0)
    now, base, level, runs = 0, 0, Fraction(0), False
    for wait in waits:
        runs = not runs
        drive.run(runs, now)
        for t in range(wait + 1):
            _, way = integral(level, runs, up if runs else down, t)
            assert drive.grid_position(now + t) == base + floor(way * speed)
        assert drive.stride >= speed
        level, way = integral(level, runs, up if runs else down, wait)
        base, now = base + floor(way * speed), now + wait
    last = [drive.grid_position(now + t) for t in range(60)]
    for place in range(last[0] - 1, last[-1] + 1):
        first = next((now + t for t in range(60) if last[t] >= place), None)
        for after in (now, now + 3):
            expected = None if place <= drive.grid_position(after) else first
            assert drive.reaches(place, after, 1) == expected
    if not runs:
        assert drive.reaches(drive.grid_position(now + 60) + 1, now, 1) is None


@pytest.mark.parametrize("runs", [True, False])
def test_its_state_is_plain(runs: bool) -> None:
    drive = RampedDrive(Fraction(100), 300, 400, 0)
    drive.run(True, 10)
    drive.run(runs, 110)
    other = RampedDrive(Fraction(100), 300, 400, 0)
    other.set_state(drive.copy_state())
    assert [other.grid_position(n) for n in (110, 200, 999)] == [drive.grid_position(n) for n in (110, 200, 999)]
    assert other.version() == drive.version()


@pytest.mark.parametrize(("up", "down"), [(70, 40), (0, 40), (70, 0), (13, 13)])
@given(st.lists(st.integers(1, 150), min_size=1, max_size=6))
def test_beyond_a_ramp_it_moves_straight_on(up: int, down: int, waits: list[int]) -> None:
    drive, now = RampedDrive(Fraction(7, 3), up, down, 0), 0
    for wait in waits:
        drive.run(not drive.runs, now)
        straight = drive.straight_from()
        assert straight >= now
        assert all(drive.line(moment) is None for moment in range(now, straight))
        line = drive.line(straight)
        assert line is not None
        for moment in range(straight, straight + 30):
            assert floor(line[0] + line[1] * moment) == drive.grid_position(moment)
        now += wait


def test_drives_that_are_switched_alike_keep_their_lead() -> None:
    one, other = (RampedDrive(Fraction(7, 3), 70, 40, 0) for _ in range(2))
    one.run(True, 10)
    one.run(False, 40)
    assert one.lead_over(other) is None
    for drive, runs, now in ((one, True, 200), (other, True, 200), (one, False, 250), (other, False, 250)):
        drive.run(runs, now)
    lead = one.lead_over(other)
    assert lead is not None
    assert {one.grid_position(now) - other.grid_position(now) for now in range(250, 400)} == {lead}
    assert one.lead_over(RampedDrive(Fraction(7, 3), 70, 41, 0)) is None
    assert one.lead_over(ConstantDrive(Fraction(7, 3), 0)) is None
