"""A quantity that follows a signal in steps."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

from steptwin.controller import SECOND, Nanos
from steptwin.simulation.logic.curve import Stepped


class Rising:
    """One a second until ``end``; then it has no value."""

    continuous = True
    unit = ""

    def __init__(self, end: Nanos) -> None:
        self._end = end

    def sync(self, now: Nanos) -> tuple[object, ...]:
        return ()

    def value(self, now: Nanos) -> float:
        return now / SECOND if now < self._end else nan

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return iter(())

    def version(self) -> object:
        return None


def test_it_stays_and_is_not_due_while_the_signal_has_no_value() -> None:
    stepped = Stepped(Rising(3 * SECOND), [(0.0, 0.0), (10.0, 10.0)], 1.0)
    stepped.update(2 * SECOND)
    assert (stepped.value, stepped.due) == (2.0, 2 * SECOND + SECOND // 2)
    stepped.update(3 * SECOND)
    assert (stepped.value, stepped.due) == (2.0, None)
