"""The encoder by itself: what turns its shaft, and how it is built."""

from __future__ import annotations

import pytest
from mic488_rig import Rig, controller

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Coupling, Encoder


class Ramp:
    """Ten pulses a second."""

    def count(self, now: Nanos) -> int:
        return 10 * now // SECOND


def test_a_shaft_that_is_blocked_and_free_again_goes_on_where_it_was() -> None:
    encoder = Encoder(400, 3200, Coupling.DRIVE)
    assert encoder.shaft(-1, 0) == -1  # whole counts, rounded down
    assert encoder.shaft(807, 0) == 100
    encoder.couple(Coupling.BLOCKED, 807, 0)
    assert encoder.shaft(5000, 0) == 100
    encoder.couple(Coupling.DRIVE, 5000, 0)
    assert encoder.shaft(5000, 0) == 100
    assert encoder.shaft(5001, 0) == 101  # 808 pulses turned it: no pulse is lost in the rounding
    encoder.turn(-7)
    assert encoder.shaft(5001, 0) == 94


def test_mechanics_turn_the_shaft_and_give_it_back_without_loss() -> None:
    encoder = Encoder(2, 1, Coupling.DRIVE)
    assert encoder.agrees
    encoder.follow(Ramp())
    assert encoder.shaft(999, 3 * SECOND) == 60
    assert not encoder.agrees
    encoder.couple(Coupling.BLOCKED, 999, 3 * SECOND)
    assert encoder.shaft(999, 9 * SECOND) == 60
    encoder.follow(None)
    assert encoder.shaft(999, 9 * SECOND) == 1998
    assert encoder.agrees


def test_a_shaft_that_mechanics_have_turned_is_coupled_to_the_drive_where_it_is() -> None:
    encoder = Encoder(2, 1, Coupling.DRIVE)
    encoder.follow(Ramp())
    encoder.couple(Coupling.DRIVE, 999, 3 * SECOND)
    assert (encoder.turned_by, encoder.shaft(999, 9 * SECOND)) == (Coupling.DRIVE, 60)
    assert encoder.shaft(1000, 9 * SECOND) == 62


def test_an_encoder_that_is_not_built_as_configured_does_not_agree() -> None:
    encoder = Encoder(400, 3200, Coupling.DRIVE)
    encoder.gear(100, 800, 1600, 0)
    assert encoder.agrees
    encoder.gear(-400, 3200, 1600, 0)
    assert not encoder.agrees
    assert encoder.shaft(1600, 0) == 200
    assert encoder.shaft(1608, 0) == 199
    assert encoder.pulses(400) == 3200.0


def test_another_gear_leaves_the_counter_where_it_is_and_only_real_ones_are_taken() -> None:
    """400 counts in 3200 pulses are configured: 800 pulses are 100 counts. Then 10 pulses are one count."""
    rig = Rig(controller(AxisConfig()))
    rig.enable(1)
    rig.set("POS_ABS", 800.0)
    rig.wait(10)
    rig.device.gear_encoder(1, 1, 10, rig.now)
    assert rig.get("ENC_IMP") == 100
    rig.set("POS_ABS", 700.0)
    rig.wait(10)
    assert rig.get("ENC_IMP") == 90
    for counts, pulses in ((0, 1), (1, 0), (1, -1)):
        text = f"^M1: {counts} encoder counts per {pulses} pulses: counts must not be 0, pulses 1 or more$"
        with pytest.raises(Misuse, match=text):
            rig.device.gear_encoder(1, counts, pulses, rig.now)
    rig.device.gear_encoder(1, -1, 1, rig.now)
    rig.set("POS_ABS", 701.0)
    rig.wait(10)
    assert rig.get("ENC_IMP") == 89


def test_a_wrong_resolution_in_the_configuration_is_a_position_error() -> None:
    """Configured 400 counts a revolution, built with 500: after 2000 pulses the encoder says 2500."""
    rig = Rig(controller(AxisConfig(pos_ctrl_mode=1, err_ctrl_mode=1)))
    rig.device.gear_encoder(1, 500, 3200, 0)
    rig.enable(1)
    rig.set("POS_ABS", 2000.0)
    rig.wait(3.0)
    assert rig.get("ENC_IMP") == 312
    assert rig.status() == 8


def test_home3_finds_the_stop_that_mechanics_hold_the_shaft_at() -> None:
    rig = Rig(controller(AxisConfig(home_mode=3)))
    rig.enable(1)
    rig.set("HOME", -800.0)
    rig.wait(1.0)

    class Stop:
        def count(self, now: Nanos) -> int:
            return -400

    rig.device.follow_shaft(1, Stop(), rig.now)
    rig.wait(0.5)
    assert rig.velocity() == 160.0
