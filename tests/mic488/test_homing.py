"""Homing HOME0–HOME4 against switches that stand at known places (MIC-20, MIC-21, MIC-30)."""

from __future__ import annotations

import pytest
from mic488_rig import Rig, controller

from steptwin.controller import SECOND
from steptwin.mic488.config import AxisConfig, InputConfig
from steptwin.mic488.encoder import Coupling

ON, VELOCITY, REACHED, HOMING, LIMIT_L, LIMIT_R = 1, 2, 4, 6, 9, 10
KL, KR, INDEX = "IN1", "IN2", "IN9"
HOME0, HOME1, HOME2, HOME3, HOME4 = range(5)

KL_FROM, KL_TO = -520, -500
"""The left sensor is a cam: on while the motor stands between these counts."""
KR_FROM, KR_TO = 500, 520


def homer(mode: int, *, limit_mode: int = 0, switches: bool = True, **config: int) -> Rig:
    rig = Rig(controller(AxisConfig(home_mode=mode, limit_mode=limit_mode, in_kl=0, in_kr=1, **config)))
    if switches:
        rig.switch(1, KL_FROM, KL_TO, KL)
        rig.switch(1, KR_FROM, KR_TO, KR)
    rig.enable(1)
    return rig


def motor(rig: Rig) -> int:
    """Pulses since power-on."""
    return rig.device.axes[0].profile.count(rig.now)


def finished(rig: Rig) -> int:
    """Wait for the end of the homing; motor count at the home position."""
    rig.until(1, REACHED)
    assert rig.position() == 0.0
    assert rig.velocity() == 0.0
    home = motor(rig)
    rig.wait(3.0)
    assert motor(rig) == home
    assert [event.axis for event in rig.events("homed")] == [1]
    return home


@pytest.mark.parametrize(
    ("mode", "velocity", "home"),
    [
        (HOME0, -800.0, KL_TO),
        (HOME0, 800.0, KR_FROM),
        (HOME1, -800.0, KL_TO + 1),
        (HOME1, 800.0, KR_FROM - 1),
        (HOME2, -800.0, KL_FROM - 1),
        (HOME2, 800.0, KR_TO + 1),
    ],
)
def test_mic_30_home_position_of_each_mode_and_side(mode: int, velocity: float, home: int) -> None:
    rig = homer(mode)
    rig.set("HOME", velocity)
    assert rig.status() == HOMING
    assert finished(rig) == home


@pytest.mark.parametrize(("mode", "direction"), [(HOME1, 1), (HOME2, -1)])
def test_mic_21_the_last_leg_is_slow(mode: int, direction: int) -> None:
    rig = homer(mode)
    rig.set("ACC", 50_000.0)
    rig.set("HOME", -100.0)
    rig.wait(5.02)
    assert motor(rig) in range(KL_FROM, KL_TO + 2)
    assert (rig.status(), rig.velocity()) == (HOMING, direction * 20.0)


def test_mic_21_the_slow_speed_is_at_least_a_pulse_per_second() -> None:
    rig = homer(HOME2, switches=False)
    rig.set("HOME", -2.0)
    rig.pin(KL, 1)
    rig.wait(1.0)
    assert rig.velocity() == -1.0


def test_mic_30_at_the_sensor_the_drive_stops_without_ramp() -> None:
    rig = homer(HOME0)
    rig.set("HOME", -800.0)
    rig.until(1, REACHED)
    # 320 u and 0.8 s of acceleration, 180 u at 800 u/s
    assert rig.now == pytest.approx((0.8 + 180 / 800) * SECOND, abs=1)


def test_mic_18_clearing_a_jog_bit_stops_no_homing() -> None:
    rig = homer(HOME0)
    rig.jog(1, +1, True)
    rig.wait(0.1)
    rig.set("HOME", -100.0)
    rig.wait(0.01)
    rig.jog(1, +1, False)
    assert finished(rig) < 0


@pytest.mark.parametrize(("mode", "home"), [(HOME0, -510), (HOME1, KL_TO + 1), (HOME2, KL_FROM - 1)])
def test_homing_may_begin_on_the_sensor(mode: int, home: int) -> None:
    rig = homer(mode)
    rig.set("POS_ABS", -510.0)
    rig.until(1, REACHED)
    rig.set("HOME", -800.0)
    assert finished(rig) == home


def test_homing_may_begin_in_motion_and_turns_round() -> None:
    rig = homer(HOME1)
    rig.set("VEL_ABS", 400.0)
    rig.wait(0.5)
    rig.set("HOME", -800.0)
    assert (rig.status(), rig.velocity()) == (HOMING, 400.0)
    assert finished(rig) == KL_TO + 1


@pytest.mark.parametrize("limit_mode", [0, 3])
def test_mic_30_the_switch_homed_to_gives_no_limit_status(limit_mode: int) -> None:
    rig = homer(HOME2, limit_mode=limit_mode)
    rig.set("HOME", -800.0)
    seen = set()
    while rig.status() != REACHED:
        rig.wait(0.01)
        seen.add(rig.status())
    assert seen == {HOMING, REACHED}


def test_after_homing_onto_the_switch_it_is_a_limit_again() -> None:
    rig = homer(HOME0, limit_mode=3)
    rig.set("HOME", -800.0)
    finished(rig)
    rig.set("VEL_ABS", -10.0)
    assert rig.status() == LIMIT_L
    rig.set("POS_ABS", 100.0)
    rig.until(1, REACHED)
    assert rig.position() == 100.0


def test_the_other_switch_is_a_limit_while_homing() -> None:
    rig = homer(HOME1, limit_mode=3, switches=False)
    rig.pin(KR, 1)
    rig.set("HOME", -100.0)
    rig.wait(1.0)
    rig.pin(KL, 1)  # back off, towards KR
    assert rig.status() == LIMIT_R
    rig.pin(KR, 0)
    rig.pin(KL, 0)
    rig.wait(1.0)
    assert rig.status() == LIMIT_R


def test_mic_30_soft_limits_are_ignored_while_homing() -> None:
    rig = homer(HOME1)
    rig.set("POSLIM_L", -100.0)
    rig.set("HOME", -800.0)
    rig.wait(0.5)
    rig.set("POSLIM_L", -50.0)
    assert finished(rig) == KL_TO + 1
    assert rig.events("overrun") == []


def test_mic_30_homing_sees_the_sensor_after_polarity_and_before_the_filter() -> None:
    inputs = (InputConfig(filter=4, level=1), *(InputConfig(),) * 19)
    rig = Rig(controller(AxisConfig(in_kl=0), inputs=inputs))
    rig.switch(1, None, -500, KL, normally_closed=True)
    rig.enable(1)
    rig.set("HOME", -800.0)
    rig.until(1, REACHED)
    assert motor(rig) == -500


def test_mic_20_without_a_sensor_the_drive_runs_until_it_is_stopped() -> None:
    rig = Rig()
    rig.enable(1)
    rig.set("HOME", 500.0)
    rig.wait(1000.0)
    assert (rig.status(), rig.velocity()) == (HOMING, 500.0)
    rig.stop()
    assert rig.status() == ON
    assert rig.position() == 500.0 * 1000.0 - 125.0


def test_mic_20_without_a_sensor_a_soft_limit_ends_it() -> None:
    rig = Rig()
    rig.enable(1)
    rig.set("POSLIM_L", -700.0)
    rig.set("HOME", -500.0)
    rig.wait(1.0)
    assert rig.status() == HOMING
    rig.set("POSLIM_L", -900.0)
    rig.until(1, LIMIT_L)
    assert rig.position() == -900.0


@pytest.mark.parametrize("mode", range(5))
def test_mic_41_a_homing_velocity_of_zero_does_nothing(mode: int) -> None:
    rig = homer(mode, switches=False)
    rig.pin(KR, 1)
    rig.set("HOME", 0.0)
    assert rig.status() == ON
    rig.set("VEL_ABS", 500.0)
    rig.wait(1.0)
    rig.set("HOME", 0.0)
    rig.wait(1.0)
    assert (rig.status(), rig.velocity()) == (VELOCITY, 500.0)


def test_a_new_command_ends_the_homing_for_good() -> None:
    rig = homer(HOME0)
    rig.set("HOME", -800.0)
    rig.wait(0.5)
    rig.set("POS_ABS", -600.0)
    rig.until(1, REACHED)
    assert rig.position() == -600.0
    assert rig.events("homed") == []


def test_homing_is_limited_to_64_khz() -> None:
    rig = Rig(controller(AxisConfig(acc=1e6, in_kl=0)))
    rig.enable(1)
    rig.set("HOME", -100_000.0)
    rig.wait(1.0)
    assert rig.velocity() == -64_000.0
    assert len(rig.events("speed-clamped")) == 1


# ---------------------------------------------------------------------- with the encoder


def test_home4_goes_back_from_the_switch_to_channel_c() -> None:
    rig = homer(HOME4, enc_offset=77)
    rig.switch(1, -450, -449, INDEX)
    rig.set("HOME", -800.0)
    rig.wait(1.225)
    assert rig.velocity() == 160.0  # MIC-21
    assert finished(rig) == -450
    assert rig.get("ENC_IMP") == 77


def test_home4_takes_channel_c_of_its_own_encoder() -> None:
    configs = [AxisConfig(home_mode=HOME4, in_kl=0)] * 4
    rig = Rig(controller(*configs))
    rig.enable(3)
    rig.set("HOME", -100.0, 3)
    rig.wait(1.0)
    rig.pin(KL, 1)
    for other in ("IN9", "IN12", "IN18"):
        rig.pin(other, 1)
        assert rig.status(3) == HOMING
    rig.pin("IN15", 1)
    assert rig.status(3) == REACHED


def test_home3_runs_to_the_mechanical_stop_and_back_to_channel_c() -> None:
    """400 counts/rev: the stop is found at a lag of 0.05 rev, 20 counts, 160 pulses, looked at every 10 ms."""
    rig = homer(HOME3, switches=False, enc_offset=-5)
    rig.set("HOME", -800.0)
    rig.wait(1.0)
    assert rig.velocity() == -800.0
    stop = motor(rig)
    rig.device.couple_encoder(1, Coupling.BLOCKED, rig.now)
    rig.wait(0.19)
    assert rig.velocity() == -800.0
    rig.wait(0.04)
    found = motor(rig)
    assert rig.status() == HOMING
    assert 160 <= stop - found <= 160 + 8 + 20
    rig.device.couple_encoder(1, Coupling.DRIVE, rig.now)
    rig.wait(0.5)
    assert rig.velocity() == 160.0
    rig.pin(INDEX, 1)
    finished(rig)
    assert rig.get("ENC_IMP") == -5


def test_home3_with_few_encoder_counts_does_not_take_rounding_for_the_stop() -> None:
    rig = homer(HOME3, switches=False, enc_resol=4)
    rig.device.couple_encoder(1, Coupling.FREE, rig.now)
    rig.set("HOME", -800.0)
    rig.device.couple_encoder(1, Coupling.DRIVE, rig.now)
    rig.wait(5.0)
    assert rig.velocity() == -800.0


def test_home3_passes_soft_limits_and_its_own_switch() -> None:
    rig = homer(HOME3, limit_mode=3)
    rig.set("POSLIM_L", -10.0)
    rig.set("HOME", -800.0)
    rig.wait(5.0)
    assert rig.status() == HOMING
    assert rig.position() < KL_FROM


def test_homing_0_to_2_leave_the_encoder_counter_alone() -> None:
    rig = homer(HOME0, enc_offset=1000)
    rig.set("HOME", -800.0)
    finished(rig)
    assert rig.get("ENC_IMP") == 1000 - 63  # 500 pulses at 400 counts per 3200 pulses, rounded down
