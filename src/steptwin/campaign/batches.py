"""Batches of cases, and those who run them: any executor of `concurrent.futures`, which may be this process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.runner import CaseRunner
from steptwin.coverage.counts import Coverage


class BatchResult(NamedTuple):
    """Results in the order of the cases; ``seconds`` of the wall for all of them."""

    results: tuple[CaseResult, ...]
    seconds: float
    coverage: list[Any] | None
    """As plain values."""


class _KeptRunner(threading.local):
    """The digest of the last description and its runner, of each thread: workers of Dask have several."""

    runner: tuple[str, CaseRunner] | None = None


_KEPT = _KeptRunner()


def run_batch(description: CampaignDescription, cases: Sequence[Case], *, counts: bool) -> BatchResult:
    """Run cases in whichever process this is. The blueprint and the beginning are made by the first batch."""
    known = _KEPT.runner
    if known is None or known[0] != description.digest:
        known = _KEPT.runner = description.digest, CaseRunner(description)
    began = time.perf_counter()
    coverage = Coverage() if counts else None
    results = tuple(known[1].run(case, coverage) for case in cases)
    return BatchResult(results, time.perf_counter() - began, None if coverage is None else coverage.to_json())


@dataclass(frozen=True, slots=True)
class Workers:
    """``open`` gives an executor, another one after it broke. ``killed``: exceptions of a task that lost its worker too often."""

    open: Callable[[], Executor]
    width: int
    """How many batches run at a time."""
    killed: tuple[type[Exception], ...] = ()


class _Here(Executor):
    """Runs a task when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - it is for who asks for the result
            future.set_exception(error)
        return future


HERE = Workers(_Here, 1)
"""None besides this process."""
