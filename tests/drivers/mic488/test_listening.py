"""Listening in on Modbus: which frame asks and which answers, and what is neither."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND
from steptwin.drivers.mic488.frames import FrameLog, ObservedFrame
from steptwin.drivers.mic488.listening import RtuListener, TcpListener
from steptwin.mic488.registermap import DataType
from steptwin.wire import mbap
from steptwin.wire.crc import with_crc
from steptwin.wire.rtu import BURSTY_GAP_NS
from steptwin.wire.slave import FrameDirection

READ, ANSWER = bytes.fromhex("01 03 27 24 00 02 8E B4"), bytes.fromhex("01 03 04 00 00 41 48 CA 55")
WRITE = bytes.fromhex("01 05 17 71 00 00 98 65")


def listener() -> tuple[RtuListener, list[ObservedFrame]]:
    words = FrameLog()
    heard: list[ObservedFrame] = []
    words.sinks.append(heard.append)
    return RtuListener(words), heard


def meanings(heard: list[ObservedFrame]) -> list[str]:
    return [f"{'?' if h.direction is None else '→' if h.direction is FrameDirection.IN else '←'} {h.meaning}" for h in heard]


@pytest.mark.parametrize("size", [1, 3, 100])
def test_questions_and_answers_of_one_wire(size: int) -> None:
    ear, heard = listener()
    stream = READ + ANSWER + WRITE + WRITE
    for at in range(0, len(stream), size):
        ear.feed(stream[at : at + size], at * MILLISECOND)
    assert meanings(heard) == [
        "→ unit 1: read M1_POS_ACT",
        "← unit 1: read M1_POS_ACT = 12.5 u",
        "→ unit 1: write OUT2 = OFF",
        "← unit 1: wrote OUT2 = OFF",
    ]


def test_noise_is_counted() -> None:
    ear, heard = listener()
    ear.feed(b"\xff\xfe\xfd" + READ, 0)
    assert meanings(heard)[0] == "→ unit 1: read M1_POS_ACT"
    assert "? no frame: 3 bytes" in meanings(heard)
    assert str(heard[-1]) == "    0.000000 s  ? no frame: 3 bytes"


def test_the_beginning_of_a_frame_that_never_ends_is_told_with_the_next() -> None:
    ear, heard = listener()
    ear.feed(READ[:5], 0)
    assert ear.deadline() == BURSTY_GAP_NS
    while (due := ear.deadline()) is not None:
        ear.expire(due)
    ear.feed(READ, 500 * MILLISECOND)
    ear.expire(500 * MILLISECOND + BURSTY_GAP_NS)
    assert meanings(heard) == ["→ unit 1: read M1_POS_ACT", "? no frame: 5 bytes"]


def test_both_directions_of_modbus_tcp() -> None:
    words = FrameLog(tcp=True)
    heard: list[ObservedFrame] = []
    words.sinks.append(heard.append)
    ear = TcpListener(words)
    for byte in mbap.encode_frame(7, 1, READ[1:-2]):
        ear.feed(bytes((byte,)), 1, FrameDirection.IN)
    ear.feed(mbap.encode_frame(7, 1, ANSWER[1:-2]), 2, FrameDirection.OUT)
    ear.feed(b"GET / HTTP/1.0\r\n\r\n", 3, FrameDirection.IN)
    ear.feed(mbap.encode_frame(8, 1, READ[1:-2]), 4, FrameDirection.IN)
    assert meanings(heard) == [
        "→ unit 1: read M1_POS_ACT",
        "← unit 1: read M1_POS_ACT = 12.5 u",
        "? no frame",
        "→ unit 1: read M1_POS_ACT",
    ]
    assert [(h.time, h.raw[:3]) for h in heard[2:]] == [(3, b"GET"), (4, bytes.fromhex("00 08 00"))]


def test_what_is_too_short_for_a_frame_is_none() -> None:
    """A unit, a function and a checksum, or an MBAP header and a function; what the function makes of it is its own affair."""
    for is_tcp, raw in ((False, bytes.fromhex("01 03 40 21")), (True, bytes.fromhex("0001 0000 0002 01 03"))):
        words = FrameLog(tcp=is_tcp)
        shorter, whole = words.frame(5, FrameDirection.IN, raw[:-1]), words.frame(5, FrameDirection.IN, raw)
        assert (shorter.time, shorter.direction, shorter.unit, shorter.meaning) == (5, None, None, "no frame")
        assert (whole.time, whole.direction, whole.unit) == (5, FrameDirection.IN, 1)
        assert whole.meaning.startswith("unit 1: ")


@pytest.mark.parametrize(
    ("first", "count", "is_learnt"), [(10000, 1, True), (9999, 2, True), (9999, 1, False), (10001, 1, False)]
)
def test_a_read_of_data_type_tells_how_values_travel(first: int, count: int, is_learnt: bool) -> None:
    """DATA_TYPE is 10000; 1 is DINT."""
    words = FrameLog(tcp=True)
    address = words._registers.of("DATA_TYPE").address
    begin = address + first - 10000
    request = bytes((3, *begin.to_bytes(2, "big"), 0, count))
    registers = [1 if begin + n == address else 0 for n in range(count)]
    answer = bytes((3, 2 * count)) + b"".join(value.to_bytes(2, "big") for value in registers)
    words.observe(0, FrameDirection.IN, mbap.encode_frame(1, 1, request))
    words.observe(1, FrameDirection.OUT, mbap.encode_frame(1, 1, answer))
    assert (words._wordings[1].data_type is DataType.DINT) is is_learnt


@pytest.mark.parametrize(("address", "is_learnt"), [(10000, True), (10001, False), (9999, False)])
def test_a_write_of_data_type_tells_how_values_travel(address: int, is_learnt: bool) -> None:
    words = FrameLog(tcp=True)
    request = bytes((6, *address.to_bytes(2, "big"), 0, 1))
    words.observe(0, FrameDirection.IN, mbap.encode_frame(1, 1, request))
    words.observe(1, FrameDirection.OUT, mbap.encode_frame(1, 1, request))
    assert (words._wordings[1].data_type is DataType.DINT) is is_learnt


@pytest.mark.parametrize("gap_ms", [4, 35])
def test_the_gap_that_ends_a_frame_is_a_choice(gap_ms: int) -> None:
    ear = RtuListener(FrameLog(), gap_ms * MILLISECOND)
    ear.feed(READ[:3], 0)
    due = ear.deadline()
    assert due is not None
    assert gap_ms * MILLISECOND <= due <= gap_ms * MILLISECOND + 1
    ear.expire(due)
    assert ear.deadline() is None


def test_an_answer_whose_question_was_not_heard_is_told() -> None:
    ear, heard = listener()
    ear.feed(ANSWER, 0)
    ear.feed(READ + ANSWER, 500 * MILLISECOND)
    assert [h.direction for h in heard] == [FrameDirection.OUT, FrameDirection.IN, FrameDirection.OUT]
    assert meanings(heard)[1:] == ["→ unit 1: read M1_POS_ACT", "← unit 1: read M1_POS_ACT = 12.5 u"]
    assert meanings(heard)[0].startswith("← unit 1: ")


def test_a_whole_frame_of_an_unknown_function_is_told_as_it_is() -> None:
    ear, heard = listener()
    frame = with_crc(b"\x01\x63\x05")
    ear.feed(frame, 0)
    ear.expire(BURSTY_GAP_NS)
    assert [(h.time, h.direction, h.unit, h.raw, h.meaning) for h in heard] == [(BURSTY_GAP_NS, None, None, frame, "no frame")]
