"""A device to put behind a port, and the frames of the manuals."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import pytest
from register_bank import RegisterBank

from steptwin.wire import pdu as modbus


@pytest.fixture(scope="session")
def new_bank() -> Callable[[], RegisterBank]:
    return RegisterBank


@pytest.fixture
def bank() -> RegisterBank:
    return RegisterBank()


class Example(NamedTuple):
    """One exchange as bytes and as values."""

    request_pdu: str
    request: modbus.ModbusRequest
    response_pdu: str
    response: modbus.ModbusResponse


# Printed in the Modbus application protocol V1.1b3, sections 6.1 to 6.12 (addresses there count from 1 in the text).
EXAMPLES = [
    Example(
        "01 00 13 00 13", modbus.ReadRequest(1, 0x13, 19),
        "01 03 CD 6B 05", modbus.BitsResponse(1, bytes.fromhex("CD6B05")),
    ),
    Example(
        "02 00 C4 00 16", modbus.ReadRequest(2, 0xC4, 22),
        "02 03 AC DB 35", modbus.BitsResponse(2, bytes.fromhex("ACDB35")),
    ),
    Example(
        "03 00 6B 00 03", modbus.ReadRequest(3, 0x6B, 3),
        "03 06 02 2B 00 00 00 64", modbus.RegistersResponse((0x022B, 0, 0x64)),
    ),
    Example(
        "05 00 AC FF 00", modbus.WriteCoilRequest(0xAC, True),
        "05 00 AC FF 00", modbus.WriteCoilRequest(0xAC, True),
    ),
    Example(
        "06 00 01 00 03", modbus.WriteRegisterRequest(1, 3),
        "06 00 01 00 03", modbus.WriteRegisterRequest(1, 3),
    ),
    Example(
        "10 00 01 00 02 04 00 0A 01 02", modbus.WriteRegistersRequest(1, (10, 0x102)),
        "10 00 01 00 02", modbus.WriteResponse(1, 2),
    ),
]  # fmt: skip


@pytest.fixture(params=EXAMPLES, ids=lambda example: f"function {example.request_pdu[:2]}")
def example(request: pytest.FixtureRequest) -> Example:
    return request.param


# Printed in the MIC488 manuals, with the misprinted CRC of the last one corrected (8E B4 instead of 04 7F).
GOLDEN = {
    "01 02 13 88 00 08 FD 62": modbus.ReadRequest(2, 5000, 8),
    "01 05 17 71 00 00 98 65": modbus.WriteCoilRequest(6001, False),
    "01 03 03 FC 00 02 04 7F": modbus.ReadRequest(3, 1020, 2),
    "01 03 27 24 00 02 8E B4": modbus.ReadRequest(3, 10020, 2),
}


@pytest.fixture(params=GOLDEN.items(), ids=lambda item: item[0])
def golden(request: pytest.FixtureRequest) -> tuple[bytes, modbus.ModbusRequest]:
    """A whole RTU request frame of a manual and what it says."""
    text, decoded = request.param
    return bytes.fromhex(text), decoded
