"""Deadlines against a list that is scanned."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from steptwin.simulation.scheduler.deadlines import Deadlines


@given(st.lists(st.tuples(st.integers(0, 8), st.none() | st.integers(0, 30)), max_size=400), st.integers(1, 7))
def test_what_is_due_is_what_a_scan_finds(puts: list[tuple[int, int | None]], period: int) -> None:
    deadlines, scanned = Deadlines(), {}
    for n, (number, due) in enumerate(puts):
        deadlines.put(number, due)
        scanned[number] = due
        assert deadlines.first() == min((moment for moment in scanned.values() if moment is not None), default=None)
        if n % period == 0:
            found = sorted(one for one, moment in scanned.items() if moment is not None and moment <= n % 31)
            assert deadlines.take(n % 31) == found
            scanned.update(dict.fromkeys(found))


def test_moments_that_are_put_off_for_ever_take_no_memory() -> None:
    deadlines = Deadlines()
    for moment in range(10_000):
        deadlines.put(0, 10**9 + moment)
    assert len(deadlines._entries) < 200
    assert deadlines.first() == 10**9 + 9_999


def test_outdated_moments_are_removed_many_at_once() -> None:
    deadlines = Deadlines()
    for moment in range(60):
        deadlines.put(0, moment)
    assert len(deadlines._entries) == 60


def test_outdated_moments_are_removed_when_they_are_as_many_as_the_others() -> None:
    deadlines, lengths = Deadlines(), []
    for number in range(65):
        deadlines.put(number, 1)
    for moment in range(2, 132):
        deadlines.put(0, moment)
        lengths.append(len(deadlines._entries))
    assert lengths == [*range(66, 195), 65]
