"""The run queue: passes in ascending order."""

from __future__ import annotations

from steptwin.simulation.scheduler.runqueue import RunQueue


def test_a_pass_is_ascending_and_what_is_added_behind_it_waits_for_the_next() -> None:
    queue = RunQueue()
    for number in (5, 2, 9, 2):
        queue.add(number)
    taken = []
    while (number := queue.take()) is not None:
        taken.append(number)
        if number == 5:
            for added in (9, 7, 5, 1):
                queue.add(added)
    assert taken == [2, 5, 7, 9]
    assert [queue.take(), queue.take(), queue.take(), queue.take()] == [1, 5, None, None]
    queue.add(0)
    assert queue.take() == 0
