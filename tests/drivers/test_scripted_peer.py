"""The driver on a real serial port, against a peer that knows nothing but its script: these bytes, then those.

Requests the manual shows are checked against the manual's own bytes.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Sequence

import pytest

from steptwin.drivers import AsyncMic488, Mic488, ModbusRefusal, NoAnswer
from steptwin.wire.crc import crc16
from steptwin.wire.pdu import ReadRequest, WriteCoilRequest


def framed(text: str) -> bytes:
    """Unit, function and data in hexadecimal, with its CRC computed here."""
    crc, data = 0xFFFF, bytes.fromhex(text)
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return data + crc.to_bytes(2, "little")


PROBE = framed("01 03 2710 000E")
REAL_OFF = framed("01 03 1C" + "0000" * 14)
OPENING = [(PROBE, [REAL_OFF])] * 2
INPUTS = bytes.fromhex("01 02 13 88 00 08 FD 62")
OUT2_OFF = bytes.fromhex("01 05 17 71 00 00 98 65")
POSITION = bytes.fromhex("01 03 27 24 00 02 8E B4")


class Peer:
    """The far end of a serial line. ``script``: what is expected, and the pieces of the answer."""

    def __init__(self, script: Sequence[tuple[bytes, Sequence[bytes]]]) -> None:
        self._master, self._slave = os.openpty()
        self.port = os.ttyname(self._slave)
        self._script = script
        self.wrong: list[bytes] = []
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    def _play(self) -> None:
        for expected, pieces in self._script:
            heard = b""
            while len(heard) < len(expected):
                heard += os.read(self._master, 300)
            if heard != expected:
                self.wrong.append(heard)
                return
            for piece in pieces:
                os.write(self._master, piece)

    def end(self) -> None:
        """The script was played to its end, and nothing else was asked."""
        self._thread.join(60)
        assert not self._thread.is_alive()
        assert self.wrong == []
        os.close(self._master)
        os.close(self._slave)


def test_the_frames_of_the_manual() -> None:
    peer = Peer(
        [
            *OPENING,
            (INPUTS, [framed("01 02 01 05")]),
            (OUT2_OFF, [OUT2_OFF]),
            (POSITION, [framed("01 03 04 0000 4148")]),
        ]
    )
    with Mic488(peer.port, timeout_s=30.0) as mic:
        assert mic.request(ReadRequest(2, 5000, 8)).packed == b"\5"  # type: ignore[union-attr]
        assert mic.request(WriteCoilRequest(6001, False)) == WriteCoilRequest(6001, False)
        assert mic.registers(10020, 2) == (0, 0x4148)
    peer.end()


def test_answers_come_in_pieces_behind_noise_and_as_refusals() -> None:
    answer = framed("01 03 04 0000 4148")
    peer = Peer(
        [
            *OPENING,
            (POSITION, [answer[:3], answer[3:4], answer[4:]]),
            (POSITION, [b"\xff\x00\x01", answer]),
            (POSITION, [framed("01 83 02")]),
        ]
    )
    with Mic488(peer.port, timeout_s=30.0) as mic:
        assert mic.registers(10020, 2) == (0, 0x4148)
        assert mic.registers(10020, 2) == (0, 0x4148)
        with pytest.raises(ModbusRefusal, match="exception 02"):
            mic.registers(10020, 2)
    peer.end()


def test_an_adapter_that_echoes() -> None:
    peer = Peer(
        [
            (PROBE, [PROBE + REAL_OFF]),
            (PROBE, [PROBE, REAL_OFF]),
            (OUT2_OFF, [OUT2_OFF, OUT2_OFF]),
            (POSITION, [POSITION + framed("01 03 04 0000 4148")]),
        ]
    )
    with Mic488(peer.port, timeout_s=30.0) as mic:
        mic.set_output(2, False)
        assert mic.registers(10020, 2) == (0, 0x4148)
    peer.end()


def test_a_peer_that_falls_silent() -> None:
    peer = Peer([*OPENING, (POSITION * 3, [])])
    with Mic488(peer.port, timeout_s=0.2) as mic, pytest.raises(NoAnswer, match="tried 3 times; nothing was received"):
        mic.registers(10020, 2)
    peer.end()


def test_tasks_on_a_real_port() -> None:
    peer = Peer([*OPENING, (INPUTS, [framed("01 02 01 05")]), (POSITION, [framed("01 03 04 0000 4148")])])

    async def main() -> None:
        async with AsyncMic488(peer.port, timeout_s=30.0) as mic:
            await mic.request(ReadRequest(2, 5000, 8))
            assert await mic.registers(10020, 2) == (0, 0x4148)

    asyncio.run(main())
    peer.end()


def test_the_scripts_own_checksum() -> None:
    assert framed("01 03 27 24 00 02") == POSITION
    assert crc16(POSITION) == 0
