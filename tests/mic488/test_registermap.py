"""The map of registers as it is built and searched: names, addresses, contradictions of rows."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.mic488.registermap import (
    Firmware,
    MapRow,
    Per,
    QuantityKind,
    Register,
    RegisterMap,
    RegisterMapError,
    RegisterSlice,
    Space,
    Type,
    UnknownRegister,
    WriteEffect,
)
from steptwin.mic488.registers import DEFAULT_FIRMWARE, FIRMWARES, ROWS, firmware, register_map


def test_names_in_either_case_and_aliases() -> None:
    chart = register_map()
    assert chart.named("m1_pos_act") is chart.named("M1_POS_ACT")
    assert chart.named("user_reg_reset").address == 2102


def test_a_wrong_name_gets_near_misses() -> None:
    with pytest.raises(
        UnknownRegister, match=r"no register named 'M1_POSACT'; did you mean M1_POS_ACT, M2_POS_ACT, M3_POS_ACT\?$"
    ):
        register_map().named("M1_POSACT")
    with pytest.raises(UnknownRegister, match=r"firmware 1\.70 has no register named 'qqq'$"):
        register_map().named("qqq")
    with pytest.raises(UnknownRegister, match=r"firmware 1\.23 has no register named 'M_STATUS'; did you mean M1_STATUS,"):
        register_map("1.23").named("M_STATUS")


def test_a_map_is_shown_by_its_firmware() -> None:
    assert repr(register_map("1.23")) == f"<RegisterMap of firmware 1.23: {len([*register_map('1.23')])} registers>"


def test_every_address_of_a_register_finds_it() -> None:
    for name in FIRMWARES:
        chart = register_map(name)
        for register in chart:
            assert chart.at(register.space, register.address) is register
            assert chart.at(register.space, register.last) is register


def test_a_hole_names_its_neighbours_in_decimal_and_hex() -> None:
    chart = register_map()
    assert chart.find(Space.HOLDING, 10019) is None
    with pytest.raises(UnknownRegister) as caught:
        chart.at(Space.HOLDING, 10019)
    assert str(caught.value) == (
        "firmware 1.70 has no holding register at 10019 (0x2723); "
        "nearest: JOG_SPEED at 10017 (0x2721)…10018 (0x2722), M1_POS_ACT at 10020 (0x2724)…10021 (0x2725)"
    )
    with pytest.raises(UnknownRegister, match="no input at 4999"):
        chart.at(Space.INPUT, 4999)
    with pytest.raises(UnknownRegister) as caught:
        chart.at(Space.HOLDING, 2000)
    assert "nearest: USER_REGISTER at 0 (0x0000)…1999 (0x07CF), " in str(caught.value)
    assert chart.find(Space.COIL, 0) is None


def test_unknown_keys_raise() -> None:
    with pytest.raises(UnknownRegister, match="key 'POS_ACT' with number 5"):
        register_map().of("POS_ACT", 5)
    with pytest.raises(UnknownRegister, match="key 'M_STATUS'"):
        register_map("1.40").of("M_STATUS")


def test_pieces_cut_a_request_at_register_borders() -> None:
    chart = register_map()
    assert list(chart.slices(Space.HOLDING, 10017, 4)) == [
        RegisterSlice(chart.named("JOG_SPEED"), 10017, 2),
        RegisterSlice(None, 10019, 1),
        RegisterSlice(chart.named("M1_POS_ACT"), 10020, 1),
    ]
    assert list(chart.slices(Space.HOLDING, 1990, 20)) == [
        RegisterSlice(chart.named("USER_REGISTER"), 1990, 10),
        RegisterSlice(None, 2000, 10),
    ]
    assert list(chart.slices(Space.COIL, 6007, 9)) == [RegisterSlice(chart.named("OUT8"), 6007, 1), RegisterSlice(None, 6008, 8)]


def test_unknown_firmware() -> None:
    with pytest.raises(Misuse, match=r"unknown firmware '2.0'; permitted: 1.23, 1.40, 1.70"):
        register_map("2.0")
    assert DEFAULT_FIRMWARE == "1.70"
    assert firmware("1.70").stored_user_registers == range(1000, 2000)
    assert firmware("1.40").stored_user_registers is None


SMALL = Firmware("9.9", "1.70", control_base=10000, user_registers=2000, stored_user_registers=None, banks=6)


GOOD = MapRow(
    name="GOOD",
    space=Space.HOLDING,
    address=40,
    control=True,
    type=Type.VALUE,
    reads=(3,),
    writes=(16,),
    kind=QuantityKind.POSITION,
    effect=WriteEffect.STORE,
    meaning="Good.",
    sections={"1.70": "3.2"},
)


def _with(**changes: Any) -> MapRow:
    return dataclasses.replace(GOOD, **changes)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            [GOOD, _with(name="NEXT", address=41)],
            "NEXT at 10041 (0x2739)…10042 (0x273A) overlaps GOOD at 10040 (0x2738)…10041 (0x2739) among the holding registers",
        ),
        (
            [GOOD, _with(address=60)],
            "the name GOOD is given to 10040 (0x2738)…10041 (0x2739) and to 10060 (0x274C)…10061 (0x274D)",
        ),
        (
            [GOOD, _with(name="NEXT", aliases=("good",), address=60)],
            "the name good is given to 10040 (0x2738)…10041 (0x2739) and to 10060 (0x274C)…10061 (0x274D)",
        ),
        (
            [
                _with(name="M{n}_X", per=Per.AXIS, copies=2, step=2),
                _with(name="X{n}", per=Per.AXIS, copies=2, step=2, address=60),
            ],
            "the key X is given to M1_X at 10040 (0x2738)…10041 (0x2739) and to X1 at 10060 (0x274C)…10061 (0x274D)",
        ),
        (
            [_with(address=65535, control=False)],
            "firmware 9.9: GOOD at 65535 (0xFFFF)…65536 (0x10000) is outside 0…65535 (0xFFFF)",
        ),
        ([_with(address=-1, control=False)], "firmware 9.9: GOOD at -1 (-0x0001)…0 (0x0000) is outside 0…65535 (0xFFFF)"),
        ([_with(writes=(5,))], "firmware 9.9: GOOD is a holding register, function 5 (05h) does not reach it"),
        ([_with(reads=(16,))], "firmware 9.9: GOOD lists function 16 (10h) on the wrong side of read and write"),
        ([_with(writes=())], "firmware 9.9: GOOD has the effect 'stores' but write functions ()"),
        ([_with(type=Type.BIT)], "firmware 9.9: GOOD is a holding register of type BIT"),
        ([_with(copies=2)], "firmware 9.9: GOOD has 2 copies per device"),
        (
            [_with(name="M{n}_X", copies=4, step=1, per=Per.AXIS)],
            "M2_X at 10041 (0x2739)…10042 (0x273A) overlaps M1_X at 10040 (0x2738)…10041 (0x2739) among the holding registers",
        ),
    ],
)
def test_a_table_that_contradicts_itself_names_the_culprit(rows: list[MapRow], message: str) -> None:
    with pytest.raises(RegisterMapError) as caught:
        RegisterMap(SMALL, rows)
    assert str(caught.value) == message


def test_a_good_row_passes() -> None:
    chart = RegisterMap(SMALL, [GOOD, _with(name="NEXT", address=42)])
    assert [r.name for r in chart] == ["GOOD", "NEXT"]


def test_a_row_of_other_firmware_is_left_out() -> None:
    assert len(RegisterMap(SMALL, [_with(firmwares=("1.23",))])) == 0


def test_the_map_is_frozen() -> None:
    chart = register_map()
    with pytest.raises(AttributeError, match=r"firmware 1\.70 is frozen"):
        chart.firmware = SMALL
    with pytest.raises(AttributeError, match=r"firmware 1\.70 is frozen"):
        del chart.registers
    with pytest.raises(dataclasses.FrozenInstanceError):
        chart.named("OUT1").address = 1  # pyrefly: ignore[read-only]
    values: Any = chart.named("DATA_TYPE").values
    with pytest.raises(TypeError):
        values[2] = "more"
    assert register_map() is chart


def test_a_deep_copy_of_what_refers_to_the_map_shares_it() -> None:
    chart = register_map()
    assert copy.deepcopy({"map": chart, "register": chart.named("OUT1")}) == {"map": chart, "register": chart.named("OUT1")}
    assert copy.deepcopy([chart])[0] is chart


def test_every_row_is_in_some_generation() -> None:
    keys = {r.key for name in FIRMWARES for r in register_map(name)}
    assert keys == {row.key for row in ROWS}
    assert isinstance(register_map().registers[0], Register)
