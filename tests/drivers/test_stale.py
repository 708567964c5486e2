"""Input of a suspension is told from fresh input, by the clock alone."""

from __future__ import annotations

from steptwin.drivers.stale import BEAT_S, QUIET_S, SUSPENDED_S, StaleInput


class Clock:
    def __init__(self) -> None:
        self.s = 100.0
        self.stale = StaleInput(lambda: self.s)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / BEAT_S)):
            self.s += BEAT_S
            self.stale.beat()


def test_input_while_the_program_runs_is_fresh() -> None:
    clock = Clock()
    for _ in range(20):
        clock.run(0.3)
        assert not clock.stale.is_stale()
    clock.s = 200.0
    clock.stale = StaleInput(lambda: clock.s)
    clock.s += SUSPENDED_S  # a slow moment
    assert not clock.stale.is_stale()


def test_input_after_a_suspension_is_stale_whether_it_comes_before_the_beat_or_after_it() -> None:
    for beats_first in (False, True):
        clock = Clock()
        clock.s += 7.0
        if beats_first:
            clock.stale.beat()
        assert [clock.stale.is_stale() for _ in range(50)] == [True] * 50, f"beats first: {beats_first}"


def test_a_key_that_is_held_stays_stale_until_it_is_let_go() -> None:
    clock = Clock()
    clock.s += 7.0
    for _ in range(100):
        assert clock.stale.is_stale()
        clock.run(0.2)
    clock.run(QUIET_S + BEAT_S)
    assert not clock.stale.is_stale()
