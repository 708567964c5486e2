"""Modbus TCP: frames behind the seven-byte MBAP header (Modbus messaging on TCP/IP V1.0b, section 3.1.3).

The header is transaction (2 bytes, repeated in the response), protocol (2, always 0), length of what follows (2), unit (1).
Nothing in the stream marks where a frame begins, so after a wrong header no byte can be trusted: the connection ends.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.state import Stateful
from steptwin.wire.pdu import MAX_PDU

HEADER_BYTES = 7
MIN_LENGTH = 2
"""Bytes of unit and PDU together, as stated in the header."""
MAX_FRAME = HEADER_BYTES + MAX_PDU
LONGEST_LENGTH = 1 + 6 + 255
"""That of a function 16 with the largest byte count: too long for the protocol, but taken, so that a quantity above the permitted
one is answered with exception 03 (MIC-24) and not with a closed connection."""

_HEADER = struct.Struct(">HHHB")
_PROTOCOL_AND_LENGTH = struct.Struct(">HH")


class TcpFrame(NamedTuple):
    raw: bytes
    """The whole frame with its header."""

    @property
    def transaction(self) -> int:
        return self.raw[0] << 8 | self.raw[1]

    @property
    def unit(self) -> int:
        return self.raw[6]

    @property
    def pdu(self) -> bytes:
        return self.raw[7:]


def encode_frame(transaction: int, unit: int, pdu: bytes) -> bytes:
    """Header and PDU. `Misuse` for a transaction outside 16 bits, a unit outside 0 to 255, a PDU outside 1 to 253 bytes."""
    if not 0 <= transaction <= 0xFFFF:
        raise Misuse(f"transaction {transaction} is outside 0 to 65535")
    if not 0 <= unit <= 0xFF:
        raise Misuse(f"unit {unit} is outside 0 to 255")
    if not 1 <= len(pdu) <= MAX_PDU:
        raise Misuse(f"a PDU of {len(pdu)} bytes is outside 1 to {MAX_PDU}")
    return _HEADER.pack(transaction, 0, len(pdu) + 1, unit) + pdu


class TcpFramer(Stateful):
    """Cuts the frames of one direction of one connection, less than 268 bytes held between calls."""

    __slots__ = ("broken", "held")

    def __init__(self) -> None:
        self.held = b""
        """The beginning of a frame whose rest has not come."""
        self.broken: str | None = None
        """Reason to close the connection, after a wrong header; no further frames are cut."""

    def feed(self, data: bytes) -> list[TcpFrame]:
        """The frames completed by ``data``, in order."""
        frames: list[TcpFrame] = []
        if self.broken is not None:
            return frames
        held = self.held + data if self.held else data
        start, size = 0, len(held)
        while size - start >= 6:
            protocol, length = _PROTOCOL_AND_LENGTH.unpack_from(held, start + 2)
            if protocol != 0 or not MIN_LENGTH <= length <= LONGEST_LENGTH:
                self.broken = (
                    f"MBAP protocol {protocol} is not 0"
                    if protocol != 0
                    else f"MBAP length {length} is outside {MIN_LENGTH} to {LONGEST_LENGTH} bytes"
                )
                start = size
                break
            end = start + 6 + length
            if end > size:
                break
            frames.append(TcpFrame(held[start:end]))
            start = end
        self.held = held[start:]
        return frames
