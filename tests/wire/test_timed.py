from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.wire import rtu
from steptwin.wire.crc import with_crc
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameDirection
from steptwin.wire.timed import FRAME_INTERVAL_NS, LINE_CHARACTERS, LineTiming, TimedRtuSlavePort, TimedUnits

NewBank = Callable[[], Any]
LINE = SerialLine(38400)
TIMING = LineTiming(LINE)
GAP = rtu.BURSTY_GAP_NS
TURN = 750_000

READ = with_crc(bytes.fromhex("01 03 00 05 00 01"))
TOLD = with_crc(bytes.fromhex("01 03 02 00 05"))
READ_NS = 2_083_334  # 8 characters at 38400 bit/s
TOLD_NS = 1_822_917  # 7 characters


def run(port: TimedRtuSlavePort, until: int) -> list[tuple[int, bytes]]:
    """As a shell does: call at every deadline."""
    out = []
    while True:
        deadline = port.deadline()
        if deadline is None or deadline > until:
            return out
        out += port.to_send(deadline)
        after = port.deadline()
        assert after is None or after > deadline


def test_mic_32_a_response_takes_the_time_of_the_wire(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    assert port.exchange(READ, 1000) == b""
    arrived = 1000 + READ_NS
    assert port.deadline() == arrived
    assert port.to_send(arrived - 1) == []
    assert bank.executed == []
    assert port.to_send(arrived) == []
    assert bank.executed == [(arrived, READ[1:-2])]
    sent = arrived + TURN + TOLD_NS
    assert port.deadline() == sent
    assert port.to_send(sent - 1) == []
    assert port.to_send(sent) == [(sent, TOLD)]
    assert port.deadline() is None


def test_mic_32_exchange_returns_what_has_left_the_wire(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    port.exchange(READ, 0)
    run(port, READ_NS)
    assert port.exchange(b"", READ_NS + TURN + TOLD_NS) == TOLD


@pytest.mark.parametrize(("baud", "request_ns", "response_ns"), [(9600, 8_333_334, 7_291_667), (115200, 694_445, 607_639)])
def test_mic_32_the_baud_rate_counts(bank: Any, baud: int, request_ns: int, response_ns: int) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(baud), turnaround_ns=5)))
    port.exchange(READ, 0)
    assert run(port, 10**9) == [(request_ns + 5 + response_ns, TOLD)]


def test_mic_32_at_most_100_requests_a_second(bank: Any) -> None:
    """A master that waits for each response loses none."""
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(115200))))
    now = 0
    for _ in range(100):
        port.exchange(READ, now)
        ((now, _),) = run(port, now + 20_000_000)
    moments = [moment for moment, _ in bank.executed]
    assert {b - a for a, b in pairwise(moments)} == {FRAME_INTERVAL_NS}
    assert port.dropped == 0


def test_mic_32_what_arrives_while_a_request_is_served_is_lost(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(115200))))
    writes = [with_crc(bytes((1, 6, 0, 0, 0, n))) for n in range(40)]
    port.exchange(b"".join(writes), 0)
    out = run(port, 10**9)
    # 694 us a frame: number 0 has come at 0.694 ms and its response has left at 0.694 + 0.75 + 0.694 = 2.139 ms. The first to
    # begin after that is number 4, at 2.778 ms; it is executed 10 ms after number 0, and its response has left at 12.139 ms.
    assert [response for _, response in out] == [writes[n] for n in (0, 4, 18, 32)]
    assert [moment for moment, _ in bank.executed] == [694_445, 10_694_445, 20_694_445, 30_694_445]
    assert port.dropped == port.lost == 36


@pytest.mark.parametrize(("pause", "executed"), [(0, 2), (-1, 1)])
def test_mic_32_a_request_that_began_before_the_response_had_left_is_lost(bank: Any, pause: int, executed: int) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    port.exchange(READ, 0)
    sent = READ_NS + TURN + TOLD_NS
    run(port, sent + pause - 1)
    port.exchange(READ[:1], sent + pause)
    run(port, sent + 1_000_000)
    port.exchange(READ[1:], sent + 1_000_000)
    run(port, 10**9)
    assert (len(bank.executed), port.dropped) == (executed, 2 - executed)


def run_all(until: int, *ports: TimedRtuSlavePort) -> list[list[tuple[int, bytes]]]:
    """What each port has sent, all called at the deadlines of all."""
    out: list[list[tuple[int, bytes]]] = [[] for _ in ports]
    while (deadlines := [due for port in ports if (due := port.deadline()) is not None]) and min(deadlines) <= until:
        for number, port in enumerate(ports):
            out[number] += port.to_send(min(deadlines))
    return out


def test_mic_32_one_request_of_each_port_waits_for_its_turn(bank: Any, new_bank: NewBank) -> None:
    other = new_bank()
    units = TimedUnits({1: bank, 2: other}, TIMING)
    ports = first, second, third, elsewhere = tuple(TimedRtuSlavePort(units) for _ in range(4))
    first.exchange(READ, 0)
    run_all(READ_NS, *ports)
    second.exchange(READ, READ_NS)  # while the response of the first is on its way
    third.exchange(READ, READ_NS + 1)
    third.exchange(READ, READ_NS + 2)  # its own first request waits
    elsewhere.exchange(with_crc(bytes.fromhex("02 03 00 05 00 01")), READ_NS)
    sent = run_all(10**9, *ports)
    turns = [READ_NS + n * FRAME_INTERVAL_NS for n in range(3)]
    assert [moment for moment, _ in bank.executed] == turns
    assert [[moment for moment, _ in of] for of in sent[:3]] == [[turn + TURN + TOLD_NS] for turn in turns]
    assert [moment for moment, _ in other.executed] == [2 * READ_NS]
    assert [port.dropped for port in ports] == [0, 0, 1, 0]


@pytest.mark.parametrize("count", [1, 2, 5])
def test_mic_32_ports_that_ask_without_pause_have_equal_shares_and_lose_nothing(bank: Any, count: int) -> None:
    ports = [TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))]
    ports += [TimedRtuSlavePort(ports[0]._units) for _ in range(count - 1)]
    served = [0] * count
    now = 0
    for port in ports:
        port.exchange(READ, now)
    while now < 10**9:
        now = min(due for port in ports if (due := port.deadline()) is not None)
        for number, port in enumerate(ports):
            if port.to_send(now):
                served[number] += 1
                port.exchange(READ, now)
    assert 98 <= sum(served) <= 101
    assert max(served) - min(served) <= 1
    assert [port.dropped for port in ports] == [0] * count


def test_mic_32_a_port_that_goes_away_with_a_request_leaves_the_controller_free(bank: Any) -> None:
    units = TimedUnits({1: bank}, TIMING)
    gone, port = TimedRtuSlavePort(units), TimedRtuSlavePort(units)
    gone.exchange(READ, 0)
    gone.to_send(READ_NS)
    gone.exchange(READ, 10_000_000)
    gone.deadline()
    gone.close()
    port.exchange(READ, 200_000_000)
    assert len(run(port, 10**9)) == 1


def test_mic_32_nothing_happens_before_it_could_be_known(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({0x41: bank}, TIMING))
    # Behind noise, could be seven bytes of a request to unit 3; the request inside ends after seven, 1.82 ms.
    port.exchange(bytes.fromhex("FF 03 05") + with_crc(bytes.fromhex("41 07")) + b"\xff", 0)
    port.exchange(b"\xff", 2_000_000)
    assert run(port, 10**9) == [(2_000_000 + TURN + LINE.duration(5), with_crc(bytes.fromhex("41 87 01")))]


def test_what_is_due_happens_before_what_comes(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    port.exchange(READ, 0)
    port.exchange(with_crc(bytes.fromhex("00 06 00 05 00 63")), READ_NS)
    assert bank.executed == [(READ_NS, READ[1:-2])]


def test_mic_32_a_long_response_keeps_the_device_busy(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(9600))))
    ask = with_crc(bytes.fromhex("01 03 00 00 00 7D"))
    port.exchange(ask, 0)
    ((sent, whole),) = run(port, 10**9)
    assert sent == 8_333_334 + TURN + 265_625_000
    assert len(whole) == 255
    port.exchange(READ, sent - 1)
    assert run(port, 10**9) == []
    port.exchange(READ, sent + 10_000_000)
    assert run(port, 10**9) == [(sent + 10_000_000 + 8_333_334 + TURN + 7_291_667, TOLD)]


def test_mic_32_characters_wait_for_the_line(bank: Any) -> None:
    whole, pieces = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING)), TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    whole.exchange(READ, 0)
    pieces.exchange(READ[:3], 0)
    pieces.exchange(READ[3:], 10)
    assert whole.deadline() == pieces.deadline() == READ_NS
    assert run(whole, 10**9) == run(pieces, 10**9)


def test_mic_32_traffic_of_others_takes_the_line_and_no_slot(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    foreign = with_crc(bytes.fromhex("02 03 00 00 00 01")) + with_crc(bytes.fromhex("02 03 02 12 34"))
    port.exchange(foreign + READ, 0)
    arrived = LINE.duration(23)
    assert run(port, 10**9) == [(arrived + TURN + TOLD_NS, TOLD)]
    assert bank.executed == [(arrived, READ[1:-2])]


def test_mic_32_a_broadcast_is_executed_by_each_unit_in_its_turn_and_not_answered(bank: Any, new_bank: NewBank) -> None:
    other = new_bank()
    units = TimedUnits({1: bank, 2: other}, TIMING)
    port, elsewhere = TimedRtuSlavePort(units), TimedRtuSlavePort(units)
    elsewhere.exchange(READ, 0)
    run(elsewhere, READ_NS)
    port.exchange(with_crc(bytes.fromhex("00 06 00 05 00 63")), READ_NS)
    port.exchange(with_crc(bytes.fromhex("00 06 00 05 00 64")), READ_NS + 1)  # the second one has no room at unit 1
    assert run_all(10**9, port, elsewhere)[0] == []
    assert [(moment, pdu[0]) for moment, pdu in bank.executed] == [(READ_NS, 3), (READ_NS + FRAME_INTERVAL_NS, 6)]
    assert [moment for moment, _ in other.executed] == [2 * READ_NS, 2 * READ_NS + FRAME_INTERVAL_NS]
    assert port.dropped == 1
    port.exchange(with_crc(bytes.fromhex("00 03 00 05 00 01")), 10**9)  # reads are ignored
    assert run(port, 2 * 10**9) == []
    assert (len(bank.executed), len(other.executed)) == (2, 2)


def test_mic_32_a_flood_is_bounded_and_the_line_recovers(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    for now in range(0, 1000, 10):
        port.exchange(b"\xff\x01\x41" * 10_000, now)
    assert port.overrun == 3_000_000 - LINE_CHARACTERS
    assert port.deadline() is not None
    run(port, 10**12)
    free = LINE.duration(LINE_CHARACTERS) + GAP
    port.exchange(READ, free)
    assert run(port, 10**12) == [(free + READ_NS + TURN + TOLD_NS, TOLD)]
    assert port.unframed == LINE_CHARACTERS


def test_mic_32_a_full_line_takes_nothing(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(SerialLine(115200))))
    port.exchange(bytes(4001), 0)
    port.exchange(
        bytes(96), 86_805
    )  # the first character has ended; by rounding 4097 are waiting now, one more than there is room
    assert port.overrun == 0
    port.exchange(READ, 86_805)
    assert port.overrun == 8
    assert run(port, 10**12) == []


def test_mic_15_a_pause_inside_a_frame_is_reported_and_with_strict_timing_drops_it(bank: Any) -> None:
    reported: list[tuple[int, int]] = []
    for strict, answers in ((False, 1), (True, 0)):
        port = TimedRtuSlavePort(
            TimedUnits({1: bank}, LineTiming(LINE, strict=strict)), on_pause=lambda unit, pause: reported.append((unit, pause))
        )
        port.exchange(READ[:5], 0)
        run(port, 3_000_000)
        port.exchange(READ[5:], 3_000_000)
        assert len(run(port, 10**9)) == answers
        port.exchange(READ, 10**9)
        assert len(run(port, 2 * 10**9)) == 1
    assert reported == [(1, 3_000_000 - LINE.duration(5))]


def test_mic_15_characters_that_follow_on_the_line_are_no_pause(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(LINE, strict=True)))
    port.exchange(READ[:5], 0)
    run(port, 1_900_000)
    port.exchange(READ[5:], 1_900_000)  # the first five take 1.3 ms
    assert len(run(port, 10**9)) == 1


def test_mic_15_frames_of_unknown_length_come_after_the_gap(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING))
    unknown = with_crc(bytes.fromhex("01 41 01 02 03"))
    port.exchange(unknown, 0)
    cut = LINE.duration(7) + GAP
    assert port.deadline() == cut
    assert run(port, 10**9) == [(cut + TURN + LINE.duration(5), with_crc(bytes.fromhex("01 C1 01")))]


def test_an_observer_sees_frames_at_their_wire_time(bank: Any) -> None:
    seen: list[tuple[int, FrameDirection, bytes]] = []
    port = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING), on_frame=lambda now, way, raw: seen.append((now, way, raw)))
    foreign = with_crc(bytes.fromhex("02 06 00 00 00 01"))
    port.exchange(READ + foreign, 0)
    run(port, 10**9)
    assert seen == [
        (READ_NS, FrameDirection.IN, READ),
        (LINE.duration(16), FrameDirection.IN, foreign),
        (READ_NS + TURN + TOLD_NS, FrameDirection.OUT, TOLD),
    ]


@given(
    st.lists(
        st.tuples(st.sampled_from([READ, READ[:5], TOLD, b"\xff\x00", READ + READ]), st.integers(0, 30_000_000)), max_size=12
    )
)
def test_looking_in_between_changes_nothing(new_bank: NewBank, sent: list[tuple[bytes, int]]) -> None:
    results = []
    for looks in (0, 3):
        bank = new_bank()
        port, now, out = TimedRtuSlavePort(TimedUnits({1: bank}, TIMING)), 0, []
        for data, pause in sent:
            for part in range(1, looks + 1):
                out += run(port, now + pause * part // (looks + 1))
                out += port.to_send(now + pause * part // (looks + 1))
            now += pause
            out += run(port, now)
            port.exchange(data, now)
        out += run(port, now + 10**9)
        results.append((out, bank.executed, port.dropped))
    assert results[0] == results[1]


@pytest.mark.parametrize(
    ("turnaround_ns", "interval_ns", "message"),
    [(-1, 0, "a turnaround of -1 ns is negative"), (0, -5, "a frame interval of -5 ns is negative")],
)
def test_timing_that_is_none(turnaround_ns: int, interval_ns: int, message: str) -> None:
    with pytest.raises(Misuse) as misuse:
        LineTiming(LINE, turnaround_ns, interval_ns)
    assert str(misuse.value) == message


def test_mic_32_a_device_may_answer_at_once(bank: Any) -> None:
    port = TimedRtuSlavePort(TimedUnits({1: bank}, LineTiming(LINE, turnaround_ns=0, interval_ns=0)))
    port.exchange(READ, 0)
    assert run(port, 10**9) == [(READ_NS + TOLD_NS, TOLD)]


def test_what_is_executed_at_the_moment_of_an_arrival_is_executed_first(bank: Any) -> None:
    second = READ_NS + TURN + TOLD_NS
    later = 5_000_000
    seen: list[tuple[int, int]] = []
    timing = LineTiming(LINE, interval_ns=second + later)
    port = TimedRtuSlavePort(
        TimedUnits({1: bank}, timing),
        on_frame=lambda now, way, raw: seen.append((now, len(bank.executed))) if way is FrameDirection.IN else None,
    )
    port.exchange(READ, 0)
    run(port, second)
    port.exchange(READ, second)
    run(port, second + later)
    port.exchange(with_crc(bytes.fromhex("02 06 00 00 00 01")), second + later)
    run(port, 10**9)
    both = second + later + READ_NS
    assert bank.executed == [(READ_NS, READ[1:-2]), (both, READ[1:-2])]
    assert seen == [(READ_NS, 0), (second + READ_NS, 1), (both, 2)]


@pytest.mark.parametrize("late", [False, True])
def test_what_arrives_before_an_execution_is_due_is_seen_before_it(new_bank: NewBank, late: bool) -> None:
    """A request to unit 1 waits for its slot; one to unit 3, whom nobody is, arrives meanwhile. A late look finds the same."""
    bank = new_bank()
    seen: list[tuple[int, int]] = []
    port = TimedRtuSlavePort(
        TimedUnits({1: bank}, LineTiming(LINE, interval_ns=40_000_000)),
        on_frame=lambda now, way, raw: seen.append((now, len(bank.executed))) if way is FrameDirection.IN else None,
    )
    port.exchange(READ, 0)
    run(port, 10_000_000)
    port.exchange(READ, 10_000_000)
    port.exchange(with_crc(bytes.fromhex("03 06 00 00 00 01")), 20_000_000)
    if late:
        port.to_send(10**9)
    else:
        run(port, 10**9)
    assert seen == [(READ_NS, 0), (10_000_000 + READ_NS, 1), (20_000_000 + READ_NS, 1)]
    assert len(bank.executed) == 2


@pytest.mark.parametrize(("function", "units"), [(0, []), (1, [1]), (0x7F, [1]), (0x80, []), (0x83, [])])
def test_mic_1_functions_that_a_unit_hears(bank: Any, function: int, units: list[int]) -> None:
    """1 to 127: what no request can have is for nobody."""
    assert TimedUnits({1: bank}, LineTiming(SerialLine(115200))).addressed(1, function) == units


def test_a_request_to_all_that_waits_does_not_make_the_line_due_in_the_past(new_bank: NewBank) -> None:
    """One to unit 1 is served, one to all waits for it, one to unit 2 waits for that: nothing is due before the first ends."""
    units = TimedUnits({1: new_bank(), 2: new_bank()}, TIMING)
    first = units.wait((1,), 1_000_000)
    units.done(first, 1_000_000, 20 * MILLISECOND)
    to_all = units.wait((1, 2), 3_000_000)
    last = units.wait((2,), 4_000_000)
    assert units.due(to_all) >= 20 * MILLISECOND
    assert units.due(last) >= units.due(to_all)
    assert not units.serves(last)
