"""What is told of a run: the first of it, and how much there was."""

from __future__ import annotations

from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.reports import MOST_KEPT, Reports


def test_records_beyond_a_number_are_counted_only() -> None:
    reports = Reports()
    records = [TraceRecord(n, "world", "event", "overdue", "x") for n in range(MOST_KEPT + 5)]
    for record in records:
        reports.add(record)
    assert list(reports) == records[:MOST_KEPT]
    assert (len(reports), reports.more, reports[-1].time) == (MOST_KEPT + 5, 5, MOST_KEPT - 1)
    again = Reports(reports.state())
    assert (list(again), again.more) == (list(reports), 5)


def test_of_nothing_there_is_nothing_to_tell() -> None:
    assert not Reports()
