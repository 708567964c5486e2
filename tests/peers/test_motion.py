"""The main job: a Modbus master that nobody here wrote drives a served MIC488 in real time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest

pytestmark = pytest.mark.peers

ON, VELOCITY, POSITION, REACHED, HOMING, LIMIT_L, LIMIT_R = 1, 2, 3, 4, 6, 9, 10
ONE_PULSE = 0.01
"""mm"""


def assert_smooth(samples: Sequence[Any], acc: float, vmax: float) -> None:
    """No step in position or velocity that the axis could not have made in the time between two samples."""
    for one, two in pairwise(samples):
        longest = two.after - one.before
        assert abs(two.position - one.position) <= vmax * longest + ONE_PULSE
        assert abs(two.velocity - one.velocity) <= acc * longest + 1e-3
        assert abs(two.velocity) <= vmax + 1e-3


def test_a_move_is_smooth_and_takes_its_time(master: Any) -> None:
    master.enable(1)
    master.dynamics(1, acc=800.0, dec=800.0, vmax=200.0)
    asked = time.monotonic()
    master.move(1, 200.0)
    samples = master.follow(1, POSITION)
    assert_smooth(samples, acc=800.0, vmax=200.0)
    assert all(two.position >= one.position for one, two in pairwise(samples))
    assert len({s.position for s in samples}) > 5
    assert max(s.velocity for s in samples) == pytest.approx(200.0)
    # 0.25 s up, 0.25 s down and 150 mm between.
    assert samples[-1].after - asked >= 0.25 + 0.25 + 150.0 / 200.0
    last = samples[-1]
    assert (last.status, last.position, last.velocity) == (REACHED, 200.0, 0.0)


def test_a_new_target_on_the_way_turns_the_axis_without_a_jump(master: Any) -> None:
    master.enable(1)
    master.dynamics(1, acc=1000.0, dec=1000.0, vmax=100.0)
    master.move(1, 200.0)
    there = [master.sample(1)]
    while there[-1].position < 100.0:
        there.append(master.sample(1))
    # So long a way back that even a client that seldom runs sees the axis on it.
    master.move(1, -5.0)
    back = master.follow(1, POSITION)
    assert_smooth(there + back, acc=1000.0, vmax=100.0)
    assert min(s.velocity for s in back) < -50.0
    assert (back[-1].status, back[-1].position) == (REACHED, -5.0)


def test_jogging_goes_on_while_the_bit_is_on_and_ramps_down_after(master: Any) -> None:
    master.enable(2)
    master.dynamics(2, acc=500.0, dec=500.0, vmax=100.0)
    master.reals(10017, 50.0)
    master.jog(2, +1, True)
    faster = [master.sample(2)]
    while faster[-1].velocity < 50.0:
        assert faster[-1].status == VELOCITY
        faster.append(master.sample(2))
    master.jog(2, +1, False)
    slower = master.follow(2, VELOCITY)
    assert_smooth(faster + slower, acc=500.0, vmax=50.0)
    assert (slower[-1].status, slower[-1].velocity) == (ON, 0.0)
    master.jog(2, -1, True)
    assert master.follow(2, ON)[-1].status == VELOCITY
    master.jog(2, -1, False)
    assert master.follow(2, VELOCITY)[-1].status == ON


def test_homing_finds_the_switch_and_sets_zero(master: Any) -> None:
    master.enable(1)
    master.dynamics(1, acc=2000.0, dec=2000.0, vmax=100.0)
    master.home(1, -100.0)
    samples = master.follow(1, HOMING)
    assert_smooth([s for s in samples if s.velocity < 0.0], acc=2000.0, vmax=100.0)
    assert (samples[-1].status, samples[-1].position) == (REACHED, 0.0)
    # HOME1: just off the switch, so that it stops the axis at the first pulse back.
    master.move(1, -0.5)
    assert master.follow(1, POSITION)[-1][2:] == (pytest.approx(-ONE_PULSE), 0.0, LIMIT_L)
    # The other switch is 260 mm away.
    master.dynamics(1, acc=2000.0, dec=2000.0, vmax=400.0)
    master.move(1, 270.0)
    assert master.follow(1, POSITION)[-1][2:] == (pytest.approx(260.0 - ONE_PULSE), 0.0, LIMIT_R)


def test_three_axes_start_together_on_a_trigger(master: Any) -> None:
    master.word(10004, 1)
    for axis, target in ((1, 100.0), (2, 150.0), (3, 200.0)):
        master.enable(axis)
        master.dynamics(axis, acc=1000.0, dec=1000.0, vmax=100.0)
        master.move(axis, target)
    assert [master.sample(axis).position for axis in (1, 2, 3)] == [0.0, 0.0, 0.0]
    master.word(10007, 7)
    assert master.words(10010, 3) == [POSITION] * 3
    first = master.words(10020, 6)
    assert first[:2] == first[2:4] == first[4:6]  # M1_POS_ACT to M3_POS_ACT: the same ramp
    assert [master.follow(axis, POSITION)[-1][2:] for axis in (1, 2, 3)] == [
        (100.0, 0.0, REACHED),
        (150.0, 0.0, REACHED),
        (200.0, 0.0, REACHED),
    ]


def test_a_limit_switch_stops_and_lets_go_the_other_way(master: Any) -> None:
    master.enable(4)
    master.dynamics(4, acc=2000.0, dec=2000.0, vmax=640.0)
    master.run(4, 640.0)
    samples = master.follow(4, VELOCITY)
    assert (samples[-1].status, samples[-1].position, samples[-1].velocity) == (LIMIT_R, 250.0, 0.0)
    master.move(4, 260.0)
    assert master.sample(4)[2:] == (250.0, 0.0, LIMIT_R)
    master.move(4, 240.0)
    assert master.follow(4, POSITION)[-1][2:] == (240.0, 0.0, REACHED)


def test_stop_needs_no_ramp(master: Any) -> None:
    master.enable(3)
    master.run(3, 25.0)
    while master.sample(3).velocity < 10.0:
        pass
    master.stop(3)
    one, two = master.sample(3), master.sample(3)
    assert (one.status, one.velocity) == (ON, 0.0)
    assert one.position == two.position > 0.0
