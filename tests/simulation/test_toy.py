"""A controller that only the tests know passes through scheduler, wires, snapshots, mechanics, faults and a line."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy import Toy, ToyBody, ToyLine

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse, TimeReversal
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.faults import Faults, prepare_for_faults, read
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.mechanics.trajectory import Build
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import Trace, TraceRecord
from steptwin.simulation.scheduler.wires import PinName, Wire

GO = b"M\x0a"
"""100 pulses: 1000 p/s² for 316 ms up to 316 p/s, and as long down again."""
ARRIVAL: Nanos = 632_455_533
"""2·√(100/1000) s, at the first whole nanosecond after it."""


def told(records: list[TraceRecord], *kinds: str) -> list[tuple[Nanos, str, str, object]]:
    return [(r.time, r.controller, r.subject, r.value) for r in records if r.kind in kinds]


# ---------------------------------------------------------------------- time


def test_a_move_ends_when_its_profile_does() -> None:
    toy = Toy()
    assert toy.execute(GO, 0) == GO
    assert toy.deadline() == ARRIVAL
    toy.advance(SECOND)
    assert [(edge.time, edge.pin, edge.value) for edge in toy.take_edges()] == [(0, "BUSY", 1.0), (ARRIVAL, "BUSY", 0.0)]
    assert toy.execute(b"P\0", SECOND) == b"P\x0a"
    with pytest.raises(TimeReversal):
        toy.advance(0)


commands = st.lists(
    st.tuples(st.integers(0, SECOND), st.sampled_from([b"M\x05", b"M\xfb", b"H\0", b"P\0", b"??", "stop", "free"])), max_size=12
)


@given(commands, st.lists(st.integers(0, SECOND), max_size=8))
def test_time_in_pieces_is_time_at_once(inputs: list[tuple[Nanos, bytes | str]], looks: list[Nanos]) -> None:
    """Both schedulers get the same inputs; one is advanced to moments in between, too."""
    traces = []
    for moments in ([], looks):
        trace = Trace()
        scheduler, toy = Scheduler(record=trace.add), Toy()
        scheduler.add("toy", toy)
        now = 0
        for wait, what in inputs:
            for look in sorted(look for look in moments if look < wait):
                scheduler.advance(now + look)
                due = scheduler.deadline()
                assert due is None or due > now + look
            now += wait
            scheduler.advance(now)
            if isinstance(what, bytes):
                toy.execute(what, now)
            else:
                toy.set_pin("STOP", float(what == "stop"), now)
        scheduler.advance(now + 10 * SECOND)
        assert scheduler.deadline() is None
        traces.append(trace.digest())
    assert traces[0] == traces[1]


# ---------------------------------------------------------------------- wires


def wired() -> tuple[Scheduler, Toy, Mic488Device]:
    scheduler, toy, mic = Scheduler(), Toy(), Mic488Device(ControllerConfig())
    scheduler.add("toy", toy)
    scheduler.add("mic", mic)
    scheduler.connect(Wire(PinName("toy", "BUSY"), PinName("mic", "IN5")))
    scheduler.connect(Wire(PinName("mic", "OUT1"), PinName("toy", "STOP"), delay=MILLISECOND))
    return scheduler, toy, mic


def test_wires_join_it_with_another_controller_in_both_directions() -> None:
    scheduler, toy, mic = wired()
    toy.execute(GO, 0)
    scheduler.advance(100 * MILLISECOND)
    assert mic.pins()["IN5"] == 1.0
    mic.execute(bytes.fromhex("05 1770 FF00"), 100 * MILLISECOND)  # OUT1 on
    scheduler.advance(SECOND)
    assert toy.axis.plan.end == 202 * MILLISECOND  # 101 ms up, and as long down
    assert mic.pins()["IN5"] == 0.0
    assert toy.execute(GO, SECOND) == b"E\x0a"


def test_a_snapshot_of_both_continues_as_the_scheduler_itself() -> None:
    scheduler, toy, mic = wired()
    toy.execute(GO, 0)
    scheduler.advance(50 * MILLISECOND)
    mic.execute(bytes.fromhex("05 1770 FF00"), 50 * MILLISECOND)
    scheduler.propagate()
    kept = pickle.loads(pickle.dumps(scheduler.snapshot()))
    others, other, _ = wired()
    others.restore(kept)
    for one in (scheduler, others):
        one.advance(SECOND)
    assert others.snapshot() == scheduler.snapshot()
    assert other.axis.plan.count(SECOND) == toy.axis.plan.count(SECOND) < 10


# ---------------------------------------------------------------------- mechanics and faults


def faulty(*faults: str) -> tuple[Scheduler, Toy, Mechanism, Faults]:
    scheduler, toy, there = Scheduler(), Toy(), Faults()
    scheduler.add("toy", toy)
    mechanism = Mechanism(scheduler, "toy", 1, Build())
    scheduler.add_part(mechanism)
    prepare_for_faults(scheduler, "toy", there, ToyBody([mechanism]))
    for fault in faults:
        there.add(read(fault))
    return scheduler, toy, mechanism, there


def test_its_shaft_is_blocked_and_loses_pulses() -> None:
    scheduler, toy, mechanism, _ = faulty("stall at_s=1 for_s=2", "lost-steps at_s=4 pulses=4")
    scheduler.advance(SECOND)
    toy.execute(GO, SECOND)
    scheduler.advance(2 * SECOND)
    assert (toy.axis.plan.count(2 * SECOND), mechanism.grid_position(2 * SECOND)) == (100, 0)
    scheduler.advance(3 * SECOND)
    assert (mechanism.grid_position(3 * SECOND), mechanism.lost(3 * SECOND)) == (0, 100)
    scheduler.advance(5 * SECOND)
    assert (mechanism.grid_position(5 * SECOND), mechanism.lost(5 * SECOND)) == (-4, 104)


def test_its_input_sticks_and_bounces() -> None:
    scheduler, toy, _, faults = faulty("stuck pin=stop value=1 until_s=1", "bounce pin=STOP bounces=1 for_ms=2 from_s=2")
    seen: list[TraceRecord] = []
    faults.sinks.append(seen.append)
    scheduler.advance(MILLISECOND)
    assert toy.execute(GO, MILLISECOND) == b"E\x0a"
    scheduler.advance(2 * SECOND)
    assert toy.pins()["STOP"] == 0.0
    scheduler.controllers["toy"].set_pin("STOP", 1.0, 2 * SECOND)
    scheduler.advance(3 * SECOND)
    assert [value for *_, value in told(seen, "edge")] == [1.0, 0.0, 0.0, 1.0]
    assert [text for *_, text in told(seen, "fault")] == ["STOP is stuck at 1", "STOP is free", "STOP bounces 1 times in 2 ms"]


def test_its_supply_drops() -> None:
    scheduler, toy, _, _ = faulty("supply-drop at_s=0.1 for_s=0.5")
    toy.execute(GO, 0)
    scheduler.advance(200 * MILLISECOND)
    assert (toy.is_off, toy.axis.plan.count(200 * MILLISECOND)) == (True, 5)
    scheduler.advance(SECOND)
    assert toy.execute(GO, SECOND) == GO


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ("slip", "fault slip: 'toy' is a toy"),
        ("wear", "fault wear: 'toy' is a toy"),
        ("stall axis=2", r"fault stall: axis = 2: permitted are 1 to 1"),
        ("stuck pin=IN1", r"fault stuck: pin = 'IN1': 'toy' has STOP, BUSY"),
        ("bounce pin=BUSY", "pin = 'BUSY': 'toy' has STOP"),
    ],
)
def test_what_cannot_fail_is_refused(fault: str, why: str) -> None:
    with pytest.raises(Misuse, match=why):
        faulty(fault)


def test_a_snapshot_with_faults_continues_alike_and_one_from_before_them_has_none() -> None:
    scheduler, toy, _, _ = faulty()
    before = scheduler.snapshot()
    scheduler, toy, _, there = faulty("stuck pin=STOP value=1 from_s=0.1", "stall at_s=0.05 for_s=3")
    toy.execute(GO, 0)
    scheduler.advance(200 * MILLISECOND)
    kept = scheduler.snapshot()
    scheduler.advance(SECOND)
    first = scheduler.snapshot()
    scheduler.restore(kept)
    scheduler.advance(SECOND)
    assert scheduler.snapshot() == first
    there.clear(SECOND)
    scheduler.restore(before)
    assert (toy.now, toy.pins()) == (0, {"STOP": 0.0, "BUSY": 0.0})
    assert scheduler.snapshot() == before


def test_a_snapshot_from_before_it_could_fail_is_restored() -> None:
    scheduler, toy = Scheduler(), Toy()
    scheduler.add("toy", toy)
    before = scheduler.snapshot()
    prepare_for_faults(scheduler, "toy", there := Faults(), ToyBody())
    there.add(read("stuck pin=STOP value=1"))
    scheduler.advance(SECOND)
    there.clear(SECOND)
    scheduler.restore(before)
    assert toy.snapshot() == before.controllers[0]


# ---------------------------------------------------------------------- a line


def lined(*faults: str) -> tuple[Scheduler, Toy, ToyLine]:
    scheduler, toy, there = Scheduler(), Toy(), Faults()
    for fault in faults:
        there.add(read(fault))
    scheduler.add("toy", toy)
    line = ToyLine(scheduler, "bus", toy, there)
    scheduler.add_part(line)
    return scheduler, toy, line


def test_a_line_of_a_world_carries_its_protocol() -> None:
    scheduler, _, line = lined()
    line.receive("pty", b"M", 0)
    line.receive("tcp-1", b"P\0", 0)
    line.receive("pty", b"\x0aP", 0)
    scheduler.advance(SECOND)
    line.receive("pty", b"\0", SECOND)
    assert line.clients["pty"].take(SECOND) == [(0, GO), (SECOND, b"P\x0a")]
    assert line.clients["tcp-1"].take(SECOND) == [(0, b"P\0")]
    line.leave("pty")
    assert list(line.clients) == ["tcp-1"]


def test_bytes_of_its_protocol_go_wrong_on_the_way() -> None:
    scheduler, _, line = lined("gap nth=1 for_ms=5 direction=in")
    line.receive("pty", b"P\0", 0)
    assert scheduler.deadline() == 5 * MILLISECOND
    scheduler.advance(SECOND)
    assert line.clients["pty"].take(SECOND) == [(5 * MILLISECOND, b"P\0")]


def test_half_a_command_is_part_of_a_snapshot() -> None:
    scheduler, _, line = lined()
    line.receive("pty", b"M", 0)
    other, _, its_line = lined()
    other.restore(scheduler.snapshot())
    its_line.receive("pty", b"\x05", 0)
    assert its_line.clients["pty"].take(0) == [(0, b"M\x05")]
