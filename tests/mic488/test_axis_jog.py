"""Jog by coils (MIC-18, MIC-41)."""

from __future__ import annotations

from mic488_rig import Rig, coil_pdu, encoder_rig, real_words, turn, word_pdu

from steptwin.controller import SECOND

# ---------------------------------------------------------------------- jog


def test_jog_runs_while_the_bit_is_on_and_ramps_down_with_acc(rig: Rig) -> None:
    rig.set("ACC", 500.0)
    rig.ask(word_pdu(rig.base + 17, 250))
    rig.jog(1, -1, True)
    rig.wait(1.0)
    assert (rig.status(), rig.velocity()) == (2, -250.0)  # MIC-31: jogging shows status 2
    rig.jog(1, -1, False)
    rig.wait_ns(SECOND // 2 - 1)
    assert rig.status() == 2
    rig.wait_ns(1)
    assert (rig.status(), rig.velocity()) == (1, 0.0)


def test_jog_speed_is_the_configured_velocity_until_written(rig: Rig) -> None:
    rig.jog(1, +1, True)
    rig.wait(2.0)
    assert rig.velocity() == 1000.0


def test_mic_18_of_both_jog_bits_the_last_write_wins(rig: Rig) -> None:
    rig.ask(word_pdu(rig.base + 17, 100))
    rig.jog(1, +1, True)
    rig.wait(1.0)
    rig.jog(1, -1, True)
    rig.wait(1.0)
    assert rig.velocity() == -100.0
    rig.jog(1, +1, False)  # the direction that bit started is over already
    rig.wait(1.0)
    assert rig.velocity() == -100.0
    rig.jog(1, -1, False)
    rig.wait(1.0)
    assert rig.status() == 1


def test_mic_18_clearing_a_bit_stops_no_motion_it_did_not_start(rig: Rig) -> None:
    rig.jog(1, +1, True)
    rig.set("VEL_ABS", 300.0)
    rig.jog(1, +1, False)
    rig.wait(2.0)
    assert rig.velocity() == 300.0
    rig.set("POS_ABS", 0.0)
    rig.jog(1, +1, False)
    rig.jog(1, -1, False)
    assert rig.status() == 3


def test_jog_bits_of_every_axis() -> None:
    rig = Rig()
    rig.enable(1, 2, 3, 4)
    for address in (2008, 2011, 2012, 2015):
        assert rig.ask(coil_pdu(address, True)) == coil_pdu(address, True)
    rig.wait(1.0)
    assert [rig.velocity(axis) for axis in (1, 2, 3, 4)] == [1000.0, -1000.0, 1000.0, -1000.0]


def test_mic_41_the_sign_of_the_jog_speed_is_ignored(rig: Rig) -> None:
    rig.write_words(rig.base + 17, *real_words(-250.0))
    for direction in (+1, -1):
        rig.jog(1, direction, True)
        rig.wait(2.0)
        assert rig.velocity() == direction * 250.0


def test_a_jog_bit_that_is_off_already_ends_no_motion_of_the_encoder() -> None:
    rig = encoder_rig(2)
    rig.ask(word_pdu(rig.base + 17, 0))
    rig.jog(1, +1, True)
    rig.jog(1, +1, False)
    turn(rig, 40)
    rig.wait(0.1)
    moving = rig.velocity()
    rig.jog(1, +1, False)
    rig.wait(3.0)
    assert moving > 0.0
    assert (rig.position(), rig.velocity()) == (320.0, 0.0)
