"""CRC-16/MODBUS, sent low byte first."""

from __future__ import annotations

from fastcrc.crc16 import modbus as crc16

__all__ = ["crc16", "is_intact", "with_crc"]


def with_crc(body: bytes) -> bytes:
    """``body`` followed by its CRC, as it goes on the wire."""
    return body + crc16(body).to_bytes(2, "little")


def is_intact(frame: bytes | bytearray) -> bool:
    """Whether the last two bytes are the CRC of those before.

    The CRC over a frame and its own CRC is 0. It stays 0 when zero bytes follow: the length has to come from elsewhere.
    """
    return crc16(frame) == 0
