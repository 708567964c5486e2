"""Planned reads, and which requests may be repeated."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType, Space, Type
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import (
    FORM,
    PROGRAM,
    RegisterItem,
    UserFormat,
    decoded,
    encoded,
    halted,
    moves,
    named,
    plan,
    repeatable,
    starts_program,
    user_item,
    value_of,
)
from steptwin.wire import pdu

MAP = register_map("1.70")
READABLE = [RegisterItem(register) for register in MAP if register.reads and register.type is not Type.MEMORY]


def test_the_reads_of_a_status() -> None:
    """M_ENABLE, M_DISABLE and M_STOP, which cannot be read, lie between the two last ones."""
    keys = [f"M{axis}_{key}" for key in ("POS_ACT", "VEL_ACT", "STATUS") for axis in (1, 2, 3, 4)]
    keys += ["M_STATUS", *(f"IN{n}" for n in range(1, 21)), *(f"OUT{n}" for n in range(1, 9))]
    blocks = plan(MAP, [named(MAP, key) for key in keys])
    assert [(block.request.function, block.request.address, block.request.count) for block in blocks] == [
        (1, 6000, 8),
        (2, 5000, 20),
        (3, 10009, 5),
        (3, 10020, 16),
    ]


@given(st.lists(st.sampled_from(READABLE), min_size=1, max_size=40))
def test_every_value_is_in_one_block_and_no_block_touches_what_may_not_be_read(items: list[RegisterItem]) -> None:
    blocks = plan(MAP, items)
    assert sorted(item for block in blocks for item, _ in block.items) == sorted(set(items))
    assert len(blocks) <= len(set(items))
    for block in blocks:
        space = {1: Space.COIL, 2: Space.INPUT, 3: Space.HOLDING}[block.request.function]
        most = pdu.MAX_REGISTERS if space is Space.HOLDING else pdu.MAX_BITS
        assert 0 < block.request.count <= most
        pieces = MAP.slices(space, block.request.address, block.request.count)
        assert all(piece.whole and piece.register is not None and piece.register.reads for piece in pieces)
        for item, place in block.items:
            assert item.address == block.request.address + place


def test_a_value_is_found_at_its_place() -> None:
    (block,) = plan(MAP, [named(MAP, "M1_POS_ACT"), named(MAP, "M2_POS_ACT")])
    values = block.values((0, 0x4148, 0, 0xC148), DataType.REAL)
    assert {item.name: value for item, value in values.items()} == {"M1_POS_ACT": 12.5, "M2_POS_ACT": -12.5}


def test_what_can_only_be_written_is_not_read() -> None:
    only = next(register for register in MAP if not register.reads)
    with pytest.raises(Misuse, match=f"{only.name} can only be written"):
        plan(MAP, [RegisterItem(only)])


def test_values_as_people_type_them() -> None:
    control, output, acc = MAP.named("PROGRAM_CTRL"), MAP.named("OUT1"), MAP.named("M1_ACC")
    assert value_of(control, "start") == 1
    assert value_of(output, " ON ") == 1.0
    assert value_of(output, "false") == 0.0
    assert value_of(acc, "12,5") == 12.5
    assert value_of(control, "0x1") == 1
    for register, typed, text in (
        (control, "often", "'often' is not a number, or STOP, START, PAUSE"),
        (output, "up", "'up' is not a number, or on, off"),
        (acc, "on", "'on' is not a number$"),
    ):
        with pytest.raises(Misuse, match=text):
            value_of(register, typed)


REPEATED = [
    pdu.ReadRequest(3, 10020, 2),
    pdu.WriteCoilRequest(2000, True),  # M1_EN
    pdu.WriteCoilRequest(2004, True),  # M1_STOP
    pdu.WriteCoilRequest(2008, True),  # M1 JOG_PLUS
    pdu.WriteRegisterRequest(10003, 0),  # PROGRAM_CTRL: stop
    pdu.WriteRegistersRequest(10003, (0,)),
    pdu.WriteRegisterRequest(10016, 15),  # M_STOP
    pdu.WriteRegistersRequest(10036, (0, 0)),  # M1_ACC
    pdu.WriteRegistersRequest(10068, (0, 0)),  # M1_VEL_ABS
    pdu.WriteRegistersRequest(10084, (0, 0)),  # M1_POS_ABS
    pdu.WriteRegistersRequest(100, (1, 2, 3)),  # user registers
]
ONCE = [
    pdu.WriteRegisterRequest(10003, 1),  # PROGRAM_CTRL: start
    pdu.WriteRegisterRequest(10003, 2),  # pause
    pdu.WriteRegisterRequest(10005, 1),  # AXIS_VEL_ABS_TRIG
    pdu.WriteRegisterRequest(10007, 1),  # AXIS_POS_ABS_TRIG
    pdu.WriteRegistersRequest(10060, (0, 0)),  # M1_HOME
    pdu.WriteRegistersRequest(10076, (0, 0)),  # M1_VEL_REL
    pdu.WriteRegistersRequest(10092, (0, 0)),  # M1_POS_REL
    pdu.WriteRegistersRequest(10090, (0, 0, 0, 0)),  # M4_POS_ABS and M1_POS_REL
    pdu.WriteRegisterRequest(9000, 1),  # nobody knows what that is
]


@pytest.mark.parametrize("request_", REPEATED, ids=str)
def test_what_may_be_repeated(request_: pdu.ModbusRequest) -> None:
    assert repeatable(MAP, request_)


@pytest.mark.parametrize("request_", ONCE, ids=str)
def test_what_is_sent_once(request_: pdu.ModbusRequest) -> None:
    assert not repeatable(MAP, request_)


MOVING = {10005, 10007, 10060, 10068, 10076, 10084, 10090, 10092, 2008, 9000}
"""First addresses of those requests above that begin a motion, or nobody knows."""


@pytest.mark.parametrize("request_", [*REPEATED, *ONCE], ids=str)
def test_what_may_begin_a_motion(request_: pdu.ModbusRequest) -> None:
    starts_program = request_ == pdu.WriteRegisterRequest(10003, 1)
    assert moves(MAP, request_) == (request_.address in MOVING or starts_program)


@pytest.mark.parametrize(
    ("request_", "ended"),
    [
        (pdu.WriteCoilRequest(2005, True), (2,)),  # M2_STOP
        (pdu.WriteCoilRequest(2005, False), ()),
        (pdu.WriteCoilRequest(2010, False), (2,)),  # M2_JOG_PLUS
        (pdu.WriteCoilRequest(2011, False), (2,)),  # M2_JOG_MINUS
        (pdu.WriteCoilRequest(2011, True), ()),
        (pdu.WriteRegisterRequest(10016, 0xFA), (2, 4)),  # M_STOP
        (pdu.WriteRegistersRequest(10016, (5,)), (1, 3)),
        (pdu.WriteRegisterRequest(10003, 0), (PROGRAM,)),  # PROGRAM_CTRL
        (pdu.WriteRegistersRequest(10003, (0,)), (PROGRAM,)),
        (pdu.WriteRegistersRequest(10003, (2,)), (PROGRAM,)),
        (pdu.WriteRegistersRequest(10003, (1,)), ()),
        (pdu.WriteRegistersRequest(10003, (2, 0)), (PROGRAM,)),  # and AXIS_CTR_MODE
        (pdu.WriteRegistersRequest(10003, (2, 1, 1)), ()),  # and a trigger
        (pdu.WriteRegistersRequest(10014, (0, 0, 2)), (2,)),  # M_ENABLE, M_DISABLE, M_STOP
        (pdu.WriteRegistersRequest(9000, (0,)), ()),
        (pdu.ReadRequest(3, 10003, 1), ()),
    ],
    ids=str,
)
def test_what_a_write_ends(request_: pdu.ModbusRequest, ended: tuple[int, ...]) -> None:
    assert halted(MAP, request_) == ended
    assert not (ended and (moves(MAP, request_) or starts_program(MAP, request_)))


# ---------------------------------------------------------------------- names


@pytest.mark.parametrize(
    ("text", "name", "address", "size"),
    [
        ("m1_pos_act", "M1_POS_ACT", 10020, 2),
        (" M_STATUS ", "M_STATUS", 10009, 1),
        ("OUT3", "OUT3", 6002, 1),
        ("USER_REGISTER[0]", "USER_REGISTER[0]", 0, 1),
        ("user_register[1999]:INT", "USER_REGISTER[1999]:int", 1999, 1),
        ("USER_REGISTER[7]:word", "USER_REGISTER[7]", 7, 1),
        ("USER_REGISTER[1998]:dint", "USER_REGISTER[1998]:dint", 1998, 2),
        ("USER_REGISTER[4]:real", "USER_REGISTER[4]:real", 4, 2),
    ],
)
def test_names_of_values(text: str, name: str, address: int, size: int) -> None:
    item = named(MAP, text)
    assert (item.name, item.address, item.size) == (name, address, size)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("M1 POS", f"'M1 POS' is not a name of a value: {FORM()}"),
        ("M1_ACC[0]", "'M1_ACC[0]': M1_ACC is one value of type REAL/DINT; name it without [ ] and :"),
        ("M1_ACC:dint", "'M1_ACC:dint': M1_ACC is one value of type REAL/DINT; name it without [ ] and :"),
        ("USER_REGISTER", "'USER_REGISTER': choose one of USER_REGISTER[0] to USER_REGISTER[1999]"),
        ("USER_REGISTER[0]:byte", "'USER_REGISTER[0]:byte': permitted behind : are word, int, dint and real"),
        ("USER_REGISTER[2000]", "user register 2000 as WORD is outside 0 to 1999"),
        ("USER_REGISTER[1999]:real", "user register 1999 as REAL is outside 0 to 1998"),
        ("USER_REGISTER[5]:dint", "user register 5 as DINT: DINTs begin at even registers"),
    ],
)
def test_names_that_are_none(text: str, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        named(MAP, text)
    assert str(refused.value) == message


def test_several_user_registers_from_one_on() -> None:
    assert user_item(MAP, 1990, UserFormat.REAL, 5).at(1992).name == "USER_REGISTER[1992]:real"
    with pytest.raises(Misuse, match=r"user register 1992 as REAL × 5 is outside 0 to 1990"):
        user_item(MAP, 1992, UserFormat.REAL, 5)
    with pytest.raises(Misuse, match="user register -1 as INT is outside 0 to 1999"):
        user_item(MAP, -1, UserFormat.INT)


def test_items_of_one_register_and_view_are_one() -> None:
    one, other = named(MAP, "USER_REGISTER[4]"), named(MAP, "USER_REGISTER[4]:int")
    assert one == named(MAP, "user_register[4]:word")
    assert len({one, other, named(MAP, "user_register[4]")}) == 2
    assert one != "USER_REGISTER[4]"
    assert repr(other) == "<Item USER_REGISTER[4]:int>"
    mixed = [named(MAP, name) for name in ("OUT2", "IN1", "M1_ACC", "OUT1", "USER_REGISTER[4]")]
    assert [item.name for item in sorted(mixed)] == ["OUT1", "OUT2", "IN1", "USER_REGISTER[4]", "M1_ACC"]


# ---------------------------------------------------------------------- values in words

WRITTEN = [
    # value, DATA_TYPE, request (manual 3.2: the low word comes first)
    ("M1_EN", 1, DataType.REAL, pdu.WriteCoilRequest(2000, True)),
    ("OUT8", 0, DataType.DINT, pdu.WriteCoilRequest(6007, False)),
    ("M_ENABLE", 15, DataType.REAL, pdu.WriteRegisterRequest(10014, 15)),
    ("M2_POS_ABS", 12.5, DataType.REAL, pdu.WriteRegistersRequest(10086, (0, 0x4148))),
    ("M2_POS_ABS", -2, DataType.DINT, pdu.WriteRegistersRequest(10086, (0xFFFE, 0xFFFF))),
    ("JOG_SPEED", 1.0, DataType.DINT, pdu.WriteRegistersRequest(10017, (0, 0x3F80))),
    ("ENC1_IMP", 65537, DataType.REAL, pdu.WriteRegistersRequest(10100, (1, 1))),
    ("USER_REGISTER[3]", 65535, DataType.REAL, pdu.WriteRegisterRequest(3, 0xFFFF)),
    ("USER_REGISTER[3]:int", -32768, DataType.REAL, pdu.WriteRegisterRequest(3, 0x8000)),
    ("USER_REGISTER[3]:int", 32767, DataType.REAL, pdu.WriteRegisterRequest(3, 0x7FFF)),
    ("USER_REGISTER[4]:dint", 65536, DataType.REAL, pdu.WriteRegistersRequest(4, (0, 1))),
    ("USER_REGISTER[4]:real", -12.5, DataType.DINT, pdu.WriteRegistersRequest(4, (0, 0xC148))),
]


@pytest.mark.parametrize(("name", "value", "data_type", "request_"), WRITTEN, ids=str)
def test_values_that_are_written_and_read(name: str, value: float, data_type: DataType, request_: pdu.ModbusRequest) -> None:
    item = named(MAP, name)
    assert encoded(item, value, data_type) == request_
    match request_:
        case pdu.WriteCoilRequest(on=on):
            words: tuple[int, ...] = (int(on),)
        case pdu.WriteRegisterRequest(value=word):
            words = (word,)
        case _:
            words = request_.values  # type: ignore[union-attr]
    assert decoded(item, words, data_type) == value
    assert isinstance(decoded(item, words, data_type), bool) == isinstance(request_, pdu.WriteCoilRequest)


@pytest.mark.parametrize(
    ("name", "value", "data_type", "message"),
    [
        ("M1_STATUS", 1, DataType.REAL, "M1_STATUS can only be read"),
        ("OUT1", 2, DataType.REAL, "OUT1 = 2: permitted are 0 (OFF) and 1 (ON)"),
        ("M1_POS_ABS", 0.5, DataType.DINT, "M1_POS_ABS = 0.5 imp: a whole number is needed"),
        ("M1_POS_ABS", float("inf"), DataType.DINT, "M1_POS_ABS = inf imp: a whole number is needed"),
        ("M1_ACC", 0, DataType.REAL, "M1_ACC = 0 mm/s²: permitted > 0 mm/s²"),
        ("M1_VEL_ABS", float("nan"), DataType.REAL, "M1_VEL_ABS = nan mm/s: permitted any finite number mm/s"),
        ("DATA_TYPE", 2, DataType.REAL, "DATA_TYPE = 2: permitted 0…1"),
        ("USER_REGISTER[3]", 65536, DataType.REAL, "USER_REGISTER[3] = 65536: permitted 0…65535"),
        ("USER_REGISTER[3]", -1, DataType.REAL, "USER_REGISTER[3] = -1: permitted 0…65535"),
        ("USER_REGISTER[3]:int", -32769, DataType.REAL, "USER_REGISTER[3]:int = -32769: permitted −32768…32767"),
        ("USER_REGISTER[3]:int", 32768, DataType.REAL, "USER_REGISTER[3]:int = 32768: permitted −32768…32767"),
        ("USER_REGISTER[4]:dint", 1.5, DataType.REAL, "USER_REGISTER[4]:dint = 1.5: a whole number is needed"),
    ],
)
def test_values_that_are_refused(name: str, value: float, data_type: DataType, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        encoded(named(MAP, name), value, data_type, "mm")
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("names", "reads"),
    [
        # A bridge is at most 16 registers or 256 bits, over what can be read.
        (["USER_REGISTER[0]", "USER_REGISTER[17]"], [(3, 0, 18)]),
        (["USER_REGISTER[0]", "USER_REGISTER[18]"], [(3, 0, 1), (3, 18, 1)]),
        (["USER_REGISTER[0]:real", "USER_REGISTER[18]:dint"], [(3, 0, 20)]),
        (["USER_REGISTER[2]:real", "USER_REGISTER[3]"], [(3, 2, 2)]),
        (["M1_POS_ACT", "M1_ACC"], [(3, 10020, 18)]),
        (["M1_POS_ACT", "M2_ACC"], [(3, 10020, 20)]),
        (["M1_VMAX", "ENC1_IMP"], [(3, 10052, 2), (3, 10100, 2)]),
        (["M4_STATUS", "M1_POS_ACT"], [(3, 10013, 1), (3, 10020, 2)]),
        (["IN1", "IN20"], [(2, 5000, 20)]),
        (["OUT8", "IN3", "OUT2"], [(1, 6001, 7), (2, 5002, 1)]),
        ([f"USER_REGISTER[{n}]" for n in range(126)], [(3, 0, 125), (3, 125, 1)]),
    ],
)
def test_reads_over_gaps(names: list[str], reads: list[tuple[int, int, int]]) -> None:
    blocks = plan(MAP, [named(MAP, name) for name in names])
    assert [(block.request.function, block.request.address, block.request.count) for block in blocks] == reads
