"""The table against the manuals (`manual_registers`)."""

from __future__ import annotations

import pytest
from manual_registers import TABLES, WORDS_OF, listed

from steptwin.mic488.registermap import (
    DataType,
    QuantityKind,
    Space,
    Type,
    WriteEffect,
)
from steptwin.mic488.registers import FIRMWARES, axes_of_mask, register_map


@pytest.mark.parametrize("name", FIRMWARES)
def test_the_map_is_what_the_manual_lists_and_nothing_else(name: str) -> None:
    shown = [(r.address, r.name, r.type.value, r.reads, r.writes) for r in register_map(name)]
    assert sorted(shown) == sorted(listed(name))


@pytest.mark.parametrize("name", FIRMWARES)
def test_the_user_registers_are_one_range(name: str) -> None:
    user = register_map(name).named("USER_REGISTER")
    count = TABLES[name][2]
    assert (user.address, user.cells, user.span, user.last) == (0, count, count, count - 1)
    assert register_map(name).find(Space.HOLDING, count) is None


def test_spaces_follow_from_the_functions() -> None:
    spaces = {r.name: r.space for r in register_map()}
    assert (spaces["OUT1"], spaces["IN1"], spaces["M1_EN"], spaces["M1_ACC"]) == (
        Space.COIL,
        Space.INPUT,
        Space.COIL,
        Space.HOLDING,
    )


def test_the_words_of_control_registers_that_can_be_read_are_those_of_the_manual() -> None:
    readable = [one for one in listed("1.70") if one.reads and one.address >= 10000]
    words = {one.address + n for one in readable for n in range(WORDS_OF[one.kind])}
    assert {10013, 10059, 10135} <= words
    control = [r for r in register_map() if r.space is Space.HOLDING and r.address >= 10000 and r.reads]
    assert {address for r in control for address in range(r.address, r.last + 1)} == words


# ---------------------------------------------------------------------- facts behind the assumptions


def test_mic_4_function_16_writes_words_too() -> None:
    words = [r for r in register_map() if r.type is Type.WORD and r.writes]
    assert words
    assert {r.accepts for r in words} == {(6, 16)}
    assert register_map().named("USER_REGISTER").accepts == (6, 16)


def test_mic_5_only_whole_values_of_32_bit_control_registers() -> None:
    chart = register_map()
    wide = [r for r in chart if r.type.size == 2 and r.writes and r.name != "JOG_SPEED"]
    assert {r.accepts for r in wide} == {(16,)}
    whole, half = chart.slices(Space.HOLDING, 10020, 3)
    assert (whole.whole, whole.register) == (True, chart.named("M1_POS_ACT"))
    assert (half.whole, half.register, half.address, half.size) == (False, chart.named("M2_POS_ACT"), 10022, 1)
    (odd,) = chart.slices(Space.HOLDING, 10021, 1)
    assert not odd.whole
    (memory,) = chart.slices(Space.HOLDING, 1, 1)
    assert memory.whole


def test_mic_6_jog_speed_is_the_one_exception() -> None:
    jog = register_map().named("JOG_SPEED")
    assert [r.name for r in register_map() if r.word_write] == ["JOG_SPEED"]
    assert (jog.address, jog.last, jog.accepts) == (10017, 10018, (6, 16))
    assert jog.unit(DataType.DINT, "mm") == "mm/s"


@pytest.mark.parametrize("axis", [1, 2, 3, 4])
@pytest.mark.parametrize("key", ["ACC", "DEC", "VMAX"])
def test_mic_7_ramps_are_positive(key: str, axis: int) -> None:
    register = register_map().of(key, axis)
    assert [register.permits(v) for v in (0.0, -1.0, 1e-30, 1.0, float("inf"), float("nan"))] == [
        False,
        False,
        True,
        True,
        False,
        False,
    ]
    assert str(register.permitted) == "> 0"


def test_mic_7_no_register_takes_what_is_not_a_number() -> None:
    for register in register_map():
        assert not any(register.permits(v) for v in (float("nan"), float("inf"), float("-inf"))), register.name


def test_mic_7_enumerations_take_their_values_only() -> None:
    chart = register_map()
    assert [v for v in range(-1, 5) if chart.named("DATA_TYPE").permits(v)] == [0, 1]
    assert [v for v in range(-1, 5) if chart.named("AXIS_CTR_MODE").permits(v)] == [0, 1]
    assert [v for v in range(-1, 5) if chart.named("PROGRAM_CTRL").permits(v)] == [0, 1, 2]
    assert dict(chart.named("PROGRAM_CTRL").values) == {0: "STOP", 1: "START", 2: "PAUSE"}


def test_mic_24_what_cannot_be_written_accepts_no_function() -> None:
    names = {one.name for one in listed("1.70") if not one.writes}
    assert {"IN20", "M_STATUS", "M4_STATUS", "M4_VEL_ACT"} <= names
    assert {r.name for r in register_map() if not r.accepts} == names
    assert all((r.effect is WriteEffect.NONE) == (not r.accepts) for r in register_map())


def test_mic_25_upper_bits_of_masks_are_accepted_and_ignored() -> None:
    masks = [r for r in register_map() if r.kind is QuantityKind.MASK]
    assert [r.name for r in masks] == [
        "AXIS_VEL_ABS_TRIG",
        "AXIS_VEL_REL_TRIG",
        "AXIS_POS_ABS_TRIG",
        "AXIS_POS_REL_TRIG",
        "M_ENABLE",
        "M_DISABLE",
        "M_STOP",
    ]
    assert all(r.permits(0xFFFF) for r in masks)
    assert axes_of_mask(0xFFF7) == axes_of_mask(7) == (1, 2, 3)
    # Manual 4.2: the table of all combinations, and the text's "bit 4 - M4" is a misprint.
    assert [axes_of_mask(m) for m in (0, 1, 2, 4, 8, 10, 15, 16)] == [(), (1,), (2,), (3,), (4,), (2, 4), (1, 2, 3, 4), ()]


@pytest.mark.parametrize(("name", "last"), [("1.23", 7), ("1.40", 7), ("1.70", 5)])
@pytest.mark.parametrize("register", ["PROG_BANK_SEL", "POS_BANK_SEL"])
def test_mic_28_banks_of_the_generation(name: str, last: int, register: str) -> None:
    bank = register_map(name).named(register)
    assert [v for v in range(-1, 10) if bank.permits(v)] == list(range(last + 1))
    assert str(bank.permitted) == f"0…{last}"


def test_status_texts_follow_the_manual() -> None:
    values = register_map().of("STATUS", 1).values
    assert list(values) == [0, 1, 2, 3, 4, 5, 6, 8, 9, 10]
    assert values[4] == "position reached"
    assert list(register_map().named("M_STATUS").values) == [0, 1, 2, 3]
    assert register_map().named("M_STATUS").section == "3.2, 4.7"


# ---------------------------------------------------------------------- units, keys, sections


@pytest.mark.parametrize(
    ("name", "real", "dint"),
    [
        ("M1_POS_ACT", "mm", "imp"),
        ("M2_VEL_ACT", "mm/s", "imp/s"),
        ("M3_ACC", "mm/s²", "imp/s²"),
        ("M4_VMAX", "mm/s", "imp/s"),
        ("M1_HOME", "mm/s", "imp/s"),
        ("ENC1_XPOS", "mm", "imp"),
        ("ENC1_IMP", "imp", "imp"),
        ("JOG_SPEED", "mm/s", "mm/s"),
        ("M1_STATUS", "", ""),
        ("M_STOP", "", ""),
        ("USER_REGISTER", "", ""),
        ("OUT1", "", ""),
    ],
)
def test_the_unit_follows_from_quantity_and_data_type(name: str, real: str, dint: str) -> None:
    register = register_map().named(name)
    assert register.unit(DataType.REAL, "mm") == real
    assert register.unit(DataType.DINT, "mm") == dint


def test_keys_are_the_same_in_all_generations() -> None:
    for key, index in [("POS_ACT", 1), ("POSLIM_R", 4), ("ENC_IMP", 2), ("OUT", 8), ("JOG_SPEED", None), ("DATA_TYPE", None)]:
        names = {register_map(name).of(key, index).name for name in FIRMWARES}
        assert len(names) == 1
    assert register_map("1.23").of("POS_ACT", 3).address == 1024
    assert register_map("1.70").of("POS_ACT", 3).address == 10024


def test_axes_and_channels() -> None:
    chart = register_map()
    assert chart.named("ENC3_IMP").axis == 3
    assert chart.named("M4_JOG_MINUS").axis == 4
    assert (chart.named("OUT5").axis, chart.named("OUT5").index) == (None, 5)
    assert (chart.named("M_STOP").axis, chart.named("M_STOP").index) == (None, None)


def test_sections_are_those_of_the_generation_s_manual() -> None:
    assert register_map("1.23").of("STATUS", 1).section == "3.2, 4.7"
    assert register_map("1.70").of("STATUS", 1).section == "3.2, 4.8"
    assert register_map("1.70").named("M_STATUS").section == "3.2, 4.7"
    assert register_map("1.70").named("USER_REG_SAVE").section == "3.1, 4.11"


def test_every_meaning_is_one_sentence() -> None:
    for name in FIRMWARES:
        for register in register_map(name):
            assert register.meaning.endswith("."), register.name
            assert ". " not in register.meaning, register.name
            assert "{" not in register.meaning, register.name
