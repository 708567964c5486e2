"""The master of the scripts: one request at a time."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.simulation.kinds.master import MOST_WAITING, Master


class Line:
    """Takes requests; answers come when the test gives them, or at once."""

    def __init__(self, *, at_once: bool = False) -> None:
        self.sent: list[tuple[Nanos, bytes]] = []
        self.at_once = at_once
        self.master = Master(self.send, 5)

    def send(self, frame: bytes, now: Nanos) -> None:
        self.sent.append((now, frame))
        if self.at_once:
            self.master.answered(frame.lower(), now)


def test_the_next_request_goes_a_pause_after_the_answer_to_the_one_before() -> None:
    line = Line()
    master = line.master
    for frame in (b"A1", b"B1"):
        master.ask(frame, MILLISECOND, 0)
    assert line.sent == [(0, b"A1")]
    assert (master.asked, master.finished, master.deadline()) == (2, 0, MILLISECOND)
    master.answered(b"a1", 100)
    assert (master.finished, master.deadline()) == (1, 105)
    master.update(104)
    assert line.sent == [(0, b"A1")]
    master.update(105)
    assert line.sent == [(0, b"A1"), (105, b"B1")]


def test_a_request_without_an_answer_is_given_up_and_what_comes_late_is_nobodys() -> None:
    line = Line()
    master = line.master
    master.wanted |= {1, 2}
    master.ask(b"A1", 100, 0)
    master.ask(b"B1", 100, 50)
    master.update(99)
    assert master.finished == 0
    master.update(100)
    assert (master.finished, master.unanswered, line.sent[-1]) == (1, 1, (100, b"B1"))
    master.answered(b"b1", 150)
    master.answered(b"late", 151)
    assert (master.finished, master.unanswered, master.answers) == (2, 1, {1: b"", 2: b"b1"})
    assert master.wanted == frozenset()
    assert master.deadline() is None


def test_answers_that_nobody_wants_are_not_kept() -> None:
    line = Line(at_once=True)
    master = line.master
    for n in range(100):
        master.ask(b"A1", 100, 10 * n)
    assert (len(line.sent), master.finished, master.answers, master.wanted) == (100, 100, {}, frozenset())


def test_a_state_in_the_middle_goes_on_elsewhere() -> None:
    one, other = Line(), Line()
    one.master.wanted |= {2}
    one.master.ask(b"A1", 100, 0)
    one.master.ask(b"B1", 100, 0)
    other.master.set_state(one.master.copy_state())
    for line in (one, other):
        line.master.answered(b"a1", 20)
        line.master.update(25)
        line.master.answered(b"b1", 30)
    assert other.master.copy_state() == one.master.copy_state()
    assert other.sent == one.sent[1:] == [(25, b"B1")]


def test_requests_that_come_faster_than_the_line_answers_are_refused_in_the_end() -> None:
    line = Line()
    for _ in range(MOST_WAITING + 1):
        line.master.ask(b"A1", 100, 0)
    with pytest.raises(Misuse, match="10000 requests of scripts are queued for this line"):
        line.master.ask(b"A1", 100, 0)
