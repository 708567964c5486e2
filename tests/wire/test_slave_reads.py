"""Reads that leave a port as it was."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from steptwin.wire.crc import with_crc
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

NewBank = Callable[[], Any]


def hexed(text: str) -> bytes:
    return with_crc(bytes.fromhex(text))


@pytest.fixture
def bank(new_bank: NewBank) -> Any:
    return new_bank()


LONE_READS = (
    ("01 01 13 88 00 08", True),
    ("01 02 13 88 00 08", True),
    ("01 03 03 FC 00 02", True),
    ("01 05 17 71 00 00", False),  # writes
    ("01 06 03 E8 00 01", False),
    ("02 03 03 FC 00 02", False),  # another slave's
    ("01 04 03 FC 00 02", False),  # not implemented
    ("01 03 03 FC 00", False),  # not whole
    ("01 03 03 FC 00 02 00", False),  # more than one frame
)


@pytest.mark.parametrize(("request_", "is_lone"), LONE_READS)
def test_a_lone_read_over_rtu(bank: Any, request_: str, is_lone: bool) -> None:
    """Golden frames of the manuals with function 01, 02, 03; nothing is executed by asking."""
    assert RtuSlavePort({1: bank}).is_lone_read(hexed(request_)) is is_lone
    assert bank.executed == []


def test_a_lone_read_over_rtu_is_intact_and_begins_a_frame(bank: Any) -> None:
    frame = hexed("01 03 03 FC 00 02")
    port = RtuSlavePort({1: bank})
    assert not port.is_lone_read(frame[:-1] + bytes((frame[-1] ^ 1,)))
    port.exchange(frame[:3], 0)
    assert not port.is_lone_read(frame)
    assert not RtuSlavePort({1: bank}, line=SerialLine(38400)).is_lone_read(frame)  # characters take time


@pytest.mark.parametrize(
    ("header", "pdu", "is_lone"),
    [
        ("00 07 00 00 00 06 01", "01 13 88 00 08", True),
        ("FF FF 00 00 00 06 02", "02 13 88 00 08", True),  # any transaction, any unit: all are answered
        ("00 07 00 00 00 06 01", "03 03 FC 00 02", True),
        ("00 07 00 00 00 06 01", "06 03 E8 00 01", False),
        ("00 07 00 00 00 06 01", "04 03 E8 00 01", False),
        ("00 07 00 01 00 06 01", "03 03 FC 00 02", False),  # not Modbus
        ("00 07 01 00 00 06 01", "03 03 FC 00 02", False),
        ("00 07 00 00 01 06 01", "03 03 FC 00 02", False),  # a length that is not that of the frame
        ("00 07 00 00 00 07 01", "03 03 FC 00 02", False),
        ("00 07 00 00 00 05 01", "03 03 FC 00", False),
        ("00 07 00 00 00 06 01", "03 03 FC 00 02 00", False),
    ],
)
def test_a_lone_read_over_tcp(bank: Any, header: str, pdu: str, is_lone: bool) -> None:
    assert TcpSlavePort({1: bank}).is_lone_read(bytes.fromhex(header + pdu)) is is_lone
    assert bank.executed == []


def test_a_lone_read_over_tcp_begins_a_frame_of_an_open_connection(bank: Any) -> None:
    frame = bytes.fromhex("00 07 00 00 00 06 01 03 03 FC 00 02")
    port = TcpSlavePort({1: bank})
    port.exchange(frame[:3], 0)
    assert not port.is_lone_read(frame)
    port = TcpSlavePort({1: bank})
    port.exchange(bytes.fromhex("00 07 00 01 00 06 01 03 03 FC 00 02"), 0)
    assert port.broken
    assert not port.is_lone_read(frame)


def test_ports_with_timing_have_no_lone_reads(bank: Any) -> None:
    """A request takes the line and the controller for some time."""
    units = TimedUnits({1: bank}, LineTiming(SerialLine(38400)))
    assert not TimedRtuSlavePort(units).is_lone_read(hexed("01 03 03 FC 00 02"))
