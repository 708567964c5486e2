"""Lengths of frames: requests, responses, and what could be either."""

from __future__ import annotations

import pytest

from steptwin.wire import rtu
from steptwin.wire.crc import crc16, with_crc
from steptwin.wire.pdu import (
    decode_request,
)
from steptwin.wire.rtu import (
    BURSTY_GAP_NS,
    FrameRole,
    RtuFrame,
    RtuFramer,
    request_length,
    response_length,
)

GAP = BURSTY_GAP_NS


def hexed(text: str) -> bytes:
    """The frame of a body without CRC."""
    return with_crc(bytes.fromhex(text))


def cut(framer: RtuFramer, data: bytes, now: int = 0) -> list[tuple[str, FrameRole]]:
    return [(frame.raw[:-2].hex(" "), frame.role) for frame in framer.feed(data, now)]


@pytest.mark.parametrize(
    ("body", "length"),
    [
        ("01 01 00 00 00 01", 8), ("01 04 00 00 00 01", 8), ("01 07", 4), ("01 08 00 00 A5 37", 8), ("01 0B", 4), ("01 0C", 4),
        ("01 0F 00 13 00 0A 02 CD 01", 11), ("01 10 00 01 00 02 04 00 0A 01 02", 13), ("01 11", 4),
        ("01 14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 02", 19), ("01 15 0D 06 00 04 00 07 00 03 06 AF 04 BE 10 0D", 18),
        ("01 16 00 04 00 F2 00 25", 10), ("01 17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF", 19), ("01 18 04 DE", 6),
        ("01 2B 0E 01 00", 7),
    ],
)  # fmt: skip
def test_lengths_of_the_requests_of_the_specification(body: str, length: int) -> None:
    raw = hexed(body)
    assert request_length(raw) == length == len(raw)
    assert RtuFramer({1}).feed(raw, 0) == [RtuFrame(raw, FrameRole.REQUEST, length)]


@pytest.mark.parametrize(
    ("body", "length"),
    [
        ("01 01 03 CD 6B 05", 8), ("01 03 06 02 2B 00 00 00 64", 11), ("01 04 02 00 0A", 7), ("01 05 00 AC FF 00", 8),
        ("01 07 6D", 5), ("01 08 00 00 A5 37", 8), ("01 0B FF FF 01 08", 8), ("01 0C 08 00 00 01 08 01 21 20 00", 13),
        ("01 0F 00 13 00 0A", 8), ("01 10 00 01 00 02", 8),
        ("01 02 03 AC DB 35", 8), ("01 06 00 01 00 03", 8), ("01 15 0D 06 00 04 00 07 00 03 06 AF 04 BE 10 0D", 18),
        ("01 14 0C 05 06 0D FE 00 20 05 06 33 CD 00 40", 17),
        ("01 16 00 04 00 F2 00 25", 10), ("01 17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF", 17),
        ("01 18 00 06 00 02 01 B8 12 84", 12), ("01 81 02", 5), ("01 C1 01", 5),
    ],
)  # fmt: skip
def test_lengths_of_the_responses_of_the_specification(body: str, length: int) -> None:
    raw = hexed(body)
    assert response_length(raw) == length == len(raw)


def test_lengths_not_known_yet_and_impossible_ones() -> None:
    assert request_length(b"\x01") > rtu.MAX_FRAME
    assert request_length(bytes.fromhex("01 10 00 00 00 01")) > rtu.MAX_FRAME
    assert request_length(bytes.fromhex("01 41")) == -1
    assert request_length(bytes.fromhex("01 10 00 00 00 7C F8")) == -1  # 257 bytes
    assert response_length(bytes.fromhex("01 03 FC")) == -1
    assert response_length(bytes.fromhex("FF 01 03 02"), 1) == 7


def test_zeros_behind_a_response_belong_to_the_next_frame() -> None:
    """The CRC of a frame stays right when zeros follow: eight bytes here look like a request."""
    framer = RtuFramer({1})
    response, broadcast = hexed("02 03 02 12 34"), hexed("00 06 00 01 00 02")
    assert crc16(response + broadcast[:1]) == 0
    assert [frame.raw for frame in framer.feed(response + broadcast, 0)] == [response, broadcast]


LOOKALIKES = [
    with_crc(head + count)
    for unit in range(1, 248)
    for address in range(0x100, 0x200)
    for head in [bytes((unit, 1, address >> 8, address & 0xFF))]
    for count in [crc16(head).to_bytes(2, "little")]
    if 1 <= int.from_bytes(count, "big") <= 2000
]


"""Reads of bits whose first six bytes are an intact response with one byte of bits; what follows are zeros."""


def test_a_request_to_this_side_is_not_taken_for_a_shorter_response() -> None:
    assert len(LOOKALIKES) > 100
    for raw in LOOKALIKES:
        assert decode_request(raw[1:-2])
        framer = RtuFramer({raw[0]})
        frames = [frame for byte in raw for frame in framer.feed(bytes((byte,)), 0)]
        assert frames == RtuFramer({raw[0]}).feed(raw, 0) == [RtuFrame(raw, FrameRole.REQUEST, 8)]


def test_a_request_inside_the_response_of_another_unit_is_data() -> None:
    inner = hexed("01 06 00 01 00 02")
    outer = with_crc(bytes((2, 3, 10)) + inner + b"\0\0")
    for size in (1, 3, 100):
        framer = RtuFramer({1})
        stream = hexed("02 03 00 00 00 05") + outer
        frames = [frame for at in range(0, len(stream), size) for frame in framer.feed(stream[at : at + size], 0)]
        assert [(frame.raw, frame.role) for frame in frames[1:]] == [(outer, FrameRole.RESPONSE)]


def test_a_response_without_its_request_waits_for_what_tells_it_from_one() -> None:
    framer = RtuFramer({1})
    response = hexed("02 01 01 15")
    assert framer.feed(response, 0) == []
    assert framer.expire(GAP) == [RtuFrame(response, FrameRole.RESPONSE, 6)]


def test_after_a_beginning_given_up_too_a_response_without_its_request_waits() -> None:
    framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
    framer.feed(bytes.fromhex("01 10 27 38 00 7B F6 41"), 0)
    response = hexed("02 01 01 15")
    assert framer.feed(response, 1_000_000) == []
    frames = framer.expire(1_000_000 + rtu.UART_GAP_NS)
    assert [(frame.raw, frame.role) for frame in frames] == [(response, FrameRole.RESPONSE)]
    assert framer.unframed == 8


@pytest.mark.parametrize("unit", [248, 255])
def test_reserved_units_are_noise(unit: int) -> None:
    framer = RtuFramer({1})
    assert framer.feed(with_crc(bytes((unit, 3, 0, 0, 0, 1))), 0) == []
    good = hexed("01 03 27 24 00 02")
    assert [frame.raw for frame in framer.feed(good, 1)] == [good]
