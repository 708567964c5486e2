"""Planned reads, and which requests may be repeated."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType, Space, Type
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import Item, named, plan, repeatable, value_of
from steptwin.wire import pdu

MAP = register_map("1.70")
READABLE = [Item(register) for register in MAP if register.reads and register.type is not Type.MEMORY]


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
def test_every_value_is_in_one_block_and_no_block_touches_what_may_not_be_read(items: list[Item]) -> None:
    blocks = plan(MAP, items)
    assert sorted(item for block in blocks for item, _ in block.items) == sorted(set(items))
    assert len(blocks) <= len(set(items))
    for block in blocks:
        space = {1: Space.COIL, 2: Space.INPUT, 3: Space.HOLDING}[block.request.function]
        most = pdu.MAX_REGISTERS if space is Space.HOLDING else pdu.MAX_BITS
        assert 0 < block.request.count <= most
        pieces = MAP.pieces(space, block.request.address, block.request.count)
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
        plan(MAP, [Item(only)])


def test_values_as_people_type_them() -> None:
    control, output, acc = MAP.named("PROGRAM_CTRL"), MAP.named("OUT1"), MAP.named("M1_ACC")
    assert value_of(control, "start") == 1
    assert value_of(output, " ON ") == 1.0
    assert value_of(output, "false") == 0.0
    assert value_of(acc, "12,5") == 12.5
    assert value_of(acc, "0x10") == 16
    for register, typed, text in (
        (control, "often", "'often' is no number, or STOP, START, PAUSE"),
        (output, "up", "'up' is no number, or on, off"),
        (acc, "on", "'on' is no number$"),
    ):
        with pytest.raises(Misuse, match=text):
            value_of(register, typed)


REPEATED = [
    pdu.Read(3, 10020, 2),
    pdu.WriteCoil(2000, True),  # M1_EN
    pdu.WriteCoil(2004, True),  # M1_STOP
    pdu.WriteCoil(2008, True),  # M1 JOG_PLUS
    pdu.WriteRegister(10003, 0),  # PROGRAM_CTRL: stop
    pdu.WriteRegister(10016, 15),  # M_STOP
    pdu.WriteRegisters(10036, (0, 0)),  # M1_ACC
    pdu.WriteRegisters(10068, (0, 0)),  # M1_VEL_ABS
    pdu.WriteRegisters(10084, (0, 0)),  # M1_POS_ABS
    pdu.WriteRegisters(100, (1, 2, 3)),  # user registers
]
ONCE = [
    pdu.WriteRegister(10003, 1),  # PROGRAM_CTRL: start
    pdu.WriteRegister(10003, 2),  # pause
    pdu.WriteRegister(10005, 1),  # AXIS_VEL_ABS_TRIG
    pdu.WriteRegister(10007, 1),  # AXIS_POS_ABS_TRIG
    pdu.WriteRegisters(10060, (0, 0)),  # M1_HOME
    pdu.WriteRegisters(10076, (0, 0)),  # M1_VEL_REL
    pdu.WriteRegisters(10092, (0, 0)),  # M1_POS_REL
    pdu.WriteRegisters(10090, (0, 0, 0, 0)),  # M4_POS_ABS and M1_POS_REL
    pdu.WriteRegister(9000, 1),  # nobody knows what that is
]


@pytest.mark.parametrize("request_", REPEATED, ids=str)
def test_what_may_be_repeated(request_: pdu.Request) -> None:
    assert repeatable(MAP, request_)


@pytest.mark.parametrize("request_", ONCE, ids=str)
def test_what_is_sent_once(request_: pdu.Request) -> None:
    assert not repeatable(MAP, request_)
