from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import Port
from steptwin.errors import Misuse
from steptwin.wire import mbap, rtu
from steptwin.wire.crc import is_intact, with_crc
from steptwin.wire.line import SerialLine
from steptwin.wire.pdu import (
    ModbusException,
    ModbusRequest,
    ModbusResponse,
    ReadRequest,
    WriteCoilRequest,
    WriteRegisterRequest,
    WriteRegistersRequest,
    answer,
    encode_request,
)
from steptwin.wire.slave import FrameDirection, PauseReports, RtuSlavePort, SlaveDevice, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

NewBank = Callable[[], Any]
GAP = rtu.BURSTY_GAP_NS


def hexed(text: str) -> bytes:
    return with_crc(bytes.fromhex(text))


def over_rtu(port: RtuSlavePort, unit: int, request: ModbusRequest, now: int = 0) -> ModbusResponse:
    """What a master on the other end makes of it."""
    data = port.exchange(rtu.encode_frame(unit, encode_request(request)), now)
    data += b"".join(answer for _, answer in port.to_send(now + GAP))
    assert rtu.response_length(data) == len(data)
    assert is_intact(data)
    assert data[0] == unit
    return answer(request, data[1:-2])


def test_golden_request_gets_a_golden_response(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    bank.registers[1020:1022] = [0x0000, 0x4120]  # 10.0, low word first
    assert port.exchange(bytes.fromhex("01 03 03 FC 00 02 04 7F"), 5) == bytes.fromhex("01 03 04 00 00 41 20 CB BB")
    assert bank.executed == [(5, bytes.fromhex("03 03 FC 00 02"))]


@pytest.mark.parametrize("text", ["01 02 13 88 00 08 FD 62", "01 05 17 71 00 00 98 65", "01 03 27 24 00 02 8E B4"])
def test_golden_requests_beyond_the_memory_of_the_bank_are_refused(bank: Any, text: str) -> None:
    frame = bytes.fromhex(text)
    assert RtuSlavePort({1: bank}).exchange(frame, 0) == with_crc(bytes((1, frame[1] | 0x80, 2)))


@pytest.mark.parametrize(
    "request_",
    [
        ReadRequest(1, 3, 10),
        ReadRequest(2, 0, 2000),
        ReadRequest(3, 0, 125),
        WriteCoilRequest(7, True),
        WriteRegisterRequest(9, 0xABCD),
        WriteRegistersRequest(100, tuple(range(123))),
    ],
    ids=str,
)
def test_two_ends_joined(new_bank: NewBank, request_: ModbusRequest) -> None:
    """Both framings and both ways through a port give what the device answers."""
    pdu = encode_request(request_)
    told = new_bank().execute(pdu, 0)
    expected = answer(request_, told)
    assert over_rtu(RtuSlavePort({1: new_bank()}), 1, request_) == expected
    assert TcpSlavePort({1: new_bank()}).exchange(mbap.encode_frame(7, 1, pdu), 0) == mbap.encode_frame(7, 1, told)
    dribbled = RtuSlavePort({1: new_bank()})
    replies = [dribbled.exchange(bytes((byte,)), 0) for byte in rtu.encode_frame(1, pdu)]
    assert not any(replies[:-1])
    assert answer(request_, replies[-1][1:-2]) == expected


@pytest.mark.parametrize("said", range(12))
@pytest.mark.parametrize("has", [2, 4, 6])
def test_a_write_with_a_wrong_number_of_bytes_is_the_same_whole_and_in_pieces(new_bank: NewBank, said: int, has: int) -> None:
    """The values look like the number of bytes that there are."""
    frame = with_crc(bytes.fromhex("01 10 00 00 00 01") + bytes((said,)) + bytes((has,)) * has)

    def outcome(pieces: list[bytes]) -> tuple[list[bytes], list[object], list[int]]:
        bank = new_bank()
        port = RtuSlavePort({1: bank})
        answers = [answer for piece in pieces if (answer := port.exchange(piece, 0))]
        answers += [answer for _, answer in port.to_send(GAP)]
        return answers, bank.executed, bank.registers[:8]

    assert outcome([frame]) == outcome([bytes((byte,)) for byte in frame])


def test_a_refusal_of_the_device_reaches_the_master(bank: Any) -> None:
    with pytest.raises(ModbusException) as refusal:
        over_rtu(RtuSlavePort({1: bank}), 1, ReadRequest(3, 2999, 2))
    assert refusal.value.code == 2


def test_mic_1_other_functions_are_refused_at_once_where_their_length_is_known(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    assert port.exchange(hexed("01 04 00 00 00 01"), 0) == hexed("01 84 01")
    assert port.exchange(hexed("01 07"), 0) == hexed("01 87 01")
    assert port.exchange(hexed("01 0F 00 13 00 0A 02 CD 01"), 0) == hexed("01 8F 01")
    assert port.exchange(hexed("01 17 00 03 00 01 00 0E 00 01 02 00 FF"), 0) == hexed("01 97 01")
    assert port.exchange(hexed("01 2B 0E 01 00"), 0) == hexed("01 AB 01")


def test_mic_1_and_after_the_gap_where_it_is_not(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    assert port.exchange(hexed("01 41 01 02"), 100) == b""
    assert port.deadline() == 100 + GAP
    assert port.to_send(100 + GAP - 1) == []
    assert port.to_send(100 + GAP) == [(100 + GAP, hexed("01 C1 01"))]
    assert port.deadline() is None


@pytest.mark.parametrize(
    "data",
    [
        bytes.fromhex("01 03 27 24 00 02 04 7F"),
        hexed("02 03 00 00 00 01"),
        hexed("01 03 00 00 00 01")[:-1],
        hexed("01 03 00 00 00 01")[:4],
        hexed("01"),
        b"\x01\x03",
        hexed("01 83 02"),
        hexed("01 C1 01 02 03"),
        hexed("01 80 01 02 03"),
        hexed("01 00 01 02 03 04"),
        b"",
    ],
    ids=["wrong CRC", "foreign", "cut by one", "cut by four", "no function", "two bytes", "refusal", "refusal of unknown length",
         "refusal of no function", "function 0", "nothing"],
)  # fmt: skip
def test_mic_1_silence(bank: Any, data: bytes) -> None:
    port = RtuSlavePort({1: bank})
    assert port.exchange(data, 0) == b""
    assert port.to_send(GAP) == []
    assert bank.executed == []
    assert over_rtu(port, 1, ReadRequest(3, 5, 1), 2 * GAP) is not None


def test_frames_longer_than_256_bytes_are_none(bank: Any) -> None:
    for byte_count in (247, 248, 255):
        port = RtuSlavePort({1: bank})
        data = with_crc(bytes((1, 16, 0, 0, 0, 124, byte_count)) + bytes(byte_count))
        assert port.exchange(data, 0) + b"".join(told for _, told in port.to_send(GAP)) == (
            hexed("01 90 03") if byte_count == 247 else b""
        )


def test_mic_2_broadcast_writes_are_executed_everywhere_and_never_answered(new_bank: NewBank) -> None:
    banks = {1: new_bank(), 5: new_bank()}
    port = RtuSlavePort(banks)
    for request in (WriteCoilRequest(3, True), WriteRegisterRequest(4, 44), WriteRegistersRequest(5, (55, 66))):
        assert port.exchange(rtu.encode_frame(0, encode_request(request)), 9) == b""
    for bank in banks.values():
        assert bank.coils[3]
        assert bank.registers[4:7] == [44, 55, 66]
        assert [now for now, _ in bank.executed] == [9, 9, 9]


@pytest.mark.parametrize(
    "body", ["00 01 00 00 00 01", "00 02 00 00 00 01", "00 03 00 00 00 01", "00 07", "00 16 00 04 00 F2 00 25"]
)
def test_mic_2_other_broadcasts_are_ignored(bank: Any, body: str) -> None:
    port = RtuSlavePort({1: bank})
    assert port.exchange(hexed(body), 0) == b""
    assert port.deadline() is None
    assert bank.executed == []


WHOLE = [
    *(bytes((function, 0, 9, 0, 2)) for function in (1, 2, 3)),
    *(bytes.fromhex(text) for text in ("050009FF00", "0600091234", "10 0009 0001 02 0102")),
    bytes((16, 0, 9, 0, 123, 246)) + bytes(246),
]
LONGEST = bytes((16, 0, 9, 0, 123, 247)) + bytes(247)
"""As long as a frame can be; its count does not match."""


@pytest.mark.parametrize(("is_tcp", "pdu"), [*((way, pdu) for way in (False, True) for pdu in (*WHOLE, LONGEST)), (True, b"\7")])
def test_a_whole_request_alone_is_answered_without_the_framer(
    new_bank: NewBank, monkeypatch: pytest.MonkeyPatch, pdu: bytes, *, is_tcp: bool
) -> None:
    """That is what nearly always comes, so it costs little; in pieces it has the same answer."""
    port: RtuSlavePort | TcpSlavePort = TcpSlavePort({1: new_bank()}) if is_tcp else RtuSlavePort({1: new_bank()})
    request = mbap.encode_frame(7, 1, pdu) if is_tcp else with_crc(b"\1" + pdu)
    assert port.exchange(request[:3], 0) == b""
    answer = port.exchange(request[3:], 0)
    assert answer != b""
    for framer in (rtu.RtuFramer, mbap.TcpFramer):
        monkeypatch.setattr(framer, "feed", lambda *_: pytest.fail("the framer was asked"))
    assert port.exchange(request, 10) == answer
    port.on_write = lambda *_: None
    if not is_tcp or pdu[0] in (1, 2, 3):
        assert port.exchange(request, 20) == answer


@pytest.mark.parametrize("function", [0, 7])
def test_mic_1_other_functions_of_the_size_of_a_request_are_not_answered_as_one(bank: Any, function: int) -> None:
    assert RtuSlavePort({1: bank}).exchange(with_crc(bytes((1, function, 0, 9, 0, 1))), 0) == b""
    assert bank.executed == []


def test_several_units_on_one_line(new_bank: NewBank) -> None:
    banks = {unit: new_bank() for unit in (1, 2, 247)}
    port = RtuSlavePort(banks)
    for unit in banks:
        over_rtu(port, unit, WriteRegisterRequest(0, unit))
    assert {unit: bank.registers[0] for unit, bank in banks.items()} == {1: 1, 2: 2, 247: 247}


def test_other_slaves_on_the_line_do_not_disturb(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    mine = hexed("01 06 00 07 00 63")
    trap = with_crc(bytes((2, 3, 10)) + hexed("01 06 00 07 00 01") + b"\0\0")  # a write to unit 1 within data of unit 2
    line = hexed("02 03 00 00 00 05") + trap + mine + hexed("03 06 00 00 00 01") * 2 + hexed("02 90 02") + mine
    for size in (1, 3, 8, 500):
        bank.executed.clear()
        assert b"".join(port.exchange(line[at : at + size], 0) for at in range(0, len(line), size)) == mine + mine
        assert [pdu for _, pdu in bank.executed] == [mine[1:-2]] * 2


@pytest.mark.parametrize("noise", ["FF FF FF", "00", "01 03", "F9 00 41 01"])
def test_a_good_request_right_behind_noise_is_answered_at_once(bank: Any, noise: str) -> None:
    port = RtuSlavePort({1: bank})
    assert port.exchange(bytes.fromhex(noise), 0) == b""
    assert port.exchange(hexed("01 03 00 05 00 01"), 1) == hexed("01 03 02 00 05")
    assert port.unframed == len(bytes.fromhex(noise))


def test_a_good_request_behind_an_unfinished_one_is_answered_when_a_gap_has_followed(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    port.exchange(bytes.fromhex("01 10 00 00 00 7B F6 00 00"), 0)
    assert port.exchange(hexed("01 03 00 05 00 01"), GAP) == b""
    assert port.deadline() == 2 * GAP
    assert port.to_send(2 * GAP) == [(2 * GAP, hexed("01 03 02 00 05"))]


def test_glued_requests_are_answered_in_order(bank: Any) -> None:
    port = RtuSlavePort({1: bank})
    ask = [hexed(f"01 03 00 {n:02X} 00 01") for n in range(20)]
    told = [hexed(f"01 03 02 00 {n:02X}") for n in range(20)]
    assert port.exchange(b"".join(ask), 0) == b"".join(told)
    assert port.exchange(b"".join(ask)[:-3], 0) == b"".join(told[:-1])
    assert port.exchange(ask[-1][-3:], 0) == told[-1]


@pytest.mark.parametrize("units", [[], [0], [248], [1, -1]])
def test_units_of_a_line(new_bank: NewBank, units: list[int]) -> None:
    devices: dict[int, SlaveDevice] = {unit: new_bank() for unit in units}
    for port in (RtuSlavePort, TcpSlavePort):
        with pytest.raises(Misuse, match=r"at least one unit|is outside 1 to 247"):
            port(devices)


def test_an_answer_is_given_at_once_and_only_once(new_bank: NewBank) -> None:
    ask, pdu = hexed("01 03 00 05 00 01"), bytes.fromhex("03 02 00 05")
    ports: list[tuple[Port, bytes, bytes]] = [
        (RtuSlavePort({1: new_bank()}), ask, hexed("01 03 02 00 05")),
        (TcpSlavePort({1: new_bank()}), mbap.encode_frame(1, 1, ask[1:-2]), mbap.encode_frame(1, 1, pdu)),
    ]
    for port, asked, told in ports:
        assert port.exchange(asked[:3], 10) == b""
        assert port.to_send(10) == []
        assert port.exchange(asked[3:], 20) == told
        assert port.exchange(asked, 30) == told
        assert port.to_send(40) == []
        assert port.deadline() is None
        port.close()


def test_no_noise_breaks_a_line(bank: Any) -> None:
    ports: list[Port] = [RtuSlavePort({1: bank}), TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(38400))))]
    for port in ports:
        assert port.exchange(b"GET / HTTP/1.1\r\n", 0) == b""
        assert port.broken is None


def test_an_observer_sees_every_frame_on_the_line(bank: Any) -> None:
    seen: list[tuple[int, FrameDirection, bytes]] = []
    port = RtuSlavePort({1: bank}, on_frame=lambda now, way, raw: seen.append((now, way, raw)))
    ask, told = hexed("01 03 00 05 00 01"), hexed("01 03 02 00 05")
    foreign, broadcast = hexed("02 06 00 01 00 01"), hexed("00 06 00 01 00 01")
    port.exchange(ask, 1)
    port.exchange(foreign + broadcast + ask, 2)
    assert seen == [
        (1, FrameDirection.IN, ask), (1, FrameDirection.OUT, told),
        (2, FrameDirection.IN, foreign), (2, FrameDirection.IN, broadcast),
        (2, FrameDirection.IN, ask), (2, FrameDirection.OUT, told),
    ]  # fmt: skip
    port.on_frame = None
    port.exchange(ask, 3)
    assert len(seen) == 6


@pytest.mark.parametrize("line", [None, SerialLine(9600)])
def test_mic_15_a_pause_above_750_us_inside_a_request_is_reported_once_a_second(bank: Any, line: SerialLine | None) -> None:
    reported: list[tuple[int, int]] = []
    port = RtuSlavePort({1: bank}, line=line, on_pause=lambda unit, pause: reported.append((unit, pause)))
    ask = with_crc(bytes.fromhex("01 03 00 05 00 01"))

    def send(now: int, pause: int) -> None:
        port.exchange(ask[:5], now)
        # A line of 9600 bit/s takes 3.125 ms for three characters.
        assert port.exchange(ask[5:], now + pause + (3_125_000 if line is not None else 0)) != b""

    send(10**9, 750_000)
    assert reported == []
    send(2 * 10**9, 750_001)
    assert reported == [(1, 750_001)]
    send(25 * 10**8, 40_000_000)
    send(4 * 10**9, 50_000_000)
    port.exchange(with_crc(bytes.fromhex("02 03 00 05 00 01"))[:4], 10 * 10**9)  # to nobody here
    port.exchange(with_crc(bytes.fromhex("02 03 00 05 00 01"))[4:], 11 * 10**9)
    assert reported == [(1, 750_001), (1, 50_000_000)]


def with_wrong_bit(frame: bytes, bit: int) -> bytes:
    return (int.from_bytes(frame, "little") ^ 1 << bit % (8 * len(frame))).to_bytes(len(frame), "little")


# Streams that come near frames: pieces of good ones, good ones with a wrong bit, and anything.
good_frames = st.builds(
    lambda unit, body: with_crc(bytes((unit,)) + body),
    st.sampled_from([0, 1, 2]),
    st.one_of(
        st.sampled_from(
            [encode_request(r) for r in (ReadRequest(3, 5, 1), WriteRegistersRequest(1, (10, 258)), WriteCoilRequest(1, True))]
        ),
        st.binary(min_size=1, max_size=30),
    ),
)
pieces = st.one_of(
    st.binary(max_size=40),
    good_frames,
    st.builds(lambda frame, cut: frame[: cut % len(frame)], good_frames, st.integers(0, 40)),
    st.builds(with_wrong_bit, good_frames, st.integers(0, 400)),
)


@given(st.lists(st.tuples(pieces, st.sampled_from([0, 1000, GAP // 2, GAP, 3 * GAP])), max_size=12))
def test_after_anything_and_a_gap_the_port_is_in_step_again(new_bank: NewBank, stream: list[tuple[bytes, int]]) -> None:
    bank = new_bank()
    port = RtuSlavePort({1: bank})
    received, now = b"", 0
    for data, pause in stream:
        now += pause
        deadline = port.deadline()
        if deadline is not None and deadline <= now:
            port.to_send(deadline)
        assert port.exchange(data, now)[:1] in (b"", b"\1")
        received += data
        assert port.to_send(now) == []
    for _, pdu in bank.executed:
        # Nothing is executed that was not received behind a unit and before the right CRC.
        assert any(with_crc(bytes((unit,)) + pdu) in received for unit in (0, 1))
    good = hexed("01 03 00 05 00 01")
    bank.registers[5] = 5
    answers = [port.exchange(good, now + GAP), *(answer for _, answer in port.to_send(now + 2 * GAP))]
    assert b"".join(answers).endswith(hexed("01 03 02 00 05"))


pdus = st.one_of(
    st.builds(ReadRequest, st.sampled_from([1, 2, 3]), st.integers(0, 3100), st.integers(1, 120)).map(encode_request),
    st.builds(WriteCoilRequest, st.integers(0, 3100), st.booleans()).map(encode_request),
    st.builds(WriteRegisterRequest, st.integers(0, 3100), st.integers(0, 0xFFFF)).map(encode_request),
    st.builds(WriteRegistersRequest, st.integers(0, 3100), st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=123)).map(
        encode_request
    ),
    st.binary(min_size=1, max_size=30),
)


@given(
    unit=st.integers(0, 3),
    pdu=pdus,
    damage=st.none() | st.tuples(st.integers(0, 300), st.integers(1, 255)),
    behind=st.sampled_from([b"", b"\x00", b"\x01\x03"]),
)
def test_a_burst_is_answered_as_its_bytes_one_by_one(
    new_bank: NewBank, unit: int, pdu: bytes, damage: tuple[int, int] | None, behind: bytes
) -> None:
    """Whatever is the usual request has a way of its own through the port."""
    data = bytearray(rtu.encode_frame(unit, pdu) + behind)
    if damage is not None:
        data[damage[0] % len(data)] ^= damage[1]
    found = []
    for pieces in ([bytes(data)], [bytes((byte,)) for byte in data]):
        banks = {1: new_bank(), 2: new_bank()}
        seen: list[tuple[FrameDirection, bytes]] = []
        port = RtuSlavePort(banks, on_frame=lambda _, way, raw, seen=seen: seen.append((way, raw)))
        out = b"".join(port.exchange(piece, 5) for piece in pieces)
        out += b"".join(sent for _, sent in port.to_send(5 + GAP))
        found.append((out, seen, [[body for _, body in bank.executed] for bank in banks.values()], port.unframed))
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("unit", "pdu", "exceptions"),
    [(1, "03 03 FC 00 02", 0), (1, "03 03 FC 00 00", 1), (1, "00 00", 0), (1, "7F 00", 1), (0, "05 17 71 00 00", 0)],
)
@pytest.mark.parametrize("at", [None, 1, 3])
def test_requests_and_exceptions_of_a_line_are_counted(
    new_bank: NewBank, unit: int, pdu: str, exceptions: int, at: int | None
) -> None:
    """Whether a frame comes at once or in two pieces. Function 0 is not answered (MIC-1)."""
    port = RtuSlavePort({1: new_bank()})
    frame = rtu.encode_frame(unit, bytes.fromhex(pdu))
    port.exchange(frame[:at], 0)
    if at is not None:
        port.exchange(frame[at:], 1)
    port.to_send(GAP + 1)
    assert (port.requests, port.exceptions) == (1, exceptions)


def test_mic_15_the_next_pause_is_reported_after_exactly_a_second() -> None:
    reported: list[int] = []
    reports = PauseReports(lambda unit, pause: reported.append(pause))
    for now, pause in ((5, 750_001), (10**9 + 4, 800_000), (10**9 + 5, 900_000)):
        reports.served(rtu.RtuFrame(b"\1\3", rtu.FrameRole.REQUEST, 2, 0, pause), now)
    assert reported == [750_001, 900_000]
