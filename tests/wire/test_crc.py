from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from steptwin.wire.crc import crc16, is_intact, table_crc16, with_crc
from steptwin.wire.pdu import ModbusRequest


def bitwise_crc(data: bytes) -> int:
    """The definition: polynomial A001 (reflected 8005), start FFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def test_catalogue_check_value() -> None:
    assert crc16(b"123456789") == 0x4B37


@given(st.binary(max_size=300))
def test_equals_the_definition(data: bytes) -> None:
    assert crc16(data) == table_crc16(data) == bitwise_crc(data)


def test_golden_frames_are_intact(golden: tuple[bytes, ModbusRequest]) -> None:
    frame, _ = golden
    assert is_intact(frame)
    assert with_crc(frame[:-2]) == frame


def test_the_misprinted_crc_of_the_manual_is_not() -> None:
    assert not is_intact(bytes.fromhex("01 03 27 24 00 02 04 7F"))


@given(st.binary(min_size=1, max_size=254), st.integers(0, 255 * 8), st.integers(1, 0xFFFF))
def test_a_burst_of_up_to_16_wrong_bits_is_found(body: bytes, place: int, pattern: int) -> None:
    frame = with_crc(body)
    wrong = int.from_bytes(frame, "little") ^ pattern << place % (8 * len(frame) - 15)
    assert not is_intact(wrong.to_bytes(len(frame), "little"))
