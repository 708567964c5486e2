"""Faults of bytes, frames and protocol, as a master sees them on the wire."""

from __future__ import annotations

from functools import partial

import pytest
from fault_rig import ANSWER, ANSWER_PDU, READ, REQUEST, FaultRig, crc, rtu, tcp
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.line import SerialChain
from steptwin.m1486.variants import variant
from steptwin.simulation.faults import Faults, FaultyPort, FaultySendingPort, LineProtocol, read
from steptwin.simulation.scheduler.trace import Trace
from steptwin.wire.slave import FrameDirection, RtuSlavePort

WRITE = bytes.fromhex("06 00 64 00 07")


# ---------------------------------------------------------------------- without faults


def test_without_faults_calls_are_those_of_the_port_itself() -> None:
    rig = FaultRig()
    assert (rig.port.exchange, rig.port.to_send, rig.port.deadline) == (
        rig.inner.exchange,
        rig.inner.to_send,
        rig.inner.deadline,
    )
    assert rig.inner.on_frame is None
    (crc_fault,) = rig.add("crc")
    assert rig.port.exchange != rig.inner.exchange
    assert rig.ask() != ANSWER
    rig.faults.remove(crc_fault.name, rig.now)
    assert rig.port.exchange == rig.inner.exchange
    assert rig.inner.on_frame is None
    assert rig.ask() == ANSWER


def test_an_observer_sees_frames_as_without_faults() -> None:
    rig = FaultRig()
    seen: list[tuple[FrameDirection, bytes]] = []
    rig.inner.on_frame = lambda now, direction, raw: seen.append((direction, raw))
    rig.add("crc nth=1")
    rig.ask()
    rig.faults.clear(rig.now)
    rig.ask()
    assert seen == [(FrameDirection.IN, REQUEST), (FrameDirection.OUT, ANSWER)] * 2


def test_who_comes_while_there_are_faults_sees_frames_too() -> None:
    rig = FaultRig("crc nth=1")
    seen: list[FrameDirection] = []
    rig.port.call_with_frames(lambda now, direction, raw: seen.append(direction))
    for _ in range(2):
        rig.ask()
        rig.faults.clear(rig.now)
    assert seen == [FrameDirection.IN, FrameDirection.OUT] * 2
    rig.port.call_with_frames(None)
    rig.ask()
    assert len(seen) == 4


def test_what_is_on_its_way_arrives_after_the_fault_is_gone() -> None:
    rig = FaultRig("delay for_ms=50")
    assert rig.ask() == b""
    rig.faults.clear(rig.now)
    assert rig.arrivals() == [(50 * MILLISECOND, ANSWER)]
    assert rig.port.exchange == rig.inner.exchange


# ---------------------------------------------------------------------- bytes


def test_flip_turns_one_bit() -> None:
    rig = FaultRig("flip nth=3 bit=7")
    assert rig.ask() == ANSWER[:2] + bytes((ANSWER[2] ^ 0x80,)) + ANSWER[3:]
    assert rig.ask() == ANSWER
    assert rig.told() == ["flip: from the twin, byte 3 of 9: 04 becomes 84"]


def test_flip_towards_the_twin_makes_it_deaf_for_that_request() -> None:
    rig = FaultRig("flip direction=in nth=4 bit=0")
    assert rig.ask(WRITE) == b""
    assert rig.arrivals() == []
    assert rig.ask() == ANSWER


def test_drop_loses_bytes_even_beyond_an_answer() -> None:
    rig = FaultRig("drop nth=8 length=3")
    assert rig.ask() == ANSWER[:7]
    assert rig.ask() == ANSWER[1:]
    assert rig.ask() == ANSWER


def test_insert_puts_a_byte_before_a_byte() -> None:
    assert FaultRig("insert nth=2 value=0x55").ask() == ANSWER[:1] + b"\x55" + ANSWER[1:]


def test_gap_is_silence_within_an_answer() -> None:
    rig = FaultRig("gap nth=4 for_ms=25")
    assert rig.ask() == ANSWER[:3]
    assert rig.arrivals() == [(25 * MILLISECOND, ANSWER[3:])]


def test_a_gap_in_a_request_ends_it_where_the_twin_gives_the_beginning_up() -> None:
    """The twin keeps the beginning of a frame for 2 s (`steptwin.wire.rtu.PAUSE_NS`), and not longer."""
    for gap, answers in ((10, 1), (60, 1), (2000, 1), (2001, 0)):
        rig = FaultRig(f"gap direction=in nth=5 for_ms={gap}")
        rig.send(REQUEST)
        assert len(rig.arrivals(3.0)) == answers, gap


def test_split_delivers_in_pieces() -> None:
    rig = FaultRig("split length=4 for_ms=16 nth=1")
    assert rig.ask() == ANSWER[:4]
    assert rig.arrivals() == [(16 * MILLISECOND, ANSWER[4:8]), (32 * MILLISECOND, ANSWER[8:])]


def test_noise_comes_before_what_was_sent() -> None:
    rig = FaultRig("noise length=5 nth=1")
    heard = rig.ask()
    assert heard[5:] == ANSWER
    assert rig.told() == [f"noise: from the twin, 5 bytes of noise: {heard[:5].hex(' ')}"]


def test_noise_before_a_request_is_got_over() -> None:
    rig = FaultRig("noise direction=in length=3 nth=1", seed=3)
    answers = rig.ask() or b"".join(data for _, data in rig.arrivals())
    assert answers == ANSWER


@given(st.integers(0, 2**32), st.lists(st.sampled_from(["flip", "drop", "insert", "gap", "split", "noise"]), min_size=1))
def test_after_any_faults_of_bytes_the_line_is_in_step_again(seed: int, kinds: list[str]) -> None:
    """And what arrives is at most ever later, never out of order."""
    faults = [f"{kind} direction={way} probability=0.1" for kind in kinds for way in ("in", "out")]
    rig = FaultRig(*faults, seed=seed)
    for _ in range(5):
        rig.ask()
    moments = [moment for moment, _ in rig.arrivals()]
    assert moments == sorted(moments)
    rig.faults.clear(rig.now)
    rig.arrivals(2.0)
    assert rig.ask() == ANSWER


def characters(*faults: str) -> tuple[FaultySendingPort, Faults]:
    chain = SerialChain([M1486Chip(variant("B"))])
    held = Faults()
    for fault in faults:
        held.add(read(fault))
    return FaultySendingPort(chain.port(), "pty", held, LineProtocol.CHARACTERS), held


def test_bytes_of_an_m1486_go_wrong_too() -> None:
    port, faults = characters("flip bit=0 nth=2", "drop direction=in nth=9")
    assert port.exchange(b"U20\r", 0) == b"B"
    assert port.exchange(b"U20\r", MILLISECOND) == b"C"  # 42H with its lowest bit turned
    assert port.exchange(b"U16\r", 2 * MILLISECOND) == b""  # the U was lost
    assert [active.struck for active in faults.active] == [1, 1]
    assert port.exchange(b"U20\r", 3 * MILLISECOND) == b"B"


def test_a_chip_that_speaks_unasked_is_heard_through_the_faults() -> None:
    port, _ = characters("gap nth=1 for_ms=5")
    calls: list[str] = []
    hook = partial(calls.append, "output")
    port.on_output = hook
    assert port.on_output == hook
    assert port.exchange(b"U20\r", 0) == b""
    assert calls == ["output"]
    assert port.deadline() == 5 * MILLISECOND
    assert port.to_send(5 * MILLISECOND) == [(5 * MILLISECOND, b"B")]
    port.close()
    assert port.on_output is None


def test_faults_of_frames_pass_a_line_of_characters_by() -> None:
    port, faults = characters("crc", "no-answer", "late")
    assert port.exchange(b"U20\r", 0) == b"B"
    assert [active.seen for active in faults.active] == [0, 0, 0]


# ---------------------------------------------------------------------- frames


@pytest.mark.parametrize("line", [LineProtocol.RTU, LineProtocol.TCP])
def test_delay_keeps_the_order_of_answers(line: LineProtocol) -> None:
    rig = FaultRig("delay for_ms=100 nth=1", line=line)
    answers = [tcp(n, 1, ANSWER_PDU) if line is LineProtocol.TCP else ANSWER for n in (1, 2)]
    assert rig.ask() == b""
    assert rig.ask() == b""
    assert rig.arrivals() == [(100 * MILLISECOND, answer) for answer in answers]


@pytest.mark.parametrize("line", [LineProtocol.RTU, LineProtocol.TCP])
def test_no_answer_whose_request_was_done(line: LineProtocol) -> None:
    rig = FaultRig("no-answer nth=1", line=line)
    assert rig.ask(WRITE) == b""
    assert rig.device.user[100] == 7
    assert rig.arrivals() == []
    assert rig.ask() != b""


@pytest.mark.parametrize("line", [LineProtocol.RTU, LineProtocol.TCP])
def test_no_answer_whose_request_was_lost(line: LineProtocol) -> None:
    rig = FaultRig("no-answer lost=request nth=1", line=line)
    assert rig.ask(WRITE) == b""
    assert rig.device.user[100] == 0x1234
    assert rig.arrivals() == []
    assert rig.ask() != b""
    assert rig.told() == ["no-answer: request lost on its way: 06 00 64 00 07"]


@pytest.mark.parametrize("line", [LineProtocol.RTU, LineProtocol.TCP])
def test_a_late_answer_comes_before_the_next_one(line: LineProtocol) -> None:
    rig = FaultRig("late nth=1", line=line)
    assert rig.ask() == b""
    assert rig.arrivals() == []
    answers = [tcp(n, 1, ANSWER_PDU) for n in (1, 2)] if line is LineProtocol.TCP else [ANSWER, ANSWER]
    assert rig.ask() == b"".join(answers)


def test_wrong_unit_is_a_good_frame_of_somebody_else() -> None:
    rig = FaultRig("wrong-unit nth=1", "wrong-unit answers_as=9 nth=2")
    assert rig.ask() == rtu(2, ANSWER_PDU)
    assert rig.ask() == rtu(9, ANSWER_PDU)
    assert rig.ask() == ANSWER
    assert FaultRig("wrong-unit", line=LineProtocol.TCP).ask() == tcp(1, 2, ANSWER_PDU)
    assert FaultRig("wrong-unit", units=(247,)).ask(unit=247) == rtu(0, ANSWER_PDU)
    assert FaultRig("wrong-unit", units=(247,), line=LineProtocol.TCP).ask(unit=247) == tcp(1, 0, ANSWER_PDU)


@given(st.integers(0, 2**64))
def test_crc_is_always_a_wrong_one(seed: int) -> None:
    heard = FaultRig("crc", seed=seed).ask()
    assert heard[:-2] == ANSWER[:-2]
    assert heard[-2:] != crc(heard[:-2])


def test_echo_gives_the_request_back_before_its_answer() -> None:
    assert FaultRig("echo").ask() == REQUEST + ANSWER


def test_crc_and_echo_do_not_exist_on_tcp() -> None:
    rig = FaultRig("crc", "echo", "flip", "noise", line=LineProtocol.TCP)
    assert rig.ask() == tcp(1, 1, ANSWER_PDU)
    assert rig.told() == []


def test_faults_of_frames_on_a_line_that_takes_its_time() -> None:
    """9600 bit/s: the answer to the second request is the one that is spoilt, though all were sent at once."""
    rig = FaultRig("wrong-unit address=100", line=LineProtocol.TCP, is_timed=True)
    rig.send(tcp(1, 1, READ) + tcp(2, 1, bytes.fromhex("03 00 64 00 01")) + tcp(3, 1, bytes.fromhex("03 00 01 00 01")))
    assert [(data[1], data[6]) for _, data in rig.arrivals()] == [(1, 2), (2, 2), (3, 1)]
    rig = FaultRig("wrong-unit function=6", line=LineProtocol.TCP, is_timed=True)
    rig.send(tcp(1, 1, READ) + tcp(2, 1, WRITE) + tcp(3, 1, READ))
    assert [(data[1], data[6]) for _, data in rig.arrivals()] == [(1, 1), (2, 2), (3, 1)]
    rig = FaultRig("crc nth=1", is_timed=True)
    rig.send(REQUEST + REQUEST)  # on the line itself the second is lost
    heard = [data for _, data in rig.arrivals()]
    assert [frame[-2:] == crc(frame[:-2]) for frame in heard] == [False]


def test_an_answer_that_overtakes_others_leaves_them_their_faults() -> None:
    """The seventeenth request is refused at once, while sixteen wait."""
    rig = FaultRig("wrong-unit nth=3", line=LineProtocol.TCP, is_timed=True)
    refused = rig.send(b"".join(tcp(n, 1, READ) for n in range(1, 18)))
    assert refused == tcp(17, 1, b"\x83\x06")
    assert [data[6] for _, data in rig.arrivals(2.0)] == [1, 2] + [1] * 14


def test_an_answer_asked_for_before_the_fault_was_set_comes_whole() -> None:
    rig = FaultRig(is_timed=True)
    rig.send(REQUEST)
    plain = FaultRig(is_timed=True)
    plain.send(REQUEST)
    rig.wait(0.0085)  # eight characters at 9600 bit/s, and the answer has not begun
    assert rig.port.to_send(rig.now) == []
    rig.add("crc")
    arrivals = rig.arrivals()
    assert [data for _, data in arrivals] == [ANSWER]
    assert arrivals == plain.arrivals(), "at the moment at which it comes without faults"


# ---------------------------------------------------------------------- protocol and what is meant


@pytest.mark.parametrize("line", [LineProtocol.RTU, LineProtocol.TCP])
def test_exception_and_busy_refuse_and_do_nothing(line: LineProtocol) -> None:
    rig = FaultRig("exception code=3 nth=1", "busy nth=1", line=line)
    refused = [bytes((0x86, code)) for code in (3, 6)]
    wanted = [tcp(n, 1, pdu) if line is LineProtocol.TCP else rtu(1, pdu) for n, pdu in enumerate(refused, start=1)]
    assert [rig.ask(WRITE), rig.ask(WRITE)] == wanted
    assert rig.device.user[100] == 0x1234
    rig.ask(WRITE)
    assert rig.device.user[100] == 7
    assert rig.told() == [
        "exception: refused with exception 03: 06 00 64 00 07",
        "busy: refused with exception 06: 06 00 64 00 07",
    ]


def test_a_fault_is_of_a_unit() -> None:
    rig = FaultRig("busy unit=2", units=(1, 2))
    assert rig.ask() == ANSWER
    assert rig.ask(unit=2) == rtu(2, b"\x83\x06")


def test_mic_23_a_single_unit_on_tcp_has_its_faults_whichever_way_it_is_addressed() -> None:
    rig = FaultRig("wrong-unit unit=1 answers_as=7", line=LineProtocol.TCP)
    assert [rig.ask(unit=unit)[6] for unit in (1, 0, 255)] == [7, 7, 7]


def test_mic_2_a_broadcast_that_is_refused_moves_nobody_and_is_not_answered() -> None:
    rig = FaultRig("busy unit=2", units=(1, 2))
    assert rig.ask(WRITE, unit=0) == b""
    assert [device.user[100] for device in rig.devices.values()] == [7, 0x1234]
    rig = FaultRig("no-answer lost=request unit=1", units=(1, 2))
    assert rig.ask(WRITE, unit=0) == b""
    assert [device.user[100] for device in rig.devices.values()] == [0x1234, 7]


def test_a_fault_is_of_a_function() -> None:
    rig = FaultRig("busy function=6")
    assert rig.ask() == ANSWER
    assert rig.ask(WRITE) == rtu(1, b"\x86\x06")


@pytest.mark.parametrize(
    ("span", "hit"),
    [("98", False), ("99", True), ("100", True), ("101", False), ("0-98", False), ("0-99", True), ("100-200", True)],
)
def test_a_fault_is_of_the_addresses_a_request_touches(span: str, hit: bool) -> None:
    rig = FaultRig(f"busy address={span}")
    assert (rig.ask() == rtu(1, b"\x83\x06")) is hit
    many = bytes.fromhex("10 00 63 00 02 04 00 00 00 00")
    assert (rig.ask(many) == rtu(1, b"\x90\x06")) is hit


def test_nth_every_and_count() -> None:
    def hits(fault: str) -> list[int]:
        rig = FaultRig(fault)
        return [n for n in range(1, 13) if rig.ask() != ANSWER]

    assert hits("busy nth=3") == [3]
    assert hits("busy every=5") == [5, 10]
    assert hits("busy count=2") == [1, 2]
    assert hits("busy every=3 count=3") == [3, 6, 9]


def test_a_fault_has_its_time() -> None:
    """Requests at 0, 10, 20, … ms."""
    rig = FaultRig("busy from_s=0.02 until_s=0.04")
    assert [n for n in range(8) if rig.ask() != ANSWER] == [2, 3, 4]
    rig.add("busy from_s=0.01 nth=2")
    assert [n for n in range(8) if rig.ask() != ANSWER] == [2]


def test_probability_is_that_and_every_fault_has_its_own_chance() -> None:
    def hits(*faults: str, seed: int = 1) -> list[int]:
        rig = FaultRig(*faults, seed=seed)
        return [n for n in range(2000) if rig.ask()[1] == 0x83]

    alone = hits("busy probability=0.2 name=mine")
    assert 330 < len(alone) < 470
    assert hits("busy probability=0.2 name=mine") == alone
    assert hits("flip probability=0.001 direction=in name=other from_s=1000", "busy probability=0.2 name=mine") == alone
    assert hits("busy probability=0.2 name=mine", seed=2) != alone
    assert hits("busy probability=0.2 name=yours") != alone
    assert hits("busy probability=0") == []


def test_a_fault_is_of_a_link() -> None:
    for fault in ("crc", "busy", "no-answer lost=request", "flip"):
        assert FaultRig(f"{fault} link=elsewhere").ask() == ANSWER
        assert FaultRig(f"{fault} link=link-1").ask() != ANSWER


def test_the_nth_is_counted_over_all_links_together() -> None:
    rig = FaultRig("crc nth=2")
    inner = RtuSlavePort(rig.devices)
    second = FaultyPort(inner, "link-2", rig.faults, LineProtocol.RTU, framed=inner, units=(1,))
    assert rig.ask() == ANSWER
    assert second.exchange(REQUEST, rig.now) != ANSWER
    assert rig.ask() == ANSWER


def test_requests_the_twin_has_no_answer_for_leave_no_trace_in_the_count() -> None:
    rig = FaultRig("crc nth=2")
    rig.ask(unit=9)
    rig.ask(READ, unit=0)
    rig.ask(bytes.fromhex("06 00 05 00 01"), unit=0)
    assert rig.ask() == ANSWER
    assert rig.ask() != ANSWER


def test_what_happens_is_recorded_with_link_controller_and_moment() -> None:
    rig = FaultRig("echo nth=1", "busy nth=2")
    rig.ask()
    rig.ask()
    told = [(r.time, r.controller, r.kind, r.subject) for r in rig.records]
    assert told == [(0, "link-1", "fault", "echo"), (10 * MILLISECOND, "1", "fault", "busy")]


def test_state_taken_out_and_put_back_changes_nothing() -> None:
    """Delayed bytes, counts and chance are state: a run that is restored goes on like the one that was not."""
    faults = ("flip probability=0.1", "gap nth=30 for_ms=40", "delay every=3 for_ms=35", "crc probability=0.3", "late every=7")

    def go_on(rig: FaultRig) -> list[object]:
        heard: list[object] = [rig.ask() for _ in range(20)]
        return [*heard, rig.arrivals(), rig.told()[told:]]

    rig = FaultRig(*faults, seed=8)
    for _ in range(6):
        rig.ask(READ)
    told = len(rig.told())
    scheduler, faults_ = rig.scheduler.snapshot(), rig.faults.copy_state()
    port, inner = rig.port.copy_state(), rig.inner.copy_state()
    now = rig.now
    first = go_on(rig)
    rig.scheduler.restore(scheduler)
    rig.inner.set_state(inner)
    rig.port.set_state(port)
    rig.faults.set_state(faults_)
    rig.now = now
    del rig.records[told:]
    assert go_on(rig) == first


def test_records_keep_their_order_where_answers_are_fetched_late() -> None:
    rig = FaultRig("crc", "flip direction=in nth=9 bit=0", is_timed=True)
    trace = Trace()
    rig.faults.sinks.append(trace.add)
    rig.send(REQUEST)
    rig.now += 500 * MILLISECOND
    rig.send(REQUEST)
    assert [record.subject for record in trace] == ["flip", "crc"]


def test_a_request_that_comes_on_no_known_link_meets_the_faults_of_every_link() -> None:
    """As a request of a script does, also after one on a link."""
    rig = FaultRig("busy link=link-2")
    assert rig.ask() == ANSWER
    refused = rig.controllers[1].refusal(1, "", READ, rig.now)
    assert refused == bytes.fromhex("83 06")


def test_a_stream_that_is_no_modbus_tcp_is_broken_behind_the_faults_too() -> None:
    rig = FaultRig("delay for_ms=1", line=LineProtocol.TCP)
    assert rig.port.broken is None
    rig.send(b"\0\1\0\1\0\2\1\3")
    rig.arrivals(0.1)
    assert rig.port.broken == "MBAP protocol 1 is not 0"


def test_requests_that_nobody_answers_are_forgotten() -> None:
    """They are for a unit that is elsewhere."""
    rig = FaultRig("wrong-unit address=99")
    sizes = []
    for _ in range(3):
        for _ in range(100):
            assert rig.ask(unit=3) == b""
        sizes.append(len(repr(rig.port.copy_state())))
    assert sizes == [sizes[0]] * 3


def test_a_request_without_an_answer_has_none_any_more_once_a_later_one_is_answered() -> None:
    """The first one reads register 99, the last one does not."""
    rig = FaultRig("supply-drop machine=1 at_s=0 for_s=0.05", "wrong-unit address=99", units=(1, 2))
    assert rig.ask() == b""
    assert rig.ask(bytes.fromhex("03 00 05 00 01"), unit=2) == rtu(2, bytes.fromhex("03 02 00 00"))
    rig.wait(0.1)
    assert rig.ask(bytes.fromhex("03 00 64 00 01")) == rtu(1, bytes.fromhex("03 02 00 00"))
    assert rig.ask() != rtu(1, bytes.fromhex("03 04 00 00 00 00"))
