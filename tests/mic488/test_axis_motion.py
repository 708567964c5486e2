"""Motions of an axis: moves, velocities, replaced commands, register of the position."""

from __future__ import annotations

import pytest
from mic488_rig import Rig

from steptwin.controller import SECOND

# ---------------------------------------------------------------------- position


def test_absolute_position_runs_a_trapezoid(rig: Rig) -> None:
    """1000 u/s² to 1000 u/s: one second and 500 u for each ramp."""
    rig.set("POS_ABS", 2000.0)
    seen = []
    for _ in range(7):
        seen.append((rig.status(), rig.position(), rig.velocity()))
        rig.wait(0.5)
    assert seen == [
        (3, 0.0, 0.0), (3, 125.0, 500.0), (3, 500.0, 1000.0), (3, 1000.0, 1000.0), (3, 1500.0, 1000.0), (3, 1875.0, 500.0),
        (4, 2000.0, 0.0),
    ]  # fmt: skip


def test_short_moves_are_triangles(rig: Rig) -> None:
    rig.set("POS_ABS", -90.0)
    rig.wait(0.3)
    assert rig.position() == -45.0
    assert rig.velocity() == pytest.approx(-300.0)
    rig.wait_ns(3 * SECOND // 10 - 1)
    assert rig.status() == 3
    rig.wait_ns(1)
    assert (rig.status(), rig.position()) == (4, -90.0)


def test_relative_position_adds_to_the_present_position_also_in_motion(rig: Rig) -> None:
    rig.set("POS_REL", 100.0)
    rig.until(1, 4)
    rig.set("POS_REL", -250.0)
    rig.until(1, 4)
    assert rig.position() == -150.0
    rig.set("VEL_ABS", 1000.0)
    rig.wait(2.0)
    assert rig.position() == 1350.0
    rig.set("POS_REL", 1000.0)
    rig.until(1, 4)
    assert rig.position() == 2350.0


def test_a_move_to_where_the_axis_is_ends_at_once(rig: Rig) -> None:
    rig.set("POS_ABS", 0.0)
    assert rig.status() == 4
    rig.set("POS_REL", 0.0)
    assert rig.status() == 4


def test_mic_29_acc_up_and_dec_down_in_position_mode_acc_both_ways_in_velocity_mode(rig: Rig) -> None:
    rig.set("ACC", 500.0)
    rig.set("DEC", 2000.0)
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    assert rig.velocity() == 500.0
    rig.wait(1.0)
    assert (rig.position(), rig.velocity()) == (1000.0, 1000.0)
    rig.wait(0.75)  # 750 u of cruise, then 250 u of braking in 0.5 s
    assert (rig.position(), rig.velocity()) == (1750.0, 1000.0)
    rig.wait(0.25)
    assert rig.velocity() == 500.0
    rig.wait(0.25)
    assert rig.status() == 4
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    assert rig.velocity() == 500.0
    rig.wait(1.0)
    rig.set("VEL_ABS", 0.0)
    rig.wait(1.0)
    assert rig.velocity() == 500.0
    rig.wait(1.0)
    assert rig.status() == 1


def test_vmax_and_ramps_count_from_the_next_command(rig: Rig) -> None:
    rig.set("POS_ABS", 5000.0)
    rig.wait(2.0)
    rig.set("VMAX", 400.0)
    rig.wait(0.5)
    assert rig.velocity() == 1000.0
    rig.set("POS_ABS", 5000.0)
    rig.wait(0.6)
    assert rig.velocity() == 400.0


def test_vmax_does_not_limit_velocity_mode(rig: Rig) -> None:
    rig.set("VEL_ABS", 3000.0)
    rig.wait(3.0)
    assert rig.velocity() == 3000.0


def test_ramps_slower_than_can_be_planned_are_kept_as_written_and_count_right(rig: Rig) -> None:
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    for key in ("ACC", "DEC"):
        rig.set(key, 1e-30)
        assert rig.get(key) == pytest.approx(1e-30)
    rig.set("POS_ABS", 0.0)
    for seconds in range(1, 5):
        rig.wait(1.0)
        assert rig.position() == 500.0 + 1000.0 * seconds - 1  # not yet slower by a pulse in all
    assert rig.velocity() == pytest.approx(1000.0 - 0.01 * 4)


# ---------------------------------------------------------------------- velocity


def test_absolute_velocity_ramps_and_reverses_through_zero(rig: Rig) -> None:
    rig.set("VEL_ABS", 800.0)
    rig.wait(0.4)
    assert (rig.status(), rig.velocity()) == (2, 400.0)
    rig.wait(1.0)
    assert rig.velocity() == 800.0
    rig.set("VEL_ABS", -800.0)
    rig.wait(0.8)
    assert rig.velocity() == pytest.approx(0.0, abs=1e-4)
    rig.wait(1.0)
    assert (rig.status(), rig.velocity()) == (2, -800.0)
    assert rig.position() == 320.0 + 480.0 + 320.0 - 320.0 - 160.0


def test_relative_velocity_adds_to_the_present_velocity_not_to_the_one_asked_for(rig: Rig) -> None:
    rig.set("VEL_ABS", 800.0)
    rig.wait(0.4)
    rig.set("VEL_REL", 100.0)
    rig.wait(1.0)
    assert rig.velocity() == 500.0
    rig.set("VEL_REL", -600.0)
    rig.wait(2.0)
    assert rig.velocity() == -100.0


def test_mic_11_velocity_ramped_to_zero_ends_with_status_1(rig: Rig) -> None:
    rig.set("VEL_ABS", 500.0)
    rig.wait(1.0)
    rig.set("VEL_REL", -500.0)
    assert rig.status() == 2
    rig.wait_ns(SECOND // 2 - 1)
    assert rig.status() == 2
    rig.wait_ns(1)
    assert rig.status() == 1
    rig.set("VEL_ABS", 0.0)
    assert rig.status() == 1


# ---------------------------------------------------------------------- replacing commands in flight


def test_a_farther_target_in_flight_keeps_the_velocity(rig: Rig) -> None:
    rig.set("POS_ABS", 2000.0)
    rig.wait(2.25)
    assert rig.velocity() == 750.0
    rig.set("POS_ABS", 4000.0)
    assert rig.velocity() == 750.0
    assert rig.status() == 3
    rig.wait(0.25)
    assert rig.velocity() == 1000.0
    rig.until(1, 4)
    assert rig.position() == 4000.0


def test_a_target_behind_reverses_through_zero(rig: Rig) -> None:
    rig.set("POS_ABS", 5000.0)
    rig.wait(2.0)
    assert rig.position() == 1500.0
    rig.set("POS_ABS", 0.0)
    rig.wait(1.0)
    assert (rig.position(), rig.velocity()) == (2000.0, 0.0)
    rig.until(1, 4)
    assert rig.position() == 0.0
    assert rig.now == (2 + 1 + 3) * SECOND


def test_a_target_too_near_to_brake_for_is_passed_and_met_from_behind(rig: Rig) -> None:
    rig.set("POS_ABS", 5000.0)
    rig.wait(2.0)
    rig.set("POS_ABS", 1600.0)
    rig.wait(1.0)
    assert rig.position() == 2000.0
    rig.until(1, 4)
    assert rig.position() == 1600.0


def test_a_move_over_no_distance_is_over_with_its_command(rig: Rig) -> None:
    rig.set("POS_REL", 0.0)
    axis = rig.device.axes[0]
    assert (axis.status, rig.device.deadline()) == (4, None)


def test_after_a_move_the_axis_stands_with_a_profile_of_its_own(rig: Rig) -> None:
    """What recordings show as one piece."""
    rig.set("POS_REL", 250.0)
    revision = rig.device.axes[0].revision
    rig.until(1, 4)
    axis = rig.device.axes[0]
    assert (axis.profile.start, axis.profile.segments, axis.revision) == (SECOND, (), revision + 1)


def test_velocity_and_position_commands_replace_each_other(rig: Rig) -> None:
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.5)
    rig.set("POS_ABS", 3000.0)
    assert (rig.status(), rig.velocity()) == (3, 1000.0)
    rig.wait(1.0)
    rig.set("VEL_ABS", 600.0)
    assert (rig.status(), rig.velocity()) == (2, 1000.0)
    rig.wait(0.4)
    assert rig.velocity() == 600.0


def test_a_velocity_above_vmax_slows_down_to_it(rig: Rig) -> None:
    rig.set("VEL_ABS", 3000.0)
    rig.wait(3.0)
    rig.set("POS_ABS", 100_000.0)
    rig.wait(2.0)
    assert rig.velocity() == 1000.0
