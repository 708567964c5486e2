"""The traffic of a line of MIC488 controllers in words, as `steptwin sniff` shows it."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.wire import mbap
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

READ, ANSWER = bytes.fromhex("01 03 27 24 00 02 8E B4"), bytes.fromhex("01 03 04 00 00 41 48 CA 55")
MEANINGS = ["unit 1: read M1_POS_ACT", "unit 1: read M1_POS_ACT = 12.5 u"]


@pytest.mark.parametrize("direction", [FrameDirection.IN, None])
def test_frames_of_a_serial_line_tell_their_direction_themselves(direction: FrameDirection | None) -> None:
    frames: list[FrameLine] = []
    decoder = ModbusDecoder(frames.append, "1.70", tcp=False)
    decoder.feed(READ, 1, direction)
    decoder.feed(ANSWER, 2, direction)
    assert frames == [
        FrameLine(1, "", FrameDirection.IN, READ, MEANINGS[0]),
        FrameLine(2, "", FrameDirection.OUT, ANSWER, MEANINGS[1]),
    ]


def test_frames_of_modbus_tcp_have_the_direction_of_their_connection() -> None:
    frames: list[FrameLine] = []
    decoder = ModbusDecoder(frames.append, "1.70", tcp=True)
    asked, answered = mbap.encode_frame(7, 1, READ[1:-2]), mbap.encode_frame(7, 1, ANSWER[1:-2])
    decoder.feed(asked, 1, FrameDirection.IN)
    decoder.feed(answered, 2, FrameDirection.OUT)
    assert frames == [
        FrameLine(1, "", FrameDirection.IN, asked, MEANINGS[0]),
        FrameLine(2, "", FrameDirection.OUT, answered, MEANINGS[1]),
    ]
    assert decoder.deadline() is None


def test_what_is_no_frame_is_told_after_a_silence() -> None:
    frames: list[FrameLine] = []
    decoder = ModbusDecoder(frames.append, "1.70", tcp=False)
    decoder.feed(b"\xff\x00", 0, FrameDirection.IN)
    due = decoder.deadline()
    assert due is not None
    assert due == 20 * MILLISECOND  # MIC-15
    decoder.expire(due - 1)
    assert frames == []
    decoder.expire(due)
    decoder.feed(b"\xff", 10**10, FrameDirection.IN)
    assert frames == [
        FrameLine(due, "", FrameDirection.OUT, b"", "no frame: 1 byte"),
        FrameLine(10**10, "", FrameDirection.OUT, b"", "no frame: 1 byte"),  # 00 could have been the unit of a broadcast
    ]


def test_the_addresses_are_those_of_the_firmware() -> None:
    frames: list[FrameLine] = []
    decoder = ModbusDecoder(frames.append, "1.23", tcp=False)
    decoder.feed(READ, 1, None)
    assert [line.meaning for line in frames] != MEANINGS[:1]
