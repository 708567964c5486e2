"""RTU and TCP as a master hears them. Frames are those of the manuals where they have them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND
from steptwin.drivers.exchange import LineLost, SendNext
from steptwin.drivers.modbus import LATE_NS, NOISE_NS, QUIET_NS, ModbusQuery, RtuMaster, TcpMaster, bits, check_unit, words
from steptwin.errors import Misuse
from steptwin.wire import mbap, rtu
from steptwin.wire.line import SerialLine
from steptwin.wire.pdu import (
    ModbusException,
    ReadRequest,
    RegistersResponse,
    WriteCoilRequest,
    WriteRegisterRequest,
    WriteRegistersRequest,
    encode_response,
)
from steptwin.wire.slave import FrameDirection

POSITION = ReadRequest(3, 10020, 2)
INPUTS = ReadRequest(2, 5000, 8)
GOLDEN = {
    "01 02 13 88 00 08 FD 62": INPUTS,
    "01 05 17 71 00 00 98 65": WriteCoilRequest(6001, False),
    "01 03 27 24 00 02 8E B4": POSITION,
}


def registers(*values: int, unit: int = 1) -> bytes:
    return rtu.encode_frame(unit, encode_response(RegistersResponse(values)))


def exception(function: int, code: int) -> bytes:
    return rtu.encode_frame(1, bytes((function | 0x80, code)))


def asked(request: ReadRequest | WriteCoilRequest | WriteRegisterRequest | WriteRegistersRequest = POSITION) -> RtuMaster:
    master = RtuMaster()
    master.start(ModbusQuery(1, request), 0, urgent=False)
    return master


# ---------------------------------------------------------------------- RTU


@pytest.mark.parametrize(("frame", "request_"), GOLDEN.items())
def test_golden_requests(frame: str, request_: ReadRequest | WriteCoilRequest) -> None:
    assert RtuMaster().start(ModbusQuery(1, request_), 0, urgent=False) == bytes.fromhex(frame)


ANSWERS = [
    (POSITION, registers(0, 0x4148), bytes.fromhex("03 04 00 00 41 48")),
    (INPUTS, rtu.encode_frame(1, b"\2\1\5"), b"\2\1\5"),
    (WriteCoilRequest(6001, False), bytes.fromhex("01 05 17 71 00 00 98 65"), bytes.fromhex("05 17 71 00 00")),
    (WriteRegisterRequest(10014, 3), rtu.encode_frame(1, bytes.fromhex("06 27 1E 00 03")), bytes.fromhex("06 27 1E 00 03")),
    (
        WriteRegistersRequest(10084, (0, 0x4148)),
        rtu.encode_frame(1, bytes.fromhex("10 27 64 00 02")),
        bytes.fromhex("10 27 64 00 02"),
    ),
]


@pytest.mark.parametrize(("request_", "frame", "pdu"), ANSWERS)
def test_an_answer_whole_byte_by_byte_and_behind_noise(request_: ReadRequest, frame: bytes, pdu: bytes) -> None:
    assert asked(request_).receive(frame, 1) == pdu
    master = asked(request_)
    assert [master.receive(bytes((byte,)), 1) for byte in frame] == [None] * (len(frame) - 1) + [pdu]
    for noise in (b"\0", b"\1", b"\1\3", b"\1\x83\2", bytes(range(40))):
        assert asked(request_).receive(noise + frame, 1) == pdu


@pytest.mark.parametrize(("request_", "frame", "pdu"), ANSWERS)
def test_a_wrong_byte_anywhere_is_no_answer(request_: ReadRequest, frame: bytes, pdu: bytes) -> None:
    for place in range(len(frame)):
        for flip in (0x01, 0x80):
            wrong = frame[:place] + bytes((frame[place] ^ flip,)) + frame[place + 1 :]
            assert asked(request_).receive(wrong, 1) is None
        assert asked(request_).receive(frame[:place] + frame[place + 1 :], 1) is None


def test_an_exception_is_raised_with_its_code() -> None:
    with pytest.raises(ModbusException) as caught:
        asked().receive(exception(3, 2), 1)
    assert (caught.value.function, caught.value.code) == (3, 2)


@pytest.mark.parametrize(
    "other",
    [
        registers(1, 2, unit=2),
        registers(1, 2, 3),
        registers(1),
        rtu.encode_frame(1, b"\4\4\0\0\0\0"),
        exception(6, 2),
        rtu.encode_frame(1, bytes.fromhex("06 27 1E 00 03")),
    ],
    ids=["another unit", "longer", "shorter", "another function", "exception to another function", "a write"],
)
def test_what_answers_something_else_is_passed_over(other: bytes) -> None:
    master = asked()
    assert master.receive(other, 1) is None
    assert master.receive(registers(7, 8), 2) == bytes.fromhex("03 04 00 07 00 08")


def test_a_write_is_answered_by_its_own_echo_only() -> None:
    assert asked(WriteRegisterRequest(10014, 3)).receive(rtu.encode_frame(1, bytes.fromhex("06 27 1E 00 01")), 1) is None
    assert asked(WriteRegistersRequest(10084, (0, 1))).receive(rtu.encode_frame(1, bytes.fromhex("10 27 66 00 02")), 1) is None


# ---------------------------------------------------------------------- late answers


def late(master: RtuMaster, request: ReadRequest = POSITION) -> ModbusQuery:
    """An exchange whose answer has not come in time."""
    query = ModbusQuery(1, request)
    master.start(query, 0, urgent=False)
    master.abandon(1000)
    return query


def test_a_request_that_a_late_answer_could_seem_to_answer_is_preceded_by_a_marker() -> None:
    master = RtuMaster()
    late(master)
    other = ModbusQuery(1, ReadRequest(3, 10022, 2))
    marker = master.start(other, 2000, urgent=False)
    assert marker == rtu.encode_frame(1, bytes.fromhex("03 00 00 00 01"))
    assert master.receive(registers(1, 2), 3000) is None  # the late answer
    assert master.receive(exception(3, 2), 3000) is None  # or a late refusal
    assert master.receive(registers(9), 4000) == SendNext(other.rtu_frame, may_wait=True)
    assert master.receive(registers(3, 4), 5000) == bytes.fromhex("03 04 00 03 00 04")
    # In step again: the next one needs no marker.
    assert master.start(ModbusQuery(1, POSITION), 6000, urgent=False) == ModbusQuery(1, POSITION).rtu_frame


def test_markers_differ_from_everything_owed() -> None:
    master = RtuMaster()
    late(master)
    late(master, ReadRequest(3, 0, 1))
    marker = master.start(ModbusQuery(1, ReadRequest(3, 10022, 2)), 2000, urgent=False)
    assert marker == rtu.encode_frame(1, bytes.fromhex("03 00 00 00 03"))  # answers of 1 and 2 registers are owed


def test_a_repeated_request_needs_no_marker_but_leaves_an_answer_owed() -> None:
    master = RtuMaster()
    query = late(master)
    assert master.start(query, 2000, urgent=False) == query.rtu_frame
    assert master.receive(registers(1, 2), 3000) is not None
    query = ModbusQuery(1, ReadRequest(3, 10022, 2))
    assert master.start(query, 4000, urgent=False) != query.rtu_frame


@pytest.mark.parametrize(
    "request_",
    [INPUTS, WriteRegisterRequest(10016, 15)],
)
def test_another_function_cannot_be_confused_and_its_answer_settles_everything(request_: ReadRequest) -> None:
    master = RtuMaster()
    late(master)
    query = ModbusQuery(1, request_)
    assert master.start(query, 2000, urgent=False) == query.rtu_frame
    answer = rtu.encode_frame(1, b"\2\1\5") if request_ is INPUTS else query.rtu_frame
    assert master.receive(registers(1, 2) + answer, 3000) == answer[1:-2]
    query = ModbusQuery(1, ReadRequest(3, 10022, 2))
    assert master.start(query, 4000, urgent=False) == query.rtu_frame


def test_another_unit_cannot_be_confused() -> None:
    master = RtuMaster()
    late(master)
    query = ModbusQuery(2, POSITION)
    assert master.start(query, 2000, urgent=False) == query.rtu_frame


def test_a_stop_waits_for_no_marker() -> None:
    master = RtuMaster()
    write = ModbusQuery(1, WriteCoilRequest(2000, True))
    master.start(write, 0, urgent=False)
    master.abandon(1000)
    stop = ModbusQuery(1, WriteCoilRequest(2004, True))
    assert master.start(stop, 2000, urgent=True) == stop.rtu_frame
    assert master.receive(write.rtu_frame, 3000) is None
    assert master.receive(stop.rtu_frame, 3000) == stop.pdu


def test_an_owed_answer_is_not_waited_for_for_ever() -> None:
    master = RtuMaster()
    late(master)
    other = ModbusQuery(1, ReadRequest(3, 10022, 2))
    assert master.start(other, 1000 + LATE_NS, urgent=False) == other.rtu_frame


def test_a_new_connection_owes_nothing() -> None:
    master = RtuMaster()
    late(master)
    master.reset()
    other = ModbusQuery(1, ReadRequest(3, 10022, 2))
    assert master.start(other, 2000, urgent=False) == other.rtu_frame
    assert master.free_ns == 0


def test_after_a_failure_the_line_has_to_be_silent_but_noise_does_not_keep_it_for_ever() -> None:
    master = RtuMaster()
    late(master)
    assert master.free_ns == 1000 + QUIET_NS
    now = 1000
    while now < 1000 + NOISE_NS:
        master.stray(b"\x55", now)
        assert now < master.free_ns <= 1000 + NOISE_NS
        now += QUIET_NS // 2
    master.stray(b"\x55", now)
    assert master.free_ns == 1000 + NOISE_NS


def test_what_was_heard_of_an_answer_is_told() -> None:
    master = asked()
    master.receive(b"\1\3\4", 1)
    assert master.abandon(2) == b"\1\3\4"


# ---------------------------------------------------------------------- echo, timing, observers


def test_an_adapter_that_echoes_is_noticed_at_the_first_read() -> None:
    master = asked()
    sent = ModbusQuery(1, POSITION).rtu_frame
    assert master.receive(sent, 1) is None
    assert master.receive(registers(1, 2), 1) == bytes.fromhex("03 04 00 01 00 02")
    assert master.echo
    # From then on the echo of a write is not taken for its answer.
    stop = ModbusQuery(1, WriteCoilRequest(2004, True))
    master.start(stop, 2, urgent=True)
    assert master.receive(stop.rtu_frame[:5], 3) is None
    assert master.receive(stop.rtu_frame[5:], 3) is None
    assert master.receive(stop.rtu_frame, 4) == stop.pdu


def test_what_looks_like_a_refusal_in_an_echo_that_is_not_whole_is_none() -> None:
    """Values of registers with the bytes of an exception."""
    values = exception(0x10, 2) + b"\0"
    write = WriteRegistersRequest(1, tuple(int.from_bytes(values[n : n + 2], "big") for n in (0, 2, 4)))
    master = asked()
    master.receive(ModbusQuery(1, POSITION).rtu_frame + registers(1, 2), 1)
    assert master.echo
    query = ModbusQuery(1, write)
    master.start(query, 2, urgent=False)
    for byte in query.rtu_frame:
        assert master.receive(bytes((byte,)), 3) is None
    assert master.receive(rtu.encode_frame(1, bytes.fromhex("10 00 01 00 03")), 4) == bytes.fromhex("10 00 01 00 03")


def test_without_echo_the_answer_of_a_write_is_its_answer() -> None:
    master = asked(WriteCoilRequest(2004, True))
    assert master.receive(ModbusQuery(1, WriteCoilRequest(2004, True)).rtu_frame, 1) is not None
    assert not master.echo


@pytest.mark.parametrize(("baud", "gap"), [(9600, 3_645_834), (38400, 1750 * MICROSECOND)])
def test_real_lines_have_a_gap_before_a_frame_and_time_for_its_characters(baud: int, gap: int) -> None:
    master = RtuMaster(SerialLine(baud))
    query = ModbusQuery(1, ReadRequest(3, 10020, 16))
    assert master.allowance_ns(query) == SerialLine(baud).duration(8 + 37)
    master.start(query, 0, urgent=False)
    master.receive(registers(*range(16)), 1000)
    assert master.free_ns == pytest.approx(1000 + gap, abs=1)


def test_every_frame_is_shown_to_the_observer() -> None:
    seen: list[tuple[FrameDirection, bytes]] = []
    master = RtuMaster(on_frame=lambda now, direction, raw: seen.append((direction, raw)))
    query = ModbusQuery(1, POSITION)
    master.start(query, 0, urgent=False)
    master.receive(b"\xff" + registers(1, 2), 1)
    master.start(query, 2, urgent=False)
    master.receive(b"\1\3", 3)
    master.abandon(4)
    assert seen == [
        (FrameDirection.IN, query.rtu_frame),
        (FrameDirection.OUT, registers(1, 2)),
        (FrameDirection.IN, query.rtu_frame),
        (FrameDirection.OUT, b"\1\3"),
    ]


# ---------------------------------------------------------------------- TCP


def answered(number: int, pdu: str, unit: int = 1) -> bytes:
    return mbap.encode_frame(number, unit, bytes.fromhex(pdu))


@pytest.fixture
def tcp() -> Callable[[ReadRequest], TcpMaster]:
    def make(request: ReadRequest = POSITION) -> TcpMaster:
        master = TcpMaster("tcp://h:502")
        assert master.start(ModbusQuery(1, request), 0, urgent=False) == bytes.fromhex("00 01 00 00 00 06 01 03 27 24 00 02")
        return master

    return make


def test_tcp_whole_and_byte_by_byte(tcp: Callable[..., TcpMaster]) -> None:
    frame, pdu = answered(1, "03 04 00 01 00 02"), bytes.fromhex("03 04 00 01 00 02")
    assert tcp().receive(frame, 1) == pdu
    master = tcp()
    assert [master.receive(bytes((byte,)), 1) for byte in frame] == [None] * (len(frame) - 1) + [pdu]


def test_tcp_late_answers_and_those_of_others_are_passed_over(tcp: Callable[..., TcpMaster]) -> None:
    master = tcp()
    master.abandon(1)
    master.start(ModbusQuery(1, POSITION), 2, urgent=False)
    assert master.receive(answered(1, "03 04 00 01 00 02"), 3) is None
    assert master.receive(other := answered(2, "03 04 00 01 00 02", unit=7), 3) is None
    assert master.abandon(4) == other
    master.start(ModbusQuery(1, POSITION), 5, urgent=False)
    assert master.receive(answered(3, "03 04 00 03 00 04"), 6) == bytes.fromhex("03 04 00 03 00 04")


def test_tcp_refusals(tcp: Callable[..., TcpMaster]) -> None:
    with pytest.raises(ModbusException) as refused:
        tcp().receive(answered(1, "83 02"), 1)
    assert (refused.value.function, refused.value.code) == (3, 2)


NO_ANSWERS = ["03 02 00 01", "83", "83 02 00", "86 02", "06 27 24 00 02", "04 04 00 01 00 02", "0D 00", "03"]


@pytest.mark.parametrize("pdu", NO_ANSWERS)
def test_tcp_what_answers_something_else_is_passed_over_and_told(tcp: Callable[..., TcpMaster], pdu: str) -> None:
    master = tcp()
    assert master.receive(answered(1, pdu), 1) is None
    assert master.receive(answered(1, "03 04 00 01 00 02"), 2) == bytes.fromhex("03 04 00 01 00 02")
    master = tcp()
    assert master.receive(answered(1, pdu), 1) is None
    assert master.abandon(2) == answered(1, pdu)
    master.start(ModbusQuery(1, POSITION), 3, urgent=False)
    assert master.abandon(4) == b""


def test_tcp_what_is_no_modbus_breaks_the_connection(tcp: Callable[..., TcpMaster]) -> None:
    for meanwhile in (False, True):
        master = tcp()
        if meanwhile:
            master.abandon(1)
        with pytest.raises(LineLost, match=r"^tcp://h:502: what came is not Modbus TCP \(MBAP protocol"):
            (master.stray if meanwhile else master.receive)(b"SSH-2.0-OpenSSH\r\n", 1)
        master.reset()
        assert master.receive(b"", 2) is None


def test_tcp_numbers_wrap_round() -> None:
    master = TcpMaster()
    query = ModbusQuery(1, POSITION)
    for _ in range(0xFFFF):
        master.start(query, 0, urgent=False)
    assert master.start(query, 0, urgent=False)[:2] == b"\0\0"


# ---------------------------------------------------------------------- odds and ends


def test_without_a_line_of_its_own_a_frame_takes_no_time() -> None:
    for master in (RtuMaster(), TcpMaster()):
        assert master.allowance_ns(ModbusQuery(1, POSITION)) == 0


@pytest.mark.parametrize("size", [1, 100])
def test_tcp_an_answer_is_taken_once(size: int) -> None:
    master = TcpMaster()
    master.start(ModbusQuery(1, POSITION), 0, urgent=False)
    frame = mbap.encode_frame(1, 1, encode_response(RegistersResponse((0, 0x4148))))
    found = [master.receive(frame[at : at + size], 0) for at in range(0, len(frame), size)]
    assert found[-1] == frame[7:]
    assert master.receive(frame, 0) is None


def test_rtu_nothing_is_an_answer_when_nothing_was_asked() -> None:
    master = asked()
    answer = registers(0, 0x4148)
    assert master.receive(answer, 0) == answer[1:-2]
    assert master.receive(answer, 0) is None


def test_content_of_answers() -> None:
    assert words(bytes.fromhex("03 04 00 01 FF FF")) == (1, 0xFFFF)
    assert bits(b"\1\1\5", 3) == [True, False, True]


def test_units() -> None:
    check_unit(255, tcp=True)
    for unit, tcp in ((0, False), (248, False), (256, True), (-1, True)):
        with pytest.raises(Misuse, match=f"unit {unit} is outside"):
            check_unit(unit, tcp=tcp)


def test_tcp_an_answer_in_pieces_is_observed_too() -> None:
    heard: list[tuple[int, FrameDirection, bytes]] = []
    master = TcpMaster(on_frame=lambda now, way, data: heard.append((now, way, data)))
    query = ModbusQuery(1, ReadRequest(3, 0, 1))
    sent = master.start(query, 10, urgent=False)
    answer = sent[:4] + bytes.fromhex("0005 01 03 02 00 07")
    assert master.receive(answer[:5], 11) is None
    assert master.receive(answer[5:], 12) == bytes.fromhex("03020007")
    assert heard == [(10, FrameDirection.IN, sent), (12, FrameDirection.OUT, answer)]


def test_rtu_noise_keeps_the_line_for_a_fifth_of_a_second_at_most() -> None:
    master = RtuMaster()
    master.start(ModbusQuery(1, ReadRequest(3, 0, 1)), 0, urgent=False)
    master.abandon(0)
    for now in range(0, SECOND, 5 * MILLISECOND):
        master.stray(b"x", now)
    assert master.free_ns == SECOND // 5


@pytest.mark.parametrize("over", ["rtu", "tcp"])
def test_after_a_reset_nothing_is_awaited(over: str) -> None:
    """An answer that comes after the connection was opened anew is that of nobody."""
    answer = encode_response(RegistersResponse((0, 0x4148)))
    frame = rtu.encode_frame(1, answer) if over == "rtu" else mbap.encode_frame(1, 1, answer)
    for is_reset in (False, True):
        master: RtuMaster | TcpMaster = RtuMaster() if over == "rtu" else TcpMaster()
        master.start(ModbusQuery(1, POSITION), 0, urgent=False)
        if is_reset:
            master.reset()
        assert master.receive(frame, MILLISECOND) == (None if is_reset else answer)


@pytest.mark.parametrize(("request_", "frame", "answer"), ANSWERS)
def test_a_whole_answer_alone_is_taken_without_a_search(
    monkeypatch: pytest.MonkeyPatch, request_: ReadRequest | WriteCoilRequest, frame: bytes, answer: bytes
) -> None:
    """That is what nearly always comes, so it costs little."""
    monkeypatch.setattr(RtuMaster, "_found", lambda *_: pytest.fail("an answer was searched for"))
    monkeypatch.setattr(mbap.TcpFramer, "feed", lambda *_: pytest.fail("the framer was asked"))
    assert asked(request_).receive(frame, 1) == answer
    master = TcpMaster()
    for number in (1, 2):
        master.start(ModbusQuery(1, request_), 0, urgent=False)
        assert master.receive(mbap.encode_frame(number, 1, answer), 1) == answer


def test_what_looks_like_an_answer_inside_of_a_late_one_is_none() -> None:
    """Registers can hold frames; a write counts as confirmed by its own answer only."""
    write = WriteRegisterRequest(100, 0x6666)
    answer = ModbusQuery(1, write).rtu_frame
    inside = bytes(20) + answer + bytes(12)
    words_inside = [int.from_bytes(inside[at : at + 2], "big") for at in range(0, len(inside), 2)]
    late_answer = registers(*words_inside)
    for cut in range(1, len(late_answer) + 1):
        master = RtuMaster()
        late(master, ReadRequest(3, 0, len(words_inside)))
        master.start(ModbusQuery(1, write), 2000, urgent=False)
        assert master.receive(late_answer[:cut], 3000) is None
        assert master.receive(late_answer[cut:] + answer, 4000) == answer[1:-2]
