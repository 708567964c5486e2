"""What is told of a run: the first of it, and how much there was."""

from __future__ import annotations

from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.boundedlog import MOST_KEPT, BoundedLog


def test_records_beyond_a_number_are_counted_only() -> None:
    log = BoundedLog()
    records = [TraceRecord(n, "world", "event", "overdue", "x") for n in range(MOST_KEPT + 5)]
    for record in records:
        log.add(record)
    assert list(log) == records[:MOST_KEPT]
    assert (len(log), log.more, log[-1].time) == (MOST_KEPT + 5, 5, MOST_KEPT - 1)
    again = BoundedLog(log.state())
    assert (list(again), again.more) == (list(log), 5)


def test_of_nothing_there_is_nothing_to_tell() -> None:
    assert not BoundedLog()
