"""Work lists against lists that are scanned."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from steptwin.simulation.scheduler.turns import Dues, Turns


def test_a_pass_is_ascending_and_what_is_added_behind_it_waits_for_the_next() -> None:
    turns = Turns()
    for number in (5, 2, 9, 2):
        turns.add(number)
    taken = []
    while (number := turns.take()) is not None:
        taken.append(number)
        if number == 5:
            for added in (9, 7, 5, 1):
                turns.add(added)
    assert taken == [2, 5, 7, 9]
    assert [turns.take(), turns.take(), turns.take(), turns.take()] == [1, 5, None, None]
    turns.add(0)
    assert turns.take() == 0


@given(st.lists(st.tuples(st.integers(0, 8), st.none() | st.integers(0, 30)), max_size=400), st.integers(1, 7))
def test_what_is_due_is_what_a_scan_finds(puts: list[tuple[int, int | None]], period: int) -> None:
    dues, scanned = Dues(), {}
    for n, (number, due) in enumerate(puts):
        dues.put(number, due)
        scanned[number] = due
        assert dues.first() == min((moment for moment in scanned.values() if moment is not None), default=None)
        if n % period == 0:
            found = sorted(one for one, moment in scanned.items() if moment is not None and moment <= n % 31)
            assert dues.take(n % 31) == found
            scanned.update(dict.fromkeys(found))


def test_moments_that_are_put_off_for_ever_take_no_memory() -> None:
    dues = Dues()
    for moment in range(10_000):
        dues.put(0, 10**9 + moment)
    assert len(dues._entries) < 200
    assert dues.first() == 10**9 + 9_999


def test_outdated_moments_are_removed_many_at_once() -> None:
    dues = Dues()
    for moment in range(60):
        dues.put(0, moment)
    assert len(dues._entries) == 60


def test_outdated_moments_are_removed_when_they_are_as_many_as_the_others() -> None:
    dues, lengths = Dues(), []
    for number in range(65):
        dues.put(number, 1)
    for moment in range(2, 132):
        dues.put(0, moment)
        lengths.append(len(dues._entries))
    assert lengths == [*range(66, 195), 65]
