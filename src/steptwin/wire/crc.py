"""CRC-16/MODBUS, sent low byte first."""

from __future__ import annotations

__all__ = ["crc16", "is_intact", "table_crc16", "with_crc"]


def _remainder(value: int) -> int:
    """The remainder of one byte; polynomial A001 (8005 reflected)."""
    for _ in range(8):
        value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return value


_REMAINDERS = tuple(map(_remainder, range(256)))


def table_crc16(data: bytes | bytearray) -> int:
    """The CRC of ``data``, without a compiled library."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _REMAINDERS[(crc ^ byte) & 0xFF]
    return crc


try:
    from fastcrc.crc16 import modbus as crc16
except ImportError:  # where there are no compiled wheels, as in a browser
    crc16 = table_crc16


def with_crc(body: bytes) -> bytes:
    """``body`` followed by its CRC, as it goes on the wire."""
    return body + crc16(body).to_bytes(2, "little")


def is_intact(frame: bytes | bytearray) -> bool:
    """Whether the last two bytes are the CRC of those before.

    The CRC over a frame and its own CRC is 0. It stays 0 when zero bytes follow, so the caller must know the length.
    """
    return crc16(frame) == 0
