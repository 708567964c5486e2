"""Records of a vision system on COM1, alone and between Modbus frames."""

from __future__ import annotations

import pytest
from mic488_rig import loaded, programmed, read_pdu

from steptwin.mic488.vision import Com1Port, VisionReceiver, VisionRecord, uses_vision
from steptwin.wire.line import SerialLine
from steptwin.wire.rtu import encode_frame
from steptwin.wire.slave import FrameDirection, RtuSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

RECORDS = [
    (b"N1 X2 Y3 A4\r", VisionRecord(1, 2, 3, 4)),
    (b"N12 X-2.5 Y+3,25 A-180\r\n", VisionRecord(12, -2.5, 3.25, -180)),
    (b"n7x1y2a3\n", VisionRecord(7, 1, 2, 3)),
    (b"noise N7 X1 Y2 A3\n", VisionRecord(7, 1, 2, 3)),
]


@pytest.mark.parametrize(("data", "record"), RECORDS)
def test_wbc_27_a_record_whole_byte_by_byte_and_with_what_follows(data: bytes, record: VisionRecord) -> None:
    assert VisionReceiver().feed(data) == [record]
    receiver = VisionReceiver()
    assert [found for byte in data for found in receiver.feed(bytes((byte,)))] == [record]
    assert VisionReceiver().feed(data + data + b"N1 X") == [record, record]


NO_RECORDS = (
    b"N1 X2 Y3\r",
    b"X1 Y2 A3 N4\r",
    b"N X1 Y2 A3\r",
    b"N1 X1 Y2 A3 B4\r",
    b"N1 X1.2.3 Y2 A3\r",
    b"\r\r",
    b"N" * 5000,
)


@pytest.mark.parametrize("data", NO_RECORDS)
def test_wbc_27_a_line_that_is_no_record_is_passed_over(data: bytes) -> None:
    receiver = VisionReceiver()
    assert receiver.feed(data) == []
    receiver.feed(b"\r")
    assert receiver.feed(b"N1 X2 Y3 A4\r") == [VisionRecord(1, 2, 3, 4)]


PROGRAM = """
L:
WAIT VisionNew = 1
$R0 = VisionNo
$R2 = VisionX
$R4 = VisionY
$R6 = VisionA
n = n + 1
$R8 = n
VisionNew = 0
JUMP L
"""


def test_a_program_sees_records() -> None:
    rig = programmed(PROGRAM)
    rig.start()
    rig.wait(1)
    port = Com1Port(rig.device)
    for number in (1, 2):
        port.exchange(f"N{number} X12.5 Y-7 A90\r\n".encode(), rig.now)
        rig.scheduler.deadline()
        rig.wait(1)
        assert [rig.r(n) for n in (0, 2, 4, 6, 8)] == [number, 12.5, -7, 90, number]
    assert (port.to_send(rig.now), port.deadline(), port.unframed) == ([], None, 0)


def test_wbc_15_modbus_and_records_on_one_port() -> None:
    rig = programmed(PROGRAM)
    rig.start()
    modbus = RtuSlavePort({1: rig.device})
    frames: list[FrameDirection] = []
    modbus.on_frame = lambda now, direction, frame: frames.append(direction)
    port = Com1Port(rig.device, modbus)
    ask = encode_frame(1, read_pdu(3, 0, 2))
    # A frame whose data look like a record is a frame.
    text = b"\rN9 X9 Y9 A9\r\n"
    write = encode_frame(1, bytes((16, 0, 100, 0, len(text) // 2, len(text))) + text)
    answers: list[int] = []
    for pieces in ([ask], [write], [write[:9], write[9:]], [b"N3 X1 Y2 A3\r" + ask], [b"N4 X1 ", ask, b"\r"]):
        rig.wait(0.5)
        answered = 0
        for piece in pieces:
            rig.wait(0.005)
            answered += bool(port.exchange(piece, rig.now))
        rig.scheduler.deadline()
        rig.wait(0.5)
        assert port.to_send(rig.now) == []
        answers.append(answered)
    assert answers == [1] * 5
    assert frames.count(FrameDirection.IN) == 5
    # The last line end may be the beginning of a frame.
    assert port.unframed == len(b"N3 X1 Y2 A3\r" + b"N4 X1 ")
    assert (rig.r(0), rig.r(8)) == (3, 1)


def test_wbc_15_a_frame_that_came_in_pieces_leaves_nothing_of_a_record() -> None:
    """Its first piece looks like the beginning of one; what comes after the frame is not the end of it."""
    rig = programmed(PROGRAM)
    rig.start()
    rig.wait(0.1)
    port = Com1Port(rig.device, RtuSlavePort({1: rig.device}))
    text = b"\rN9 X9 Y9 \0"
    write = encode_frame(1, bytes((16, 0, 100, 0, len(text) // 2, len(text))) + text)
    cut = write.index(b"Y9 ") + 3
    assert port.exchange(write[:cut], rig.now) == b""
    assert port.exchange(write[cut:], rig.now) != b""
    port.exchange(b"A7\r", rig.now)
    rig.wait(0.1)
    assert rig.r(8) == 0
    port.exchange(b"N4 X1 Y2 A3\r", rig.now)
    rig.scheduler.deadline()
    rig.wait(0.1)
    assert (rig.r(0), rig.r(8)) == (4, 1)


def test_wbc_15_a_frame_found_when_the_line_falls_silent_leaves_nothing_of_a_record() -> None:
    """With line timing a frame is complete when its last character has arrived, after the call that brings it."""
    rig = programmed(PROGRAM)
    rig.start()
    rig.wait(0.1)
    port = Com1Port(rig.device, TimedRtuSlavePort(TimedUnits({1: rig.device}, LineTiming(SerialLine(38400)))))
    texts = (f"\rN9 X{x:04} Y9".encode() for x in range(10_000))
    frames = (encode_frame(1, bytes((16, 0, 100, 0, len(text) // 2, len(text))) + text) for text in texts)
    # Up to its checksum it looks like the beginning of a record.
    frame = next(frame for frame in frames if frame[-2:].isdigit())
    for record in (b"A7\r", b"N4 X1 Y2 A3\r"):
        assert port.exchange(frame, rig.now) == b""
        while (due := port.deadline()) is not None:
            rig.wait_ns(due - rig.now)
            port.to_send(rig.now)
        port.exchange(record, rig.now)
        rig.wait(0.1)
    assert (rig.r(0), rig.r(8)) == (4, 1)


def test_wbc_15_a_frame_before_a_record_leaves_it_whole() -> None:
    rig = programmed(PROGRAM)
    rig.start()
    rig.wait(0.1)
    port = Com1Port(rig.device, RtuSlavePort({1: rig.device}))
    port.exchange(encode_frame(1, read_pdu(3, 0, 2)) + b"N4 X1 ", rig.now)
    port.to_send(rig.now)
    port.exchange(b"Y2 A3\r", rig.now)
    rig.scheduler.deadline()
    rig.wait(0.1)
    assert (rig.r(0), rig.r(8)) == (4, 1)


@pytest.mark.parametrize(
    ("text", "uses"),
    [
        ("WAIT VisionNew = 1\n", True),
        ("VisionNew = 0\n", True),
        ("x = VisionX\n", True),
        ("OUT1 = ON\nWAIT IN1 = ON\n", False),
    ],
)
def test_whether_a_program_reads_or_writes_records(text: str, *, uses: bool) -> None:
    assert uses_vision(loaded(text)[0]) == uses
