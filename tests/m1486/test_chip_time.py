"""The contract of time, and snapshots."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.controller import MILLISECOND, SECOND, Nanos, PinEdge
from steptwin.errors import TimeReversal
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.events import EVENTS, M1486Event
from steptwin.m1486.variants import variant

PROGRAM = (b":3\r", b"[\r@1\rl3\r+5\ri1l2\re\rc2\rf1280\rr\rt2\ru4\rw20\r@2\rz3\ro3\r(2\rj1\r]\r", b"k\r", b"u1\ru4\r", b"c75\r")


def busy_chip(kind: str, is_timed: bool, statement_ns: int | None) -> M1486Chip:
    return M1486Chip(variant(kind), is_timed=is_timed, statement_ns=statement_ns)


class Action(NamedTuple):
    """Characters, or a pin and its level, at a moment."""

    at: int
    data: bytes = b""
    pin: str = ""
    level: int = 0

    def do(self, chip: M1486Chip) -> None:
        if self.pin:
            chip.set_pin(self.pin, self.level, self.at)
        else:
            chip.receive(self.data, self.at)


def drive(
    chip: M1486Chip, plan: list[Action], extra: list[int]
) -> tuple[list[M1486Event], list[PinEdge], list[tuple[int, bytes]]]:
    """Do what the plan says at its moments; look at the chip at ``extra`` moments too."""
    edges: list[PinEdge] = []
    sent: list[tuple[int, bytes]] = []
    for moment in sorted({*extra, *(action.at for action in plan)}):
        chip.advance(moment)
        due = chip.deadline()
        assert due is None or due > moment
        for action in plan:
            if action.at == moment:
                action.do(chip)
        edges += chip.take_edges()
        sent += chip.to_send(moment)
    return list(chip.events), edges, sent


moments = st.integers(0, 400).map(lambda ms: ms * MILLISECOND)
characters = st.tuples(moments, st.sampled_from(PROGRAM)).map(lambda drawn: Action(*drawn))
pins = st.sampled_from(["B1", "B2", "B3", "LIMIT", "JOG", "RST", "SD"])
levels = st.tuples(moments, st.just(b""), pins, st.integers(0, 1)).map(lambda drawn: Action(*drawn))
plans = st.lists(characters | levels, max_size=8).map(lambda plan: [Action(0, PROGRAM[1]), *sorted(plan)])


@given(plans, st.lists(st.integers(0, 500_000_000), max_size=10), st.booleans(), st.sampled_from([None, 0, 100_000]))
def test_looking_changes_nothing(plan: list[Action], extra: list[int], is_timed: bool, statement_ns: int | None) -> None:
    end = 600 * MILLISECOND
    one, other = (busy_chip("B", is_timed, statement_ns) for _ in range(2))
    assert drive(one, plan, [end]) == drive(other, plan, [*extra, end])
    assert one.copy_state() == other.copy_state()


@given(plans, st.integers(0, 500), st.booleans())
def test_a_snapshot_goes_on_like_the_original(plan: list[Action], cut: int, is_timed: bool) -> None:
    moment, end = cut * MILLISECOND, 600 * MILLISECOND
    one, other = (busy_chip("B", is_timed, None) for _ in range(2))
    drive(one, [action for action in plan if action.at <= moment], [moment])
    other.restore(pickle.loads(pickle.dumps(one.snapshot())))
    for chip in (one, other):
        for action in plan:
            if action.at > moment:
                action.do(chip)
        chip.advance(end)
    assert list(one.events) == list(other.events)
    assert one.to_send(end) == other.to_send(end)
    assert one.copy_state() == other.copy_state()


def test_a_snapshot_takes_the_place_of_another_program() -> None:
    one, other = Bench("B"), Bench("B")
    one.file("@1", "+1", "u4", "w10", "j1")
    other.file("@1", "+2", "u5", "w10", "j1")
    for bench in (one, other):
        bench.run(ms=25)
    other.chip.restore(one.chip.snapshot())
    assert one.run(ms=100) == other.run(ms=100)
    assert one.chip.copy_state() == other.chip.copy_state()


def test_looking_changes_nothing_while_commands_wait_for_room() -> None:
    sent = []
    for looks in (1, 300):
        bench = Bench("A")
        bench.do("t57")
        bench.send("w50", *["+1"] * 58)
        assert bench.chip.receiver.is_stalled
        bench.sent()
        end = 300 * MILLISECOND
        sent.append(
            [piece for n in range(1, looks + 1) for piece in bench.chip.to_send(bench.now + (end - bench.now) * n // looks)]
        )
        assert bench.variable == 58
    assert sent[0] == sent[1]
    assert [data for _, data in sent[0]] == [b"\x7e", b"\x7f"]


def test_looking_changes_nothing_while_a_loop_that_has_run_before_makes_room() -> None:
    chips = []
    for looks in (1, 500):
        bench = Bench("A")
        bench.file("@1", "w50", *["+1"] * 20, "j1")
        bench.run(ms=80)
        bench.send(*["-1"] * 60)
        assert bench.chip.receiver.is_stalled
        begin = bench.now
        for n in range(1, looks + 1):
            bench.chip.advance(begin + 500 * MILLISECOND * n // looks)
        chips.append(bench.chip)
    assert list(chips[0].events) == list(chips[1].events)
    assert chips[0].copy_state() == chips[1].copy_state()


def test_time_does_not_go_back() -> None:
    bench = Bench()
    bench.run(1.0)
    with pytest.raises(TimeReversal):
        bench.chip.receive(b"u20\r", 1)


CALLS: dict[str, Callable[[M1486Chip, Nanos], object]] = {
    "advance": lambda chip, now: chip.advance(now),
    "characters": lambda chip, now: chip.receive(b"u1\r", now),
    "what was sent": lambda chip, now: chip.to_send(now),
    "pin": lambda chip, now: chip.set_pin("B3", 0, now),
    "power off": lambda chip, now: chip.power_off(now),
    "power cycle": lambda chip, now: chip.power_cycle(now),
}


@pytest.mark.parametrize("name", CALLS)
def test_whatever_is_done_at_a_moment_finds_the_chip_there(name: str) -> None:
    """What was due before has been done before: W50 waits for 50 ms, T2 takes 1 ms."""
    bench = Bench()
    bench.send("c2", "w50", "t2")
    CALLS[name](bench.chip, SECOND)
    assert bench.now == SECOND
    assert [(edge.time, edge.value) for edge in bench.edges if edge.pin == "B2"] == [(0, 0.0), (51 * MILLISECOND, 1.0)]
    bench.run(1.0)


def test_a_chip_advances_to_its_next_change_or_to_the_end_of_the_time() -> None:
    """W50 is done after 50 ms, T2 takes 1 ms; then nothing is to be done."""
    chip = Bench().chip
    for end in (SECOND, 2 * SECOND):
        assert chip.advance_to_change(end) == chip.now == end
    chip.receive(b"w50\rt2\r", chip.now)
    begin = chip.now
    assert chip.advance_to_change(begin + 30 * MILLISECOND) == chip.now == begin + 30 * MILLISECOND
    assert chip.advance_to_change(begin + SECOND) == chip.now == begin + 50 * MILLISECOND


def test_every_event_has_a_known_code() -> None:
    bench = Bench("E1", address=1)
    bench.do("[", "u20", "]", "f64", "r", "w1", "c2", "y", "k", "c75", "\\")
    bench.chip.power_cycle(bench.now)
    bench.pin(RST=1)
    assert {event.code for event in bench.chip.events} <= EVENTS.keys()
    assert [event.time for event in bench.chip.events] == sorted(event.time for event in bench.chip.events)
