"""A log of bounded length: failures and warnings that are shown at the end of a run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from steptwin.simulation.scheduler.trace import TraceRecord

MOST_KEPT = 1000
"""A script may fail once a second for months: further records are only counted. The trace has all of them."""


class BoundedLogState(NamedTuple):
    first: tuple[TraceRecord, ...]
    count: int


class BoundedLog:
    """The first records of something, and how many there were."""

    def __init__(self, state: BoundedLogState | None = None) -> None:
        self._first = [] if state is None else list(state.first)
        self._count = 0 if state is None else state.count

    def add(self, record: TraceRecord) -> None:
        self._count += 1
        if len(self._first) < MOST_KEPT:
            self._first.append(record)

    def __len__(self) -> int:
        """How many there were."""
        return self._count

    def __iter__(self) -> Iterator[TraceRecord]:
        """The first of them."""
        return iter(self._first)

    def __getitem__(self, index: int) -> TraceRecord:
        return self._first[index]

    @property
    def more(self) -> int:
        """How many are counted only."""
        return self._count - len(self._first)

    def state(self) -> BoundedLogState:
        return BoundedLogState(tuple(self._first), self._count)
