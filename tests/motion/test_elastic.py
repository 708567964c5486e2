"""A mass on a spring, against Runge and Kutta's integration of its differential equation."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import SECOND
from steptwin.motion.elastic import SETTLED_P, DriveInterval, Response, Spring

Drive = Callable[[float], tuple[float, float]]
MS = 1_000_000


def integrated(spring: Spring, drive: Drive, begin_s: float, end_s: float, x: float, v: float, steps: int) -> tuple[float, float]:
    """x″ = ω²·(u − x) + 2·ζ·ω·(u′ − v), by the classical method of fourth order."""
    w, z = 2 * 3.141592653589793 * spring.frequency, spring.damping

    def rate(t: float, x: float, v: float) -> tuple[float, float]:
        u, du = drive(t)
        return v, w * w * (u - x) + 2 * z * w * (du - v)

    h = (end_s - begin_s) / steps
    for n in range(steps):
        t = begin_s + n * h
        a = rate(t, x, v)
        b = rate(t + h / 2, x + h / 2 * a[0], v + h / 2 * a[1])
        c = rate(t + h / 2, x + h / 2 * b[0], v + h / 2 * b[1])
        d = rate(t + h, x + h * c[0], v + h * c[1])
        x += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    return x, v


MOVE = (
    DriveInterval(0, 0.0, 0.0, 2000.0, 0.0),  # 0.1 s to 200 p/s
    DriveInterval(100 * MS, 10.0, 200.0, 0.0, 0.0),
    DriveInterval(250 * MS, 40.0, 200.0, 0.0, -20000.0),  # with jerk, to 100 p/s
    DriveInterval(350 * MS, 40.0 + 20.0 - 20000.0 * 0.1**3 / 6, 100.0, 0.0, 0.0),
    DriveInterval(400 * MS, 61.666666666666664, 0.0, 0.0, 0.0),  # stops at once
)


def moved(t: float) -> tuple[float, float]:
    """The same, written as it is said."""
    if t < 0.1:
        return 1000 * t * t, 2000 * t
    if t < 0.25:
        return 10 + 200 * (t - 0.1), 200.0
    if t < 0.35:
        return 40 + 200 * (t - 0.25) - 20000 * (t - 0.25) ** 3 / 6, 200 - 10000 * (t - 0.25) ** 2
    if t < 0.4:
        return 60 - 20 / 6 + 100 * (t - 0.35), 100.0
    return 60 - 20 / 6 + 5, 0.0


@pytest.mark.parametrize("spring", [Spring(12.0, 0.06), Spring(3.0, 0.6), Spring(40.0, 0.01)])
def test_it_goes_as_the_differential_equation_says(spring: Spring) -> None:
    response = Response(spring, MOVE, 0.0, 0.0)
    x = v = 0.0
    bounds = (0.0, 0.1, 0.25, 0.35, 0.4, 0.7)
    for begin, end in pairwise(bounds):
        # The drive has corners only at these moments; the last value before a corner is taken from the left.
        def drive(t: float, begin: float = begin, end: float = end) -> tuple[float, float]:
            return moved(min(max(t, begin), end - 1e-12))

        x, v = integrated(spring, drive, begin, end, x, v, 4000)
        found = response.at(round(end * SECOND))
        assert found[0] == pytest.approx(x, abs=1e-6)
        assert found[1] == pytest.approx(v, abs=1e-4)


def test_a_jump_of_the_drive_is_the_limit_of_a_quick_move() -> None:
    spring = Spring(10.0, 0.2)
    at_once = Response(spring, (DriveInterval(0, 0.0, 0.0, 0.0, 0.0), DriveInterval(1, 5.0, 0.0, 0.0, 0.0)), 0.0, 0.0)
    quick_s = 1e-6
    x, v = integrated(spring, lambda t: (5 * t / quick_s, 5 / quick_s), 0.0, quick_s, 0.0, 0.0, 10)
    x, v = integrated(spring, lambda t: (5.0, 0.0), quick_s, 0.05, x, v, 4000)
    assert at_once.at(50 * MS)[0] == pytest.approx(x, abs=1e-3)


def test_it_is_settled_when_its_amplitude_is_small() -> None:
    response = Response(Spring(10.0, 0.1), (DriveInterval(0, 0.0, 0.0, 0.0, 0.0),), 8.0, 0.0)
    (_, end) = response.ends()
    assert response.oscillates(end - 1)
    assert not response.oscillates(end)
    period = 100 * MS
    before = max(abs(response.at(moment)[0]) for moment in range(end - period, end, MS // 10))
    assert SETTLED_P < before < SETTLED_P * 2.0
    assert response.at(end) == (0.0, 0.0)


@pytest.mark.parametrize("spring", [Spring(12.0, 0.06), Spring(3.0, 0.6)])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("level", [-0.5, 30.5, 61.5, 62.5, 64.5, 90.5])
def test_a_crossing_is_the_first_nanosecond_beyond(spring: Spring, direction: int, level: float) -> None:
    """Against looking every 0.1 ms, and at the nanosecond before."""
    response = Response(spring, MOVE, 0.0, 0.0)
    for after in (0, 120 * MS, 398 * MS, 450 * MS):
        found = response.reaches(level, after, direction)
        seen = next((t for t in range(after + 1, 3 * SECOND, MS // 10) if (response.at(t)[0] - level) * direction >= 0), None)
        if found is None:
            assert seen is None
            continue
        assert seen is None or found <= seen
        assert found > after
        assert (response.at(found)[0] - level) * direction >= 0
        if found > after + 1:
            assert (response.at(found - 1)[0] - level) * direction < 0


@pytest.mark.parametrize("begin", [100 * MS, 250 * MS])
def test_a_crossing_is_found_where_a_part_of_the_motion_ends(begin: int) -> None:
    response = Response(Spring(12.0, 0.06), MOVE, 0.0, 0.0)
    for moment in range(begin - 2, begin + 3):
        assert response.reaches(response.at(moment)[0], 90 * MS, 1) == moment


def test_turns_are_where_the_direction_changes() -> None:
    response = Response(Spring(12.0, 0.06), MOVE, 0.0, 0.0)
    turning_points = [0, *response.turning_points(0)]
    assert turning_points == sorted(set(turning_points))
    for begin, end in zip(turning_points, [*turning_points[1:], 5 * SECOND], strict=True):
        values = [response.at(begin + (end - begin) * n // 50)[0] for n in range(51)]
        steps = [b - a for a, b in pairwise(values)]
        assert min(steps) >= -1e-9 or max(steps) <= 1e-9


def test_without_oscillation_it_turns_once_where_its_drive_does() -> None:
    """From 100 p/s to −100 p/s within 2 s; the spring is so stiff that it has settled long before."""
    drives = (DriveInterval(0, 0.0, 100.0, -100.0, 0.0), DriveInterval(2 * SECOND, 0.0, 0.0, 0.0, 0.0))
    response = Response(Spring(100.0, 0.5), drives, 0.0, 0.0)
    settled = next(begin for begin in response.ends() if begin > 0)
    assert settled < SECOND // 2
    assert [turn for turn in response.turning_points(settled) if turn < 2 * SECOND] == [SECOND]
    assert [turn for turn in response.turning_points(SECOND) if turn < 2 * SECOND] == []
    assert response.at(SECOND)[1] == 0.0


@given(
    frequency=st.floats(0.5, 200.0),
    damping=st.floats(0.01, 0.95),
    x=st.floats(-50.0, 50.0),
    v=st.floats(-1e4, 1e4),
    level=st.integers(-60, 60),
)
def test_what_moves_endlessly_is_followed_for_ever(frequency: float, damping: float, x: float, v: float, level: int) -> None:
    response = Response(Spring(frequency, damping), (DriveInterval(0, 0.0, 10.0, 0.0, 0.0),), x, v)
    far = response.reaches(1e8 - 0.5, 0, 1)
    assert far is not None
    assert far == pytest.approx((1e8 - 0.5) / 10.0 * SECOND, rel=1e-8)
    found = response.reaches(level + 0.25, 0, 1)
    assert found is not None
    assert response.at(found)[0] >= level + 0.25
    if found > 1:
        assert response.at(found - 1)[0] < level + 0.25
