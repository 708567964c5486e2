from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU

from steptwin.errors import Misuse
from steptwin.wire import rtu
from steptwin.wire.crc import crc16, with_crc
from steptwin.wire.pdu import (
    ModbusRequest,
    ReadRequest,
    WriteRegisterRequest,
    WriteRegistersRequest,
    decode_request,
    encode_request,
)
from steptwin.wire.rtu import (
    BURSTY_GAP_NS,
    PAUSE_NS,
    FrameRole,
    RtuFrame,
    RtuFramer,
    StrictRtuFramer,
    encode_frame,
)

GAP = BURSTY_GAP_NS


def hexed(text: str) -> bytes:
    """The frame of a body without CRC."""
    return with_crc(bytes.fromhex(text))


def cut(framer: RtuFramer, data: bytes, now: int = 0) -> list[tuple[str, FrameRole]]:
    return [(frame.raw[:-2].hex(" "), frame.role) for frame in framer.feed(data, now)]


# A line with three slaves as it sounds: requests to others, their responses, refusals, a broadcast, and requests to unit 1.
CONVERSATION = [
    (hexed("02 03 27 24 00 04"), FrameRole.REQUEST),
    (hexed("02 03 08 00 01 00 02 00 03 00 04"), FrameRole.RESPONSE),
    (hexed("01 03 27 24 00 02"), FrameRole.REQUEST),
    (hexed("03 06 00 10 00 07"), FrameRole.REQUEST),
    (hexed("03 06 00 10 00 07"), FrameRole.RESPONSE),
    (hexed("00 05 17 71 FF 00"), FrameRole.REQUEST),
    (hexed("02 01 00 00 00 05"), FrameRole.REQUEST),
    (hexed("02 01 01 15"), FrameRole.RESPONSE),
    (hexed("02 01 00 00 00 18"), FrameRole.REQUEST),
    (hexed("02 01 03 15 AA 55"), FrameRole.RESPONSE),
    (hexed("01 10 27 38 00 02 04 41 20 00 00"), FrameRole.REQUEST),
    (hexed("03 10 00 10 00 02 04 00 01 00 02"), FrameRole.REQUEST),
    (hexed("03 10 00 10 00 02"), FrameRole.RESPONSE),
    (hexed("03 03 FF F0 00 01"), FrameRole.REQUEST),
    (hexed("03 83 02"), FrameRole.RESPONSE),
    (hexed("02 03 00 00 00 01"), FrameRole.REQUEST),
    (hexed("02 03 02 00 00"), FrameRole.RESPONSE),
    (hexed("00 06 00 01 00 02"), FrameRole.REQUEST),
    (hexed("03 11"), FrameRole.REQUEST),
    (hexed("03 11 05 41 42 43 44 FF"), FrameRole.RESPONSE),
    (hexed("02 18 00 10"), FrameRole.REQUEST),
    (hexed("02 18 00 06 00 02 01 B8 12 84"), FrameRole.RESPONSE),
    (hexed("03 17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF"), FrameRole.REQUEST),
    (hexed("03 17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF"), FrameRole.RESPONSE),
    (hexed("01 01 17 70 00 08"), FrameRole.REQUEST),
]
STREAM = b"".join(frame for frame, _ in CONVERSATION)


def test_golden_frames_are_whole_requests(golden: tuple[bytes, ModbusRequest]) -> None:
    raw, request = golden
    (frame,) = RtuFramer(own={1}).feed(raw, 0)
    assert frame == RtuFrame(raw, FrameRole.REQUEST, 8)
    assert frame.unit == 1
    assert decode_request(frame.pdu) == request
    assert encode_frame(1, frame.pdu) == raw


def test_frames_are_those_of_pymodbus(golden: tuple[bytes, ModbusRequest]) -> None:
    raw, _ = golden
    used, unit, _, pdu = FramerRTU(DecodePDU(True)).decode(raw)
    assert (used, unit, pdu) == (8, 1, raw[1:-2])
    assert FramerRTU(DecodePDU(True)).encode(pdu, 1, 0) == encode_frame(1, pdu)


@pytest.mark.parametrize("own", [{1}, set()], ids=["slave", "listener"])
@pytest.mark.parametrize("size", [1, 2, 3, 5, 7, 8, 9, 64, 1000])
def test_a_conversation_in_pieces_of_any_size(own: set[int], size: int) -> None:
    framer = RtuFramer(own)
    frames = [frame for at in range(0, len(STREAM), size) for frame in framer.feed(STREAM[at : at + size], at)]
    assert [(frame.raw, frame.role) for frame in frames] == CONVERSATION
    assert framer.deadline() is None
    assert framer.unframed == 0
    assert frames[-1].end == len(STREAM)


@given(st.lists(st.integers(0, len(STREAM)), max_size=60))
def test_splits_do_not_matter(places: list[int]) -> None:
    framer = RtuFramer({1})
    edges = [0, *sorted(places), len(STREAM)]
    frames = [frame for a, b in pairwise(edges) for frame in framer.feed(STREAM[a:b], 0)]
    assert frames == RtuFramer({1}).feed(STREAM, 0)
    assert len(frames) == len(CONVERSATION)


words = st.integers(0, 0xFFFF)
requests = st.one_of(
    st.builds(ReadRequest, st.just(3), st.integers(0, 0xFF00), st.integers(1, 125)),
    st.builds(WriteRegisterRequest, words, words),
    st.builds(WriteRegistersRequest, st.integers(0, 0xFF00), st.lists(words, min_size=1, max_size=123).map(tuple)),
)


@given(st.lists(st.tuples(st.sampled_from([0, 1, 5]), requests), max_size=12), st.randoms(use_true_random=False))
def test_any_requests_in_any_pieces(sent: list[tuple[int, ModbusRequest]], random: Any) -> None:
    frames = [encode_frame(unit, encode_request(request)) for unit, request in sent]
    stream, framer, found = b"".join(frames), RtuFramer({1, 5}), []
    while stream:
        size = random.randint(1, 20)
        found += framer.feed(stream[:size], 0)
        stream = stream[size:]
    assert [frame.raw for frame in found] == frames
    assert {frame.role for frame in found} <= {FrameRole.REQUEST}


@pytest.mark.parametrize(
    "noise", ["FF", "00", "01", "01 03", "FF FF FF", "01 03 01", "C8 41 41", "F9 F9 03 10", "01 83 02 00 00"]
)
def test_a_frame_right_behind_noise_is_found_at_once(noise: str) -> None:
    framer = RtuFramer({1})
    good = hexed("01 03 27 24 00 02")
    assert cut(framer, bytes.fromhex(noise) + good) == [("01 03 27 24 00 02", FrameRole.REQUEST)]
    assert framer.unframed == len(bytes.fromhex(noise))
    assert framer.deadline() is None


def test_a_wrong_crc_costs_the_frame_and_not_the_next() -> None:
    framer = RtuFramer({1})
    good = hexed("01 03 27 24 00 02")
    assert framer.feed(good[:-1] + b"\0" + good, 0) == [RtuFrame(good, FrameRole.REQUEST, 16)]
    assert framer.unframed == 8


def test_what_may_be_the_response_of_another_unit_delays_the_next_burst_by_a_gap_at_most() -> None:
    """The end of this frame, 02 04 7F, announces 132 bytes of unit 2; what is inside those would be data."""
    wrong, good = bytes.fromhex("01 03 27 24 00 02 04 7F"), hexed("01 03 27 24 00 02")
    framer = RtuFramer({1})
    assert framer.feed(wrong + good, 0) == framer.expire(GAP) == []
    assert framer.feed(good, 10 * GAP) == []
    assert framer.deadline() == 11 * GAP
    assert framer.expire(11 * GAP) == [RtuFrame(good, FrameRole.REQUEST, 24, begin=10 * GAP)]
    assert framer.feed(good, 11 * GAP) == [RtuFrame(good, FrameRole.REQUEST, 32, begin=11 * GAP)]


def test_mic_15_a_pause_does_not_cut_a_frame() -> None:
    framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
    good = hexed("01 10 27 38 00 02 04 41 20 00 00")
    assert framer.feed(good[:5], 0) == []
    assert framer.expire(750_000) == []  # the gap of a UART passes, the adapter has not delivered yet
    assert framer.feed(good[5:9], 16_000_000) == []
    assert framer.expire(16_750_000) == []
    assert [frame.raw for frame in framer.feed(good[9:], 32_000_000)] == [good]


@pytest.mark.parametrize("body", ["01 03 27 24 00 02", "01 10 27 38 00 02 04 00 00 00 00", "01 05 17 71 00 00", "01 07"])
def test_mic_15_a_pause_anywhere_does_not_cut_a_frame(body: str) -> None:
    good = hexed(body)
    for place in range(1, len(good)):
        framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
        framer.feed(good[:place], 0)
        assert [frame.raw for frame in framer.feed(good[place:], PAUSE_NS)] == [good]
    for size in (1, 2, 3):
        framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
        frames = [frame.raw for at in range(0, len(good), size) for frame in framer.feed(good[at : at + size], at * 1_000_000)]
        assert frames == [good]


@pytest.mark.parametrize("gap_ns", [rtu.UART_GAP_NS, GAP])
@pytest.mark.parametrize("pause_ms", [1, 20, 40, 50, 200, 1000, 2000])
@pytest.mark.parametrize("sizes", [(3, 3, 2), (1, 7), (7, 1), (2, 4, 2), (1,) * 8])
def test_mic_15_a_request_in_pieces_is_one_frame(sizes: tuple[int, ...], pause_ms: int, gap_ns: int) -> None:
    """Nagle's algorithm and adapters make such pauses; a shell calls `expire` in each of them."""
    framer, good, now, at = RtuFramer({1}, gap_ns), hexed("01 03 27 24 00 02"), 5, 0
    frames: list[RtuFrame] = []
    for size in sizes:
        frames += framer.feed(good[at : at + size], now)
        at, now = at + size, now + pause_ms * 1_000_000
        deadline = framer.deadline()
        if deadline is not None and deadline < now:
            frames += framer.expire(deadline)
    assert frames == [RtuFrame(good, FrameRole.REQUEST, 8, begin=5, pause=pause_ms * 1_000_000)]


@pytest.mark.parametrize("pause_ms", [20, 30, 200, 1500, 3000])
@pytest.mark.parametrize(
    "body", ["01 03 27 24 00 02", "01 10 27 38 00 02 04 41 20 00 00", "02 03 27 24 00 02", "00 06 00 01 00 02"]
)
def test_mic_15_after_a_truncated_frame_the_next_request_is_answered(body: str, pause_ms: int) -> None:
    """At once, or when the gap has passed; whole, and in two pieces with a pause of their own."""
    truncated, good = hexed(body), hexed("01 10 27 38 00 02 04 41 20 00 01")
    for kept in range(1, len(truncated)):
        for cut_at, inside_ms in ((len(good), 0), (5, 0), (5, 3), (5, 60)):
            framer = RtuFramer({1})
            framer.feed(truncated[:kept], 0)
            frames: list[RtuFrame] = []
            now = pause_ms * 1_000_000
            for piece in (good[:cut_at], good[cut_at:]):
                frames += framer.feed(piece, now)
                now += inside_ms * 1_000_000
            frames += framer.expire(now + GAP)
            assert [frame.raw for frame in frames] == [good], (kept, cut_at, inside_ms)


def test_when_a_frame_began_and_the_longest_pause_inside_it() -> None:
    framer, one, two = RtuFramer({1}), hexed("01 03 27 24 00 02"), hexed("01 10 27 38 00 02 04 41 20 00 00")
    framer.feed(b"\xff" + one[:2], 100, 400)  # a byte takes 100
    framer.feed(one[2:5], 1000, 1300)
    frames = framer.feed(one[5:] + two[:1], 1500, 1900)
    assert [(frame.raw, frame.begin, frame.pause) for frame in frames] == [(one, 200, 600)]
    (frame,) = framer.feed(two[1:], 1950, 3000)
    assert (frame.raw, frame.begin, frame.pause) == (two, 1800, 50)


def test_a_silence_behind_a_frame_is_not_inside_it() -> None:
    framer = RtuFramer({0x41})
    # Behind noise, could be seven bytes of a request to unit 3; what comes later shows that the request inside is one.
    frame = hexed("41 07")
    assert framer.feed(bytes.fromhex("FF 03 05") + frame, 0) == []
    (found,) = framer.feed(b"\xff\xff", 10_000_000)
    assert (found.raw, found.pause) == (frame, 0)


FC16 = "01 10 01 2C 00 28 50"  # 40 registers from 300 on
EMBEDDED = hexed("01 06 00 64 66 66")
AROUND = hexed(FC16 + bytes(20).hex() + EMBEDDED.hex() + bytes(52).hex())
"""A request that writes 40 registers, whose data hold a request."""


@pytest.mark.parametrize("own", [{1}, {2}, set()], ids=["own", "foreign", "listener"])
@pytest.mark.parametrize("pause_ms", [1, 25, 200])
@pytest.mark.parametrize("parts", [(41, 48), (27, 62), (28, 61), (34, 55), (35, 54), (7, 20, 62), (27, 20, 42), (1,) * 89])
def test_mic_15_data_of_an_unfinished_frame_are_never_a_request(parts: tuple[int, ...], pause_ms: int, own: set[int]) -> None:
    framer, frames, now = RtuFramer(own), [], 0
    at = 0
    for size in parts:
        frames += framer.feed(AROUND[at : at + size], now)
        at, now = at + size, now + pause_ms * 1_000_000
        while (due := framer.deadline()) is not None and due < now:
            frames += framer.expire(due)
    assert [(frame.raw, frame.role) for frame in frames] == [(AROUND, FrameRole.REQUEST)]


def test_mic_15_data_of_a_frame_given_up_are_never_a_request() -> None:
    good = hexed("01 03 27 24 00 02")
    for kept in range(35, len(AROUND)):
        framer = RtuFramer({1})
        assert framer.feed(AROUND[:kept], 0) == framer.expire(GAP) == []
        frames = framer.feed(good, 10 * GAP)
        assert [frame.raw for frame in frames or framer.expire(11 * GAP)] == [good], kept


def test_mic_15_data_of_a_frame_with_a_wrong_crc_are_no_request() -> None:
    good, framer = hexed("01 03 27 24 00 02"), RtuFramer({1})
    assert framer.feed(AROUND[:8] + b"\1" + AROUND[9:], 0) == framer.expire(GAP) == []
    assert [frame.raw for frame in framer.feed(good, 10 * GAP)] == [good]


def test_a_response_of_another_unit_that_pauses_holds_no_request() -> None:
    for request in (b"", hexed("09 03 00 00 00 7D")):
        response = hexed("09 03 FA" + bytes(20).hex() + EMBEDDED.hex() + bytes(222).hex())
        framer = RtuFramer({1})
        frames = framer.feed(request, 0) + framer.feed(response[:100], 5_000_000) + framer.expire(40_000_000)
        frames += framer.feed(response[100:], 45_000_000)
        assert [frame.raw for frame in frames] == [*filter(None, [request]), response]


@pytest.mark.parametrize("pause_ns", [750_000, 1_000_000, 3_000_000])
def test_mic_15_a_burst_that_is_a_request_alone_waits_for_the_gap_behind_an_unfinished_frame(pause_ns: int) -> None:
    framer, unfinished, good = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS), AROUND[:27], hexed("01 03 27 24 00 02")
    framer.feed(unfinished, 0)
    framer.expire(750_000)
    assert framer.feed(good, 5_000_000) == []
    assert framer.deadline() == 5_750_000
    framer.feed(good[:3], 5_100_000)  # the same burst goes on: what may be data waits
    framer.feed(good[3:], 5_200_000 + pause_ns)
    assert framer.deadline() == 5_200_000 + pause_ns + 750_000
    frames = framer.expire(5_200_000 + pause_ns + 750_000)
    assert [frame.raw for frame in frames] == [good, good]


def test_mic_15_a_request_that_is_not_alone_in_its_burst_waits_for_what_a_network_delays() -> None:
    framer, good = RtuFramer({1}), hexed("01 03 27 24 00 02")
    framer.feed(AROUND[:27], 0)
    assert framer.feed(good + b"\xff", 50_000_000) == framer.expire(50_000_000 + GAP) == []
    assert framer.deadline() == 50_000_000 + GAP + rtu.DELAY_NS
    assert [frame.raw for frame in framer.expire(50_000_000 + GAP + rtu.DELAY_NS)] == [good]
    assert framer.deadline() is None
    assert len(framer.held) == 0


def test_mic_15_a_request_with_a_pause_waits_for_another_one_behind_an_unfinished_frame() -> None:
    """A sender that pauses in a frame does so again: the bytes may be data of the first frame."""
    good = hexed("01 03 27 24 00 02")
    for pause_ms, wanted_ms in ((30, 30), (200, 200), (900, 200)):
        framer, end = RtuFramer({1}), (100 + pause_ms) * 1_000_000
        framer.feed(AROUND[:27], 0)
        framer.feed(good[:5], 100_000_000)
        framer.feed(good[5:], end)
        assert framer.expire(end + GAP) == []
        assert framer.deadline() == end + wanted_ms * 1_000_000 + GAP
        assert [frame.raw for frame in framer.expire(end + wanted_ms * 1_000_000 + GAP)] == [good]


def test_mic_15_strict_framing_drops_a_frame_that_pauses() -> None:
    good = hexed("01 03 27 24 00 02")
    for pause, found in ((750_000, [good]), (750_001, [])):
        framer = StrictRtuFramer({1})
        framer.feed(good[:5], 0)
        framer.feed(good[5:], pause)
        assert framer.deadline() == pause + 750_001
        assert [frame.raw for frame in framer.feed(good, 10_000_000)] == found, pause
        assert [frame.raw for frame in framer.expire(10_750_001)] == [good]
        assert framer.deadline() is None


@pytest.mark.parametrize(
    "burst",
    [AROUND[:41], AROUND[41:], AROUND[27:], b"\xff" + EMBEDDED, EMBEDDED + b"\0", EMBEDDED + AROUND[:8], EMBEDDED * 33],
    ids=["beginning", "end", "end that begins with a request", "behind noise", "noise behind", "half a frame behind", "too long"],
)
def test_mic_15_strict_framing_drops_the_whole_burst(burst: bytes) -> None:
    framer = StrictRtuFramer({1})
    for at in range(0, len(burst), 7):
        assert framer.feed(burst[at : at + 7], 0) == []
        assert len(framer.held) <= rtu.MAX_FRAME + 1
    assert framer.expire(750_001) == []
    assert (framer.unframed, len(framer.held)) == (len(burst), 0)
    assert [frame.raw for frame in framer.feed(EMBEDDED * 32, 800_000) + framer.expire(1_550_001)] == [EMBEDDED] * 32


def test_mic_15_strict_framing_has_frames_of_unknown_length() -> None:
    raw = hexed("01 41 01 02 03")
    framer = StrictRtuFramer({1})
    assert framer.feed(raw, 0) + framer.expire(750_001) == [RtuFrame(raw, FrameRole.UNKNOWN, len(raw))]


def test_mic_15_a_beginning_given_up_delays_the_next_frame_by_a_gap() -> None:
    framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
    good = hexed("01 03 27 24 00 02")
    framer.feed(bytes.fromhex("01 10 27 38 00 7B F6 41"), 0)  # announces 255 bytes
    assert framer.feed(good, 1_000_000) == []
    assert [frame.raw for frame in framer.expire(1_750_000)] == [good]
    assert framer.unframed == 8
    assert framer.deadline() is None


def test_mic_15_a_beginning_is_not_kept_for_ever() -> None:
    framer = RtuFramer({1})
    good = hexed("01 03 27 24 00 02")
    framer.feed(good[:5], 0)
    assert framer.feed(good[5:], PAUSE_NS + 1) == []
    assert framer.unframed == 5


def test_mic_15_what_may_be_data_is_not_executed_when_the_gap_has_passed() -> None:
    framer = RtuFramer({1})
    good = hexed("01 03 27 24 00 02")
    # What looks like a request of 255 bytes keeps the framer waiting.
    assert framer.feed(bytes.fromhex("01 10 27 38 00 7B F6 41") + good + good, 5) == []
    assert framer.deadline() == 5 + GAP
    assert framer.expire(5 + GAP - 1) == framer.expire(5 + GAP) == []
    assert framer.deadline() is None
    assert framer.feed(good, 10 * GAP) == []
    assert [(frame.raw, frame.end) for frame in framer.expire(11 * GAP)] == [(good, 32)]


def test_mic_15_a_late_shell_finds_the_same() -> None:
    framer = RtuFramer({1})
    good = hexed("01 03 27 24 00 02")
    framer.feed(bytes.fromhex("01 10 27 38 00 7B F6 41"), 0)
    framer.feed(good, 2 * GAP)
    assert [frame.end for frame in framer.feed(good, 10 * GAP)] == [16, 24]


@pytest.mark.parametrize(
    "body",
    ["01 41 01 02 03", "01 64", "01 2B 0D 00 01 02 03 04", "01 08 00 00 01 02 03 04", "01 03 00 00 00 01 00", "09 41 01"],
)
def test_a_rest_with_a_right_crc_is_a_frame_of_unknown_length(body: str) -> None:
    framer = RtuFramer({1})
    raw = hexed(body)
    before = hexed("02 03 27 24 00 04")
    assert [frame.raw for frame in framer.feed(before + raw, 0)] == [before]
    assert framer.expire(GAP) == [RtuFrame(raw, FrameRole.UNKNOWN, len(before + raw))]
    assert framer.unframed == 0


def test_an_unknown_frame_after_a_beginning_given_up() -> None:
    framer = RtuFramer({1}, gap_ns=rtu.UART_GAP_NS)
    framer.feed(bytes.fromhex("01 10 27 38 00 7B F6 41"), 0)
    framer.expire(750_000)
    raw = hexed("01 41 01 02 03")
    assert framer.feed(raw, 2_000_000) == []
    assert [frame.raw for frame in framer.expire(2_750_000)] == [raw]
    assert framer.unframed == 8


@given(st.lists(st.tuples(st.binary(max_size=300), st.integers(0, 2 * PAUSE_NS)), max_size=12))
def test_whatever_comes_frames_are_intact_and_memory_is_bounded(pieces: list[tuple[bytes, int]]) -> None:
    framer, now, framed, fed = RtuFramer({1}), 0, 0, 0
    for data, pause in pieces:
        now += pause
        fed += len(data)
        for frame in framer.feed(data, now):
            assert crc16(frame.raw) == 0
            assert rtu.MIN_FRAME <= len(frame.raw) <= rtu.MAX_FRAME
            framed += len(frame.raw)
        assert len(framer.held) <= rtu.MAX_FRAME
        assert framer.unframed == fed - framed - len(framer.held) >= 0
    for _ in range(3):  # a gap, that with a pause, that of a network
        framer.expire(framer.deadline() or now)
    assert framer.deadline() is None


# What keeps the framer busiest: starts of frames everywhere, announcements of long ones.
@pytest.mark.parametrize(
    "pattern", ["01", "01 03", "01 10", "02 03", "02 17", "01 10 00 00 00 7B F6", "00 10 10 10 10 10 F6", "41 41", "00", "FF"]
)
def test_a_flood_of_noise_costs_a_bounded_number_of_looks_per_byte(pattern: str, monkeypatch: pytest.MonkeyPatch) -> None:
    looks = 0
    look = RtuFramer._look

    def counted(self: RtuFramer, start: int, *, waiting: bool) -> tuple[int, FrameRole]:
        nonlocal looks
        looks += 1
        return look(self, start, waiting=waiting)

    monkeypatch.setattr(RtuFramer, "_look", counted)
    unit = bytes.fromhex(pattern)
    data = (unit * (20_000 // len(unit) + 1))[:20_000]
    for size in (20_000, 1000, 7):
        looks = 0
        framer = RtuFramer({1})
        for at in range(0, len(data), size):
            framer.feed(data[at : at + size], 0)
        assert looks <= len(data) + 2 * (len(data) // size)
        assert len(framer.held) <= rtu.MAX_FRAME


def test_a_request_after_a_flood_of_beginnings_is_answered() -> None:
    framer, good = RtuFramer({1}), hexed("01 03 27 24 00 02")
    assert framer.feed(bytes.fromhex("01 10 00 00 00 7B F6") * 2000 + good, 0) == framer.expire(GAP) == []
    assert framer.feed(good, 2 * GAP) == []
    assert [frame.raw for frame in framer.expire(3 * GAP)] == [good]


def test_requests_behind_each_other_are_no_noise() -> None:
    """Any number comes in one delivery."""
    assert len(RtuFramer({1}).feed(hexed("01 03 27 24 00 02") * 1000, 0)) == 1000


@pytest.mark.parametrize(
    ("unit", "size", "message"),
    [
        (248, 5, "unit 248 is outside 0 to 247"),
        (-1, 5, "unit -1 is outside 0 to 247"),
        (1, 0, "a PDU of 0 bytes is outside 1 to 253"),
        (1, 254, "a PDU of 254 bytes is outside 1 to 253"),
    ],
)
def test_frames_that_cannot_be(unit: int, size: int, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        encode_frame(unit, bytes(size))
    assert str(misuse.value) == message


def test_a_gap_takes_time() -> None:
    with pytest.raises(Misuse, match="a gap of 0 ns is not positive"):
        RtuFramer(gap_ns=0)


@pytest.mark.parametrize("size", [1, 253])
def test_the_shortest_and_the_longest_pdu(size: int) -> None:
    assert len(encode_frame(247, bytes(size))) == size + 3


def test_a_shell_that_feeds_nothing_gets_what_the_gap_completes() -> None:
    framer = RtuFramer()
    unknown = with_crc(bytes.fromhex("01 41 01 02 03"))
    assert framer.feed(unknown, 0) == []
    assert [frame.raw for frame in framer.feed(b"", BURSTY_GAP_NS)] == [unknown]


def test_a_snapshot_of_an_untouched_framer_is_one_of_an_untouched_framer() -> None:
    framer = RtuFramer({1})
    framer.feed(b"\x01\x03", 5)
    framer.set_state(RtuFramer({1}).copy_state())
    assert (framer.held, framer.fed, framer.unframed, framer.deadline()) == (b"", 0, 0, None)


def test_the_shortest_gap() -> None:
    framer = RtuFramer(gap_ns=1)
    framer.feed(b"\x01", 7)
    assert framer.deadline() == 8
