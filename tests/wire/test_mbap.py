from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU

from steptwin.errors import Misuse
from steptwin.wire import mbap
from steptwin.wire.mbap import TcpFrame, TcpFramer, encode_frame

# Modbus messaging on TCP/IP V1.0b, section 4.4.2.3: transaction 15 01, unit FF, read of register 5.
EXAMPLE = bytes.fromhex("15 01 00 00 00 06 FF 03 00 04 00 01")


def test_example_of_the_specification() -> None:
    assert encode_frame(0x1501, 0xFF, bytes.fromhex("03 00 04 00 01")) == EXAMPLE
    (frame,) = TcpFramer().feed(EXAMPLE)
    assert (frame.transaction, frame.unit, frame.pdu, frame.raw) == (0x1501, 0xFF, bytes.fromhex("03 00 04 00 01"), EXAMPLE)


def test_frames_are_those_of_pymodbus() -> None:
    used, unit, transaction, pdu = FramerSocket(DecodePDU(True)).decode(EXAMPLE)
    assert (used, unit, transaction, pdu) == (12, 0xFF, 0x1501, EXAMPLE[7:])
    assert FramerSocket(DecodePDU(True)).encode(pdu, unit, transaction) == EXAMPLE


frames = st.builds(encode_frame, st.integers(0, 0xFFFF), st.integers(0, 255), st.binary(min_size=1, max_size=253))


LONGEST_FRAME = 6 + mbap.LONGEST_LENGTH


@given(st.lists(frames, max_size=10), st.lists(st.integers(0, 600), max_size=20))
def test_frames_come_whole_and_in_order_however_they_are_split(sent: list[bytes], places: list[int]) -> None:
    stream, framer = b"".join(sent), TcpFramer()
    edges = [0, *sorted(places), len(stream)]
    found = []
    for a, b in pairwise(edges):
        found += framer.feed(stream[a:b])
        assert len(framer.held) < mbap.MAX_FRAME
    assert found == [TcpFrame(raw) for raw in sent]
    assert (framer.held, framer.broken) == (b"", None)


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ("00 01 00 01 00 06", "MBAP protocol 1 is not 0"),
        ("47 45 54 20 2F 20", "MBAP protocol 21536 is not 0"),  # GET / of a lost browser
        ("00 01 00 00 00 00", "MBAP length 0 is outside 2 to 262 bytes"),
        ("00 01 00 00 00 01", "MBAP length 1 is outside 2 to 262 bytes"),
        ("00 01 00 00 01 07", "MBAP length 263 is outside 2 to 262 bytes"),
    ],
)
def test_a_wrong_header_ends_the_connection_behind_the_good_frames(header: str, reason: str) -> None:
    framer = TcpFramer()
    assert framer.feed(EXAMPLE + bytes.fromhex(header)[:5]) == [TcpFrame(EXAMPLE)]
    assert framer.feed(bytes.fromhex(header)[5:] + EXAMPLE) == []
    assert framer.broken == reason
    assert framer.feed(EXAMPLE) == []
    assert framer.held == b""


@given(st.lists(st.binary(max_size=300), max_size=8))
def test_whatever_comes_memory_is_bounded(pieces: list[bytes]) -> None:
    framer = TcpFramer()
    for data in pieces:
        for frame in framer.feed(data):
            assert 8 <= len(frame.raw) <= LONGEST_FRAME
            if len(frame.raw) <= mbap.MAX_FRAME:
                assert encode_frame(frame.transaction, frame.unit, frame.pdu) == frame.raw
        assert len(framer.held) < LONGEST_FRAME


@pytest.mark.parametrize(
    ("transaction", "unit", "size", "message"),
    [
        (65536, 1, 5, "transaction 65536 is outside 0 to 65535"),
        (0, 256, 5, "unit 256 is outside 0 to 255"),
        (0, 1, 0, "a PDU of 0 bytes is outside 1 to 253"),
        (0, 1, 254, "a PDU of 254 bytes is outside 1 to 253"),
    ],
)
def test_frames_that_cannot_be(transaction: int, unit: int, size: int, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        encode_frame(transaction, unit, bytes(size))
    assert str(misuse.value) == message


@pytest.mark.parametrize("length", [2, 254, 262])
def test_lengths_that_are_none_too_many(length: int) -> None:
    """262: a request to write 123 registers that says it has 255 bytes."""
    frame = bytes((0, 1, 0, 0, *length.to_bytes(2, "big"), 1)) + bytes(length - 1)
    framer = TcpFramer()
    assert framer.feed(frame) == [TcpFrame(frame)]
    assert framer.broken is None
