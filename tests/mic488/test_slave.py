"""Requests and responses byte for byte: what may be read and written, and what is refused with which exception."""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manual_registers import TABLES, WORDS_OF, controls, listed
from mic488_rig import OFFSETS, OUT, Rig, coil_pdu, controller, dint_words, read_pdu, real_words, word_pdu, words_pdu

from steptwin.mic488 import slave
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.wire import pdu as modbus
from steptwin.wire.slave import TcpSlavePort

FIRMWARES = tuple(OFFSETS)
USER_REGISTERS = {firmware: count for firmware, (_, _, count) in TABLES.items()}
BANKS = {"1.23": 8, "1.40": 8, "1.70": 6}

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


def hexes(response: bytes) -> str:
    return response.hex(" ").upper()


@pytest.fixture(params=FIRMWARES)
def any_rig(request: pytest.FixtureRequest) -> Rig:
    return Rig(firmware=request.param)


# ---------------------------------------------------------------------- the manual's examples


def test_example_of_the_manual_read_inputs() -> None:
    rig = Rig()
    rig.pin("IN1", 1)
    rig.pin("IN8", 1)
    rig.wait(0.010)
    assert hexes(rig.ask(bytes.fromhex("02 1388 0008"))) == "02 01 81"


def test_example_of_the_manual_out2_off() -> None:
    rig = Rig()
    rig.coil(OUT + 1, True)
    assert hexes(rig.ask(bytes.fromhex("05 1771 0000"))) == "05 17 71 00 00"
    assert rig.pins()["OUT2"] == 0.0


@pytest.mark.parametrize(("firmware", "request_"), [("1.23", "03 03FC 0002"), ("1.40", "03 2724 0002"), ("1.70", "03 2724 0002")])
def test_example_of_the_manual_read_position(firmware: str, request_: str) -> None:
    rig = Rig(controller(AxisConfig(gear=12800.0)), firmware)
    rig.set("POS_ACT", 4.5)
    assert hexes(rig.ask(bytes.fromhex(request_))) == "03 04 00 00 40 90"  # 4.5 = 40 90 00 00, low word first
    rig.use_dint()
    assert hexes(rig.ask(bytes.fromhex(request_))) == "03 04 E1 00 00 00"  # 57600 = 00 00 E1 00


@pytest.mark.parametrize(("firmware", "head"), [("1.23", "10 042C 0002 04"), ("1.70", "10 2754 0002 04")])
def test_example_of_the_manual_velocity_of_12800_pulses_per_revolution(firmware: str, head: str) -> None:
    """2.5 rev/s = 32000 imp/s."""
    rig = Rig(controller(AxisConfig(gear=12800.0, acc=10.0)), firmware)
    rig.enable(1)
    assert rig.ask(bytes.fromhex(head + "0000 4020"))[:5] == bytes.fromhex(head)[:5]
    rig.wait(1.0)
    assert rig.velocity() == 2.5
    rig.use_dint()
    assert rig.velocity() == 32000
    assert rig.ask(bytes.fromhex(head + "3E80 0000")) == bytes.fromhex(head)[:5]  # 16000 = 3E 80
    rig.wait(1.0)
    assert rig.velocity() == 16000


# ---------------------------------------------------------------------- which addresses exist


def readable(firmware: str) -> set[int]:
    """Words of control registers."""
    found = [one for is_word in (True, False) for one in controls(firmware, is_word=is_word) if one.reads]
    return {one.address + n for one in found for n in range(WORDS_OF[one.kind])}


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_mic_3_strict_single_registers_are_readable_where_the_manual_says_so_and_nowhere_else(firmware: str) -> None:
    rig, words = Rig(firmware=firmware), readable(firmware) | {*range(USER_REGISTERS[firmware])}
    for address in [*range(2200), *range(9900, 10300), 0x7FFF, 0xFFFE, 0xFFFF]:
        expected = 0 if address in words else ILLEGAL_ADDRESS
        assert rig.exception(read_pdu(3, address, 1)) == expected, address


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_mic_5_two_words_are_readable_where_both_belong_to_something_readable(firmware: str) -> None:
    rig, words, base = Rig(firmware=firmware), readable(firmware), OFFSETS[firmware]
    assert {base, base + 13, base + 20, base + 135} <= words
    for address in range(base, base + 150):
        expected = 0 if {address, address + 1} <= words else ILLEGAL_ADDRESS
        assert rig.exception(read_pdu(3, address, 2)) == expected, address


@pytest.mark.parametrize("dint", [False, True])
def test_mic_5_any_part_of_values_reads_as_the_words_of_the_whole(any_rig: Rig, dint: bool) -> None:
    rig = any_rig
    rig.enable(1, 2)
    rig.set("VEL_ABS", 1234.5)
    rig.wait(1.2345)
    if dint:
        rig.use_dint()
    whole = rig.read_words(rig.base + 20, 40)
    for first in range(40):
        for count in range(1, 41 - first):
            assert rig.read_words(rig.base + 20 + first, count) == whole[first : first + count], (first, count)
    assert rig.read_words(rig.base + 9, 5) == [0, 2, 1, 0, 0]


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_bits_are_readable_where_the_manual_says_so(firmware: str) -> None:
    rig = Rig(firmware=firmware)
    for address in [*range(1990, 2110), *range(4990, 5030), *range(5990, 6020), 0, 0xFFFF]:
        assert rig.exception(read_pdu(1, address, 1)) == (0 if 6000 <= address < 6008 else ILLEGAL_ADDRESS), address
        assert rig.exception(read_pdu(2, address, 1)) == (0 if 5000 <= address < 5020 else ILLEGAL_ADDRESS), address


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_coils_are_writable_where_the_manual_says_so(firmware: str) -> None:
    rig = Rig(firmware=firmware)
    writable = {one.address for one in listed(firmware) if one.kind == "BIT" and one.writes}
    for address in [*range(1990, 2110), *range(4990, 5030), *range(5990, 6020), 0, 0xFFFF]:
        assert rig.exception(coil_pdu(address, True)) == (0 if address in writable else ILLEGAL_ADDRESS), address


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_mic_24_words_are_writable_where_the_manual_says_so(firmware: str) -> None:
    rig = Rig(firmware=firmware)
    several = {*range(USER_REGISTERS[firmware]), *(one.address for one in controls(firmware, is_word=True) if one.writes)}
    single = several | {one.address for one in controls(firmware, is_word=False) if one.writes == (6,)}
    assert single - several == {OFFSETS[firmware] + 17}  # JOG_SPEED alone is a pair that takes function 06 (MIC-6)
    for address in [*range(2100), *range(9990, 10150)]:
        assert rig.exception(word_pdu(address, 0)) == (0 if address in single else ILLEGAL_ADDRESS), address
        assert rig.exception(words_pdu(address, 0)) == (0 if address in several else ILLEGAL_ADDRESS), address


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_mic_24_pairs_are_writable_where_the_manual_says_so(firmware: str) -> None:
    rig, base = Rig(firmware=firmware), OFFSETS[firmware]
    writable = {one.address for one in controls(firmware, is_word=False) if one.writes}
    for address in range(base + 17, base + 150):
        expected = 0 if address in writable else ILLEGAL_ADDRESS
        assert rig.exception(words_pdu(address, *real_words(1.0))) == expected, address


def test_a_request_may_not_leave_the_address_space() -> None:
    for lenient in (False, True):
        rig = Rig(lenient=lenient)
        assert rig.exception(read_pdu(3, 0xFFFF, 2)) == ILLEGAL_ADDRESS
        assert rig.exception(read_pdu(1, 0xFFF0, 17)) == ILLEGAL_ADDRESS
        assert rig.exception(words_pdu(0xFFFF, 1, 2)) == ILLEGAL_ADDRESS


# ---------------------------------------------------------------------- what is refused


def test_mic_1_exceptions_01_02_03(any_rig: Rig) -> None:
    for function in {*range(1, 128)} - {1, 2, 3, 5, 6, 16}:
        assert any_rig.exception(bytes((function, 0, 0, 0, 1))) == ILLEGAL_FUNCTION
    assert any_rig.exception(read_pdu(3, 30000, 1)) == ILLEGAL_ADDRESS
    assert any_rig.exception(word_pdu(any_rig.base, 2)) == ILLEGAL_VALUE


def test_mic_3_one_unreadable_address_refuses_the_whole_request(any_rig: Rig) -> None:
    base = any_rig.base
    assert any_rig.exception(read_pdu(3, base, 14)) == 0
    assert any_rig.exception(read_pdu(3, base, 15)) == ILLEGAL_ADDRESS  # M_ENABLE is write-only
    assert any_rig.exception(read_pdu(3, base + 20, 40)) == 0
    assert any_rig.exception(read_pdu(3, base + 20, 42)) == ILLEGAL_ADDRESS  # M1_HOME is write-only
    assert any_rig.exception(read_pdu(3, base + 100, 16)) == 0
    assert any_rig.exception(read_pdu(3, base + 100, 22)) == ILLEGAL_ADDRESS  # hole at 116…119


def test_mic_5_half_of_a_control_pair_cannot_be_written_but_user_registers_are_plain_memory(any_rig: Rig) -> None:
    base = any_rig.base
    assert any_rig.exception(word_pdu(base + 52, 5)) == ILLEGAL_ADDRESS
    assert any_rig.exception(words_pdu(base + 52, 5)) == ILLEGAL_ADDRESS
    assert any_rig.exception(words_pdu(base + 53, 5, 5)) == ILLEGAL_ADDRESS
    any_rig.write_words(0, *dint_words(0x12345678))
    assert any_rig.read_words(1, 1) == [0x1234]
    any_rig.write_words(1, 0xABCD)
    assert any_rig.read_words(0, 2) == [0x5678, 0xABCD]


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize(
    "key", ["POS_ACT", "ACC", "VMAX", "HOME", "VEL_ABS", "VEL_REL", "POS_ABS", "POS_REL", "ENC_XPOS", "POSLIM_L"]
)
def test_mic_7_nan_and_infinity_are_refused(key: str, bad: float) -> None:
    rig = Rig()
    rig.enable(1)
    before = rig.read_words(rig.base + 20, 40)
    assert rig.exception(rig.set_pdu(key, bad)) == ILLEGAL_VALUE
    assert rig.read_words(rig.base + 20, 40) == before
    assert rig.status() == 1


@pytest.mark.parametrize("key", ["ACC", "DEC", "VMAX"])
@pytest.mark.parametrize("bad", [0.0, -0.0, -1.0])
@pytest.mark.parametrize("dint", [False, True])
def test_mic_7_ramps_and_vmax_must_be_above_zero(key: str, bad: float, dint: bool) -> None:
    rig = Rig()
    if dint:
        rig.use_dint()
    assert rig.exception(rig.set_pdu(key, bad, 3)) == ILLEGAL_VALUE
    assert rig.get(key, 3) == 1000


@pytest.mark.parametrize(
    ("key", "value"),
    [("DATA_TYPE", 2), ("AXIS_CTR_MODE", 2), ("PROGRAM_CTRL", 3), ("DATA_TYPE", 0xFFFF), ("PROGRAM_CTRL", 0xFFFF)],
)
def test_mic_7_enumerations_refuse_other_values(any_rig: Rig, key: str, value: int) -> None:
    for pdu in (word_pdu(any_rig.address(key), value), words_pdu(any_rig.address(key), value)):
        assert any_rig.exception(pdu) == ILLEGAL_VALUE
    assert any_rig.word(key) == 0


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("key", ["PROG_BANK_SEL", "POS_BANK_SEL"])
def test_mic_28_banks_of_each_firmware(firmware: str, key: str) -> None:
    rig, last = Rig(firmware=firmware), BANKS[firmware] - 1
    rig.word(key, last)
    assert rig.exception(word_pdu(rig.address(key), last + 1)) == ILLEGAL_VALUE
    assert rig.word(key) == last


@pytest.mark.parametrize("value", [0x0001, 0x00FF, 0xFF01, 0xFFFF, 0x0100])
def test_mic_7_coil_values_other_than_on_and_off_are_refused(value: int) -> None:
    rig = Rig()
    assert rig.exception(struct.pack(">BHH", 5, OUT, value)) == ILLEGAL_VALUE
    assert rig.exception(struct.pack(">BHH", 5, 2000, value)) == ILLEGAL_VALUE
    assert rig.bits(1, OUT, 8) == [0] * 8
    assert rig.status() == 0


@pytest.mark.parametrize(
    "pdu",
    [
        read_pdu(3, 0, 0),
        read_pdu(3, 0, 126),
        read_pdu(1, 6000, 0),
        read_pdu(2, 5000, 2001),
        struct.pack(">BHHB", 16, 0, 0, 0),
        words_pdu(0, *range(124)),
        struct.pack(">BHHBHH", 16, 0, 2, 3, 1, 2),
        struct.pack(">BHHBHH", 16, 0, 2, 6, 1, 2),
        words_pdu(0, 1, 2)[:-1],
        words_pdu(0, 1, 2) + b"\0",
        read_pdu(3, 0, 1)[:-1],
        word_pdu(0, 1) + b"\0",
        coil_pdu(6000, True)[:-1],
    ],
)
def test_mic_24_impossible_quantities_and_lengths_are_refused(pdu: bytes) -> None:
    rig = Rig()
    rig.write_words(0, 7, 7)  # so that the beginning of the request is known already
    assert rig.exception(pdu) == ILLEGAL_VALUE
    assert rig.read_words(0, 2) == [7, 7]


@pytest.mark.parametrize("count", [124, 127])
def test_mic_24_a_write_of_too_many_registers_is_refused_on_tcp_too(count: int) -> None:
    port = TcpSlavePort({1: Rig().device})
    pdu = words_pdu(0, *range(count))
    request = struct.pack(">HHHB", 7, 0, len(pdu) + 1, 1) + pdu
    assert port.exchange(request, 0) == bytes.fromhex("00 07 00 00 00 03 01 90 03")
    assert port.broken is None


def test_mic_24_the_longest_requests_are_served() -> None:
    rig = Rig()
    rig.write_words(100, *range(123))
    assert rig.read_words(100, 125) == [*range(123), 0, 0]
    assert rig.bits(2, 5000, 20) == [0] * 20


def test_mic_24_writing_what_is_read_only_is_an_address_error(any_rig: Rig) -> None:
    base = any_rig.base
    for address in (base + 9, base + 10, base + 13):
        assert any_rig.exception(word_pdu(address, 0)) == ILLEGAL_ADDRESS
    assert any_rig.exception(words_pdu(base + 28, *real_words(1.0))) == ILLEGAL_ADDRESS


# ---------------------------------------------------------------------- several registers in one request


def test_mic_4_one_request_spans_several_registers_and_types() -> None:
    rig = Rig()
    rig.write_words(rig.base + 14, 0b0011, 0b0010, 0, *real_words(250.0))  # M_ENABLE, M_DISABLE, M_STOP, JOG_SPEED
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [1, 0, 0, 0]
    rig.jog(1, +1, True)
    rig.wait(1.0)
    assert rig.velocity() == 250.0


def test_mic_4_parameters_commands_and_counters_in_one_request_take_effect_in_order() -> None:
    rig = Rig()
    rig.enable(1, 2, 3, 4)
    values: list[int] = []
    for key in ("ACC", "DEC", "VMAX"):
        for axis in range(4):
            values += real_words({"ACC": 100.0, "DEC": 200.0, "VMAX": 300.0}[key] + axis)
    rig.write_words(rig.base + 36, *values)
    assert [rig.get(key, axis) for key in ("ACC", "DEC", "VMAX") for axis in (1, 2, 3, 4)] == [
        n + axis for n in (100, 200, 300) for axis in range(4)
    ]
    # POS_REL of four axes, ENCx_IMP (always DINT) and ENCx_XPOS in one request
    rig.write_words(rig.base + 92, *real_words(10.0) * 4, *dint_words(-70000) * 4, *real_words(0.0) * 4)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [3, 3, 3, 3]
    assert rig.get("ENC_IMP") == 0  # XPOS, the same counter, came after it


def test_mic_4_one_bad_value_and_nothing_is_written() -> None:
    rig = Rig()
    rig.enable(1)
    before = rig.read_words(rig.base + 20, 40)
    words = [*real_words(5.0) * 11, *real_words(-5.0)]  # ACC, DEC, VMAX of four axes, the last one bad
    assert rig.exception(words_pdu(rig.base + 36, *words)) == ILLEGAL_VALUE
    assert rig.read_words(rig.base + 20, 40) == before
    assert rig.exception(words_pdu(rig.base, 1, 0, 99)) == ILLEGAL_VALUE
    assert rig.word("DATA_TYPE") == 0


def test_mic_4_a_bad_address_comes_before_a_bad_value() -> None:
    rig = Rig()
    assert rig.exception(words_pdu(rig.base, 99, 99, 99, 99, 99, 0, 0, 0, 0, 0)) == ILLEGAL_ADDRESS


def test_mic_4_function_16_writes_words() -> None:
    rig = Rig()
    rig.write_words(rig.address("AXIS_CTR_MODE"), 1)
    assert rig.word("AXIS_CTR_MODE") == 1


# ---------------------------------------------------------------------- whatever comes

ANY_PDU = st.binary(min_size=0, max_size=40) | st.builds(
    lambda function, address, rest: struct.pack(">BH", function, address) + rest,
    st.sampled_from([1, 2, 3, 5, 6, 16, 16, 7, 0x83]),
    st.one_of(st.integers(0, 0xFFFF), st.integers(9990, 10140), st.integers(1990, 2110), st.integers(5990, 6010)),
    st.binary(max_size=20),
)
VALUE_PDU = st.builds(
    lambda offset, values: words_pdu(10000 + offset, *values),
    st.integers(0, 135),
    st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=8),
)


@settings(max_examples=60)
@given(
    pdus=st.lists(st.tuples(ANY_PDU | VALUE_PDU, st.integers(0, 10**10)), max_size=25),
    lenient=st.booleans(),
    gear=st.sampled_from([100.0, 1.0, 0.3, 1e-30, 1e30]),
)
def test_whatever_bytes_arrive_the_response_belongs_to_the_request(
    pdus: list[tuple[bytes, int]], lenient: bool, gear: float
) -> None:
    axis = AxisConfig(gear=gear, limit_mode=3, in_kl=0, in_kr=1, home_mode=1)
    config = replace(ControllerConfig(), axes=(axis,) * 4)
    rig = Rig(config, lenient=lenient)
    rig.enable(1, 2, 3, 4)
    for pdu, pause in pdus:
        rig.wait_ns(pause)
        response = rig.ask(pdu)
        try:
            request = modbus.decode_request(pdu)
        except modbus.ModbusException as refusal:
            expected = refusal.pdu
        else:
            expected = bytes((pdu[0] | 0x80, response[1])) if response[0] & 0x80 else response
            with suppress(modbus.ModbusException):  # anything but a response or an exception to this request raises
                modbus.answer(request, response)
        assert response == expected
        assert not response[0] & 0x80 or response[1] in (ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE)


@pytest.mark.parametrize(
    ("compiler", "first", "second"),
    [
        ("compile_registers", word_pdu(10001, 1), word_pdu(10001, 2)),
        ("compile_registers", words_pdu(10020, 0, 0), words_pdu(10020, 0, 0x4120)),
        ("compile_registers", words_pdu(0, 0x1234, 1), words_pdu(0, 0x5678, 2)),
        ("compile_read", read_pdu(3, 10020, 2), read_pdu(3, 10020, 2)),
        ("compile_coil", coil_pdu(OUT, True), coil_pdu(OUT, True)),
    ],
)
def test_what_is_asked_again_is_not_compiled_again(
    compiler: str, first: bytes, second: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[object] = []
    compile_it = getattr(slave, compiler)
    monkeypatch.setattr(slave, compiler, lambda *asked, **options: compiled.append(asked) or compile_it(*asked, **options))
    rig = Rig()
    rig.device.slave = slave.Slave("1.70", lenient=False)
    assert [rig.exception(pdu) for pdu in (first, second, first)] == [0, 0, 0]
    assert len(compiled) == 1
