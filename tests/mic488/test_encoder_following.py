"""An axis that follows its encoder: ENCFOLLOW (MIC-19, MIC-26)."""

from __future__ import annotations

import pytest
from mic488_rig import EN, Rig, controller, couple, encoder_rig, turn

from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Coupling

ON, VELOCITY, POSITION, REACHED, ERROR, HOMING, CORRECTION, LIMIT_R = 1, 2, 3, 4, 5, 6, 8, 10
CONTROL_OFF, ENCODER, ENCFOLLOW = range(3)
NONE, ERRMODE0, ERRMODE1, ERRMODE2 = range(4)


def follower(**config: float) -> Rig:
    return encoder_rig(ENCFOLLOW, ERRMODE0, **config)


def test_the_axis_follows_the_handwheel() -> None:
    rig = follower()
    turn(rig, 100)
    assert rig.status() == ON
    rig.wait(0.01)
    assert rig.status() == POSITION
    rig.until(1, REACHED)
    assert rig.position() == 800.0
    turn(rig, -25)
    rig.until(1, POSITION)
    rig.until(1, REACHED)
    assert rig.position() == 600.0
    assert rig.scheduler.deadline() is None


def test_following_is_planned_anew_every_10_ms_while_the_wheel_turns() -> None:
    rig = follower()
    for _ in range(100):
        turn(rig, 1)
        rig.wait(0.013)
    assert rig.velocity() > 0.0
    rig.wait(3.0)
    assert rig.position() == 800.0


def test_following_keeps_to_vmax_ramps_and_64_khz() -> None:
    rig = follower(acc=1e6, dec=1e6, vel=1e6)
    turn(rig, 100_000)
    rig.wait(2.0)
    assert rig.velocity() == 64_000.0
    slow = follower()
    turn(slow, 100_000)
    slow.wait(2.0)
    assert slow.velocity() == 1000.0


def test_following_stops_at_limits_and_comes_back() -> None:
    rig = follower()
    rig.set("POSLIM_R", 500.0)
    turn(rig, 100)
    rig.wait(5.0)
    assert (rig.status(), rig.position()) == (LIMIT_R, 500.0)
    turn(rig, -60)
    rig.wait(5.0)
    assert rig.position() == 320.0


def test_following_stops_at_a_switch_and_turns_back_from_there() -> None:
    rig = follower(limit_mode=2, in_kr=0)
    rig.switch(1, 500, None, "IN1")
    turn(rig, 100)
    rig.wait(5.0)
    assert (rig.status(), rig.position()) == (LIMIT_R, 500.0)
    turn(rig, 10)
    rig.wait(1.0)
    assert (rig.status(), rig.position()) == (LIMIT_R, 500.0)
    turn(rig, -20)
    rig.wait(5.0)
    assert rig.position() == 340.0


def test_a_disabled_axis_does_not_follow_and_catches_up_with_nothing() -> None:
    rig = Rig(controller(AxisConfig(pos_ctrl_mode=ENCFOLLOW)))
    turn(rig, 100)
    rig.wait(1.0)
    rig.enable(1)
    rig.wait(1.0)
    assert rig.position() == 0.0
    turn(rig, 1)
    rig.wait(1.0)
    assert rig.position() == 8.0


@pytest.mark.parametrize("command", [("POS_ABS", 5000.0), ("VEL_ABS", 100.0), ("HOME", -100.0)])
def test_a_command_goes_before_the_handwheel(command: tuple[str, float]) -> None:
    rig = follower(in_kl=0)
    rig.set(*command)
    status = rig.status()
    rig.wait(0.5)
    turn(rig, 1000)
    rig.wait(0.5)
    assert rig.status() == status
    rig.stop()
    stopped = rig.position()
    rig.wait(1.0)
    assert rig.position() == stopped
    turn(rig, 10)
    rig.wait(2.0)
    assert rig.position() == stopped + 80.0


def test_writing_registers_does_not_move_a_following_axis() -> None:
    rig = follower()
    turn(rig, 10)
    rig.wait(2.0)
    rig.set("ENC_IMP", 12345)
    rig.set("POS_ACT", 7.0)
    rig.wait(1.0)
    assert rig.position() == 7.0
    turn(rig, 1)
    rig.set("POS_ACT", 0.0)
    rig.wait(1.0)
    assert rig.position() == 8.0


def test_whatever_a_wheel_asks_for_can_be_planned() -> None:
    rig = follower(mot_resol=2**31 - 1, enc_resol=1)
    for counts in (2**31 - 1, -(2**31), 2**31 - 1):
        turn(rig, counts)
        rig.wait(0.05)
    assert rig.status() == POSITION
    encoder = encoder_rig(mot_resol=2**31 - 1, enc_resol=1)
    encoder.set("POS_ABS", 100.0)
    turn(encoder, 2**31 - 1)
    encoder.wait(3.0)
    assert encoder.status() in (CORRECTION, ERROR)


def test_an_axis_that_nobody_disturbs_needs_no_control_loop() -> None:
    """An idle machine costs nothing, in any mode."""
    for mode in (CONTROL_OFF, ENCODER, ENCFOLLOW):
        rig = encoder_rig(mode)
        assert rig.scheduler.deadline() is None
        rig.set("VEL_ABS", 100.0)
        assert rig.scheduler.deadline() is None


def test_a_slip_between_two_moves_is_corrected_by_the_second() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 800.0)
    rig.until(1, REACHED)
    turn(rig, -20)
    rig.set("POS_REL", 80.0)
    rig.until(1, CORRECTION)
    rig.until(1, REACHED)
    assert rig.get("ENC_IMP") == 110


def test_what_was_turned_while_the_drive_was_off_is_no_slip() -> None:
    rig = encoder_rig(en_wired=0)
    rig.coil(EN, False)
    turn(rig, -20)
    rig.set("POS_REL", 80.0)
    rig.until(1, REACHED)
    rig.wait(1.0)
    assert (rig.status(), rig.get("ENC_IMP")) == (REACHED, -10)


def test_a_move_that_arrives_where_it_should_needs_no_control_loop() -> None:
    """Also where the encoder turns by itself, so that the motion is watched."""
    rig = encoder_rig()
    couple(rig, Coupling.FREE)
    rig.set("POS_ABS", 32.0)
    rig.until(1, REACHED)
    rig.wait_ns(1)
    assert rig.status() == REACHED
    assert rig.scheduler.deadline() is None
