"""Values in requests and responses, byte for byte; holes of the map, lenient or not; how requests are planned."""

from __future__ import annotations

import struct
from math import nan

import pytest
from mic488_rig import OFFSETS, OUT, Rig, controller, dint_words, read_pdu, real_words, word_pdu, words_pdu

from steptwin.mic488.config import AxisConfig
from steptwin.mic488.slave import PLANS_KEPT, slave

FIRMWARES = tuple(OFFSETS)
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


@pytest.fixture(params=FIRMWARES)
def any_rig(request: pytest.FixtureRequest) -> Rig:
    return Rig(firmware=request.param)


# ---------------------------------------------------------------------- values


def test_mic_6_jog_speed_takes_a_real_with_16_and_a_signed_word_with_06() -> None:
    rig = Rig(controller(AxisConfig(gear=10.0)))
    rig.use_dint()  # it stays REAL in units/s
    rig.enable(1)
    for write, units in ((words_pdu(rig.base + 17, *real_words(12.5)), 12.5), (word_pdu(rig.base + 17, 30), 30.0)):
        assert rig.exception(write) == 0
        rig.jog(1, +1, True)
        rig.wait(1.0)
        assert rig.velocity() == units * 10
    assert rig.exception(word_pdu(rig.base + 18, 1)) == ILLEGAL_ADDRESS
    assert rig.exception(words_pdu(rig.base + 17, 1)) == ILLEGAL_ADDRESS
    assert rig.exception(words_pdu(rig.base + 17, *real_words(nan))) == ILLEGAL_VALUE
    assert rig.exception(read_pdu(3, rig.base + 17, 2)) == ILLEGAL_ADDRESS


def test_mic_6_a_signed_word_is_signed() -> None:
    rig = Rig(lenient=True)
    rig.ask(word_pdu(rig.base + 17, -30))
    assert rig.read_words(rig.base + 17, 2) == list(real_words(-30.0))


def test_mic_17_data_type_changes_the_representation_only() -> None:
    rig = Rig(controller(AxisConfig(gear=12800.0), AxisConfig(gear=0.5)))
    for key, units in (("POS_ACT", 4.5), ("ACC", 3.0), ("DEC", 2.0), ("VMAX", 2.5), ("POSLIM_L", -100.0), ("POSLIM_R", 100.0)):
        rig.set(key, units)
    rig.set("VMAX", 3000.0, 2)
    rig.use_dint()
    shown = {key: rig.get(key) for key in ("POS_ACT", "ACC", "DEC", "VMAX", "POSLIM_L", "POSLIM_R")}
    assert shown == {"POS_ACT": 57600, "ACC": 38400, "DEC": 25600, "VMAX": 32000, "POSLIM_L": -1280000, "POSLIM_R": 1280000}
    assert rig.get("VMAX", 2) == 1500
    rig.set("ACC", 12800)
    rig.word("DATA_TYPE", 0)
    rig.dint = False
    assert rig.get("ACC") == 1.0
    assert rig.get("POS_ACT") == 4.5


def test_mic_17_a_stored_trigger_value_keeps_its_meaning() -> None:
    rig = Rig(controller(AxisConfig(gear=100.0)))
    rig.enable(1)
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_ABS", 2.0)
    rig.use_dint()
    rig.word("AXIS_POS_ABS_TRIG", 1)
    rig.until(1, 4)
    assert rig.position() == 200


def test_mic_14_targets_are_rounded_to_the_nearest_pulse() -> None:
    rig = Rig(controller(AxisConfig(gear=10.0)))
    rig.enable(1)
    rig.set("POS_ABS", 1.26)
    rig.until(1, 4)
    assert rig.position() == pytest.approx(1.3, rel=1e-7)
    rig.use_dint()
    assert rig.position() == 13


@pytest.mark.parametrize("value", [2147483648.0, 1e38, -2147483904.0])
def test_a_position_beyond_the_counter_is_refused(value: float) -> None:
    rig = Rig()
    for key in ("POS_ACT", "POS_ABS", "POS_REL", "ENC_XPOS"):
        assert rig.exception(rig.set_pdu(key, value)) == ILLEGAL_VALUE, key
    assert rig.exception(rig.set_pdu("POS_ACT", -2147483648.0)) == 0


@pytest.mark.parametrize(("gear", "last", "beyond"), [(32767.0, 65538.0, 65539.0), (32767.5, 65536.0, 65537.0)])
def test_mic_14_a_position_is_rounded_before_it_is_compared_with_the_counter(gear: float, last: float, beyond: float) -> None:
    """65537 x 32767.5 is half a pulse beyond the last position, and the next whole one is outside."""
    rig = Rig(controller(AxisConfig(gear=gear)))
    for sign in (1.0, -1.0):
        assert rig.exception(rig.set_pdu("POS_ABS", sign * last)) == 0
    assert rig.exception(rig.set_pdu("POS_ABS", beyond)) == ILLEGAL_VALUE


def test_quantities_that_outgrow_their_register_show_its_limit() -> None:
    rig = Rig(controller(AxisConfig(gear=1e-6, acc=1e9)))
    rig.use_dint()
    rig.set("POSLIM_R", 2147483647)
    rig.word("DATA_TYPE", 0)
    rig.dint = False
    assert rig.get("POSLIM_R") == pytest.approx(2.147483647e15, rel=1e-6)
    big = Rig(controller(AxisConfig(gear=1e6)))
    big.set("VMAX", 1e30)
    assert big.get("VMAX") == pytest.approx(1e30)
    big.use_dint()
    assert big.get("VMAX") == 2**31 - 1
    tiny = Rig(controller(AxisConfig(gear=1e-37)))
    tiny.use_dint()
    tiny.set("POS_ACT", -1000)
    tiny.word("DATA_TYPE", 0)
    tiny.dint = False
    assert tiny.get("POS_ACT") == -struct.unpack(">f", bytes.fromhex("7F7FFFFF"))[0]


def test_mic_25_mask_bits_above_the_fourth_axis_are_ignored() -> None:
    rig = Rig()
    rig.word("M_ENABLE", 0xFFF5)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [1, 0, 1, 0]
    rig.word("M_DISABLE", 0xFFF4)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [1, 0, 0, 0]
    rig.word("M_ENABLE", 8)
    assert rig.status(4) == 1


def test_m_all_status_reads_0_before_1_70() -> None:
    for firmware in ("1.23", "1.40"):
        rig = Rig(firmware=firmware)
        rig.word("PROGRAM_CTRL", 1)
        assert rig.word("M_STATUS") == 0


def test_user_registers_keep_words_and_both_32_bit_types(any_rig: Rig) -> None:
    last = {1000: 499, 10000: 1999}[any_rig.base]
    any_rig.write_words(last - 1, *dint_words(-5))
    any_rig.write_words(0, *real_words(-0.125))
    any_rig.ask(word_pdu(2, 65535))
    assert any_rig.read_words(last - 1, 2) == [0xFFFB, 0xFFFF]
    assert any_rig.read_words(0, 3) == [*real_words(-0.125), 65535]
    assert any_rig.exception(words_pdu(last, 1, 2)) == ILLEGAL_ADDRESS
    assert any_rig.read_words(last, 1) == [0xFFFF]


# ---------------------------------------------------------------------- lenient


def test_mic_3_lenient_holes_read_0_and_write_only_registers_their_last_value() -> None:
    rig = Rig(lenient=True)
    assert rig.read_words(30000, 125) == [0] * 125
    rig.write_words(1998, 8, 9)
    assert rig.read_words(1997, 5) == [0, 8, 9, 0, 0]
    rig.word("M_ENABLE", 5)
    rig.set("HOME", -12.5, 2)
    rig.coil(OUT, True)
    rig.coil(2009, True)
    assert rig.read_words(rig.base + 14, 6) == [5, 0, 0, 0, 0, 0]
    assert rig.read_words(rig.base + 62, 2) == list(real_words(-12.5))
    assert rig.bits(1, 2008, 3) == [0, 1, 0]
    assert rig.bits(1, 5999, 3) == [0, 1, 0]
    assert rig.bits(2, 5019, 2) == [0, 0]
    assert rig.read_words(rig.base + 63, 2) == [real_words(-12.5)[1], 0]  # MIC-5
    assert rig.exception(word_pdu(30000, 1)) == ILLEGAL_ADDRESS
    assert rig.read_words(0xFFFF, 1) == [0]
    assert rig.read_words(0xFFFF - 124, 125) == [0] * 125


def test_mic_3_lenient_last_values_follow_data_type_and_end_with_the_power() -> None:
    rig = Rig(controller(AxisConfig(gear=100.0)), lenient=True)
    rig.set("POS_ABS", 2.5)
    rig.use_dint()
    assert rig.get("POS_ABS") == 250
    rig.device.power_cycle(rig.now)
    rig.dint = False
    assert rig.get("POS_ABS") == 0
    rig.use_dint()
    assert [rig.get(key, 2) for key in ("POS_ABS", "POS_REL", "VEL_ABS", "HOME")] == [0, 0, 0, 0]
    assert [rig.word(key) for key in ("M_ENABLE", "M_DISABLE", "M_STOP")] == [0, 0, 0]


def test_mic_3_lenient_last_values_are_in_units_of_their_axis() -> None:
    gears = (100.0, 40.0, 8.0, 2.0)
    rig = Rig(controller(*(AxisConfig(gear=gear) for gear in gears)), lenient=True)
    for axis in (1, 2, 3, 4):
        rig.set("POS_ABS", 2.5, axis)
    assert [rig.get("POS_ABS", axis) for axis in (1, 2, 3, 4)] == [2.5] * 4
    rig.use_dint()
    assert [rig.get("POS_ABS", axis) for axis in (1, 2, 3, 4)] == [2.5 * gear for gear in gears]


def test_mic_3_a_refused_write_is_not_remembered() -> None:
    rig = Rig(lenient=True)
    rig.set("POS_ABS", 7.0)
    assert rig.exception(rig.set_pdu("POS_ABS", nan)) == ILLEGAL_VALUE
    assert rig.get("POS_ABS") == 7.0


# ---------------------------------------------------------------------- plans


def test_a_master_that_tries_everything_fills_no_memory() -> None:
    asked = slave("1.40", lenient=True)
    rig = Rig(firmware="1.40", lenient=True)
    for address in range(4 * PLANS_KEPT + 10):
        rig.ask(read_pdu(3, address, 2))
    assert 0 < len(asked) <= 4 * PLANS_KEPT
    assert rig.read_words(10020, 2) == [0, 0]


def test_controllers_share_plans_but_no_values() -> None:
    one, other = Rig(controller(AxisConfig(gear=10.0))), Rig(controller(AxisConfig(gear=4.0)))
    one.set("POS_ACT", 5.0)
    other.set("POS_ACT", 7.0)
    other.use_dint()
    assert (one.get("POS_ACT"), other.get("POS_ACT")) == (5.0, 28)
    one.write_words(3, 1)
    assert other.read_words(3, 1) == [0]
