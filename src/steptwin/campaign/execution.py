"""Runs cases by workers, a bounded number at a time, whatever becomes of a worker."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any

from steptwin.campaign.batches import BatchResult, Workers, run_batch
from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.description import CampaignDescription

TASK_S = 0.25
"""Aim for the duration of a task: a tenth of a second at least, for the cost of its way to a worker and back."""
MOST_CASES = 500
"""Most cases of a task."""
WAITING = 2
"""Tasks for each worker, of which one runs."""
MOST_TRIES = 2
"""Losses of a worker after which a task runs alone, so that the one that ends its workers is found."""


@dataclass(slots=True)
class _Batch:
    cases: Sequence[Case]
    tries: int = 0
    executor: Executor | None = None
    """That it was given to last."""


@dataclass(frozen=True, slots=True)
class Done:
    """Cases with their results; ``coverage`` of their programs as plain values, where it is counted."""

    cases: Sequence[Case]
    results: Sequence[CaseResult]
    coverage: list[Any] | None = None


class CaseExecution:
    """Gives what is done as it is done. ``is_over``: no further case is begun; those that were are awaited."""

    def __init__(
        self,
        description: CampaignDescription,
        workers: Workers,
        cases: Iterator[Case],
        is_over: Callable[[], bool],
        *,
        counts: bool = False,
    ) -> None:
        self._description = description
        self._workers = workers
        self._cases = cases
        self._is_over = is_over
        self._counts = counts
        self._size = 1
        """Cases in the next batch."""
        self._running: dict[Future[BatchResult], _Batch] = {}
        self._again: deque[_Batch] = deque()
        """Batches whose worker was lost."""
        self._executor: Executor | None = None

    def __iter__(self) -> Iterator[Done]:
        while True:
            self._fill()
            if not self._running:
                return
            finished, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in finished:
                yield from self._take(future)

    def _fill(self) -> None:
        while self._again and not self._is_alone:
            if self._running and self._again[0].tries >= MOST_TRIES:
                return
            self._submit(self._again.popleft())
        while not self._again and len(self._running) < self._most and (batch := self._next()) is not None:
            self._submit(batch)

    @property
    def _most(self) -> int:
        return 1 if self._workers.width == 1 else self._workers.width * WAITING

    @property
    def _is_alone(self) -> bool:
        """Whether a suspect runs, beside which nothing else may."""
        return any(batch.tries >= MOST_TRIES for batch in self._running.values())

    def _next(self) -> _Batch | None:
        if self._is_alone or self._is_over():
            return None
        cases = list(islice(self._cases, self._size))
        return _Batch(cases) if cases else None

    def _submit(self, batch: _Batch) -> None:
        if self._executor is None:
            self._executor = self._workers.open()
        try:
            future = self._executor.submit(run_batch, self._description, batch.cases, counts=self._counts)
        except BrokenExecutor:
            self._executor = None
            self._again.appendleft(batch)
        else:
            batch.executor = self._executor
            self._running[future] = batch

    def _take(self, future: Future[BatchResult]) -> Iterator[Done]:
        batch = self._running.pop(future)
        try:
            found = future.result()
        except BrokenExecutor:
            if batch.executor is self._executor:  # not one that was opened since
                self._executor = None
            yield from self._lost(batch)
        except self._workers.killed:
            batch.tries = MOST_TRIES
            yield from self._lost(batch)
        else:
            self._measure(found, len(batch.cases))
            yield Done(batch.cases, found.results, found.coverage)

    def _lost(self, batch: _Batch) -> Iterator[Done]:
        """Its worker was lost, or that of another batch in the same pool."""
        if batch.tries < MOST_TRIES:
            batch.tries += 1
            self._again.append(batch)
        elif len(batch.cases) > 1:
            self._again.extend(_Batch([case], MOST_TRIES) for case in batch.cases)
        else:
            (case,) = batch.cases
            error = "the process that ran it was lost each time"
            yield Done(batch.cases, [CaseResult(case.number, (), "", 0, {}, error)])

    def _measure(self, found: BatchResult, count: int) -> None:
        each = found.seconds / count
        fitting = MOST_CASES if each <= 0.0 else int(TASK_S / each)
        self._size = min(max(fitting, 1), MOST_CASES, 2 * max(self._size, count))
