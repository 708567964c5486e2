"""Where cases run: in this process, in a pool of processes, in a cluster of Dask. All are executors of `concurrent.futures`."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import Any

from steptwin.campaign.batches import HERE, Workers
from steptwin.errors import LineFailure, Misuse
from steptwin.extras import missing
from steptwin.system import processors

LOCAL = "local"
"""The address that stands for a cluster of Dask on this computer."""
CONNECT_S = 10
MOST_JOBS = 1024


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
            yield HERE
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
