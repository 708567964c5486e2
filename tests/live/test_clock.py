"""Virtual time follows the wall's."""

from __future__ import annotations

import math

import pytest

from steptwin.errors import Misuse
from steptwin.live.clock import Clock


class Wall:
    def __init__(self) -> None:
        self.ns = 5_000

    def __call__(self) -> int:
        return self.ns


def test_it_starts_at_zero_and_runs_with_the_wall() -> None:
    wall = Wall()
    clock = Clock(wall_ns=wall)
    assert clock.now() == 0
    wall.ns += 1_234_567_890_123
    assert clock.now() == 1_234_567_890_123


@pytest.mark.parametrize(("speed", "virtual_ns", "wait_s"), [(10.0, 2_000_000_000, 0.1), (0.1, 20_000_000, 10.0)])
def test_speed(speed: float, virtual_ns: int, wait_s: float) -> None:
    wall = Wall()
    clock = Clock(speed, wall)
    wall.ns += 200_000_000
    assert clock.now() == virtual_ns
    assert clock.wait_s(virtual_ns + 1_000_000_000) == pytest.approx(wait_s)


def test_what_is_past_is_not_waited_for() -> None:
    wall = Wall()
    clock = Clock(wall_ns=wall)
    wall.ns += 10
    assert clock.wait_s(3) == 0.0


@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_lag_takes_time_back(speed: float) -> None:
    wall = Wall()
    clock = Clock(speed, wall)
    wall.ns += 1_000_000
    before = clock.now()
    clock.lag(400_000)
    assert clock.now() == before - 400_000


@pytest.mark.parametrize("speed", [0.0, -1.0, math.inf, math.nan])
def test_impossible_speeds(speed: float) -> None:
    with pytest.raises(Misuse, match="must be finite and greater than 0"):
        Clock(speed)


def test_it_stands_where_it_is_stopped_and_goes_on_from_there() -> None:
    wall = Wall()
    clock = Clock(2.0, wall, begin=7_000)
    wall.ns += 1_000
    assert clock.now() == 9_000
    clock.stop(9_000)
    wall.ns += 1_000_000
    assert clock.now() == 9_000
    assert clock.wait_s(9_001) == math.inf
    assert clock.wait_s(9_000) == 0.0
    clock.stop(20_000)
    clock.run(10.0)
    assert clock.now() == 20_000
    wall.ns += 1_000
    assert clock.now() == 30_000
    assert clock.wait_s(1_000_030_000) == pytest.approx(0.1)
