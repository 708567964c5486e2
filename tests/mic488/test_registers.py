"""The table against the manuals: a transcription of tables 3.1 and 3.2, typed from each manual, in the manual's own columns."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from steptwin.mic488.registermap import (
    DataType,
    QuantityKind,
    Space,
    Type,
    WriteEffect,
)
from steptwin.mic488.registers import FIRMWARES, axes_of_mask, register_map

BITS = """
6000 6001 6002 6003 6004 6005 6006 6007 | OUT1 OUT2 OUT3 OUT4 OUT5 OUT6 OUT7 OUT8 | 01 | 05
5000 5001 5002 5003 5004 5005 5006 5007 5008 5009 | IN1 IN2 IN3 IN4 IN5 IN6 IN7 IN8 IN9 IN10 | 02 |
5010 5011 5012 5013 5014 5015 5016 5017 5018 5019 | IN11 IN12 IN13 IN14 IN15 IN16 IN17 IN18 IN19 IN20 | 02 |
2000 2001 2002 2003 | M1_EN M2_EN M3_EN M4_EN | | 05
2004 2005 2006 2007 | M1_STOP M2_STOP M3_STOP M4_STOP | | 05
2008 2009 | M1_JOG_PLUS M1_JOG_MINUS | | 05
2010 2011 | M2_JOG_PLUS M2_JOG_MINUS | | 05
2012 2013 | M3_JOG_PLUS M3_JOG_MINUS | | 05
2014 2015 | M4_JOG_PLUS M4_JOG_MINUS | | 05
"""
BITS_OF_1_70_ONLY = """
2100 2101 2102 | USER_REG_READ USER_REG_SAVE USER_REG_ZERO | | 05
"""

# Manual 1.23 in English. The first address of POSLIM_L is printed 1114, which is ENC4_XPOS; 1120 is meant.
REGISTERS_1_23 = """
1000 | DATA_TYPE | WORD | 03 | 06
1001 | PROG_BANK_SEL | WORD | 03 | 06
1002 | POS_BANK_SEL | WORD | 03 | 06
1003 | PROGRAM_CTRL | WORD | 03 | 06
1004 | AXIS_CTR_MODE | WORD | 03 | 06
1005 | AXIS_VEL_ABS_TRIG | WORD | 03 | 06
1006 | AXIS_VEL_REL_TRIG | WORD | 03 | 06
1007 | AXIS_POS_ABS_TRIG | WORD | 03 | 06
1008 | AXIS_POS_REL_TRIG | WORD | 03 | 06
1009 | M_ALL_STATUS | WORD | 03 |
1010 1011 1012 1013 | M1_STATUS M2_STATUS M3_STATUS M4_STATUS | WORD | 03 |
1014 | M_ENABLE | WORD | | 06
1015 | M_DISABLE | WORD | | 06
1016 | M_STOP | WORD | | 06
1017 | JOG_SPEED | REAL | | 06
1020 1022 1024 1026 | M1_POS_ACT M2_POS_ACT M3_POS_ACT M4_POS_ACT | REAL/DINT | 03 | 10
1028 1030 1032 1034 | M1_VEL_ACT M2_VEL_ACT M3_VEL_ACT M4_VEL_ACT | REAL/DINT | 03 |
1036 1038 1040 1042 | M1_ACC M2_ACC M3_ACC M4_ACC | REAL/DINT | 03 | 10
1044 1046 1048 1050 | M1_DEC M2_DEC M3_DEC M4_DEC | REAL/DINT | 03 | 10
1052 1054 1056 1058 | M1_VMAX M2_VMAX M3_VMAX M4_VMAX | REAL/DINT | 03 | 10
1060 1062 1064 1066 | M1_HOME M2_HOME M3_HOME M4_HOME | REAL/DINT | | 10
1068 1070 1072 1074 | M1_VEL_ABS M2_VEL_ABS M3_VEL_ABS M4_VEL_ABS | REAL/DINT | | 10
1076 1078 1080 1082 | M1_VEL_REL M2_VEL_REL M3_VEL_REL M4_VEL_REL | REAL/DINT | | 10
1084 1086 1088 1090 | M1_POS_ABS M2_POS_ABS M3_POS_ABS M4_POS_ABS | REAL/DINT | | 10
1092 1094 1096 1098 | M1_POS_REL M2_POS_REL M3_POS_REL M4_POS_REL | REAL/DINT | | 10
1100 1102 1104 1106 | ENC1_IMP ENC2_IMP ENC3_IMP ENC4_IMP | DINT | 03 | 10
1108 1110 1112 1114 | ENC1_XPOS ENC2_XPOS ENC3_XPOS ENC4_XPOS | REAL/DINT | 03 | 10
1120 1122 1124 1126 | M1_POSLIM_L M2_POSLIM_L M3_POSLIM_L M4_POSLIM_L | REAL/DINT | 03 | 10
1128 1130 1132 1134 | M1_POSLIM_R M2_POSLIM_R M3_POSLIM_R M4_POSLIM_R | REAL/DINT | 03 | 10
"""

# Manual 1.70 in Polish. Its table still lists 10009 as M_ALL_STATUS, its section 4.7 describes M_STATUS there.
REGISTERS_1_70 = """
10000 | DATA_TYPE | WORD | 03 | 06
10001 | PROG_BANK_SEL | WORD | 03 | 06
10002 | POS_BANK_SEL | WORD | 03 | 06
10003 | PROGRAM_CTRL | WORD | 03 | 06
10004 | AXIS_CTR_MODE | WORD | 03 | 06
10005 | AXIS_VEL_ABS_TRIG | WORD | 03 | 06
10006 | AXIS_VEL_REL_TRIG | WORD | 03 | 06
10007 | AXIS_POS_ABS_TRIG | WORD | 03 | 06
10008 | AXIS_POS_REL_TRIG | WORD | 03 | 06
10009 | M_STATUS | WORD | 03 |
10010 10011 10012 10013 | M1_STATUS M2_STATUS M3_STATUS M4_STATUS | WORD | 03 |
10014 | M_ENABLE | WORD | | 06
10015 | M_DISABLE | WORD | | 06
10016 | M_STOP | WORD | | 06
10017 | JOG_SPEED | REAL | | 06
10020 10022 10024 10026 | M1_POS_ACT M2_POS_ACT M3_POS_ACT M4_POS_ACT | REAL/DINT | 03 | 10
10028 10030 10032 10034 | M1_VEL_ACT M2_VEL_ACT M3_VEL_ACT M4_VEL_ACT | REAL/DINT | 03 |
10036 10038 10040 10042 | M1_ACC M2_ACC M3_ACC M4_ACC | REAL/DINT | 03 | 10
10044 10046 10048 10050 | M1_DEC M2_DEC M3_DEC M4_DEC | REAL/DINT | 03 | 10
10052 10054 10056 10058 | M1_VMAX M2_VMAX M3_VMAX M4_VMAX | REAL/DINT | 03 | 10
10060 10062 10064 10066 | M1_HOME M2_HOME M3_HOME M4_HOME | REAL/DINT | | 10
10068 10070 10072 10074 | M1_VEL_ABS M2_VEL_ABS M3_VEL_ABS M4_VEL_ABS | REAL/DINT | | 10
10076 10078 10080 10082 | M1_VEL_REL M2_VEL_REL M3_VEL_REL M4_VEL_REL | REAL/DINT | | 10
10084 10086 10088 10090 | M1_POS_ABS M2_POS_ABS M3_POS_ABS M4_POS_ABS | REAL/DINT | | 10
10092 10094 10096 10098 | M1_POS_REL M2_POS_REL M3_POS_REL M4_POS_REL | REAL/DINT | | 10
10100 10102 10104 10106 | ENC1_IMP ENC2_IMP ENC3_IMP ENC4_IMP | DINT | 03 | 10
10108 10110 10112 10114 | ENC1_XPOS ENC2_XPOS ENC3_XPOS ENC4_XPOS | REAL/DINT | 03 | 10
10120 10122 10124 10126 | M1_POSLIM_L M2_POSLIM_L M3_POSLIM_L M4_POSLIM_L | REAL/DINT | 03 | 10
10128 10130 10132 10134 | M1_POSLIM_R M2_POSLIM_R M3_POSLIM_R M4_POSLIM_R | REAL/DINT | 03 | 10
"""
# Revision history: 1.40 brings the addresses and the memory, 1.70 M_STATUS and the USER_REG_ bits.
REGISTERS_1_40 = REGISTERS_1_70.replace("M_STATUS |", "M_ALL_STATUS |", 1)

TABLES = {
    "1.23": (BITS, REGISTERS_1_23, 500),
    "1.40": (BITS, REGISTERS_1_40, 2000),
    "1.70": (BITS + BITS_OF_1_70_ONLY, REGISTERS_1_70, 2000),
}
Listed = tuple[int, str, str, tuple[int, ...], tuple[int, ...]]


def _codes(cell: str) -> tuple[int, ...]:
    return (int(cell, 16),) if cell else ()


def _rows(table: str) -> Iterator[list[str]]:
    for line in table.split("\n"):
        if line:
            yield [cell.strip() for cell in line.split("|")]


def _listed(name: str) -> list[Listed]:
    bits, registers, _ = TABLES[name]
    listed: list[Listed] = []
    for addresses, names, reads, writes in _rows(bits):
        pairs = zip(addresses.split(), names.split(), strict=True)
        listed += [(int(address), bit, "BIT", _codes(reads), _codes(writes)) for address, bit in pairs]
    for addresses, names, kind, reads, writes in _rows(registers):
        pairs = zip(addresses.split(), names.split(), strict=True)
        listed += [(int(address), register, kind, _codes(reads), _codes(writes)) for address, register in pairs]
    return [*listed, (0, "USER_REGISTER", "WORD/DINT/REAL", (3,), (6, 16))]


@pytest.mark.parametrize("name", FIRMWARES)
def test_the_map_is_what_the_manual_lists_and_nothing_else(name: str) -> None:
    shown = [(r.address, r.name, r.type.value, r.reads, r.writes) for r in register_map(name)]
    assert sorted(shown) == sorted(_listed(name))


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
    words = {"WORD": 1, "DINT": 2, "REAL": 2, "REAL/DINT": 2}
    readable = [(address, kind) for address, _, kind, reads, _ in _listed("1.70") if reads and address >= 10000]
    listed = {address + n for address, kind in readable for n in range(words[kind])}
    assert {10013, 10059, 10135} <= listed
    control = [r for r in register_map() if r.space is Space.HOLDING and r.address >= 10000 and r.reads]
    assert {address for r in control for address in range(r.address, r.last + 1)} == listed


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
    listed = {name for _, name, _, _, writes in _listed("1.70") if not writes}
    assert {"IN20", "M_STATUS", "M4_STATUS", "M4_VEL_ACT"} <= listed
    assert {r.name for r in register_map() if not r.accepts} == listed
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
