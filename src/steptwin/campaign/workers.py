"""Where cases run: in this process, in a pool of processes, in a cluster of Dask. All are executors of `concurrent.futures`."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.runner import CaseRunner
from steptwin.coverage.counts import Coverage
from steptwin.errors import LineFailure, Misuse
from steptwin.extras import missing
from steptwin.system import processors

LOCAL = "local"
"""The address that stands for a cluster of Dask on this computer."""
CONNECT_S = 10
MOST_JOBS = 1024


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


def _begin() -> None:
    """In a new process of a pool: it ends with the process that made it, which alone is for Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)


@contextmanager
def _without_interrupts() -> Generator[None]:
    """Processes that begin meanwhile never see Ctrl-C, also before `_begin`. Only the main thread can change that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _pool(jobs: int) -> Executor:
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        with _without_interrupts():
            begun = [pool.submit(os.getpid) for _ in range(jobs)]
        begun[0].result()
    except BrokenExecutor:
        raise Misuse(
            "the processes of the campaign end as they begin: a script that runs one with jobs needs "
            "'if __name__ == \"__main__\":' around what it does"
        ) from None
    return pool


def usual_jobs() -> int:
    """As many as there are processors for this process."""
    return min(processors(), MOST_JOBS)


@contextmanager
def workers(jobs: int | None, dask: str | None) -> Generator[Workers]:
    """``jobs`` processes, 1: none besides this; or the cluster at an address, `LOCAL` for one of ``jobs`` processes here. Raises
    `Misuse`, and `LineFailure` for a cluster that is not there."""
    wanted = usual_jobs() if jobs is None else jobs
    if not 1 <= wanted <= MOST_JOBS:
        raise Misuse(f"jobs {wanted}: permitted are 1 to {MOST_JOBS}")
    with ExitStack() as opened:
        if dask is not None:
            yield _cluster(dask, wanted, opened)
        elif wanted == 1:
            yield Workers(_Here, 1)
        else:
            yield Workers(lambda: opened.enter_context(_closing(_pool(wanted))), wanted)


@contextmanager
def _closing(pool: Executor) -> Generator[Executor]:
    """Its processes end after what they run, and run nothing else."""
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _cluster(address: str, jobs: int, opened: ExitStack) -> Workers:
    try:
        from distributed import Client, LocalCluster
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise missing("--dask", "campaign-dask") from None
    where: Any = address
    if address == LOCAL:
        cluster = LocalCluster(n_workers=jobs, threads_per_worker=1, host="127.0.0.1", dashboard_address=None)
        where = opened.enter_context(cluster)
    try:
        client = opened.enter_context(Client(where, timeout=CONNECT_S, set_as_default=False))
        client.wait_for_workers(1, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise LineFailure(f"no cluster of Dask with a worker at {address}: {error}") from None
    width = sum(client.nthreads().values())
    return Workers(lambda: client.get_executor(pure=False), width, (KilledWorker,))
